//! Hints: the reason why a stream has no frames, as far as the stream's bytes show it.

use framelock_receiving::Protocol;

use super::summary::Summary;

/// The facts about a stream from which a hint is made.
pub(super) struct Stream<'s> {
    pub(super) protocol: &'s Protocol,
    /// The first bytes of the stream.
    pub(super) beginning: &'s [u8],
    pub(super) summary: &'s Summary,
    /// Whether pauses are reported to the receiver.
    pub(super) has_pauses: bool,
}

impl Stream<'_> {
    /// Returns a hint if no frame has arrived or most bytes were discarded.
    pub(super) fn hint(&self) -> Option<String> {
        let Summary {
            bytes,
            frames,
            discarded,
            ..
        } = *self.summary;
        let is_good = bytes == 0 || frames > 0 && discarded <= bytes / 2;
        (!is_good).then(|| {
            let (protocol, cause) = (self.protocol, self.cause());
            format!("{discarded} of {bytes} bytes are in no frame of {protocol}; {cause}")
        })
    }

    fn cause(&self) -> &'static str {
        let needs_pauses = self.protocol.description.ending_event().is_some();
        if needs_pauses && !self.has_pauses {
            "silence ends these frames: read a serial port or a live stream, with --idle-gap"
        } else if is_decimal_text(self.beginning) {
            "the input looks like decimal text, such as AB128127128: have the sender write each value as a byte"
        } else {
            "check --frame, --input, the baud rate and parity, and whether the line is inverted"
        }
    }
}

fn is_decimal_text(bytes: &[u8]) -> bool {
    let is_text = |byte: &u8| matches!(byte, b'!'..=b'~' | b'\r' | b'\n');
    let digits = bytes.iter().filter(|byte| byte.is_ascii_digit()).count();
    bytes.iter().all(is_text) && 10 * digits > 3 * bytes.len()
}
