//! What there is to see at a position, as JSON for the page's script to draw.

use std::ops::Range;

use framelock::motion::Setpoint;
use serde_json::{Value, json};

use crate::line::Cell;
use crate::machine::{Machine, Tally};
use crate::run::Run;
use crate::scenario::FrameKind;

impl Run {
    /// What there is to see at a position, of these places on the line.
    pub(crate) fn seen(&self, position: usize, places: Range<usize>) -> Value {
        let position = position.min(self.positions());
        let places = places.start..places.end.min(self.cells.len());
        let mut state = self.kept_before(places.start.min(position));
        let seen = self.cells.get(places.clone()).unwrap_or_default();
        let mut fates = vec![vec![None; state.machines.len()]; seen.len()];
        while state.position < position {
            if let Some(place) = state.position.checked_sub(places.start)
                && let (Some(fates), Some(cell)) = (fates.get_mut(place), seen.get(place))
            {
                fates.fill(cell.received.map(|_| "pending"));
            }
            self.step(&mut state);
            for (nth, machine) in state.machines.iter().enumerate() {
                for (place, fate) in &machine.fates {
                    let place = place.checked_sub(places.start);
                    let fates = place.and_then(|place| fates.get_mut(place));
                    if let Some(known) = fates.and_then(|fates| fates.get_mut(nth)) {
                        *known = Some(*fate);
                    }
                }
            }
        }
        let begins = |place: usize| {
            let mut next = self.cells.iter().skip(place).take(64).zip(1..);
            let ends = next.find(|(cell, _)| cell.ends > 0);
            ends.is_some_and(|(cell, length)| cell.ends == length)
        };
        let cells = places.zip(seen).zip(fates).map(|((place, cell), fates)| {
            json!({
                "place": place, "sent": cell.sent, "received": cell.received, "kind": kind(cell),
                "begins": begins(place), "fates": fates,
            })
        });
        let cells: Vec<Value> = cells.collect();
        let machines = state.machines.iter();
        let machines: Vec<Value> = machines.map(|one| self.machine(one, state.now)).collect();
        json!({
            "position": position, "positions": self.positions(), "bytes": self.cells.len(),
            "seconds": f64::from(state.now) / 1e3, "sentence": self.sentence(position, &machines),
            "cells": cells, "machines": machines,
        })
    }

    /// What happened in the last step.
    fn sentence(&self, position: usize, machines: &[Value]) -> String {
        let cell = position.checked_sub(1).map(|last| self.cells.get(last));
        let byte = |byte: Option<u8>| byte.map_or(String::new(), |byte| format!("{byte:02X}"));
        let mut sentence = match cell {
            None => return "Nothing has come yet.".to_owned(),
            Some(None) => "The line is silent.".to_owned(),
            Some(Some(cell)) => match kind(cell) {
                "lost" => return format!("{} is lost on the line.", byte(cell.sent)),
                "altered" => format!("{} arrives as {}.", byte(cell.sent), byte(cell.received)),
                "inserted" => format!("{} comes, which nobody sent.", byte(cell.received)),
                _ => format!("{} comes.", byte(cell.received)),
            },
        };
        for machine in machines {
            let [name, what] = ["name", "what"].map(|key| machine[key].as_str());
            sentence.extend([
                " ",
                name.unwrap_or_default(),
                " ",
                what.unwrap_or_default(),
                ".",
            ]);
        }
        sentence
    }

    fn machine(&self, machine: &Machine, now: u32) -> Value {
        let (tally, lecture) = (&machine.tally, machine.line.lecture());
        let output = { machine.failsafe }.poll(now);
        let status = match tally {
            Tally {
                missed_in_row: 0, ..
            } => "LISTENING",
            Tally {
                missed_in_row: 1,
                wrong_in_row: 0,
                ..
            } => "MISSED ONE",
            Tally {
                wrong_in_row: 0, ..
            } => "DEAF",
            _ => "MISREADING",
        };
        let missing = now.saturating_sub(tally.since);
        let bytes: Vec<u8> = machine.pending.iter().map(|(_, byte)| *byte).collect();
        let stored = |axis: usize| match (lecture, self.scenario.frame) {
            (Some(lecture), _) => <[u8; 3]>::from(lecture.temp).get(axis).copied(),
            (None, FrameKind::Crsf) => None,
            (None, _) => bytes.get(3 + axis).copied(),
        };
        json!({
            "name": if lecture.is_some() { "The lecture's machine" } else { "The receiver" },
            "state": lecture.map(|lecture| lecture.state.lecture_name()),
            "window": window(self.scenario.frame, &bytes),
            "temporary": [stored(0), stored(1), stored(2)],
            "setpoint": machine.setpoint,
            "output": Setpoint::from(output.axes),
            "phase": output.phase,
            "status": status,
            "status_seconds": if status == "LISTENING" { 0.0 } else { f64::from(missing) / 1e3 },
            "tally": tally,
            "counters": machine.line.counters(),
            "what": what(machine),
        })
    }
}

fn kind(cell: &Cell) -> &'static str {
    match (cell.sent, cell.received) {
        (_, None) => "lost",
        (None, _) => "inserted",
        (sent, received) if sent == received => "as sent",
        _ => "altered",
    }
}

/// A frame's places, and the pending bytes that are there.
fn window(kind: FrameKind, bytes: &[u8]) -> Vec<Value> {
    let names: &[&str] = match kind {
        FrameKind::Bin => &["'A'", "'B'", "reserved", "pitch", "roll", "yaw", "CR"],
        FrameKind::BinCrc8 => &[
            "'A'", "'B'", "reserved", "pitch", "roll", "yaw", "crc", "CR",
        ],
        FrameKind::Crsf => &["C8", "length", "type"],
    };
    let expected = match (kind, bytes) {
        (FrameKind::Crsf, [_, length, ..]) => usize::from(*length) + 2,
        _ => names.len(),
    };
    let slot = |place| {
        let name = names.get::<usize>(place).unwrap_or(&"payload");
        json!({ "name": name, "byte": bytes.get(place) })
    };
    (0..expected.max(bytes.len())).map(slot).collect()
}

/// What a machine did in the last step.
fn what(machine: &Machine) -> String {
    let has = |wanted| machine.fates.iter().any(|(_, fate)| *fate == wanted);
    let setpoint = machine
        .setpoint
        .map_or("none".to_owned(), |setpoint| setpoint.to_string());
    if has("committed") {
        format!("commits a frame: {setpoint}")
    } else if has("wrong") {
        format!("commits a frame that nobody sent: {setpoint}")
    } else if let [(_, why), ..] = machine.fates[..] {
        format!("discards {}: {why}", machine.fates.len())
    } else if let Some(lecture) = machine.line.lecture() {
        format!("waits in state {}", lecture.state)
    } else {
        format!("holds {}", machine.pending.len())
    }
}
