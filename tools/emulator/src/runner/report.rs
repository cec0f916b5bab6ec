//! Prints events with their emulated times: watched words, pulses, LEDs, log, resets.

use std::io::Write;

use nrf52840_emulator::{MILLISECOND, Pins, ResetCause};
use serde_json::{Value, json};

use crate::arguments::{ReportFormat, Watch};

/// LED1 to LED4 of the nRF52840-DK, at P0.13 to P0.16. They are lit when low.
const LEDS: [u32; 4] = [13, 14, 15, 16];

/// An event on the board.
pub(crate) enum Event<'a> {
    Changed(&'a Watch, u32),
    /// Pulse widths in microseconds, of the channels that go to a pin.
    Pulses(Vec<u64>),
    /// Which of LED1 to LED4 are lit.
    Leds([bool; 4]),
    Log(String),
    Reset(ResetCause),
}

/// Returns which LEDs are lit.
pub(crate) fn leds(pins: Pins) -> [bool; 4] {
    let [outputs, _] = pins.outputs;
    let [high, _] = pins.high;
    LEDS.map(|pin| outputs >> pin & 1 == 1 && high >> pin & 1 == 0)
}

/// Prints one event.
pub(crate) fn print(
    out: &mut impl Write,
    format: ReportFormat,
    at: u64,
    event: &Event,
) -> std::io::Result<()> {
    if format == ReportFormat::Json {
        return writeln!(out, "{}", object(at, event));
    }
    let (whole, part) = (at / MILLISECOND, at % MILLISECOND * 1_000 / MILLISECOND);
    let (what, how) = text(event);
    writeln!(out, "{whole:>8}.{part:03} ms  {what:<9} {how}")
}

fn text<'a>(event: &'a Event) -> (&'a str, String) {
    let some = |words: Vec<String>| {
        if words.is_empty() {
            "none".to_owned()
        } else {
            words.join("  ")
        }
    };
    match event {
        Event::Changed(watch, value) => {
            let fields = fields(watch, *value).into_iter();
            let fields = fields.map(|(name, value)| format!("{name} {value:3}"));
            (&watch.0, some(fields.collect()))
        }
        Event::Pulses(widths) => {
            let widths = widths.iter().map(|width| format!("{width:4} us"));
            ("pulses", some(widths.collect()))
        }
        Event::Leds(lit) => {
            let lit = (1..).zip(lit).filter(|(_, lit)| **lit);
            ("lit", some(lit.map(|(n, _)| format!("LED{n}")).collect()))
        }
        Event::Log(line) => ("log", line.clone()),
        Event::Reset(cause) => ("reset", cause.to_string()),
    }
}

fn object(at: u64, event: &Event) -> Value {
    match event {
        Event::Changed(watch, value) => {
            let fields = fields(watch, *value).into_iter();
            let fields = fields.map(|(name, value)| (name.to_owned(), json!(value)));
            let what = [("event", json!(watch.0)), ("cycles", json!(at))];
            let what = what.map(|(name, value)| (name.to_owned(), value));
            Value::Object(fields.chain(what).collect())
        }
        Event::Pulses(widths) => json!({"cycles": at, "event": "pulses", "microseconds": widths}),
        Event::Leds(lit) => json!({"cycles": at, "event": "leds", "lit": lit}),
        Event::Log(line) => json!({"cycles": at, "event": "log", "line": line}),
        Event::Reset(cause) => json!({"cycles": at, "event": "reset", "cause": cause.to_string()}),
    }
}

/// Returns the word's bytes with their names, or the entire word if its bytes have no names.
fn fields((_, names): &Watch, value: u32) -> Vec<(&str, u32)> {
    if names.is_empty() {
        return vec![("value", value)];
    }
    let bytes = value.to_le_bytes().map(u32::from);
    names.iter().map(String::as_str).zip(bytes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(format: ReportFormat, names: &[&str]) -> String {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        let watch = ("SETPOINT".to_owned(), names);
        let mut out = Vec::new();
        let event = Event::Changed(&watch, 0x014A_C87F);
        print(&mut out, format, 96_000, &event).expect("memory takes it");
        String::from_utf8(out).expect("it is text")
    }

    #[test]
    fn a_watched_word_is_shown_by_its_bytes_names_or_as_a_whole() {
        let names = ["pitch", "roll", "yaw"];
        assert_eq!(
            printed(ReportFormat::Text, &names),
            "       1.500 ms  SETPOINT  pitch 127  roll 200  yaw  74\n"
        );
        assert_eq!(
            printed(ReportFormat::Json, &names),
            "{\"cycles\":96000,\"event\":\"SETPOINT\",\"pitch\":127,\"roll\":200,\"yaw\":74}\n"
        );
        assert_eq!(
            printed(ReportFormat::Text, &[]),
            "       1.500 ms  SETPOINT  value 21678207\n"
        );
    }
}
