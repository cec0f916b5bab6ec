use framelock::{Format, Verdict};

use crate::Headed;

/// FlySky's iBUS, the frames for servos: 32 bytes, `20 40`, fourteen channels of 16 bits, little endian,
/// and 0xFFFF less the sum of all bytes before. The line has 115 200 baud.
///
/// The message is the channels as they were sent: pulses of 1000 to 2000 µs, with 1500 in the middle.
/// Radios with more channels put those into the upper four bits; mask them then.
///
/// The sum notices each single wrong byte, but not bytes that have changed places.
///
/// Source: FlySky has published nothing. The layout is Betaflight's:
/// <https://github.com/betaflight/betaflight/blob/master/src/main/rx/ibus.c>.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::Ibus;
/// let mut receiver = BufferedReceiver::<_, 64>::new(Ibus);
/// let received = Ibus::encode(&[1500; 14]).into_iter().find_map(|byte| receiver.push(byte));
/// assert_eq!(received, Some([1500; 14]));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Ibus;

impl Format for Ibus {
    const LONGEST: usize = 32;
    type Message<'a> = [u16; 14];

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        let frame = Headed {
            sync: &[0x20, 0x40],
            header: 2,
            longest: Self::LONGEST,
        };
        let check =
            |frame: &[u8]| matches!(frame, [checked @ .., a, b] if sum(checked) == [*a, *b]);
        frame.judge(bytes, |_| Some(Self::LONGEST), check)
    }

    #[inline]
    fn decode(&self, frame: &[u8]) -> [u16; 14] {
        let mut words = frame.chunks_exact(2).skip(1);
        [(); 14].map(|()| match words.next() {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => 0,
        })
    }
}

impl Ibus {
    /// The frame with these channels.
    #[must_use]
    pub fn encode(channels: &[u16; 14]) -> [u8; 32] {
        let mut frame = [0; 32];
        [frame[0], frame[1]] = [0x20, 0x40];
        for (place, channel) in frame.chunks_exact_mut(2).skip(1).zip(channels) {
            place.copy_from_slice(&channel.to_le_bytes());
        }
        [frame[30], frame[31]] = sum(&frame[..30]);
        frame
    }
}

#[inline]
fn sum(bytes: &[u8]) -> [u8; 2] {
    let less = |sum: u16, &byte: &u8| sum.wrapping_sub(byte.into());
    bytes.iter().fold(0xFFFF, less).to_le_bytes()
}
