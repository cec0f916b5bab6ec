//! The lecture's machine, unchanged: the state machine that D. J. Broderick's lecture teaches and that much firmware in
//! the field uses. It has seven states and takes one step per byte. It waits for 'A', then for 'B', then for four bytes
//! of any value, then for CR. The last three of these four bytes are the demands. With the CR the machine commits all
//! three demands at the same time. It throws away a broken frame as a whole: if another byte comes where 'A', 'B' or CR
//! is due, the machine returns to its first state. It does so even if this byte is an 'A'.
//!
//! **It can go deaf for ever.** After one lost byte, a stream that repeats a payload with the bytes `AB` may keep the
//! machine out of step for ever. Then it commits nothing. For every whole frame, [`Receiver`](crate::Receiver) delivers
//! this frame, or an earlier one that shares bytes with it.

use crate::motion::Setpoint;
use crate::parser::{next_by_pushing, parser_by_own_functions};
use crate::{DiscardReason, Found, LineEvent, Parser};

/// The byte that the machine waits for. The lecture calls the states A, B, 1, 2, 3, 4 and CR.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// A: the first sync byte, `'A'`.
    #[default]
    SyncA,
    /// B: the second sync byte, `'B'`.
    SyncB,
    /// 1: the reserved byte.
    Reserved,
    /// 2: pitch.
    Pitch,
    /// 3: roll.
    Roll,
    /// 4: yaw.
    Yaw,
    /// CR: the terminator.
    Terminator,
}

impl State {
    /// All states, in the order of the frame. In the state with index `n` the machine has taken `n` bytes of a frame.
    /// The index equals `state as usize`.
    pub const ALL: [Self; 7] = [
        Self::SyncA,
        Self::SyncB,
        Self::Reserved,
        Self::Pitch,
        Self::Roll,
        Self::Yaw,
        Self::Terminator,
    ];
}

impl core::fmt::Display for State {
    /// Writes the lecture's name of the state.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::SyncA => "A",
            Self::SyncB => "B",
            Self::Reserved => "1",
            Self::Pitch => "2",
            Self::Roll => "3",
            Self::Yaw => "4",
            Self::Terminator => "CR",
        })
    }
}

/// The lecture's machine. It occupies four bytes. Every value of the type is reachable by some stream. The
/// documentation of [`Receiver`](crate::Receiver) shows both machines on the same bytes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lecture {
    /// The byte that the machine waits for.
    pub state: State,
    /// The temporary setpoints. Each holds the last byte that was stored in it. This byte may come from an earlier,
    /// broken frame.
    pub temp: Setpoint,
}

impl Lecture {
    /// Creates the machine as it is at reset: state A, temporary setpoints zero.
    #[must_use]
    pub const fn new() -> Self {
        let (state, [pitch, roll, yaw]) = (State::SyncA, [0; 3]);
        let temp = Setpoint { pitch, roll, yaw };
        Self { state, temp }
    }

    /// Performs one step of the lecture's state table. The code has one line per row of the table.
    ///
    /// A step compares the state once and the byte at most once, and stores at most three values.
    #[inline]
    #[rustfmt::skip]
    #[expect(clippy::match_same_arms, reason = "one arm for each row of the table, in its order")]
    pub const fn push(&mut self, byte: u8) -> Option<Setpoint> {
        // Each row leads to state A, unless the row sets another state.
        let before = self.state;
        self.state = State::SyncA;
        match (before, byte) {
            (State::SyncA,      b'A')  =>                             self.state = State::SyncB,
            (State::SyncA,      _)     => {}
            (State::SyncB,      b'B')  =>                             self.state = State::Reserved,
            (State::SyncB,      _)     => {}
            (State::Reserved,   _)     =>                             self.state = State::Pitch,
            (State::Pitch,      pitch) => { self.temp.pitch = pitch;  self.state = State::Roll }
            (State::Roll,       roll)  => { self.temp.roll = roll;    self.state = State::Yaw }
            (State::Yaw,        yaw)   => { self.temp.yaw = yaw;      self.state = State::Terminator }
            (State::Terminator, b'\r') => return Some(self.temp),
            (State::Terminator, _)     => {}
        }
        None
    }

    /// Does the same as [`push`](Self::push), and reports each byte whose outcome is decided. All bytes of a broken
    /// frame are discarded together.
    #[inline]
    fn push_with(&mut self, byte: u8, mut account: impl FnMut(Found<()>)) -> Option<Setpoint> {
        let before = self.state;
        let setpoint = self.push(byte);
        match (before, self.state) {
            (State::SyncA, State::SyncA) => account(Found::discarded(1, DiscardReason::NoSync)),
            (State::SyncB, State::SyncA) => account(Found::discarded(2, DiscardReason::BrokenSync)),
            (State::Terminator, _) => account(match setpoint {
                Some(_) => Found::frame(7, ()),
                None => Found::discarded(7, DiscardReason::WrongTerminator),
            }),
            _ => {}
        }
        setpoint
    }

    /// Takes a slice byte by byte. Reports the outcome of each byte, except the bytes that are pending at the end.
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<Setpoint>)) {
        for &byte in bytes {
            let setpoint = self.push_with(byte, |one| {
                if let Found::Discarded { count, why } = one {
                    found(Found::discarded(count, why));
                }
            });
            if let Some(setpoint) = setpoint {
                found(Found::frame(7, setpoint));
            }
        }
    }

    next_by_pushing!(Setpoint);

    /// Discards the bytes of the incomplete frame, so that no later frame contains a byte from before the event.
    pub fn line_event(&mut self, _: LineEvent, mut found: impl FnMut(Found<Setpoint>)) {
        let (count, why) = (self.pending(), DiscardReason::LineEvent);
        if count > 0 {
            found(Found::Discarded { count, why });
        }
        self.reset();
    }

    /// Returns the number of bytes of a frame that have been taken: 0 to 6.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.state as usize
    }

    /// Returns to state A, with temporary setpoints zero.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Parser for Lecture {
    type Message<'a> = Setpoint;

    parser_by_own_functions!(Setpoint);
}
