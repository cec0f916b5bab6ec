//! Slices: however a stream is cut, the same as byte by byte.

use framelock::{Bin, BinCrc8, Mismatch, Parser, Rescan, Setpoint, Sink};

use super::{any_lecture, any_receiver};

/// All that a parser says about a slice of `N` bytes: which byte gave which setpoint, and how many
/// bytes were dropped for each reason.
#[derive(PartialEq)]
struct Report<const N: usize> {
    setpoints: [Option<Setpoint>; N],
    dropped: [u8; 4],
    /// Where the slice begins.
    from: usize,
}

impl<const N: usize> Report<N> {
    const fn new() -> Self {
        Self {
            setpoints: [None; N],
            dropped: [0; 4],
            from: 0,
        }
    }
}

impl<const N: usize> Sink<Setpoint> for Report<N> {
    fn frame(&mut self, index: usize, setpoint: Setpoint) {
        self.setpoints[self.from + index] = Some(setpoint);
    }

    fn dropped(&mut self, count: usize, why: Mismatch) {
        let place = match why {
            Mismatch::NoSync => 0,
            Mismatch::BrokenSync => 1,
            Mismatch::Check => 2,
            Mismatch::Terminator => 3,
        };
        // At most all bytes and those held before.
        self.dropped[place] += count.to_le_bytes()[0];
    }
}

/// From any state, a slice of `N` bytes: the same commits at the same bytes, as much dropped for
/// the same reasons (which is all that the accounts are made of) and the same state as byte by
/// byte; and the same commits as by `push`.
///
/// That is enough for every cut of every stream: a stream cut into slices is fed one after the
/// other, each from whatever state the one before it led to; by induction over the slices all is
/// as byte by byte. What is bounded is the length of a slice.
fn slice_equals_bytes<P, const N: usize>(parser: P)
where
    P: Parser<Message = Setpoint> + Copy + PartialEq,
{
    let bytes: [u8; N] = kani::any();
    let mut whole = Report::<N>::new();
    let mut fed = parser;
    fed.feed(&bytes, &mut whole);

    let mut single = Report::<N>::new();
    let mut one_by_one = parser;
    let mut pushed = parser;
    let mut i = 0;
    while i < N {
        single.from = i;
        one_by_one.feed(&[bytes[i]], &mut single);
        assert!(pushed.push(bytes[i]) == whole.setpoints[i]);
        assert!(whole.setpoints[i] == single.setpoints[i]);
        i += 1;
    }
    assert!(whole.dropped == single.dropped);
    assert!(fed == one_by_one && fed == pushed);
    kani::cover!(
        whole.setpoints[N - 1].is_some(),
        "the slice's last byte completes a frame"
    );
    kani::cover!(whole.setpoints[0].is_some(), "its first does");
}

/// R5 for the receiver of BIN.
///
/// Theorem: 6
/// Length: slices of 8 bytes
/// Covers: Receiver::feed
#[kani::proof]
#[kani::unwind(10)]
fn receiver_of_bin() {
    slice_equals_bytes::<_, 8>(any_receiver::<Bin, Rescan>());
}

/// R5 for the receiver of BIN-CRC8: commits and state. (What is dropped for which reason is tested.)
///
/// Theorem: 6
/// Length: slices of 4 bytes
#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8() {
    let mut fed = any_receiver::<BinCrc8, Rescan>();
    let mut pushed = fed;
    let bytes: [u8; 4] = kani::any();
    let mut setpoints = [None; 4];
    fed.feed(&bytes, &mut |index, setpoint| {
        setpoints[index] = Some(setpoint)
    });
    let mut i = 0;
    while i < 4 {
        assert!(pushed.push(bytes[i]) == setpoints[i]);
        i += 1;
    }
    assert!(fed == pushed);
    kani::cover!(
        setpoints[3].is_some(),
        "the slice's last byte completes a frame"
    );
    kani::cover!(setpoints[0].is_some(), "its first does");
}

/// R5 for the lecture's machine.
///
/// Theorem: 6
/// Length: slices of 8 bytes
/// Covers: Lecture::feed
#[kani::proof]
#[kani::unwind(10)]
fn lecture() {
    slice_equals_bytes::<_, 8>(any_lecture());
}
