//! The view of a position, as JSON that the page's script draws.

use std::ops::Range;

use framelock::motion::Setpoint;
use framelock_description::{Description, KIND};
use serde_json::{Value, json};

use crate::machine::{Fate, Machine};
use crate::run::Run;

/// The greatest number of pending bytes that the page draws.
const MOST: usize = 64;

impl Run {
    /// Returns the view of a position, with the cells at these places on the line.
    pub(crate) fn json(&self, position: usize, places: Range<usize>) -> Value {
        let last = position.min(self.positions());
        let end = places.end.min(self.cells.len());
        let from = places.start.min(end);
        let state = self.at(last);
        // The number of bytes that arrive before the cell.
        let before = self.cells[..from].iter();
        let mut arrived = before.filter(|cell| cell.received.is_some()).count();
        let cells = (from..end).map(|place| {
            let cell = &self.cells[place];
            let has_arrived = place < last && cell.received.is_some();
            let fates = state.machines.iter().map(|machine| {
                let fate = machine.fates.get(arrived).map(Fate::to_string);
                has_arrived.then(|| fate.unwrap_or_else(|| "pending".to_owned()))
            });
            let fates: Vec<_> = fates.collect();
            arrived += usize::from(cell.received.is_some());
            json!({
                "place": place, "sent": cell.sent, "received": cell.received, "kind": cell.kind(),
                "begins": cell.begins, "fates": fates,
            })
        });
        let cells: Value = cells.collect();
        let machines = state
            .machines
            .iter()
            .map(|machine| self.machine(machine, state.now));
        json!({
            "position": last, "positions": self.positions(), "bytes": self.cells.len(),
            "seconds": f64::from(state.now) / 1e3, "sentence": self.sentence(last, &state.machines),
            "cells": cells, "machines": machines.collect::<Value>(),
        })
    }

    /// Describes the last step in a sentence.
    fn sentence(&self, position: usize, machines: &[Machine]) -> String {
        let cell = position.checked_sub(1).map(|last| self.cells.get(last));
        let byte = |byte: Option<u8>| byte.map_or(String::new(), |byte| format!("{byte:02X}"));
        let mut sentence = match cell {
            None => return "No byte has arrived yet.".to_owned(),
            Some(None) => "The line is silent.".to_owned(),
            Some(Some(cell)) => match cell.kind() {
                "lost" => {
                    return format!(
                        "{} is lost on the line. Nothing arrives, so no machine can notice it yet.",
                        byte(cell.sent)
                    );
                }
                "altered" => format!("{} arrives as {}.", byte(cell.sent), byte(cell.received)),
                "inserted" => format!("{} arrives, but nobody sent it.", byte(cell.received)),
                _ => format!("{} arrives.", byte(cell.received)),
            },
        };
        for machine in machines {
            let what = what(&self.protocol.description, machine);
            let name = machine.name().replacen("the", "The", 1);
            sentence = format!("{sentence} {name} {what}.");
        }
        sentence
    }

    fn machine(&self, machine: &Machine, now: u32) -> Value {
        let (tally, lecture) = (&machine.tally, machine.lecture());
        let status = match (tally.missed_in_row, tally.wrong_in_row) {
            (0, _) if tally.delivered + tally.wrong == 0 => "NO FRAME YET",
            (0, _) => "LISTENING",
            (1, 0) => "MISSED ONE",
            (_, 0) => "DEAF",
            _ => "MISREADING",
        };
        let missing = now.saturating_sub(tally.since);
        let bytes = machine.line.pending();
        let description = &self.protocol.description;
        let stored = |axis: usize| match lecture {
            // No byte has arrived that the machine could have stored.
            Some(_) if machine.line.counters().bytes == 0 => None,
            Some(lecture) => <[u8; 3]>::from(lecture.temp).get(axis).copied(),
            None => bytes.get(3 + axis).copied(),
        };
        let axes = self.protocol.has_setpoints().then(|| {
            json!({
                "temporary": [stored(0), stored(1), stored(2)],
                "setpoint": machine.setpoint(),
                "output": Setpoint::from(machine.output.axes),
                "phase": machine.output.phase,
                "reason": machine.standstill.reason(machine.output.phase),
            })
        });
        json!({
            "name": machine.name(),
            "state": lecture.map(|lecture| lecture.state.to_string()),
            "window": &bytes[..bytes.len().min(MOST)],
            "pending": bytes.len(),
            "axes": axes,
            "fields": fields(description, &machine.frame),
            "status": status,
            "status_seconds": if status == "LISTENING" { 0.0 } else { f64::from(missing) / 1e3 },
            "tally": tally,
            "counters": machine.line.counters(),
        })
    }
}

/// Returns the name, value and unit of each field of a frame. If the description has kinds, the frame's kind comes
/// first.
fn fields(description: &Description, bytes: &[u8]) -> Vec<[String; 3]> {
    let Some(kind) = description.kind(bytes).filter(|_| !bytes.is_empty()) else {
        return Vec::new();
    };
    let has_kinds = description.has_kinds();
    let name = has_kinds.then(|| [KIND, kind.name_of(bytes), ""].map(str::to_owned));
    let fields = kind.values(bytes).map(|(field, content)| {
        let values: Vec<String> = content.values().map(|value| value.to_string()).collect();
        let unit = field.unit.clone().unwrap_or_default();
        [field.name.clone(), values.join(" "), unit]
    });
    name.into_iter().chain(fields).collect()
}

/// Describes the machine's last step.
fn what(description: &Description, machine: &Machine) -> String {
    let decided = &machine.fates[machine.decided_before..];
    let has = |wanted| decided.contains(&wanted);
    let frame = || {
        let fields = fields(description, &machine.frame).into_iter();
        let fields: Vec<String> = fields
            .map(|field| field.join(" ").trim_end().to_owned())
            .collect();
        let text = fields.join(", ");
        match text.split_at_checked(80) {
            Some((beginning, _)) => format!("{beginning}..."),
            None => text,
        }
    };
    if has(Fate::Delivered) {
        format!("delivers a frame: {}", frame())
    } else if has(Fate::Wrong) {
        format!("delivers a frame that nobody sent: {}", frame())
    } else if let [why, ..] = decided {
        format!("discards {}: {why}", decided.len())
    } else if let Some(lecture) = machine.lecture() {
        format!("waits in state {}", lecture.state)
    } else {
        format!("holds {}", machine.line.pending().len())
    }
}
