use framelock::Format;

use crate::layout::{Algorithm, Checksum, FixedBits, Layout, Length, Patterns, Written};

/// What an NMEA 0183 sentence looks like: see [`Nmea`].
pub const NMEA: Layout<'static> = Layout {
    sync: Patterns::any_byte_of(b"$!"),
    length: Length::Delimiter,
    shortest: 7,
    longest: 128,
    fixed: &[FixedBits {
        at: -5,
        mask: 0xFF,
        value: b'*',
    }],
    checksum: Some(Checksum {
        algorithm: Algorithm::Xor,
        bytes: 1,
        written: Written::Hex,
        at: -4,
        from: 1,
        to: -6,
    }),
    terminator: Patterns::one(b"\r\n"),
    ..Layout::NONE
};

/// NMEA 0183, the text of satellite receivers and ships: `$` or `!`, a sentence, `*`, its checksum in two
/// hexadecimal digits, CR LF. The line has 4 800 baud, or as many as the receiver is set to.
///
/// Sentences without a checksum are none. The standard has sentences of up to 82 bytes; receivers send longer ones,
/// so those of up to 128 are accepted.
///
/// The checksum is an exclusive or: it notices each single wrong bit, and lets one in 256 random sentences pass.
///
/// Source: the standard is sold; u-blox F9 HPG 1.32 Interface Description, UBX-22008968, "NMEA frame structure".
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::Nmea;
/// let mut receiver = BufferedReceiver::<_, 256>::new(Nmea);
/// let mut received = Vec::new();
/// for byte in *b"noise $GPTXT,01,01,02,ok*49\r\n" {
///     if let Some(sentence) = receiver.push(byte) {
///         received.extend(sentence.split(|&byte| byte == b',').map(<[u8]>::to_vec));
///     }
/// }
/// assert_eq!(received, [&b"GPTXT"[..], b"01", b"01", b"02", b"ok"]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Nmea;

impl Format for Nmea {
    crate::judged_by!(NMEA);
    /// What is between the first byte and the `*`.
    type Message<'a> = &'a [u8];

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        match frame {
            [_, sentence @ .., _, _, _, _, _] => sentence,
            _ => &[],
        }
    }
}

impl Nmea {
    /// Writes the frame of a sentence to the front of `into`, and gives its length; nothing if it is longer than 128
    /// bytes or than `into`, or has a line's end in it.
    pub fn encode(sentence: &[u8], into: &mut [u8]) -> Option<usize> {
        crate::write(&NMEA, into, &[b"$", sentence, b"*hh\r\n"])
    }
}
