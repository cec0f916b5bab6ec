//! Nothing from the wire reaches a terminal as it came.

/// Whether a terminal acts on nothing in it, and shows it from left to right.
#[must_use]
pub fn is_harmless(text: &str) -> bool {
    let turns = |c| matches!(c, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    !text
        .chars()
        .any(|c| c.is_control() && c != '\n' || turns(c))
}

/// Frames of text, without a checksum: a fuzzer makes these by itself.
pub const LINES: &str = r#"
    sync = "23"
    terminator = "0D 0A"
    longest = 40
    fields = [
        { name = "number", at = 1, type = "u8" },
        { name = "note", at = 2, type = "text" },
    ]
"#;

/// The first byte says of which frames; the others are on the wire as they are, as a line and as a sentence of NMEA.
/// `texts` gives what a program writes of a stream of these frames.
///
/// # Panics
/// A terminal would act on it.
pub fn terminal(bytes: &[u8], texts: impl FnOnce(usize, &[u8]) -> Vec<String>) {
    let Some((&frames, bytes)) = bytes.split_first() else {
        return;
    };
    let check = bytes.iter().fold(0, |check, byte| check ^ byte);
    let end = format!("*{check:02X}\r\n");
    let (line, sentence) = ([b"#1", bytes, b"\r\n"], [b"$", bytes, end.as_bytes()]);
    let stream = [bytes, &line.concat(), &sentence.concat()].concat();
    for text in texts(frames.into(), &stream) {
        assert!(is_harmless(&text), "{text:?}");
    }
}
