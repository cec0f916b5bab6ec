//! What is printed: setpoints, pulses, LEDs, log lines, resets; each at its emulated time.

use std::io::Write;

use framelock_emulator::{CYCLES_PER_SECOND, Pins, ResetCause};
use serde_json::{Value, json};

use crate::arguments::Format;

/// LED1 to LED4 of the nRF52840-DK, at P0.13 to P0.16; they light when low.
const LEDS: [u32; 4] = [13, 14, 15, 16];

/// Something that happened on the board.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Event {
    /// The published setpoint: pitch, roll, yaw.
    Setpoint([u8; 3]),
    /// Pulse widths in microseconds, of the channels that go to a pin; nothing: no pulses any more.
    Pulses(Option<[Option<u64>; 4]>),
    /// Which of LED1 to LED4 are lit.
    Leds([bool; 4]),
    Log(String),
    Reset(ResetCause),
}

/// Which LEDs are lit.
pub(crate) fn leds(pins: Pins) -> [bool; 4] {
    let [outputs, _] = pins.outputs;
    let [high, _] = pins.high;
    LEDS.map(|pin| outputs >> pin & 1 == 1 && high >> pin & 1 == 0)
}

/// Prints one event.
pub(crate) fn print(
    out: &mut impl Write,
    format: Format,
    at: u64,
    event: &Event,
) -> std::io::Result<()> {
    match format {
        Format::Text => {
            let millisecond = CYCLES_PER_SECOND / 1_000;
            let (whole, part) = (at / millisecond, at % millisecond * 1_000 / millisecond);
            writeln!(out, "{whole:>8}.{part:03} ms  {}", text(event))
        }
        Format::Json => {
            let mut object = object(event);
            if let Value::Object(fields) = &mut object {
                fields.insert("cycles".to_owned(), json!(at));
            }
            writeln!(out, "{object}")
        }
    }
}

fn text(event: &Event) -> String {
    match event {
        Event::Setpoint([pitch, roll, yaw]) => {
            format!("setpoint  pitch {pitch:3}  roll {roll:3}  yaw {yaw:3}")
        }
        Event::Pulses(Some(widths)) => {
            let widths: Vec<String> = widths
                .iter()
                .flatten()
                .map(|w| format!("{w:4} us"))
                .collect();
            format!("pulses    {}", widths.join("  "))
        }
        Event::Pulses(None) => "pulses    none".to_owned(),
        Event::Leds(lit) => {
            let leds = (1..).zip(lit).filter(|(_, lit)| **lit);
            let leds: Vec<String> = leds.map(|(n, _)| format!("LED{n}")).collect();
            let leds = if leds.is_empty() {
                "none".to_owned()
            } else {
                leds.join(" ")
            };
            format!("lit       {leds}")
        }
        Event::Log(line) => format!("log       {line}"),
        Event::Reset(cause) => format!("reset     {}", cause_name(*cause)),
    }
}

fn object(event: &Event) -> Value {
    match event {
        Event::Setpoint([pitch, roll, yaw]) => {
            json!({"event": "setpoint", "pitch": pitch, "roll": roll, "yaw": yaw})
        }
        Event::Pulses(Some(widths)) => {
            let widths: Vec<u64> = widths.iter().flatten().copied().collect();
            json!({"event": "pulses", "microseconds": widths})
        }
        Event::Pulses(None) => json!({"event": "pulses", "microseconds": []}),
        Event::Leds(lit) => json!({"event": "leds", "lit": lit}),
        Event::Log(line) => json!({"event": "log", "line": line}),
        Event::Reset(cause) => json!({"event": "reset", "cause": cause_name(*cause)}),
    }
}

fn cause_name(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::Pin => "pin",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Soft => "soft",
    }
}
