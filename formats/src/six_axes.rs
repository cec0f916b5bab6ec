use framelock::{DiscardReason, Encode, FixedFormat, Format, Shape, Verdict};

use crate::Headed;

/// Six axes of a motion platform: 16 bytes, `FF FF`, six numbers of 16 bits, `0A 0D`.
///
/// The numbers are taken as little endian, 0 to 65 535 over an axis's travel. If yours are big endian:
/// `axes.map(u16::swap_bytes)`.
///
/// Use it with the small [`Receiver`](framelock::Receiver), which delivers each frame with its last byte. It is
/// a [`Format`] as well, for [`Either`](crate::Either) and programs that take any format.
///
/// There is no checksum: what is checked is the first two bytes and the last two, and axes may look like
/// either. So report the idle gap behind each frame as a [`LineEvent`](framelock::LineEvent).
///
/// Source: no standard; what motion software is set up to send for six axes of 16 bits.
///
/// # Examples
/// ```
/// use framelock::{Encode, Receiver};
/// use framelock_formats::SixAxes;
/// let mut receiver = Receiver::<SixAxes>::new();
/// let axes = [0, 16_384, 32_768, 40_000, 65_535, 13];
/// let received = SixAxes::encode(axes).into_iter().find_map(|byte| receiver.push(byte));
/// assert_eq!(received, Some(axes));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct SixAxes;

impl FixedFormat for SixAxes {
    type Frame = [u8; 16];
    type Message = [u16; 6];
    const SHAPE: Shape<[u8; 16]> = {
        let mut places = [None; 16];
        [places[0], places[1]] = [Some(0xFF); 2];
        [places[14], places[15]] = [Some(b'\n'), Some(b'\r')];
        Shape::new(places)
    };

    #[inline]
    fn decode(frame: [u8; 16]) -> [u16; 6] {
        let mut words = frame.chunks_exact(2).skip(1);
        [(); 6].map(|()| match words.next() {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => 0,
        })
    }
}

impl Encode for SixAxes {
    fn encode(axes: [u16; 6]) -> [u8; 16] {
        let mut frame = [0xFF; 16];
        for (place, axis) in frame.chunks_exact_mut(2).skip(1).zip(axes) {
            place.copy_from_slice(&axis.to_le_bytes());
        }
        [frame[14], frame[15]] = [b'\n', b'\r'];
        frame
    }
}

impl Format for SixAxes {
    const LONGEST: usize = 16;
    type Message<'a> = [u16; 6];

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        let frame = Headed {
            sync: &[0xFF, 0xFF],
            header: 2,
            longest: <Self as Format>::LONGEST,
        };
        frame.judge_and_say_why(
            bytes,
            |_| Some(<Self as Format>::LONGEST),
            |frame| (!frame.ends_with(b"\n\r")).then_some(DiscardReason::Terminator),
        )
    }

    #[inline]
    fn decode(&self, frame: &[u8]) -> [u16; 6] {
        frame
            .try_into()
            .map_or([0; 6], <Self as FixedFormat>::decode)
    }
}
