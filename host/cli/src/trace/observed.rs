//! A machine, and what each byte makes it do: seen from outside, by the bytes that are pending.

use anyhow::{Error, Result};
use framelock::motion::Setpoint;
use serde::Serialize;

use crate::frame::{Frame, LECTURE_STATES};
use crate::line::{AnyLine, Watched};
use crate::names::{PolicyName, name};

/// The place of pitch in a frame; roll and yaw follow.
const AXES_AT: usize = 3;
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// A machine under observation.
pub(super) struct Observed {
    policy: PolicyName,
    frame: Frame,
    line: Watched,
    /// Each axis as stored last, in whatever frame that was.
    temp: [Option<u8>; 3],
    setpoint: Option<Setpoint>,
}

/// What one byte did to one machine: a row of the table.
#[derive(Serialize)]
pub(super) struct Step {
    pub(super) offset: usize,
    pub(super) byte: u8,
    policy: String,
    /// By the lecture's names.
    pub(super) state_before: &'static str,
    pub(super) state_after: &'static str,
    /// Pitch, roll, yaw, each as stored last; none where nothing was stored yet.
    pub(super) temp: [Option<u8>; 3],
    /// Pitch, roll and yaw of the last frame.
    pub(super) setpoint: Option<[u8; 3]>,
    /// How many bytes are discarded now; this byte may be one of them.
    pub(super) discarded: usize,
    /// What happened, in words.
    pub(super) what: String,
}

impl Observed {
    pub(super) fn new(policy: PolicyName) -> Result<Self> {
        let frame = Frame::named("bin").map_err(Error::msg)?;
        Ok(Self {
            policy,
            line: Watched::new(AnyLine::new(&frame, policy)?),
            frame,
            temp: [None; 3],
            setpoint: None,
        })
    }

    /// Takes the next byte.
    pub(super) fn push(&mut self, byte: u8) -> Step {
        let before = self.line.pending().len();
        let (mut committed, mut discarded) = (None, 0);
        for piece in self.line.push(byte) {
            match piece.discarded {
                None => committed = self.frame.setpoint(&piece.bytes),
                Some(_) => discarded += piece.bytes.len(),
            }
        }
        let pending = self.line.pending();
        for (stored, &new) in self.temp.iter_mut().zip(pending.iter().skip(AXES_AT)) {
            *stored = Some(new);
        }
        self.setpoint = committed.or(self.setpoint);
        Step {
            offset: self.line.counters().bytes - 1,
            byte,
            policy: name(&self.policy),
            state_before: state(before),
            state_after: state(pending.len()),
            temp: self.temp,
            setpoint: self.setpoint.map(Into::into),
            discarded,
            what: match committed {
                None => self.what(before, byte, discarded),
                committed => format!("SP={}", in_brackets(committed)),
            },
        }
    }

    /// What a byte did that completed no frame.
    fn what(&self, before: usize, byte: u8, discarded: usize) -> String {
        let after = self.line.pending().len();
        let stored = before.checked_sub(AXES_AT).and_then(|axis| AXES.get(axis));
        match (before, stored) {
            (0 | 1, _) if after > before => "sync".into(),
            (0, _) => "no sync: discarded".into(),
            (1, _) if after == 1 => "sync; the 'A' discarded".into(),
            (1, _) => "no sync: both discarded".into(),
            (2, _) => "reserved, not kept".into(),
            (_, Some(axis)) => format!("temp {axis}={byte:02X}"),
            (_, None) => {
                let what = format!("not CR: {discarded} bytes discarded");
                let start = if after == 1 { "A" } else { "AB" };
                match self.line.counters().bytes - after {
                    _ if after == 0 => what,
                    offset => format!("{what}; resynchronised to the {start} at offset {offset}"),
                }
            }
        }
    }

    /// Where every byte has gone.
    pub(super) fn balance(&self) -> String {
        let counters = self.line.counters();
        let discarded = &counters.discarded;
        let reasons = [
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("no CR", discarded.terminator),
        ];
        let reasons = reasons.iter().filter(|(_, count)| *count > 0);
        let reasons = reasons.map(|(why, count)| format!("; {why}: {count}"));
        format!(
            "{} byte{} = {} x {} committed + {} discarded + {} pending\n{:9}SP={}{}",
            counters.bytes,
            if counters.bytes == 1 { "" } else { "s" },
            LECTURE_STATES.len(),
            counters.frames,
            discarded.total(),
            self.line.pending().len(),
            "",
            in_brackets(self.setpoint),
            reasons.collect::<Vec<_>>().concat(),
        )
    }
}

fn state(pending: usize) -> &'static str {
    LECTURE_STATES.get(pending).copied().unwrap_or_default()
}

/// A setpoint as the lecture writes it, `(7F,C8,4A)`; dashes if there is none yet.
fn in_brackets(setpoint: Option<Setpoint>) -> String {
    match setpoint {
        Some(Setpoint { pitch, roll, yaw }) => format!("({pitch:02X},{roll:02X},{yaw:02X})"),
        None => "(--,--,--)".into(),
    }
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

    /// On streams in which starts of frames, and starts that come to nothing, are frequent.
    #[test]
    fn what_is_said_is_what_the_bytes_are() {
        for policy in [PolicyName::Discard, PolicyName::Rescan] {
            let (mut starts, mut frames) = ([0; 7], 0);
            for seed in 0..2_000 {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let length = random.random_range(0..60);
                let byte = |_| *b"AABB\r\0x".choose(&mut random).unwrap();
                let stream: Vec<u8> = (0..length).map(byte).collect();
                let mut machine = Observed::new(policy).unwrap();
                let mut setpoint = None;
                for (offset, &byte) in stream.iter().enumerate() {
                    let step = machine.push(byte);
                    if step.what.starts_with("SP=") {
                        let &[b'A', b'B', _, pitch, roll, yaw, b'\r'] =
                            &stream[offset - 6..=offset]
                        else {
                            panic!("{stream:?}")
                        };
                        setpoint = Some([pitch, roll, yaw]);
                        assert_eq!((step.state_before, step.state_after), ("CR", "A"));
                        assert_eq!(Some(step.temp), setpoint.map(|axes| axes.map(Some)));
                        frames += 1;
                    } else if let Some((_, place)) = step.what.split_once("at offset ") {
                        let start = &stream[place.parse().unwrap()..=offset];
                        assert_eq!(step.state_after, state(start.len()));
                        assert!(b"AB".starts_with(start) || start.starts_with(b"AB"));
                        // What the frame under way has brought already is stored.
                        for (&byte, stored) in start.iter().skip(3).zip(step.temp) {
                            assert_eq!(stored, Some(byte));
                        }
                        starts[start.len()] += 1;
                    }
                    assert_eq!(step.setpoint, setpoint);
                }
            }
            assert!(frames > 0);
            // Of the five bytes behind the failed AB any may be where the receiver begins.
            let may_begin = |count: &i32| (*count > 0) == (policy == PolicyName::Rescan);
            assert!(starts[1..=5].iter().all(may_begin), "{starts:?}");
        }
    }
}
