//! Slices: however a stream is cut, the same as byte by byte.

use framelock::{Bin, BinCrc8, Format, Mismatch, Parser, Receiver, Rescan, Setpoint, Sink};

use super::{any_lecture, any_receiver};

/// All that a parser says about a slice of `N` bytes: which byte gave which setpoint, and how many
/// bytes were dropped for each reason.
#[derive(PartialEq)]
pub(super) struct Report<const N: usize> {
    pub(super) setpoints: [Option<Setpoint>; N],
    pub(super) dropped: [u8; 4],
    /// Where the slice begins.
    pub(super) from: usize,
}

impl<const N: usize> Report<N> {
    pub(super) const fn new() -> Self {
        Self {
            setpoints: [None; N],
            dropped: [0; 4],
            from: 0,
        }
    }

    /// As much more is dropped for that reason.
    pub(super) fn drop_more(&mut self, count: u8, why: Mismatch) {
        let place = match why {
            Mismatch::NoSync => 0,
            Mismatch::BrokenSync => 1,
            Mismatch::Check => 2,
            Mismatch::Terminator => 3,
        };
        self.dropped[place] += count;
    }
}

impl<const N: usize> Sink<Setpoint> for Report<N> {
    fn frame(&mut self, index: usize, setpoint: Setpoint) {
        self.setpoints[self.from + index] = Some(setpoint);
    }

    fn dropped(&mut self, count: usize, why: Mismatch) {
        // At most all bytes and those held before.
        self.drop_more(count.to_le_bytes()[0], why);
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

/// What is said to be a frame at the head of a slice, taken whole where nothing is held, is what
/// byte by byte its last byte commits, and none before; nothing is dropped, and again nothing held.
fn whole_frame_equals_bytes<F, const LENGTH: usize>()
where
    F: Format<Word = u64, Message = Setpoint>,
{
    // A word and one byte more: it looks no further.
    let bytes: [u8; 9] = kani::any();
    let length: usize = kani::any_where(|&length| length <= 9);
    if let Some(setpoint) = Receiver::<F>::whole_frame_of_slice(&bytes[..length]) {
        assert!(length >= LENGTH);
        let mut single = Report::<1>::new();
        let mut one_by_one = Receiver::<F>::new();
        let mut i = 0;
        while i < LENGTH {
            assert!(single.setpoints[0].is_none());
            one_by_one.feed(&[bytes[i]], &mut single);
            i += 1;
        }
        assert!(single.setpoints[0] == Some(setpoint));
        assert!(single.dropped == [0; 4]);
        assert!(one_by_one == Receiver::new());
        kani::cover!(length == 9, "a frame");
    }
}

/// R5 for the receiver of BIN: frames taken whole.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(10)]
fn whole_frames_of_bin() {
    whole_frame_equals_bytes::<Bin, 7>();
}

/// R5 for the receiver of BIN-CRC8, likewise.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn whole_frames_of_bin_crc8() {
    whole_frame_equals_bytes::<BinCrc8, 8>();
}

/// R5 for the receiver of BIN, slices of less than 96 bytes. From any state, at any place of a
/// slice: what is taken at once, as many bytes as it says, gives the same commits at the same
/// bytes, as much dropped for the same reasons, and the same state as these bytes one by one.
///
/// Such a slice is nothing but whole frames and such parts, each where the one before it ended,
/// until none is left: by induction over them all is as byte by byte.
///
/// Theorem: 6
/// Length: any
/// Covers: Receiver::feed
#[kani::proof]
#[kani::unwind(17)]
fn parts_of_bin() {
    let receiver = any_receiver::<Bin, Rescan>();
    // A word and one byte more: it looks no further.
    let bytes: [u8; 9] = kani::any();
    let length: usize = kani::any_where(|&length| length > 0 && length <= 9);
    let begins: bool = kani::any();
    let mut whole = Report::<10>::new();
    let mut fed = receiver;
    let at = if begins { 0 } else { 1 };
    let taken = fed.some_of_slice(&bytes[..length], at, &mut whole);
    assert!(taken > 0 && taken <= length);

    let mut single = Report::<10>::new();
    let mut one_by_one = receiver;
    let mut i = 0;
    while i < 9 {
        if i < taken {
            single.from = at + i;
            one_by_one.feed(&[bytes[i]], &mut single);
        }
        i += 1;
    }
    assert!(whole.setpoints == single.setpoints);
    assert!(whole.dropped == single.dropped);
    assert!(fed == one_by_one);
    kani::cover!(taken == 7, "a whole frame");
    kani::cover!(taken == 2 && !begins, "a part of one");
    kani::cover!(
        taken == 1 && single.dropped[3] > 0,
        "a byte at which one fails"
    );
}

/// R5 for the receiver of BIN-CRC8, likewise: commits and state. (What is dropped for which reason
/// is tested.)
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn parts_of_bin_crc8() {
    let receiver = any_receiver::<BinCrc8, Rescan>();
    let bytes: [u8; 9] = kani::any();
    let length: usize = kani::any_where(|&length| length > 0 && length <= 9);
    let begins: bool = kani::any();
    let at = if begins { 0 } else { 1 };
    let mut fed = receiver;
    let mut committed = None;
    let taken = fed.some_of_slice(&bytes[..length], at, &mut |index, setpoint| {
        committed = Some((index, setpoint));
    });
    assert!(taken > 0 && taken <= length);

    let mut pushed = receiver;
    let mut expected = None;
    let mut i = 0;
    while i < 9 {
        if i < taken
            && let Some(setpoint) = pushed.push(bytes[i])
        {
            // At most one: the first would be forgotten.
            assert!(expected.is_none());
            expected = Some((at + i, setpoint));
        }
        i += 1;
    }
    assert!(committed == expected);
    assert!(fed == pushed);
    kani::cover!(taken == 8, "a whole frame");
    kani::cover!(taken == 2 && !begins, "a part of one");
}

/// R5 for the receiver of BIN: short slices as a whole, from any state. No more than that they do not
/// panic, and commit what `push` does; for longer ones see the parts above.
///
/// Theorem: 1, 6
/// Length: slices of up to 3 bytes
/// Run: long
/// Covers: Receiver::feed
#[kani::proof]
#[kani::unwind(10)]
fn receiver_of_bin() {
    let mut fed = any_receiver::<Bin, Rescan>();
    let mut pushed = fed;
    let bytes: [u8; 3] = kani::any();
    let length: usize = kani::any_where(|&length| length <= 3);
    let mut setpoints = [None; 3];
    fed.feed(&bytes[..length], &mut |index, setpoint| {
        setpoints[index] = Some(setpoint);
    });
    let mut i = 0;
    while i < 3 {
        let setpoint = if i < length {
            pushed.push(bytes[i])
        } else {
            None
        };
        assert!(setpoints[i] == setpoint);
        i += 1;
    }
    assert!(fed == pushed);
    kani::cover!(setpoints[2].is_some(), "the last byte completes a frame");
    kani::cover!(setpoints[0].is_some() && length == 3, "the first does");
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
