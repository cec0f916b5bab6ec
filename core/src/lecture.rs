//! The lecture's machine, literally: what the lecture teaches and what much firmware in the field does. Seven states,
//! one step per byte: it waits for 'A', for 'B', for four bytes that may have any value, and for CR, and then commits
//! the demands, all at once. A frame that goes wrong is thrown away whole: another byte in the place of 'A', 'B' or CR
//! leads back to the start, also if it is an 'A'.
//!
//! **It can go deaf for ever**: after one lost byte, a stream that repeats a payload holding the
//! bytes `AB` may keep it out of step without end. [`Receiver`](crate::Receiver) does not.

use crate::motion::Setpoint;
use crate::parser::{next_by_pushing, parser_by_own_functions};
use crate::{DiscardReason, Found, LineEvent, Parser};

/// The byte that the machine waits for. The lecture's own names are A, B, 1, 2, 3, 4 and CR.
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
    /// Every state, in the order of the frame: in state `n`, also by `as usize`, `n` bytes of a frame have been taken.
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
    /// The lecture's name.
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

/// The lecture's machine. Four bytes; every value of the type is a state that some stream reaches.
/// [`Receiver`](crate::Receiver) has an example of both on the same bytes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lecture {
    /// The byte waited for.
    pub state: State,
    /// The temporary setpoints: each keeps the byte stored last, in whatever frame that was.
    pub temp: Setpoint,
}

impl Lecture {
    /// The machine at reset: state A, temporary setpoints zero.
    #[must_use]
    pub const fn new() -> Self {
        let (state, [pitch, roll, yaw]) = (State::SyncA, [0; 3]);
        let temp = Setpoint { pitch, roll, yaw };
        Self { state, temp }
    }

    /// One step of the lecture's state table, row by row.
    ///
    /// One comparison of the state, one of the byte, at most three stores.
    #[inline]
    #[rustfmt::skip]
    #[expect(clippy::match_same_arms, reason = "one arm for each row of the table, in its order")]
    pub const fn push(&mut self, byte: u8) -> Option<Setpoint> {
        // Each row leads to A, unless it says where else.
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

    /// [`push`](Self::push), with an account of each byte whose outcome it decides. All bytes of a broken frame
    /// are discarded at once.
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

    /// Takes a slice, byte by byte, and says what becomes of each but those pending at the end.
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

    /// The bytes taken so far are thrown away: no later frame has a byte from before.
    pub fn line_event(&mut self, _: LineEvent, mut found: impl FnMut(Found<Setpoint>)) {
        let (count, why) = (self.pending(), DiscardReason::LineEvent);
        if count > 0 {
            found(Found::Discarded { count, why });
        }
        self.reset();
    }

    /// How many bytes of a frame have come: 0 to 6.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.state as usize
    }

    /// State A again, temporary setpoints zero.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Parser for Lecture {
    type Message<'a> = Setpoint;

    parser_by_own_functions!(Setpoint);
}
