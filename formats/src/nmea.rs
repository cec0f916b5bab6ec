//! NMEA 0183, the text of satellite receivers and ships.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{
    Algorithm, CheckedLayout, Checksum, Encoding, FixedBits, Layout, Length, Patterns,
};

/// The layout of an NMEA 0183 sentence: see [`Nmea`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    sync: Patterns::any_byte_of(b"$!"),
    length: Length::Delimiter,
    shortest: 7,
    longest: 512 + 3,
    content: &[(b'%', b'~'), (b'"', b'#'), (b' ', b' ')],
    fixed: &[FixedBits {
        at: -5,
        mask: 0xFF,
        value: b'*',
    }],
    checksum: Some(Checksum {
        algorithm: Algorithm::Xor,
        encoding: Encoding::Hex,
        at: -4,
        from: 1,
        to: -6,
        ..Checksum::at_the_end(1)
    }),
    terminator: Patterns::one(b"\r\n"),
    other_terminators: [Patterns::one(b"\n"), Patterns::one(b"\r\r\n")],
    ..Layout::NONE
}
.checked();

/// NMEA 0183, the text of satellite receivers and ships: `$` or `!`, a sentence, `*`, its checksum in two hexadecimal
/// digits, and CR LF. LF alone and CR CR LF are accepted too, because both line ends occur in logs. The standard's
/// line runs at 4 800 baud. Satellite receivers often use another rate.
///
/// Sentences without a checksum are rejected. The standard allows frames of up to 82 bytes. Satellite receivers send
/// longer frames, such as PUBX,03 with 424 bytes, so frames of up to 515 bytes are accepted. A sentence consists
/// of printable characters except `$` and `!`, which begin another sentence.
///
/// The checksum is an exclusive or. It detects a single wrong bit in a sentence. One in 256 random sentences passes.
///
/// Source: u-blox F9 HPG 1.32 Interface Description, UBX-22008968, "NMEA frame structure". The standard itself is not
/// free.
///
/// # Examples
/// ```
/// use framelock_formats::nmea::{self, Nmea};
/// let mut receiver = nmea::Receiver::new(Nmea);
/// let mut received = Vec::new();
/// for byte in *b"noise $GPTXT,01,01,02,ok*49\r\n" {
///     if let Some(frame) = receiver.push(byte) {
///         received.extend(frame.message().split(|&byte| byte == b',').map(<[u8]>::to_vec));
///     }
/// }
/// assert_eq!(received, [&b"GPTXT"[..], b"01", b"01", b"02", b"ok"]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Nmea;

/// A receiver whose buffer is twice as long as the longest frame: 1 030 bytes.
pub type Receiver = framelock::BufferedReceiver<Nmea, [u8; 1030]>;

impl Format for Nmea {
    crate::classify_by!(LAYOUT);
    /// The text between the first byte and the `*`.
    type Message<'a> = &'a [u8];

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        let star = frame.iter().rposition(|&byte| byte == b'*');
        frame.get(1..star.unwrap_or_default()).unwrap_or_default()
    }
}

impl EncodeInto for Nmea {
    /// Ends the frame with CR LF. Fails for frames of more than 515 bytes, and for sentences that are empty, or contain
    /// `$`, `!` or a character that is not printable.
    fn encode_into<'b>(
        &self,
        sentence: &[u8],
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        crate::write(&LAYOUT, into, &[b"$", sentence, b"*hh\r\n"])
    }
}
