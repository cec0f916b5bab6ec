//! NMEA 0183, the text of satellite receivers and ships.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{Algorithm, Checksum, Encoding, FixedBits, Layout, Length, Patterns};

/// What an NMEA 0183 sentence looks like: see [`Nmea`].
pub const LAYOUT: Layout<'static> = Layout::builder()
    .sync(Patterns::any_byte_of(b"$!"))
    .length(Length::Delimiter)
    .shortest(7)
    .longest(512 + 3)
    .content(&[(b'%', b'~'), (b'"', b'#'), (b' ', b' ')])
    .fixed(&[FixedBits::new(-5, 0xFF, b'*')])
    .checksum(
        Checksum::at_the_end(1)
            .algorithm(Algorithm::Xor)
            .encoding(Encoding::Hex)
            .at(-4)
            .from(1)
            .to(-6),
    )
    .terminator(Patterns::one(b"\r\n"))
    .other_terminators(&[b"\n", b"\r\r\n"])
    .build_const();

/// NMEA 0183, the text of satellite receivers and ships: `$` or `!`, a sentence, `*`, its checksum in two
/// hexadecimal digits, and CR LF; or LF alone, or CR CR LF, as logs have them. The line has 4 800 baud, or as many as the receiver is set to.
///
/// Sentences without a checksum are none. The standard has sentences of up to 82 bytes; receivers send longer ones, such
/// as 424 bytes of PUBX,03, so sentences of up to 512 bytes are accepted. A sentence consists of printable characters
/// without `$` and `!`: either begins another sentence.
///
/// The checksum is an exclusive or: it notices each single wrong bit, and lets one in 256 random sentences pass.
///
/// Source: the standard is sold; u-blox F9 HPG 1.32 Interface Description, UBX-22008968, "NMEA frame structure".
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

/// A receiver with a buffer of twice the longest frame: 1 030 bytes.
pub type Receiver = framelock::BufferedReceiver<Nmea, [u8; 1030]>;

impl Format for Nmea {
    crate::classify_by!(LAYOUT);
    /// What is between the first byte and the `*`.
    type Message<'a> = &'a [u8];

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        let star = frame.iter().rposition(|&byte| byte == b'*');
        frame.get(1..star.unwrap_or_default()).unwrap_or_default()
    }
}

impl EncodeInto for Nmea {
    /// Writes CR LF at the end. Fails for frames of more than 515 bytes, and for sentences that contain anything but
    /// printable characters, or `$` or `!`.
    fn encode_into<'b>(
        &self,
        sentence: &[u8],
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        crate::write(&LAYOUT, into, &[b"$", sentence, b"*hh\r\n"])
    }
}
