//! Target `framing`: two random formats, one of which keeps the laws of [`Format`], and a stream of any bytes.

use std::cell::Cell;

use arbitrary::{Arbitrary, Unstructured};
use framelock::{
    BufferedReceiver, Classification, Counters, DiscardReason, Format, Found, Line, LineEvent,
};
use framelock_proofs::reference::framed;

use crate::outcome::{Counted, Occurred, add, as_counter};
use crate::stream::{Stream, StreamStep, bytes_of};

/// A random format, and a stream.
#[derive(Debug)]
pub struct AnyFormat {
    /// The seed of the format's classifications.
    pub seed: u32,
    /// A draw about fewer than `LONGEST` bytes gives `Incomplete` with the probability `(patience % 16 + 1) / 16`.
    /// `patience / 16 % 4` chooses the length of the longest frame and the size of the buffer.
    pub patience: u8,
    /// The stream.
    pub stream: Stream,
}

impl<'a> Arbitrary<'a> for AnyFormat {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self {
            seed: u.arbitrary()?,
            patience: u.arbitrary()?,
            stream: u.arbitrary()?,
        })
    }
}

/// For a lawful format, checks that the receiver reports the same as the naive reference, both with pushed bytes and
/// with fed slices. For an unlawful format, checks that every byte is still counted once.
///
/// Counts the outcomes, and the states of the receiver in which slices and line events reach it.
///
/// # Panics
/// Panics if the input shows a bug.
pub fn framing(input: &AnyFormat, occurred: &mut Occurred) {
    match input.patience / 16 % 4 {
        0 => of_length::<9, 16>(input, occurred),
        1 => of_length::<5, 5>(input, occurred),
        2 => of_length::<2, 3>(input, occurred),
        _ => of_length::<1, 1>(input, occurred),
    }
}

fn of_length<const LONGEST: usize, const N: usize>(input: &AnyFormat, occurred: &mut Occurred) {
    let format = |is_lawful| Drawn::<LONGEST> {
        seed: input.seed,
        patience: input.patience % 16,
        is_lawful,
    };
    accounted_for::<LONGEST, N>(|| format(false), &input.stream);
    let by_rules = format(true);
    as_the_reference(
        || by_rules,
        N,
        &by_rules,
        &input.stream,
        || QUESTIONS.take(),
        occurred,
    );
}

/// The findings in order. Consecutive bytes discarded for the same reason are one finding.
#[derive(Default)]
struct Findings {
    all: Vec<Found<usize>>,
    /// The number of bytes in all findings.
    bytes: usize,
}

impl Findings {
    /// Adds a finding of the receiver. The message of a frame is the frame's bytes, which must be the next bytes of
    /// `stream`.
    fn receive(&mut self, stream: &[u8], found: Found<&[u8]>) {
        let place = self.bytes;
        let end = place + found.bytes();
        self.bytes = end;
        let found = found.map(|frame| {
            assert_eq!(frame, &stream[place..end], "at {place} of {stream:02X?}");
            place
        });
        add(&mut self.all, found);
    }
}

fn reference<F: Format>(
    format: &F,
    bytes: &[u8],
    end: Option<LineEvent>,
) -> (Vec<Found<usize>>, usize) {
    let mut all = Vec::new();
    let pending = framed(format, bytes, end, |found| add(&mut all, found));
    (all, pending)
}

/// Checks that receivers of the format, with a buffer of this size, find and count the same as the reference with the
/// format `naive`. One receiver gets the slices of the stream by `feed`, another gets every byte by `push`, and a third
/// gets the slices in several ways. `questions` returns how often the receivers have called `classify_after` since the
/// last call of `questions`. Counts the outcomes, and the states in which slices and line events reach the third
/// receiver. Returns the counters.
pub(crate) fn as_the_reference<F>(
    format: impl Fn() -> F,
    buffer: usize,
    naive: &impl Format,
    Stream(steps): &Stream,
    questions: impl Fn() -> usize,
    occurred: &mut Occurred,
) -> Counters
where
    F: for<'a> Format<Message<'a> = &'a [u8]> + 'static,
{
    let longest = format().longest();
    let receiver = || {
        let receiver = BufferedReceiver::with_buffer(format(), vec![0; buffer]);
        receiver.expect("the buffer holds the longest frame")
    };
    let (mut fed, mut pushed) = (receiver(), Line::new(receiver()));
    let mut line = Line::new(receiver());
    let mut counted = Counted::default();
    let mut reached = [0_u32; STATES.len()];
    for stretch in steps.split_inclusive(|step| matches!(step, StreamStep::Event(_))) {
        let bytes = bytes_of(stretch);
        let (expected, pending) = reference(naive, &bytes, None);

        let mut findings = Findings::default();
        for step in stretch {
            let StreamStep::Slice(slice) = step else {
                continue;
            };
            // `fed` has decided all bytes that can be decided. `line` may have left some of these bytes undecided.
            let states = [fed.pending() > 0, line.pending() > fed.pending()];
            let way = take(&mut line, slice);
            for (state, is_reached) in states.into_iter().enumerate() {
                reached[2 * way + state] += u32::from(is_reached && !slice.is_empty());
            }
            fed.feed(slice, |found| {
                findings.receive(&bytes, found.map(|frame| frame.message()));
            });
        }
        assert_eq!(
            (&findings.all, fed.pending()),
            (&expected, pending),
            "fed: {steps:02X?}"
        );

        let ends = ends(&expected);
        let (mut frames, late) = push(&mut pushed, &bytes, &ends, &questions);
        reached[6] += late;
        // Do not poll before a line event, so that some line events come while bytes are undecided.
        if !matches!(stretch.last(), Some(StreamStep::Event(_))) {
            frames.extend(polled(&mut pushed));
            assert_eq!(pushed.pending(), pending, "pushed: {steps:02X?}");
        }

        let is_undecided = line.pending() > pending;
        let is_in_steps = bytes.len() % 2 == 1;
        if is_in_steps {
            reached[7] += u32::from(is_undecided);
            while line.poll_step(|_| ()) {}
        }
        let mut all = expected;
        if let Some(StreamStep::Event(event)) = stretch.last() {
            all = reference(naive, &bytes, Some(*event)).0;
            fed.line_event(*event, |found| {
                findings.receive(&bytes, found.map(|frame| frame.message()));
            });
            let has_ended = (0..longest).any(|_| {
                !pushed.line_event_step(*event, |found| {
                    frames.extend(found.message().map(|frame| frame.message().to_vec()));
                })
            });
            assert!(has_ended, "too many steps: {steps:02X?}");
            reached[9] += as_counter(self::ends(&all).len() - ends.len());
            if is_in_steps {
                while line.line_event_step(*event, |_| ()) {}
            } else {
                reached[8] += u32::from(is_undecided);
                line.line_event(*event, |_| ());
            }
            counted.line_event(*event);
            assert_eq!((fed.pending(), pushed.pending(), line.pending()), (0, 0, 0));
            assert_eq!(findings.all, all, "line event: {steps:02X?}");
        } else {
            line.feed(&[], |_| ());
        }
        let is_frame = |found: &&Found<usize>| matches!(found, Found::Frame { .. });
        let expected = all.iter().filter(is_frame).map(|found| match *found {
            Found::Frame {
                length, message, ..
            } => &bytes[message..message + length],
            Found::Discarded { .. } => &[],
        });
        assert!(frames.iter().eq(expected), "pushed: {steps:02X?}");
        counted.add(bytes.len(), &all);
        let counters = line.counters();
        assert_eq!(counters, &counted.counters, "{steps:02X?}");
        assert_eq!(pushed.counters(), counters, "pushed: {steps:02X?}");
        let places = counters.frame_bytes + counters.discarded.total() + as_counter(line.pending());
        assert_eq!(
            counters.bytes, places,
            "every byte is counted once: {steps:02X?}"
        );
        if !matches!(stretch.last(), Some(StreamStep::Event(_))) {
            break;
        }
    }
    for (name, times) in STATES.into_iter().zip(reached) {
        occurred.count(name, times);
    }
    occurred.count_all(&counted.counters);
    counted.counters
}

/// The states of the receiver when slices and line events reach it, and frames that come late. Undecided bytes are
/// pending bytes that a `poll` would deliver or discard.
const STATES: [&str; 10] = [
    "pushed while bytes are pending",
    "pushed while bytes are undecided",
    "pulled while bytes are pending",
    "pulled while bytes are undecided",
    "fed while bytes are pending",
    "fed while bytes are undecided",
    "a pushed frame comes late",
    "polled in steps while bytes are undecided",
    "a line event while bytes are undecided",
    "a line event ends a frame",
];

/// Pushes bytes that no line event interrupts. `ends` has the index after each frame's last byte. A frame may come
/// late, but at most by the number of bytes by which it is shorter than the longest frame. Checks this bound, and that
/// each byte causes at most one classification. Returns the frames, and how many of them come late.
fn push<F>(
    line: &mut Line<BufferedReceiver<F, Vec<u8>>>,
    bytes: &[u8],
    ends: &[usize],
    questions: impl Fn() -> usize,
) -> (Vec<Vec<u8>>, u32)
where
    F: for<'a> Format<Message<'a> = &'a [u8]> + 'static,
{
    let longest = line.parser().format().longest();
    let (mut frames, mut late) = (Vec::new(), 0);
    questions();
    for (place, &byte) in bytes.iter().enumerate() {
        if let Some(frame) = line.push(byte) {
            frames.push(frame.message().to_vec());
            let behind = place + 1 - ends[frames.len() - 1];
            assert!(
                behind <= longest - frame.bytes().len(),
                "{behind} late: {bytes:02X?}"
            );
            late += u32::from(behind > 0);
        }
        assert!(
            questions() <= 1,
            "at most one classification per byte: {bytes:02X?}"
        );
        assert!(line.pending() < longest, "{bytes:02X?}");
    }
    (frames, late)
}

/// Polls the line, and returns the frames. Asserts that polling in steps finds the same frames.
fn polled<F>(line: &mut Line<BufferedReceiver<F, Vec<u8>>>) -> Vec<Vec<u8>>
where
    F: for<'a> Format<Message<'a> = &'a [u8]> + 'static,
{
    let (mut stepped, mut found_by_steps, mut frames) = (line.clone(), Vec::new(), Vec::new());
    while stepped.poll_step(|found| {
        found_by_steps.extend(found.message().map(|frame| frame.message().to_vec()));
    }) {}
    while let Some(frame) = line.poll() {
        frames.push(frame.message().to_vec());
    }
    assert_eq!(found_by_steps, frames, "poll in steps");
    frames
}

/// Gives a slice to the line in one of three ways. The slice's first byte chooses the way. Returns the way's number.
/// Only pushing may leave bytes undecided.
fn take<F: Format + 'static>(line: &mut Line<BufferedReceiver<F, Vec<u8>>>, slice: &[u8]) -> usize {
    let way = usize::from(slice.first().map_or(2, |first| first % 3));
    match way {
        0 => {
            for &byte in slice {
                let _ = line.push(byte);
            }
            while slice.len().is_multiple_of(3) && line.poll().is_some() {}
        }
        1 => {
            let mut rest = slice;
            while line.next(&mut rest).is_some() {}
        }
        _ => line.feed(slice, |_| ()),
    }
    way
}

/// A format whose messages are the frames themselves.
#[derive(Clone, Copy)]
pub(crate) struct Frames<F>(pub(crate) F);

impl<F: Format> Format for Frames<F> {
    const LONGEST: usize = F::LONGEST;
    type Message<'a> = &'a [u8];

    fn longest(&self) -> usize {
        self.0.longest()
    }

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.0.classify(bytes)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.0.classify_after(bytes, seen)
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        self.0.classify_before(bytes, event)
    }

    fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte)
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        let _ = self.0.decode(frame);
        frame
    }
}

/// Returns the index after each frame's last byte.
fn ends(findings: &[Found<usize>]) -> Vec<usize> {
    let end = |found: &Found<usize>| match *found {
        Found::Frame {
            length, message, ..
        } => Some(message + length),
        Found::Discarded { .. } => None,
    };
    findings.iter().filter_map(end).collect()
}

/// For any format, checks that the findings followed by the pending bytes are the stream, and that each pushed byte
/// causes at most one classification.
fn accounted_for<const LONGEST: usize, const N: usize>(
    format: impl Fn() -> Drawn<LONGEST>,
    Stream(steps): &Stream,
) {
    let bytes = bytes_of(steps);
    let mut fed = BufferedReceiver::<_, [u8; N]>::new(format());
    let mut findings = Findings::default();
    let mut pushed = Line::new(BufferedReceiver::<_, [u8; N]>::new(format()));
    let mut taken = 0;
    for step in steps {
        match step {
            StreamStep::Slice(slice) => {
                fed.feed(slice, |found| {
                    findings.receive(&bytes, found.map(|frame| frame.message()));
                });
                QUESTIONS.take();
                for &byte in slice {
                    pushed.push(byte);
                    assert!(QUESTIONS.take() <= 1, "{steps:02X?}");
                    assert!(pushed.pending() < LONGEST, "{steps:02X?}");
                }
            }
            StreamStep::Event(event) => {
                fed.line_event(*event, |found| {
                    findings.receive(&bytes, found.map(|frame| frame.message()));
                });
                pushed.line_event(*event, |_| ());
            }
        }
        taken += step.bytes().len();
        assert!(fed.pending() < LONGEST, "{steps:02X?}");
        assert_eq!(findings.bytes + fed.pending(), taken, "{steps:02X?}");
        let counters = pushed.counters();
        let placed =
            counters.frame_bytes + counters.discarded.total() + as_counter(pushed.pending());
        let taken = as_counter(taken);
        assert_eq!((placed, counters.bytes), (taken, taken), "{steps:02X?}");
    }
}

std::thread_local! {
    /// The number of calls of `classify_after` of [`Drawn`] formats since the number was last read.
    static QUESTIONS: Cell<usize> = const { Cell::new(0) };
}

/// A format whose classification of bytes is random, but always the same for the same bytes.
#[derive(Clone, Copy)]
struct Drawn<const LONGEST: usize> {
    seed: u32,
    patience: u8,
    /// Whether the format keeps the laws. If not, its classifications are arbitrary.
    is_lawful: bool,
}

impl<const LONGEST: usize> Drawn<LONGEST> {
    fn draw(self, bytes: &[u8]) -> Classification {
        // An FNV-1a hash, followed by another multiplication. The upper half of the product is used because it is the
        // most random.
        let start = 0xCBF2_9CE4_8422_2325 ^ u64::from(self.seed);
        let hash = bytes.iter().fold(start, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3)
        });
        let [.., luck, why, number, wide] = hash.wrapping_mul(0x9E37_79B9_7F4A_7C15).to_le_bytes();
        let number = usize::from(number);
        let within = |most: usize| 1 + number % most.max(1);
        match (luck % 16 <= self.patience, self.is_lawful) {
            (true, true) if bytes.len() < LONGEST => Classification::Incomplete {
                at_least: bytes.len() + within(LONGEST - bytes.len()),
            },
            (true, false) => Classification::Incomplete {
                at_least: if wide < 9 {
                    usize::MAX
                } else {
                    number % (2 * LONGEST)
                },
            },
            (_, true) if why % 2 == 0 => Classification::Frame(within(bytes.len())),
            (_, false) if why % 2 == 0 => Classification::Frame(if wide < 9 {
                usize::MAX
            } else {
                number % (2 * LONGEST)
            }),
            _ => Classification::Rejected(match why / 2 % 7 {
                0 => DiscardReason::NoSync,
                1 => DiscardReason::BrokenSync,
                2 => DiscardReason::BadHeader,
                3 => DiscardReason::WrongTerminator,
                4 => DiscardReason::ChecksumMismatch,
                5 => DiscardReason::TooLong,
                _ => DiscardReason::UnknownMessage,
            }),
        }
    }
}

impl<const LONGEST: usize> Format for Drawn<LONGEST> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = &'a [u8];

    /// Classifies the bytes. A lawful format draws a classification for the first byte. If the result asks for more
    /// bytes and they are there, the format draws again for that many bytes, and so on. An unlawful format draws once,
    /// for all bytes.
    fn classify(&self, bytes: &[u8]) -> Classification {
        let mut known = if self.is_lawful { 1 } else { bytes.len() };
        loop {
            match self.draw(&bytes[..known]) {
                Classification::Incomplete { at_least }
                    if self.is_lawful && at_least <= bytes.len() =>
                {
                    known = at_least;
                }
                classification => return classification,
            }
        }
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        QUESTIONS.set(QUESTIONS.get() + 1);
        assert!((1..=LONGEST).contains(&bytes.len()));
        if self.is_lawful && seen > 0 {
            let before = self.classify(&bytes[..seen]);
            assert!(seen < bytes.len() && matches!(before, Classification::Incomplete { .. }));
        }
        self.classify(bytes)
    }

    /// Draws a frame or a rejection, or any classification if the format does not keep the laws.
    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        let classification = self.classify(bytes);
        assert!(!self.is_lawful || matches!(classification, Classification::Incomplete { .. }));
        let other = Self {
            seed: !self.seed ^ u32::from(event == LineEvent::Idle),
            ..*self
        };
        match other.draw(bytes) {
            Classification::Incomplete { .. } if self.is_lawful => {
                Classification::Rejected(DiscardReason::LineEvent)
            }
            classification => classification,
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}
