//! Traces a receiver: a row for each byte.

use anyhow::{Error, Result};
use framelock::motion::Setpoint;
use framelock_description::hex;
use framelock_receiving::{AnyLine, Piece, Policy, Protocol, TrackedLine};

use crate::frame_writer::FrameWriter;
use crate::view_parts::STATES;

/// The columns of BIN: the receiver, the lecture's state before and after the byte, the stored values and the setpoint.
const BIN_COLUMNS: &str = "   policy    state     temp      setpoint";

/// The column of frames other than BIN.
const OTHER_COLUMNS: &str = "    pending";

/// The separator between events of the same byte. The separator begins a new row for each further event.
const GOES_ON: &str = "\n                       ";

/// The offset of pitch in a frame; roll and yaw follow.
const AXES_AT: usize = 3;
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// Returns whether the frames are BIN, which the lecture's machine receives.
pub(super) fn is_bin(protocol: &Protocol) -> bool {
    protocol.name == "bin"
}

/// A receiver that is traced.
pub(super) struct Traced {
    pub(super) policy: Policy,
    frames: FrameWriter,
    line: TrackedLine,
    bin: Option<BinTrace>,
}

/// The values of the lecture's columns, which only BIN has.
#[derive(Clone, Copy, Default)]
struct BinTrace {
    /// The last stored pitch, roll and yaw; `None` for an axis that was not stored yet.
    temp: [Option<u8>; 3],
    /// The setpoint of the last frame.
    setpoint: Option<Setpoint>,
}

/// The effect of one byte on one receiver.
pub(super) struct Step {
    offset: usize,
    byte: u8,
    /// The numbers of pending bytes before and after the byte.
    before: usize,
    after: usize,
    /// The frames and the discarded bytes whose outcome the byte decided.
    pieces: Vec<Piece>,
    bin: Option<BinTrace>,
}

impl Traced {
    pub(super) fn new(protocol: &Protocol, policy: Policy) -> Result<Self> {
        Ok(Self {
            policy,
            line: TrackedLine::new(AnyLine::new(protocol, policy).map_err(Error::msg)?),
            frames: FrameWriter::new(protocol.clone()),
            bin: is_bin(protocol).then(BinTrace::default),
        })
    }

    /// Returns the names of the columns between the byte and the event.
    pub(super) const fn columns(&self) -> &'static str {
        match self.bin {
            Some(_) => BIN_COLUMNS,
            None => OTHER_COLUMNS,
        }
    }

    /// Takes the next byte.
    pub(super) fn push(&mut self, byte: u8) -> Step {
        let before = self.line.pending().len();
        let offset = self.line.decided() + before;
        let pieces = self.line.push(byte);
        let pending = self.line.pending();
        if let Some(bin) = &mut self.bin {
            for (stored, &new) in bin.temp.iter_mut().zip(pending.iter().skip(AXES_AT)) {
                *stored = Some(new);
            }
            let frames = pieces.iter().filter(|piece| piece.discarded.is_none());
            let mut setpoints =
                frames.filter_map(|piece| self.frames.protocol.setpoint(&piece.bytes));
            bin.setpoint = setpoints.next_back().or(bin.setpoint);
        }
        Step {
            offset,
            byte,
            before,
            after: pending.len(),
            pieces,
            bin: self.bin,
        }
    }

    /// Returns a step as rows of text. The first row has the columns, and each further row has one more event.
    /// `policy` is the receiver's name.
    pub(super) fn row(&self, step: &Step, policy: &str) -> String {
        let Step { offset, byte, .. } = *step;
        let columns = match &step.bin {
            Some(bin) => format!(
                " {policy:<9} {:>2} -> {:<2}  {}  {}",
                state(step.before),
                state(step.after),
                in_hex(bin.temp),
                in_hex(bin.axes()),
            ),
            None => format!("  {:>7}", step.after),
        };
        let events = self.happened(step).into_iter();
        let events: Vec<String> = events.map(|event| format!("  {event}")).collect();
        format!(
            "{offset:>6}  {byte:02X} {:<3}{columns}{}",
            character(byte),
            events.join(GOES_ON)
        )
    }

    /// Returns a line of text for each event of a step.
    fn happened(&self, step: &Step) -> Vec<String> {
        if let Some(bin) = &step.bin {
            return bin.happened(step);
        }
        let lines = step.pieces.iter().map(|piece| {
            let (from, bytes) = (piece.from, &piece.bytes);
            if let Some(why) = piece.discarded {
                return format!("discarded {} from offset {from}: {why}", hex::glued(bytes));
            }
            let mut fields = Vec::new();
            self.frames.append_text(&mut fields, bytes);
            let fields = String::from_utf8_lossy(&fields);
            format!("frame from offset {from}:{fields}")
        });
        lines.collect()
    }

    /// Returns the sums that account for every byte. `policy` is the receiver's name.
    pub(super) fn balance(&self, policy: &str) -> String {
        let counters = self.line.counters();
        let discarded = &counters.discarded;
        let (bytes, pending) = (counters.bytes, self.line.pending().len());
        let Some(bin) = &self.bin else {
            return format!(
                "{bytes} bytes = {} in {} frames + {} discarded + {pending} pending",
                counters.frame_bytes,
                counters.frames,
                discarded.total(),
            );
        };
        let reasons = [
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("no CR", discarded.wrong_terminator),
        ];
        let counted = reasons.iter().filter(|(_, count)| *count > 0);
        let reason_counts = counted.map(|(why, count)| format!("; {why}: {count}"));
        format!(
            "{:<11}{bytes} byte{} = {} x {} committed + {} discarded + {pending} pending\n{:11}SP={}{}",
            format!("{policy}:"),
            if bytes == 1 { "" } else { "s" },
            STATES.len(),
            counters.frames,
            discarded.total(),
            "",
            in_brackets(bin.axes()),
            reason_counts.collect::<String>(),
        )
    }
}

impl BinTrace {
    fn axes(&self) -> [Option<u8>; 3] {
        self.setpoint
            .map_or([None; 3], |setpoint| <[u8; 3]>::from(setpoint).map(Some))
    }

    /// Returns the effect of a byte in the lecture's words.
    fn happened(&self, step: &Step) -> Vec<String> {
        let (before, after, byte) = (step.before, step.after, step.byte);
        if step.pieces.iter().any(|piece| piece.discarded.is_none()) {
            return vec![format!("SP={}", in_brackets(self.axes()))];
        }
        let stored = before.checked_sub(AXES_AT).and_then(|axis| AXES.get(axis));
        let what = match (before, stored) {
            (0 | 1, _) if after > before => "sync".into(),
            (0, _) => "no sync: discarded".into(),
            (1, _) if after == 1 => "sync; the 'A' discarded".into(),
            (1, _) => "no sync: both discarded".into(),
            (2, _) => "reserved, not kept".into(),
            (_, Some(axis)) => format!("temp {axis}={byte:02X}"),
            (_, None) => {
                let discarded: usize = step.pieces.iter().map(|piece| piece.bytes.len()).sum();
                format!("not CR: {discarded} bytes discarded")
            }
        };
        let is_resynchronised = before + 1 == STATES.len() && after > 0;
        let goes_on = is_resynchronised.then(|| {
            let start = if after == 1 { "A" } else { "AB" };
            let offset = step.offset + 1 - after;
            format!("resynchronised to the {start} at offset {offset}")
        });
        [what].into_iter().chain(goes_on).collect()
    }
}

/// Returns the lecture's name of the state with this number of pending bytes.
fn state(pending: usize) -> &'static str {
    STATES[pending]
}

/// Returns a byte as text, or an empty text if the byte is not printable.
fn character(byte: u8) -> String {
    match byte {
        b'\r' => "CR".into(),
        b' '..=b'~' => format!("'{}'", char::from(byte)),
        _ => String::new(),
    }
}

/// Returns three values in hex, with dashes for a value that is not known yet.
fn in_hex(axes: [Option<u8>; 3]) -> String {
    joined(axes, " ")
}

/// Returns a setpoint as the lecture writes it, `(7F,C8,4A)`, with dashes if there is none yet.
fn in_brackets(axes: [Option<u8>; 3]) -> String {
    format!("({})", joined(axes, ","))
}

fn joined(axes: [Option<u8>; 3], separator: &str) -> String {
    axes.map(|axis| axis.map_or_else(|| "--".into(), |value| format!("{value:02X}")))
        .join(separator)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use rand::seq::IndexedRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The streams contain many starts of frames and many false starts.
    #[test]
    fn the_described_events_match_the_bytes() {
        let bin = Protocol::named("bin").unwrap();
        for policy in [Policy::Lecture, Policy::Framelock] {
            let (mut starts, mut frames) = ([0; 7], 0);
            for seed in 0..2_000 {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let length = random.random_range(0..60);
                let byte = |_| *b"AABB\r\0x".choose(&mut random).unwrap();
                let stream: Vec<u8> = (0..length).map(byte).collect();
                let mut machine = Traced::new(&bin, policy).unwrap();
                let mut setpoint = None;
                for (offset, &byte) in stream.iter().enumerate() {
                    let step = machine.push(byte);
                    let shown = step.bin.unwrap();
                    let what = machine.happened(&step);
                    if what[0].starts_with("SP=") {
                        let &[b'A', b'B', _, pitch, roll, yaw, b'\r'] =
                            &stream[offset - 6..=offset]
                        else {
                            panic!("{stream:?}")
                        };
                        setpoint = Some([pitch, roll, yaw]);
                        assert_eq!((state(step.before), state(step.after)), ("CR", "A"));
                        assert_eq!(Some(shown.temp), setpoint.map(|axes| axes.map(Some)));
                        frames += 1;
                    } else if let Some((_, place)) = what.last().unwrap().split_once("at offset ") {
                        let start = &stream[place.parse().unwrap()..=offset];
                        assert_eq!(step.after, start.len());
                        assert!(b"AB".starts_with(start) || start.starts_with(b"AB"));
                        // The lecture's machine has already stored values of the incomplete frame.
                        for (&byte, stored) in start.iter().skip(3).zip(shown.temp) {
                            assert_eq!(stored, Some(byte));
                        }
                        starts[start.len()] += 1;
                    }
                    assert_eq!(shown.setpoint.map(<[u8; 3]>::from), setpoint);
                }
            }
            assert!(frames > 0);
            // framelock's receiver may find a new start at any of the five bytes after the AB of a failed frame. The
            // lecture's machine never does.
            let may_begin = |count: &i32| (*count > 0) == (policy == Policy::Framelock);
            assert!(starts[1..=5].iter().all(may_begin), "{starts:?}");
        }
    }
}
