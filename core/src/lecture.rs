//! The lecture's machine, literally: seven states, one step per byte. A frame that
//! goes wrong is thrown away whole.
//!
//! ```text
//!        other          other (also 'A')
//!        ┌──┐     ┌──────────────────────────┐
//!        │  ▼     ▼                          │
//!        │ ┌───────┐  'A'  ┌───────┐         │
//!  ────► └─┤   A   ├──────►│   B   ├─────────┘
//!          └───────┘       └───┬───┘
//!              ▲               │ 'B'
//!              │               ▼
//!              │           ┌───────┐ any ┌───────┐ any ┌───────┐ any ┌───────┐
//!              │           │   1   ├────►│   2   ├────►│   3   ├────►│   4   │
//!              │           │  skip │     │ pitch │     │ roll  │     │  yaw  │
//!              │           └───────┘     └───────┘     └───────┘     └───┬───┘
//!              │                                                         │ any
//!              │  CR: all three demands are committed at once             ▼
//!              │  other: nothing is implemented                      ┌───────┐
//!              └─────────────────────────────────────────────────────┤  CR   │
//!                                                                    └───────┘
//! ```
//!
//! It is here because it is what the lecture teaches and what much firmware in the field does.
//! **It can go deaf for ever**: after one lost byte, a stream that repeats a payload holding the
//! bytes `AB` may keep it out of step without end. [`Receiver`](crate::Receiver) does not.

use crate::{Event, Mismatch, Parser, Setpoint};

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
    /// Every state, in the order of the frame: the state at index `n` has `n` bytes of a frame.
    pub const ALL: [Self; 7] = [
        Self::SyncA,
        Self::SyncB,
        Self::Reserved,
        Self::Pitch,
        Self::Roll,
        Self::Yaw,
        Self::Terminator,
    ];

    /// The lecture's name of the state.
    #[must_use]
    pub const fn lecture_name(self) -> &'static str {
        match self {
            Self::SyncA => "A",
            Self::SyncB => "B",
            Self::Reserved => "1",
            Self::Pitch => "2",
            Self::Roll => "3",
            Self::Yaw => "4",
            Self::Terminator => "CR",
        }
    }

    /// How many bytes of a frame have been taken: 0 to 6.
    #[must_use]
    pub const fn bytes_taken(self) -> usize {
        self as usize
    }
}

impl core::fmt::Display for State {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.lecture_name())
    }
}

/// The lecture's machine. Four bytes; every value of the type is a state that some stream reaches.
///
/// # Examples
/// The lecture's first example:
/// ```
/// use framelock::{Lecture, Setpoint};
/// let mut machine = Lecture::new();
/// for byte in [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A] {
///     assert_eq!(machine.push(byte), None);
/// }
/// assert_eq!(machine.push(0x0D), Some(Setpoint { pitch: 0x7F, roll: 0xC8, yaw: 0x4A }));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lecture {
    /// The byte waited for.
    pub state: State,
    /// The temporary setpoints: each keeps the byte stored last, in whatever frame that was.
    pub temp: Setpoint,
}

const _: () = assert!(size_of::<Lecture>() <= 8);

impl Lecture {
    /// The machine at reset: state A, temporary setpoints zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            state: State::SyncA,
            temp: Setpoint {
                pitch: 0,
                roll: 0,
                yaw: 0,
            },
        }
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

    /// Takes a slice: see [`Parser::feed`].
    pub fn feed(&mut self, bytes: &[u8], frame: impl FnMut(usize, Setpoint)) {
        Parser::feed(self, bytes, frame);
    }

    /// How many bytes of a frame have come: 0 to 6.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.state.bytes_taken()
    }

    /// State A again, temporary setpoints zero.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Parser for Lecture {
    type Message = Setpoint;
    const FRAME_LENGTH: usize = 7;

    #[inline]
    fn push(&mut self, byte: u8) -> Option<Setpoint> {
        self.push(byte)
    }

    /// What the machine throws away, it throws away together.
    #[inline]
    fn push_with(
        &mut self,
        byte: u8,
        mut dropped: impl FnMut(usize, Mismatch),
    ) -> Option<Setpoint> {
        let before = self.state;
        let setpoint = self.push(byte);
        match (setpoint, before, self.state) {
            (None, State::SyncA, State::SyncA) => dropped(1, Mismatch::NoSync),
            (None, State::SyncB, State::SyncA) => dropped(2, Mismatch::BrokenSync),
            (None, State::Terminator, _) => dropped(7, Mismatch::Terminator),
            _ => {}
        }
        setpoint
    }

    fn feed_events(&mut self, bytes: &[u8], mut event: impl FnMut(Event<Setpoint>)) {
        for (index, &byte) in bytes.iter().enumerate() {
            let message = self.push_with(byte, |count, why| event(Event::Dropped { count, why }));
            if let Some(message) = message {
                event(Event::Frame { index, message });
            }
        }
    }

    fn pending(&self) -> usize {
        self.pending()
    }

    fn reset(&mut self) {
        self.reset();
    }
}
