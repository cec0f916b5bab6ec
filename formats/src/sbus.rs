//! Futaba's SBUS.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{CheckedLayout, FixedBits, Layout, Patterns};

/// The layout of an SBUS frame: see [`Sbus`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    sync: Patterns::one(&[0x0F]),
    longest: 25,
    fixed: &[FixedBits {
        at: 23,
        mask: 0xF0,
        value: 0,
    }],
    terminator: Patterns::any_byte_of(&[0x00, 0x04, 0x14, 0x24, 0x34]),
    ..Layout::NONE
}
.checked();

/// Futaba's SBUS. A frame has 25 bytes: `0F`, sixteen channels of 11 bits, flags, `00`. The line runs at 100 000 baud
/// with even parity and two stop bits, and is inverted.
///
/// **SBUS has no checksum**: a wrong byte in a channel goes unnoticed, and the bytes of channels may look like a
/// frame's beginning or end. Only the first byte, the four unused bits of the flags, and the last byte are checked. The
/// unused bits must be zero. The last byte must be 00, or 04, 14, 24 or 34 in SBUS2. These checks are weak, so report
/// parity errors, and the idle gap after each frame, as [`LineEvent`](framelock::LineEvent)s.
///
/// Source: Futaba has published nothing. PX4 and Betaflight agree on the layout:
/// <https://github.com/PX4/PX4-Autopilot/blob/main/src/lib/rc/sbus.cpp>,
/// <https://github.com/betaflight/betaflight/blob/master/src/main/rx/sbus.c>.
///
/// # Examples
/// ```
/// use framelock::EncodeInto;
/// use framelock_formats::sbus::{self, Sbus};
/// let sent = sbus::Message { channels: [992; 16], failsafe: true, ..Default::default() };
/// let mut buffer = [0; 25];
/// let frame = Sbus.encode_into(sent, &mut buffer)?;
/// let mut receiver = sbus::Receiver::new(Sbus);
/// let received = frame.iter().find_map(|&byte| receiver.push(byte).map(|frame| frame.message()));
/// assert_eq!(received, Some(sent));
/// # Ok::<(), framelock::EncodeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Sbus;

/// A receiver whose buffer is twice as long as the longest frame.
pub type Receiver = framelock::BufferedReceiver<Sbus, [u8; 50]>;

/// The contents of an SBUS frame.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Message {
    /// Channels 1 to 16: 0 to 2047. Most transmitters use 172 to 1811, with 992 in the middle.
    pub channels: [u16; 16],
    /// Channels 17 and 18, on or off.
    pub digital: [bool; 2],
    /// True if the radio missed a frame. The channels then repeat an earlier frame.
    pub frame_lost: bool,
    /// True if the radio has lost its transmitter. The channels then have the failsafe values that are configured in
    /// the radio.
    pub failsafe: bool,
}

impl Format for Sbus {
    crate::classify_by!(LAYOUT);
    type Message<'a> = Message;

    #[inline]
    fn decode(&self, frame: &[u8]) -> Message {
        let mut message = Message::default();
        if let Some(frame) = frame.first_chunk::<25>() {
            let [.., flags, _] = *frame;
            if let Some(channels) = frame.get(1..).and_then(<[u8]>::first_chunk) {
                unpack_channels(channels, &mut message.channels);
            }
            message.digital = [flags & 1 != 0, flags & 2 != 0];
            message.frame_lost = flags & 4 != 0;
            message.failsafe = flags & 8 != 0;
        }
        message
    }
}

impl EncodeInto for Sbus {
    /// Writes the lower 11 bits of each channel.
    fn encode_into<'b>(
        &self,
        message: Message,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        let [seventeen, eighteen] = message.digital.map(u8::from);
        let radio = u8::from(message.frame_lost) << 2 | u8::from(message.failsafe) << 3;
        let flags = seventeen | eighteen << 1 | radio;
        let channels = pack_channels(&message.channels);
        crate::write(&LAYOUT, into, &[&[0], &channels, &[flags, 0]])
    }
}

/// The number of bytes that sixteen channels of 11 bits occupy. CRSF packs channels in the same way.
pub(crate) const CHANNEL_BYTES: usize = 22;

/// Unpacks the sixteen channels. Channel `n` begins at bit `11 * n`. Eight channels occupy eleven bytes, which are read
/// as three words that begin at bits 0, 32 and 56.
#[inline]
pub(crate) fn unpack_channels(bytes: &[u8; CHANNEL_BYTES], channels: &mut [u16; 16]) {
    for (eight, half) in channels.chunks_exact_mut(8).zip(bytes.chunks_exact(11)) {
        if let (&[a, b, c, d, e, f, g, h, i, j, k], [c0, c1, c2, c3, c4, c5, c6, c7]) =
            (half, eight)
        {
            let from_0 = u32::from_le_bytes([a, b, c, d]);
            let from_32 = u32::from_le_bytes([e, f, g, h]);
            let from_56 = u32::from_le_bytes([h, i, j, k]);
            *c0 = channel(from_0);
            *c1 = channel(from_0 >> 11);
            *c2 = channel(from_0 >> 22 | from_32 << 10);
            *c3 = channel(from_32 >> 1);
            *c4 = channel(from_32 >> 12);
            *c5 = channel(from_32 >> 23 | from_56 << 1);
            *c6 = channel(from_56 >> 10);
            *c7 = channel(from_56 >> 21);
        }
    }
}

/// Returns the lowest 11 bits.
#[inline]
const fn channel(bits: u32) -> u16 {
    (bits & 0x7FF) as u16
}

/// Packs the lower 11 bits of each channel.
fn pack_channels(channels: &[u16; 16]) -> [u8; CHANNEL_BYTES] {
    let mut channels = channels.iter();
    let (mut bits, mut count) = (0_u32, 0_u32);
    [(); CHANNEL_BYTES].map(|()| {
        if count < 8 {
            let channel = channels.next().copied().unwrap_or_default() & 0x7FF;
            bits |= u32::from(channel).wrapping_shl(count);
            count = count.wrapping_add(11);
        }
        let [byte, ..] = bits.to_le_bytes();
        bits >>= 8;
        count = count.wrapping_sub(8);
        byte
    })
}
