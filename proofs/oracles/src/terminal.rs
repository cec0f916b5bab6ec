//! Target `terminal`: no control character from the wire may reach a terminal.

/// Returns whether a terminal shows the text from left to right and acts on no character except the
/// newline.
#[must_use]
pub fn is_harmless(text: &str) -> bool {
    let turns = |c| matches!(c, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    !text
        .chars()
        .any(|c| c.is_control() && c != '\n' || turns(c))
}

/// A description of text frames. They have no checksum, so that a fuzzer can find valid ones by chance.
pub const LINES: &str = r#"
    sync = "23"
    terminator = "0D 0A"
    longest = 40
    fields = [
        { name = "number", at = 1, type = "u8" },
        { name = "note", at = 2, type = "text" },
    ]
"#;

/// Checks the texts that a program writes. The first byte chooses the frame format. The other bytes are sent three
/// times: unchanged, as a line of text, and as an NMEA sentence. `texts` returns the program's output for a stream in
/// this format.
///
/// # Panics
/// Panics if a terminal would act on a text.
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
