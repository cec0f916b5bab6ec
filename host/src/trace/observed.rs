//! A machine, and what each byte made it do.

use std::fmt;

use framelock::{Accounting, Bin, Counters, Lecture, Parser, Receiver, Setpoint, State};

/// What of a machine the lecture's table shows.
pub(super) trait Machine: Parser<Message = Setpoint> {
    /// The byte that it waits for.
    fn state(&self) -> State;

    /// Pitch, roll and yaw of the frame under way, as far as it has brought them.
    fn temp(&self) -> [Option<u8>; 3];
}

impl Machine for Lecture {
    fn state(&self) -> State {
        self.state
    }

    fn temp(&self) -> [Option<u8>; 3] {
        let Setpoint { pitch, roll, yaw } = self.temp;
        let taken = self.state.bytes_taken();
        [(pitch, 3), (roll, 4), (yaw, 5)].map(|(value, place)| (taken > place).then_some(value))
    }
}

impl Machine for Receiver<Bin> {
    fn state(&self) -> State {
        Receiver::state(self)
    }

    fn temp(&self) -> [Option<u8>; 3] {
        Receiver::temp(self)
    }
}

/// A machine under observation.
pub(super) struct Observed<P> {
    line: Accounting<P>,
    /// Each axis as stored last, in whatever frame that was.
    temp: [Option<u8>; 3],
    in_force: Option<Setpoint>,
}

/// What one byte did to one machine: a row of the table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Step {
    pub(super) before: State,
    pub(super) after: State,
    /// Each axis as stored last, in whatever frame that was.
    pub(super) temp: [Option<u8>; 3],
    /// The setpoint in force after the byte.
    pub(super) in_force: Option<Setpoint>,
    pub(super) event: Event,
    /// How many bytes are discarded now; this byte may be one of them.
    pub(super) discarded: u64,
}

/// What happened.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Event {
    /// A sync byte where one was due.
    Sync,
    /// The byte that nobody keeps.
    Reserved,
    /// One axis of the temporary setpoint.
    Stored { axis: &'static str, value: u8 },
    /// The frame is complete: its setpoint is in force.
    Implemented(Setpoint),
    /// Not the first sync byte.
    NoSync,
    /// The first sync byte was not followed by the second; perhaps by another first.
    BrokenSync { may_be_first: bool },
    /// Another byte where the CR was due. The receiver may find the start of a frame, of so many
    /// bytes so far, at that offset inside the failed one.
    NoTerminator {
        discarded: u64,
        found: Option<Found>,
    },
}

/// The start of a frame inside a failed one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Found {
    pub(super) offset: u64,
    pub(super) bytes: u64,
}

impl<P: Machine> Observed<P> {
    pub(super) fn new(machine: P) -> Self {
        Self {
            line: Accounting::new(machine),
            temp: [None; 3],
            in_force: None,
        }
    }

    /// Takes the next byte. One push of the machine and a comparison of its counters.
    pub(super) fn push(&mut self, byte: u8) -> Step {
        let before = self.line.parser().state();
        let discarded_before = self.line.counters().discarded.total();
        let implemented = self.line.push(byte);

        let after = self.line.parser().state();
        let discarded = self.line.counters().discarded.total() - discarded_before;
        for (stored, new) in self.temp.iter_mut().zip(self.line.parser().temp()) {
            *stored = new.or(*stored);
        }
        self.in_force = implemented.or(self.in_force);
        Step {
            before,
            after,
            temp: self.temp,
            in_force: self.in_force,
            event: self.event(before, byte, after, implemented, discarded),
            discarded,
        }
    }

    fn event(
        &self,
        before: State,
        byte: u8,
        after: State,
        implemented: Option<Setpoint>,
        discarded: u64,
    ) -> Event {
        let stored = |axis| Event::Stored { axis, value: byte };
        match (before, implemented) {
            (_, Some(setpoint)) => Event::Implemented(setpoint),
            (State::SyncA, _) if after == State::SyncB => Event::Sync,
            (State::SyncA, _) => Event::NoSync,
            (State::SyncB, _) if after == State::Reserved => Event::Sync,
            (State::SyncB, _) => Event::BrokenSync {
                may_be_first: after == State::SyncB,
            },
            (State::Reserved, _) => Event::Reserved,
            (State::Pitch, _) => stored("pitch"),
            (State::Roll, _) => stored("roll"),
            (State::Yaw, _) => stored("yaw"),
            (State::Terminator, _) => {
                let bytes = self.line.pending() as u64;
                let found = (bytes > 0).then(|| Found {
                    offset: self.line.counters().bytes - bytes,
                    bytes,
                });
                Event::NoTerminator { discarded, found }
            }
        }
    }

    /// Where every byte has gone.
    pub(super) fn balance(&self) -> Balance {
        Balance {
            counters: *self.line.counters(),
            under_way: self.line.pending(),
            in_force: self.in_force,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sync => write!(f, "sync"),
            Self::Reserved => write!(f, "reserved, not kept"),
            Self::Stored { axis, value } => write!(f, "temp {axis}={value:02X}"),
            Self::Implemented(setpoint) => write!(f, "SP={}", InForce(Some(*setpoint))),
            Self::NoSync => write!(f, "no sync: discarded"),
            Self::BrokenSync {
                may_be_first: false,
            } => write!(f, "no sync: discarded, and the 'A' before it"),
            Self::BrokenSync { may_be_first: true } => {
                write!(f, "sync again: the 'A' before it discarded")
            }
            Self::NoTerminator { discarded, found } => {
                write!(
                    f,
                    "not CR: nothing is implemented, {discarded} bytes discarded"
                )?;
                let Some(Found { offset, bytes }) = found else {
                    return Ok(());
                };
                let start = if *bytes == 1 { "A" } else { "AB" };
                write!(f, "; resynchronised to the {start} at offset {offset}")
            }
        }
    }
}

/// A setpoint as the lecture writes it, `(7F,C8,4A)`; dashes if there is none yet.
struct InForce(Option<Setpoint>);

impl fmt::Display for InForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(Setpoint { pitch, roll, yaw }) => write!(f, "({pitch:02X},{roll:02X},{yaw:02X})"),
            None => write!(f, "(--,--,--)"),
        }
    }
}

/// Where every byte has gone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Balance {
    counters: Counters,
    under_way: usize,
    in_force: Option<Setpoint>,
}

impl fmt::Display for Balance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counters {
            bytes,
            frames,
            discarded,
            ..
        } = self.counters;
        let plural = if bytes == 1 { "" } else { "s" };
        write!(
            f,
            "{bytes} byte{plural} = 7 x {frames} committed + {} discarded",
            discarded.total()
        )?;
        let reasons = [
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("no CR", discarded.terminator),
        ];
        let reasons: Vec<String> = reasons
            .into_iter()
            .filter(|(_, count)| *count > 0)
            .map(|(reason, count)| format!("{reason} {count}"))
            .collect();
        if !reasons.is_empty() {
            write!(f, " ({})", reasons.join(", "))?;
        }
        let under_way = self.under_way;
        write!(f, " + {under_way} under way; SP={}", InForce(self.in_force))
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

    /// Streams in which starts of frames, and starts that come to nothing, are frequent.
    fn streams() -> impl Iterator<Item = Vec<u8>> {
        (0..2_000).map(|seed| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let length = random.random_range(0..60);
            let byte = |_| *b"AABB\r\0x".choose(&mut random).unwrap();
            (0..length).map(byte).collect()
        })
    }

    #[test]
    fn the_start_found_is_where_it_is_said_to_be() {
        let mut found_starts = [0; 7];
        for stream in streams() {
            let mut machine = Observed::new(Receiver::<Bin>::new());
            for (offset, &byte) in stream.iter().enumerate() {
                let step = machine.push(byte);
                let Event::NoTerminator {
                    found: Some(found), ..
                } = step.event
                else {
                    continue;
                };
                let from = usize::try_from(found.offset).unwrap();
                let start = &stream[from..=offset];
                assert_eq!(start.len() as u64, found.bytes);
                assert_eq!(start.len(), step.after.bytes_taken());
                assert!(b"AB".starts_with(start) || start.starts_with(b"AB"));
                // What the frame under way has brought already is stored.
                for (place, stored) in (3..6).zip(step.temp) {
                    assert!(start.get(place).is_none_or(|&byte| stored == Some(byte)));
                }
                found_starts[start.len()] += 1;
            }
        }
        // Of the five bytes behind the failed AB any may be where it begins.
        assert!(found_starts[1..=5].iter().all(|&count| count > 0));
        assert_eq!(found_starts[6], 0);
    }

    #[test]
    fn the_setpoint_in_force_changes_where_it_is_implemented_and_nowhere_else() {
        fn check(mut machine: Observed<impl Machine>, stream: &[u8]) -> u64 {
            let mut in_force = None;
            let mut implemented = 0;
            for &byte in stream {
                let step = machine.push(byte);
                if let Event::Implemented(setpoint) = step.event {
                    assert_eq!((step.before, byte), (State::Terminator, b'\r'));
                    assert_eq!(step.temp, <[u8; 3]>::from(setpoint).map(Some));
                    in_force = Some(setpoint);
                    implemented += 1;
                }
                assert_eq!(step.in_force, in_force);
            }
            implemented
        }
        let counts = streams().map(|stream| {
            let discard = check(Observed::new(Lecture::new()), &stream);
            let rescan = check(Observed::new(Receiver::<Bin>::new()), &stream);
            (discard, rescan)
        });
        let (discard, rescan) =
            counts.fold((0, 0), |sum, count| (sum.0 + count.0, sum.1 + count.1));
        assert!(rescan > discard && discard > 0);
    }
}
