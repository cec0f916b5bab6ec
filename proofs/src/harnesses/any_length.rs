//! Commits, for streams of any length, by induction over the bytes of the stream.
//!
//! The ghost is what the specification speaks of: the last bytes of the stream, and how many came
//! since the last commit. The invariant ties the machine's state to it. Each harness takes *any*
//! ghost, the machine in the state that the invariant demands, and any next byte; shows that the
//! machine commits if and only if the specification does; and that the invariant holds again. The
//! base, a machine at reset with no byte received, satisfies the invariant. Hence it holds, and
//! with it the theorem, after every stream of any length.

use framelock::{Bin, BinCrc8, Format, Lecture, Parser, Receiver, Setpoint, Shape, State, Window};

use super::{any_lecture, is_bin, is_bin_crc8};

/// The end of a stream: its last bytes, newest last, and how many came since the last commit (as
/// far as it matters, so `N` stands for `N` or more).
#[derive(Clone, Copy)]
struct Ghost<const N: usize> {
    last: [u8; N],
    since: u8,
}

impl<const N: usize> Ghost<N> {
    fn any() -> Self {
        Self {
            last: kani::any(),
            since: kani::any_where(|&since| usize::from(since) <= N),
        }
    }

    /// The stream goes on by a byte.
    fn then(mut self, byte: u8, committed: bool) -> Self {
        let mut i = 1;
        while i < N {
            self.last[i - 1] = self.last[i];
            i += 1;
        }
        self.last[N - 1] = byte;
        self.since = if committed {
            0
        } else if usize::from(self.since) < N {
            self.since + 1
        } else {
            self.since
        };
        self
    }

    fn word(&self) -> u64 {
        let mut word = 0;
        let mut i = 0;
        while i < N {
            word = word << 8 | u64::from(self.last[i]);
            i += 1;
        }
        word
    }
}

/// The invariant of the receiver: it holds the bytes since the last commit, as many as matter.
fn receiver_of<F: Format<Word = u64>, const N: usize>(ghost: &Ghost<N>) -> Receiver<F> {
    Receiver::holding(ghost.word(), ghost.since)
}

/// A commit if and only if the last `N` bytes are a frame that overlaps no earlier commit; and the
/// setpoint is that frame's.
fn commits_exactly_the_frames<F, const N: usize>(is_frame: fn([u8; N]) -> bool)
where
    F: Format<Word = u64, Message = Setpoint>,
{
    let reset = Ghost {
        last: kani::any(),
        since: 0,
    };
    assert!(Receiver::<F>::new() == receiver_of::<F, N>(&reset));

    let ghost = Ghost::<N>::any();
    let byte = kani::any();
    let mut receiver = receiver_of::<F, N>(&ghost);
    let setpoint = receiver.push(byte);

    let next = ghost.then(byte, false);
    let frame = usize::from(next.since) == N && is_frame(next.last);
    let [pitch, roll, yaw] = [next.last[3], next.last[4], next.last[5]];
    assert!(setpoint == frame.then_some(Setpoint { pitch, roll, yaw }));
    assert!(receiver == receiver_of(&ghost.then(byte, frame)));
    kani::cover!(frame, "a frame is committed");
    kani::cover!(
        !frame && is_frame(next.last),
        "a frame overlaps one committed before"
    );
}

/// R1, R2, R4 for BIN: a commit at byte n if and only if bytes n-6..=n are a frame that overlaps
/// no earlier commit; and the setpoint is that frame's.
///
/// Theorem: 3, 4
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn bin_commits_exactly_the_frames() {
    commits_exactly_the_frames::<Bin, 7>(is_bin);
}

/// R1, R2, R4 for BIN-CRC8, likewise.
///
/// Theorem: 3, 4
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8_commits_exactly_the_frames() {
    commits_exactly_the_frames::<BinCrc8, 8>(is_bin_crc8);
}

/// The invariant of the lecture's machine: as many bytes as its state counts came since the last
/// commit; they begin a frame, and the temporary setpoints are theirs.
fn lecture_fits(machine: &Lecture, ghost: &Ghost<7>) -> bool {
    let taken = machine.state.bytes_taken();
    let at = |place: usize| ghost.last[7 - taken + place];
    taken <= usize::from(ghost.since)
        && (taken < 1 || at(0) == b'A')
        && (taken < 2 || at(1) == b'B')
        && (taken < 4 || at(3) == machine.temp.pitch)
        && (taken < 5 || at(4) == machine.temp.roll)
        && (taken < 6 || at(5) == machine.temp.yaw)
}

/// M1, M2 for the lecture's machine: a commit at byte n means that bytes n-6..=n are a frame,
/// that they overlap no earlier commit, and that the setpoint is theirs.
///
/// Theorem: 3
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn lecture_commits_only_frames() {
    assert!(lecture_fits(
        &Lecture::new(),
        &Ghost {
            last: kani::any(),
            since: 0
        }
    ));

    let ghost = Ghost::<7>::any();
    let mut machine = any_lecture();
    kani::assume(lecture_fits(&machine, &ghost));
    let byte = kani::any();
    let committed = machine.push(byte);

    let next = ghost.then(byte, false);
    if let Some(setpoint) = committed {
        let [_, _, _, pitch, roll, yaw, _] = next.last;
        assert!(next.since == 7 && is_bin(next.last));
        assert!(setpoint == Setpoint { pitch, roll, yaw });
    }
    assert!(lecture_fits(
        &machine,
        &ghost.then(byte, committed.is_some())
    ));
    kani::cover!(committed.is_some(), "a frame is committed");
    kani::cover!(
        committed.is_none() && next.since == 7 && is_bin(next.last),
        "a frame is missed: soundness is all that holds for this machine"
    );
}

/// M1 for the lecture's machine: each step is the table's.
///
/// Theorem: 2
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn lecture_steps_by_its_table() {
    let before = any_lecture();
    let byte: u8 = kani::any();
    let mut after = before;
    let committed = after.push(byte);
    let next = match (before.state.bytes_taken(), byte) {
        (0, b'A') => 1,
        (1, b'B') => 2,
        (state @ 2..=5, _) => state + 1,
        _ => 0,
    };
    assert!(after.state.bytes_taken() == next);
    let stored = |place, byte_before| {
        if before.state.bytes_taken() == place {
            byte
        } else {
            byte_before
        }
    };
    assert!(after.temp.pitch == stored(3, before.temp.pitch));
    assert!(after.temp.roll == stored(4, before.temp.roll));
    assert!(after.temp.yaw == stored(5, before.temp.yaw));
    let complete = before.state == State::Terminator && byte == b'\r';
    assert!(committed == complete.then_some(before.temp));
    kani::cover!(complete, "a commit");
    kani::cover!(
        before.state == State::SyncB && byte == b'A',
        "the row that Rescan changes"
    );
}

/// Any format of `N` bytes, any of them fixed or free, and any further check.
fn any_format<const N: usize>() {
    let places: [Option<u8>; N] = kani::any();
    let shape = Shape::<u64>::new(places);
    let reset = Ghost::<8> {
        last: kani::any(),
        since: 0,
    };
    assert!(Window::EMPTY == Window::holding(&shape, reset.word(), reset.since));

    let ghost = Ghost::<8>::any();
    let byte = kani::any();
    // Whatever the check looks at, its answer about this window is yes or no.
    let check: bool = kani::any();
    let before = Window::holding(&shape, ghost.word(), ghost.since);
    let (after, committed) = before.push(&shape, byte, |_| check);

    let next = ghost.then(byte, false);
    let mut frame = check && usize::from(next.since) >= N;
    let mut place = 0;
    while place < N {
        if let Some(fixed) = places[place] {
            frame = frame && next.last[8 - N + place] == fixed;
        }
        place += 1;
    }
    assert!(committed == frame);
    let ghost = ghost.then(byte, frame);
    assert!(after == Window::holding(&shape, ghost.word(), ghost.since));
    if frame {
        let received: [u8; N] = framelock::Frame::from_word(before.with(byte));
        let mut place = 0;
        while place < N {
            assert!(received[place] == next.last[8 - N + place]);
            place += 1;
        }
    }
    kani::cover!(frame, "a frame is committed");
    kani::cover!(!frame && check, "no frame");
}

/// R1, R2, R4 for every format of one to eight bytes: whichever bytes are fixed, to whatever
/// values, and whatever else is checked, the receiver's engine commits exactly the frames that
/// overlap no earlier one, and gives their bytes.
///
/// Theorem: 4c
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn every_format_of_up_to_eight_bytes() {
    match kani::any::<u8>() {
        1 => any_format::<1>(),
        2 => any_format::<2>(),
        3 => any_format::<3>(),
        4 => any_format::<4>(),
        5 => any_format::<5>(),
        6 => any_format::<6>(),
        7 => any_format::<7>(),
        _ => any_format::<8>(),
    }
}
