//! Events with their emulated times: watched words, pulses, log, resets.

use std::fmt::Write as _;

use nrf52840_emulator::{MILLISECOND, ResetCause};

use crate::arguments::Watch;

/// An event on the board.
pub(crate) enum Event<'a> {
    Changed(&'a Watch, u32),
    /// Pulse widths in microseconds, of the channels that go to a pin.
    Pulses(Vec<u64>),
    Log(String),
    Reset(ResetCause),
}

/// Returns the line that shows the event.
pub(crate) fn line(at: u64, event: &Event) -> String {
    let (name, text) = match event {
        Event::Changed(watch, value) => (watch.0.as_str(), fields(watch, *value)),
        Event::Pulses(widths) if widths.is_empty() => ("pulses", "none".to_owned()),
        Event::Pulses(widths) => {
            let widths = widths.iter().map(|width| format!("{width:4} us"));
            ("pulses", widths.collect::<Vec<_>>().join("  "))
        }
        Event::Log(line) => ("log", line.clone()),
        Event::Reset(cause) => ("reset", cause.to_string()),
    };
    let (whole, part) = (at / MILLISECOND, at % MILLISECOND * 1_000 / MILLISECOND);
    format!("{whole:>8}.{part:03} ms  {name:<9} {text}")
}

/// Returns the word's bytes with their names, or the entire word if its bytes have no names.
fn fields((_, names): &Watch, value: u32) -> String {
    if names.is_empty() {
        return format!("value {value:3}");
    }
    let mut text = String::new();
    for (name, byte) in names.iter().zip(value.to_le_bytes()) {
        let between = if text.is_empty() { "" } else { "  " };
        // Writing to a string cannot fail.
        let _ = write!(text, "{between}{name} {byte:3}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(names: &[&str]) -> String {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        let watch = ("SETPOINT".to_owned(), names);
        line(96_000, &Event::Changed(&watch, 0x014A_C87F))
    }

    #[test]
    fn a_watched_word_is_shown_by_its_bytes_names_or_as_a_whole() {
        assert_eq!(
            printed(&["pitch", "roll", "yaw"]),
            "       1.500 ms  SETPOINT  pitch 127  roll 200  yaw  74"
        );
        assert_eq!(printed(&[]), "       1.500 ms  SETPOINT  value 21678207");
    }
}
