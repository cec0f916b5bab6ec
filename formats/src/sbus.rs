use framelock::Format;

use crate::layout::{FixedBits, Layout, Patterns};

/// What an SBUS frame looks like: see [`Sbus`].
pub const SBUS: Layout<'static> = Layout {
    sync: Patterns::one(&[0x0F]),
    shortest: 25,
    longest: 25,
    fixed: &[FixedBits {
        at: 23,
        mask: 0xF0,
        value: 0,
    }],
    terminator: Patterns::any_byte_of(&[0x00, 0x04, 0x14, 0x24, 0x34]),
    ..Layout::NONE
};

/// Futaba's SBUS: 25 bytes, `0F`, sixteen channels of 11 bits, flags, `00`. The line has 100 000 baud, even
/// parity and two stop bits, and is inverted.
///
/// **SBUS has no checksum**: a wrong byte in a channel goes unnoticed, and channels may look like a frame's
/// beginning or end. What is checked is the first byte, that the flags' four unused bits are zero, and the last
/// byte: 00, or 04, 14, 24 or 34 of SBUS2. So report parity errors, and the idle gap behind each frame, as
/// [`LineEvent`](framelock::LineEvent)s.
///
/// Source: Futaba has published nothing. PX4 and Betaflight agree on the layout:
/// <https://github.com/PX4/PX4-Autopilot/blob/main/src/lib/rc/sbus.cpp>,
/// <https://github.com/betaflight/betaflight/blob/master/src/main/rx/sbus.c>.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Sbus, SbusMessage};
/// let sent = SbusMessage { channels: [992; 16], failsafe: true, ..SbusMessage::default() };
/// let mut receiver = BufferedReceiver::<_, 50>::new(Sbus);
/// let received = sent.encode().into_iter().find_map(|byte| receiver.push(byte));
/// assert_eq!(received, Some(sent));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Sbus;

/// What an SBUS frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct SbusMessage {
    /// Channels 1 to 16: 0 to 2047. Most transmitters use 172 to 1811, with 992 in the middle.
    pub channels: [u16; 16],
    /// Channels 17 and 18, on or off.
    pub digital: [bool; 2],
    /// The radio missed a frame; the channels are those of an earlier one.
    pub frame_lost: bool,
    /// The radio has lost its transmitter; the channels are what it was set up to send then.
    pub failsafe: bool,
}

impl Format for Sbus {
    crate::judged_by!(SBUS);
    type Message<'a> = SbusMessage;

    #[inline]
    fn decode(&self, frame: &[u8]) -> SbusMessage {
        let &[_, ref channels @ .., flags, _] = frame else {
            return SbusMessage::default();
        };
        SbusMessage {
            channels: channels.try_into().map_or([0; 16], unpack_channels),
            digital: [flags & 1 != 0, flags & 2 != 0],
            frame_lost: flags & 4 != 0,
            failsafe: flags & 8 != 0,
        }
    }
}

impl SbusMessage {
    /// The frame that says it, with the lower 11 bits of each channel.
    #[must_use]
    pub fn encode(&self) -> [u8; 25] {
        let [seventeen, eighteen] = self.digital.map(u8::from);
        let radio = u8::from(self.frame_lost) << 2 | u8::from(self.failsafe) << 3;
        let flags = seventeen | eighteen << 1 | radio;
        let mut frame = [0; 25];
        let [_, places @ .., place, _] = &mut frame;
        places.copy_from_slice(&pack_channels(&self.channels));
        *place = flags;
        SBUS.seal(&mut frame);
        frame
    }
}

/// Bytes of sixteen channels of 11 bits, the lowest bits first. CRSF packs them in the same way.
const CHANNEL_BYTES: usize = 22;

/// Unpacks the sixteen channels.
#[inline]
pub(crate) fn unpack_channels(bytes: &[u8; CHANNEL_BYTES]) -> [u16; 16] {
    let mut channels = [0; 16];
    let mut bit = 0_u32;
    for channel in &mut channels {
        // Four bytes have it; the last four, from 18 on, have the last two channels.
        let at = (bit / 8).min(18);
        let shift = bit.wrapping_sub(at.wrapping_mul(8));
        let four = bytes.get(at as usize..).and_then(<[u8]>::first_chunk);
        let bits = u32::from_le_bytes(four.copied().unwrap_or_default());
        *channel = (bits.wrapping_shr(shift) & 0x7FF) as u16;
        bit = bit.wrapping_add(11);
    }
    channels
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
