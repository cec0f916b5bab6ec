//! Theorems about the engine, for every format. For each byte of the frame, a format either fixes the value or allows
//! any value. The format may also have any further check. Each submodule has one harness per length of frame. Theorem 6
//! is proved for frames of up to three bytes, and of seven and eight bytes. Frames of other lengths run the same
//! generic code.
//!
//! **States.** [`push`](Window::push) leaves a window without a note, or `EMPTY` if it delivers a frame.
//! [`push_with`](Window::push_with) leaves a window with a note, from which the number of pending bytes follows. The
//! harnesses start from any window of either kind ([`any_window`]), and show that both functions again leave a window
//! of one of these kinds.
//!
//! **Theorem 4: delivery.** `push` delivers exactly the frames that share no byte with an earlier delivered frame (R1,
//! R2, R4). The proof is an induction. Take any history, a window that holds the history's last bytes, and any next
//! byte. The harness shows that the window delivers exactly if the last bytes are such a frame, and that the window
//! otherwise holds the last bytes of the history with the new byte appended. The induction begins with `EMPTY`, the
//! window of the empty history ([`commits`]).
//!
//! **Theorem 6: slices.** [`feed`](Window::feed) delivers the same frames and discards the same bytes as pushing the
//! bytes one by one, and leads to a window in which the same bytes are pending (R5). Equal pending bytes are enough,
//! because windows in which the same bytes are pending treat all later bytes alike ([`pending`]).
//!
//! When a byte is pushed, the oldest pending bytes are discarded, possibly all of them and the new byte, until a frame
//! can begin with the remaining bytes. Compare the bytes from a discarded byte on with a frame. The first wrong
//! position decides the reason for discarding this byte (L3; [`mismatches`]). `push_with` reports these reasons,
//! delivers the frames that `push` delivers, and leads to a window in which the same bytes are pending ([`one_byte`]).
//! Later bytes never change a reason ([`reasons`]). So if some bytes can begin a frame, each shorter beginning of these
//! bytes can, too.
//!
//! `feed` consists of three loops. From any state, each iteration of each loop takes some bytes and has the same effect
//! as pushing these bytes one by one. By induction over the iterations, the same is true of `feed`.
//!
//! 1. The first loop calls `push_with` until all pending bytes lie in the slice.
//! 2. Then `feed` empties the window and goes back to the first pending byte. If the pending bytes are pushed again,
//!    none of them is discarded ([`reasons`]), and all of them are pending again ([`mismatches`]). At the start of each
//!    iteration of the second loop nothing is pending, and at least `LENGTH` bytes are left, where `LENGTH` is the
//!    length of a frame. If these bytes begin with a frame, pushing the bytes would deliver the frame with its last
//!    byte. If not, suppose that the first `LENGTH` of these bytes were pushed. The window would deliver nothing, and
//!    the same bytes would be pending as if the first pushed byte had never come. So `feed` discards the first byte and
//!    examines the next position ([`starts`]). `push_with` may find the reason for discarding a byte earlier than
//!    `feed`, before `LENGTH` bytes have come. By [`reasons`], both find the same reason. Between iterations, `feed`
//!    discards several bytes together only if no frame can begin with any of them (`noise::verification`). So
//!    `push_with` would discard each of these bytes immediately.
//! 3. The third loop calls `push_with` until no byte is left.
//!
//! **Theorem 1: no panics.** The harnesses named above run the steps with short slices. [`long_steps`] runs the steps,
//! and [`long_slice_is_fed`] runs `feed` as a whole, with slices of up to 4096 bytes.

use super::{DiscardReason, Found, FrameBytes, Shape, Window, Word};
use crate::any_format::part;
use crate::fixed_format::sealed::Words;

impl<F: FrameBytes> Window<F> {
    /// Returns the window that holds the last `count` bytes of a history, with or without a note. `count` is less than
    /// the length of a frame.
    pub(crate) fn holding(history: &[u8], count: usize, has_note: bool, shape: &Shape<F>) -> Self {
        let window = holding(history, count);
        if has_note {
            with_note(window, window.pending(shape))
        } else {
            window
        }
    }

    fn pushed(
        mut self,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
    ) -> (Self, Option<F::Word>) {
        let frame = self.push(shape, byte, check);
        (self, frame)
    }
}

/// Returns the window that holds the last `count` bytes of a history: `EMPTY`, or a window without a note. `count` is
/// less than the length of a frame.
fn holding<F: FrameBytes>(history: &[u8], count: usize) -> Window<F> {
    let mut window = Window::EMPTY;
    let mut place = 0;
    while place < history.len() {
        if place + count >= history.len() {
            window = Window(window.with(history[place]));
        }
        place += 1;
    }
    window
}

/// Returns the word whose lowest bytes are a whole frame, as the window builds it.
fn word_of<const N: usize>(frame: &[u8; N]) -> <[u8; N] as Words>::Word
where
    [u8; N]: FrameBytes,
{
    let mut word = Window::<[u8; N]>::EMPTY;
    let mut place = 0;
    while place < N {
        word = Window(word.with(frame[place]));
        place += 1;
    }
    word.0
}

/// Returns an arbitrary state: a window that holds fewer bytes than a frame, with or without a note.
fn any_window<const N: usize>(shape: &Shape<[u8; N]>) -> Window<[u8; N]>
where
    [u8; N]: FrameBytes,
{
    let history: [u8; N] = kani::any();
    let count = kani::any_where(|&count| count < N);
    Window::holding(&history, count, kani::any(), shape)
}

/// Returns the same window with the note that `count` bytes are pending.
fn with_note<F: FrameBytes>(window: Window<F>, count: usize) -> Window<F> {
    Window(window.0 & !F::Word::of_note(15) | Window::<F>::note(count))
}

fn any_shape<const N: usize>() -> Shape<[u8; N]> {
    Shape::new(kani::any::<[Option<u8>; N]>())
}

fn commits_exactly_the_frames<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let places: [Option<u8>; N] = kani::any();
    let shape = Shape::new(places);
    // The bytes before the pushed byte, and the number since the last delivered frame, or N - 1 if this is less.
    let mut history: [u8; N] = kani::any();
    let since: usize = kani::any_where(|&since| since < N);
    let byte: u8 = kani::any();
    // The result of the format's check may be true or false.
    let check: bool = kani::any();
    let before: Window<[u8; N]> = Window::holding(&history, since, kani::any(), &shape);
    let (after, frame) = before.pushed(&shape, byte, |_| check);

    let mut place = 1;
    while place < N {
        history[place - 1] = history[place];
        place += 1;
    }
    history[N - 1] = byte;
    let mut is_frame = check && since == N - 1;
    let mut place = 0;
    while place < N {
        is_frame = is_frame && places[place].is_none_or(|fixed| history[place] == fixed);
        place += 1;
    }
    assert!(frame == is_frame.then_some(word_of(&history)));
    let since = if is_frame { 0 } else { (since + 1).min(N - 1) };
    assert!(after == holding(&history, since));
    kani::cover!(is_frame, "a frame");
    kani::cover!(!is_frame && check, "no frame");
}

/// Returns the reason why no frame can begin with the last `known` bytes of a history, or `None` if a frame can. The
/// first wrong byte decides the reason.
fn first_mismatch<const N: usize>(
    places: &[Option<u8>; N],
    history: &[u8; N],
    known: usize,
) -> Option<DiscardReason> {
    let mut in_sync = true;
    let mut place = 0;
    while place < known {
        in_sync = in_sync && places[place].is_some();
        if places[place].is_some_and(|fixed| fixed != history[N - known + place]) {
            return Some(match place {
                _ if !in_sync => DiscardReason::WrongTerminator,
                0 => DiscardReason::NoSync,
                _ => DiscardReason::BrokenSync,
            });
        }
        place += 1;
    }
    None
}

/// The engine finds the same reasons as [`first_mismatch`], and so the right number of pending bytes. A window may also
/// hold bytes that are not pending. Leaving these bytes out does not change which bytes are pending.
fn mismatches_are_found<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let places: [Option<u8>; N] = kani::any();
    let shape = Shape::new(places);
    let history: [u8; N] = kani::any();
    let count: usize = kani::any_where(|&count| count < N);
    let window: Window<[u8; N]> = holding(&history, count);
    let whole = word_of(&history);
    let first = first_mismatch(&places, &history, N);
    let mut longest = 0;
    let mut known = 1;
    while known < N {
        let why = first_mismatch(&places, &history, known);
        assert!(shape.mismatch(whole, known) == why);
        assert!(shape.agrees(whole, known) == why.is_none());
        if known <= count && why.is_none() {
            longest = known;
        }
        known += 1;
    }
    assert!(shape.mismatch(whole, N) == first);
    assert!(window.pending(&shape) == longest);
    assert!(window.room(&shape) == N - 1 - longest);
    let noted = with_note(window, longest);
    assert!(noted.pending(&shape) == longest && noted.room(&shape) == N - 1 - longest);
    assert!(window.agrees_with(holding(&history, longest), &shape));
    kani::cover!(first.is_none(), "a frame");
    kani::cover!(
        N < 3 || 0 < longest && longest < count,
        "a frame begun within"
    );
}

/// Takes one byte in any state. `push_with` delivers the frame that `push` delivers, and leads to the same window, plus
/// the note for the number of bytes that are pending. It discards pending bytes, oldest first, each for the reason that
/// [`first_mismatch`] gives, or because a frame fails the check. It stops at the first byte with which a frame can
/// still begin. Afterwards the new byte, and each byte that was pending, is part of the frame, discarded, or pending.
fn one_byte_is_pushed<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let shape = any_shape::<N>();
    let check: bool = kani::any();
    let before = any_window::<N>(&shape);
    let byte: u8 = kani::any();
    let mut after = before;
    let mut discarded = Discarded::watched(kani::any());
    let frame = after.push_with(&shape, byte, |_| check, |why| discarded.add(why));
    let (pushed, committed) = before.pushed(&shape, byte, |_| check);
    assert!(frame.map(<[u8; N]>::from_word) == committed.map(<[u8; N]>::from_word));

    let pending = before.pending(&shape);
    let mut expected = Discarded::watched(discarded.watched);
    let mut kept = if frame.is_some() { 0 } else { pending + 1 };
    let mut known = N;
    while known > 0 {
        if known <= pending + 1 {
            match shape.mismatch(before.with(byte), known) {
                Some(why) => expected.add(why),
                None if known == N && !check => expected.add(DiscardReason::ChecksumMismatch),
                None => break,
            }
            kept -= 1;
        }
        known -= 1;
    }
    assert!(discarded == expected);
    assert!(after == with_note(pushed, kept));
    assert!(pushed.pending(&shape) == kept);
    assert!(frame.is_none() || pending + 1 == N && discarded.count == 0);
    kani::cover!(frame.is_some(), "a frame");
    let is_watched = |why| discarded.why == Some(why);
    kani::cover!(
        is_watched(DiscardReason::ChecksumMismatch),
        "a failed check"
    );
    let is_wrong_terminator = is_watched(DiscardReason::WrongTerminator);
    kani::cover!(N == 1 || is_wrong_terminator, "a wrong terminator");
}

/// The number of discarded bytes, and the reason for an arbitrary one of them.
#[derive(PartialEq)]
struct Discarded {
    watched: u8,
    count: u8,
    why: Option<DiscardReason>,
}

impl Discarded {
    fn watched(watched: u8) -> Self {
        let (count, why) = (0, None);
        Self {
            watched,
            count,
            why,
        }
    }

    fn add(&mut self, why: DiscardReason) {
        if self.count == self.watched {
            self.why = Some(why);
        }
        self.count += 1;
    }
}

/// Checks the positions of a slice at which the second loop of `feed` compares a whole frame. At each of these
/// positions, pushing the bytes has the same result as the comparison.
fn start_is_pushed<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let shape = any_shape::<N>();
    let check: bool = kani::any();
    let bytes: [u8; 16] = kani::any();
    let word = <[u8; N] as Words>::Word::load(&bytes).unwrap();
    let head = word.down(<[u8; N] as Words>::Word::BYTES - N);

    let (mut from_first, mut from_second) = (Window::<[u8; N]>::EMPTY, Window::EMPTY);
    let mut at = 0;
    while at < N {
        let (after, frame) = from_first.pushed(&shape, bytes[at], |_| check);
        from_first = after;
        assert!(frame.is_some() == (at == N - 1 && shape.agrees(head, N) && check));
        if at > 0 {
            let (after, frame) = from_second.pushed(&shape, bytes[at], |_| check);
            from_second = after;
            assert!(frame.is_none());
        }
        at += 1;
    }
    if shape.agrees(head, N) && check {
        assert!(from_first == Window::EMPTY);
    } else {
        assert!(from_first.agrees_with(from_second, &shape));
    }
    kani::cover!(shape.agrees(head, N) && check, "a frame");
    kani::cover!(from_first.pending(&shape) == N - 1, "the next start");
}

static BYTES: [u8; 4096] = [0; 4096];

/// Returns a slice of any length up to 4096 bytes. All its bytes are 0. With an arbitrary shape, a frame may begin with
/// any of these bytes or with none.
fn any_slice() -> &'static [u8] {
    let length = usize::from(kani::any::<u16>());
    kani::assume(length <= BYTES.len());
    part(&BYTES, 0, length)
}

/// Theorem 1: `feed` takes a slice of any length up to 4096 bytes, in any state. The harness runs the function, and
/// each of its loops, up to the first check of a whole frame. The other iterations of the loops perform the same steps.
/// [`long_slice_is_taken`] proves the steps. Any two bytes have the shape of a frame here.
#[kani::proof]
#[kani::unwind(17)]
fn long_slice_is_fed() {
    // A constant, so that the prover sees at once where the executions end.
    let shape = const { &Shape::new([None; 2]) };
    let mut window = any_window(shape);
    let bytes = any_slice();
    let check = |_| {
        kani::cover!(bytes.len() == BYTES.len(), "a long slice");
        kani::assume(false);
        false
    };
    let pending = window.pending(shape);
    window.feed(shape, bytes, check, |_| {
        unreachable!("nothing is found before the first check")
    });
    assert!(window.pending(shape) == pending + bytes.len());
    kani::cover!(bytes.len() == 1, "a byte waits");
}

/// Checks that `skip_blocks` returns the rest of the slice.
fn skips_blocks<const N: usize>(shape: &Shape<[u8; N]>, bytes: &[u8])
where
    [u8; N]: FrameBytes,
{
    let mut placed = 0;
    let mut found = |one: Found<_>| placed += one.bytes();
    let rest = Window::<[u8; N]>::skip_blocks(shape, bytes, &mut found);
    assert!(placed + rest.len() == bytes.len());
}

/// Theorem 1: the steps of `feed` take a slice of any length up to 4096 bytes, and return the rest of the slice.
fn long_slice_is_taken<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let shape = any_shape::<N>();
    let check: bool = kani::any();
    let mut window = any_window::<N>(&shape);
    let bytes = any_slice();
    let (pending, taken) = (window.pending(&shape), usize::from(kani::any::<u16>()));
    kani::assume(pending <= taken && taken <= bytes.len());
    let rest = window.give_back(&shape, bytes, taken);
    assert!(window.pending(&shape) == 0 && rest.len() == bytes.len() - taken + pending);

    // No byte of these slices can begin a frame, or each byte can. The lengths are constants, so that the provers see
    // at once how many blocks a slice has. `noise::verification` proves the search in longer slices.
    skips_blocks(&shape, part(&BYTES, 0, 15));
    skips_blocks(&shape, part(&BYTES, 0, 16));
    skips_blocks(&shape, part(&BYTES, 0, 37));

    let mut placed = 0;
    let mut found = |one: Found<_>| placed += one.bytes();
    let taken = Window::<[u8; N]>::take(&shape, bytes, |_| check, &mut found);
    let left = taken.as_ref().map_or(bytes.len(), |taken| taken.rest.len());
    assert!(placed + left == bytes.len());
    let dropped = taken.map(|taken| taken.dropped);
    assert!(dropped.is_none() == (bytes.len() < <[u8; N] as Words>::Word::BYTES));
    assert!(dropped.is_none_or(|dropped| dropped == placed || placed == N));
    kani::cover!(dropped == Some(0) && bytes.len() == 4096, "a frame");
    kani::cover!(dropped == Some(1) && bytes.len() == 4096, "no frame");
}

/// `load` fills a word with the first bytes of a slice, the first byte in the highest position. `from_word` returns the
/// lowest bytes of a word.
#[kani::proof]
#[kani::unwind(10)]
fn words_hold_frames() {
    fn frame_is_read<const N: usize>(word: u64, bytes: &[u8; 9])
    where
        [u8; N]: FrameBytes<Word = u64>,
    {
        let frame = <[u8; N]>::from_word(word);
        let mut place = 0;
        while place < N {
            assert!(frame[place] == bytes[8 - N + place]);
            place += 1;
        }
    }
    let bytes: [u8; 9] = kani::any();
    assert!(u64::load(bytes.first_chunk::<7>().unwrap()).is_none());
    let word = u64::load(&bytes).unwrap();
    frame_is_read::<1>(word, &bytes);
    frame_is_read::<2>(word, &bytes);
    frame_is_read::<3>(word, &bytes);
    frame_is_read::<4>(word, &bytes);
    frame_is_read::<5>(word, &bytes);
    frame_is_read::<6>(word, &bytes);
    frame_is_read::<7>(word, &bytes);
    frame_is_read::<8>(word, &bytes);
    kani::cover!(word == 1, "seven bytes are 0");
}

/// The reason why a byte is discarded does not change with later bytes.
fn reasons_stay<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let shape = any_shape::<N>();
    let window = any_window(&shape);
    let byte = kani::any();
    let known: usize = kani::any_where(|&known| 0 < known && known < N);
    let before = shape.mismatch(window.0, known);
    let after = shape.mismatch(window.with(byte), known + 1);
    assert!(before.is_none() || after == before);
    kani::cover!(before.is_some(), "a reason");
}

/// If the same bytes are pending in two windows, both treat the next byte alike, and afterwards the same bytes are
/// pending in both.
fn only_what_is_pending_matters<const N: usize>()
where
    [u8; N]: FrameBytes,
{
    let shape = any_shape::<N>();
    let check: bool = kani::any();
    let byte = kani::any();
    let (one, other) = (any_window(&shape), any_window(&shape));
    kani::assume(one.agrees_with(other, &shape));
    let (after, frame) = one.pushed(&shape, byte, |_| check);
    let (after_other, frame_other) = other.pushed(&shape, byte, |_| check);
    assert!(frame.map(<[u8; N]>::from_word) == frame_other.map(<[u8; N]>::from_word));
    assert!(after.agrees_with(after_other, &shape));
    kani::cover!(frame.is_some(), "a frame");
    kani::cover!(one != other, "different bytes held");
}

/// Compares `feed` as a whole with single pushes, for the frame 1, 0. This checks the argument in the module's
/// documentation, and that nothing panics. Returns for each position whether a frame ends there.
// Never inlined, because otherwise the solver would unwind this function's loops again for each iteration of the
// caller's loop.
#[inline(never)]
fn slice_is_pushed<const LENGTH: usize>(
    before: Window<[u8; 2]>,
    bytes: [u8; LENGTH],
) -> [bool; LENGTH] {
    let shape = Shape::new([Some(1), Some(0)]);
    let mut fed = before;
    let (mut frames, mut known) = ([false; LENGTH], 0);
    let pending = before.pending(&shape);
    fed.feed(
        &shape,
        &bytes,
        |_| true,
        |found| {
            assert!(found.bytes() > 0);
            known += found.bytes();
            if let Found::Frame { .. } = found {
                frames[known - pending - 1] = true;
            }
        },
    );
    let mut pushed = before;
    let mut place = 0;
    while place < LENGTH {
        let (after, frame) = pushed.pushed(&shape, bytes[place], |_| true);
        pushed = after;
        assert!(frames[place] == frame.is_some());
        place += 1;
    }
    assert!(fed.agrees_with(pushed, &shape));
    assert!(known + fed.pending(&shape) == pending + LENGTH);
    frames
}

/// Checks the first and the third loop on sixteen streams: each of eight slices is fed to a window that holds one byte,
/// and to a window that holds none.
#[kani::proof]
#[kani::unwind(18)]
fn short_slice_is_pushed() {
    let (mut number, mut begun_before, mut at_the_end) = (0_u8, false, false);
    while number < 16 {
        let [held, first, second, third] = [0, 1, 2, 3].map(|bit| number >> bit & 1);
        let before = holding(&[1, 1], usize::from(held));
        let frames = slice_is_pushed(before, [first, second, third]);
        begun_before |= frames[0];
        at_the_end |= frames[2];
        number += 1;
    }
    kani::cover!(begun_before, "a frame begun before");
    kani::cover!(at_the_end, "a frame at the end");
}

/// Checks the second and the third loop on eight streams. The second loop runs at most twice, because an 8-byte word
/// fits at two positions in nine bytes.
#[kani::proof]
#[kani::unwind(18)]
fn slice_of_words_is_pushed() {
    let (mut number, mut in_first, mut in_second) = (0_u8, false, false);
    while number < 8 {
        let [first, second, third] = [0, 1, 2].map(|bit| number >> bit & 1);
        let bytes = [first, second, third, 0, 0, 0, 0, 0, 1];
        let frames = slice_is_pushed(Window::EMPTY, bytes);
        in_first |= frames[1];
        in_second |= frames[2];
        number += 1;
    }
    kani::cover!(in_first, "a frame in the first word");
    kani::cover!(in_second, "a frame in the second");
}

/// Defines one harness for each length of frame.
macro_rules! for_frames {
    ($module:ident, $proof:ident: $($name:ident $length:literal)*) => {
        mod $module {
            $(
                #[kani::proof]
                #[kani::unwind(18)]
                fn $name() {
                    super::$proof::<$length>();
                }
            )*
        }
    };
    ($module:ident, $proof:ident) => {
        for_frames!($module, $proof: of_1 1 of_2 2 of_3 3 of_7 7 of_8 8);
    };
}
for_frames!(commits, commits_exactly_the_frames:
    of_1 1 of_2 2 of_3 3 of_4 4 of_5 5 of_6 6 of_7 7 of_8 8 of_16 16);
for_frames!(mismatches, mismatches_are_found);
for_frames!(one_byte, one_byte_is_pushed);
for_frames!(starts, start_is_pushed);
for_frames!(long_steps, long_slice_is_taken: of_1 1 of_16 16);
for_frames!(reasons, reasons_stay: of_2 2 of_3 3 of_7 7 of_8 8);
for_frames!(pending, only_what_is_pending_matters: of_2 2 of_3 3 of_7 7 of_8 8);
