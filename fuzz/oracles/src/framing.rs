//! Target `framing`: formats of any length, lawful and lawless, and a stream of any bytes.

use std::cell::Cell;

use arbitrary::{Arbitrary, Unstructured};
use framelock::{BufferedReceiver, Classification, DiscardReason, Format, Found, Line};
use framelock_proofs::reference::framed;

use crate::outcome::{Counted, add, as_counter};
use crate::stream::{Stream, StreamStep, bytes_of};

/// A format that nobody would think of, and a stream.
#[derive(Debug)]
pub struct AnyFormat {
    seed: u32,
    /// Of 16 beginnings so many go on.
    patience: u8,
    stream: Stream,
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

/// The receiver finds what the naive reference does in streams of any lawful format, pushed and fed;
/// with a lawless one no byte is lost from the accounts.
///
/// # Panics
/// If the input shows a bug.
pub fn framing(input: &AnyFormat) {
    lengths::<1, 1>(input);
    lengths::<2, 3>(input);
    lengths::<5, 5>(input);
    lengths::<9, 16>(input);
}

fn lengths<const LONGEST: usize, const N: usize>(input: &AnyFormat) {
    let format = |is_lawful| Drawn::<LONGEST> {
        seed: input.seed,
        patience: input.patience % 16,
        is_lawful,
    };
    as_the_reference::<_, N>(|| format(true), &input.stream, || QUESTIONS.take());
    accounted_for::<LONGEST, N>(|| format(false), &input.stream);
}

/// What is found, bytes that are discarded one behind the other for the same reason at once.
#[derive(Default)]
struct Findings(Vec<Found<usize>>);

impl Findings {
    /// Of what the receiver finds: its message is the frame, which must be the next of `stream`.
    fn receive(&mut self, stream: &[u8], found: Found<&[u8]>) {
        let place = self.bytes();
        let end = place + found.bytes();
        let found = found.map(|frame| {
            assert_eq!(frame, &stream[place..end], "at {place} of {stream:02X?}");
            place
        });
        add(&mut self.0, found);
    }

    fn bytes(&self) -> usize {
        self.0.iter().map(Found::bytes).sum()
    }
}

fn reference<F: Format>(format: &F, bytes: &[u8], is_over: bool) -> (Vec<Found<usize>>, usize) {
    let mut findings = Findings::default();
    let pending = framed(format, bytes, is_over, |found| add(&mut findings.0, found));
    (findings.0, pending)
}

/// A receiver of the format, fed with the stream as it is cut and pushed byte by byte, finds what
/// the reference does, and counts it. `questions` gives how often the format was asked about more than
/// whether a byte starts a frame, since the last call.
pub(crate) fn as_the_reference<F, const N: usize>(
    format: impl Fn() -> F,
    Stream(steps): &Stream,
    questions: impl Fn() -> usize,
) where
    F: for<'a> Format<Message<'a> = &'a [u8]> + 'static,
{
    let mut fed = BufferedReceiver::<_, [u8; N]>::new(format());
    let mut pushed = BufferedReceiver::<_, [u8; N]>::new(format());
    let mut line = Line::new(BufferedReceiver::<_, [u8; N]>::new(format()));
    let mut counted = Counted::default();
    for stretch in steps.split_inclusive(|step| matches!(step, StreamStep::Event(_))) {
        let bytes = bytes_of(stretch);
        let (expected, pending) = reference(&format(), &bytes, false);

        let mut findings = Findings::default();
        for slice in stretch.iter().map(StreamStep::bytes) {
            fed.feed(slice, |found| {
                findings.receive(&bytes, found.map(|frame| frame.message()));
            });
        }
        assert_eq!(
            (&findings.0, fed.pending()),
            (&expected, pending),
            "fed: {steps:02X?}"
        );

        let mut frames = Vec::new();
        let ends = ends(&expected);
        questions();
        for (place, &byte) in bytes.iter().enumerate() {
            if let Some(frame) = pushed.push(byte) {
                frames.push(frame.message().to_vec());
                let late = place + 1 - ends[frames.len() - 1];
                assert!(
                    late <= F::LONGEST - frame.bytes().len(),
                    "{late} late: {steps:02X?}"
                );
            }
            assert!(questions() <= 1, "one question a byte: {steps:02X?}");
            assert!(pushed.pending() < F::LONGEST, "{steps:02X?}");
        }
        while let Some(frame) = pushed.poll() {
            frames.push(frame.message().to_vec());
        }
        assert_eq!(pushed.pending(), pending, "pushed: {steps:02X?}");

        for slice in stretch.iter().map(StreamStep::bytes) {
            match slice {
                &[byte] => {
                    let _ = line.push(byte);
                    // Between the slices what is left may be polled, or not.
                    while byte % 2 == 1 && line.poll().is_some() {}
                }
                [first, ..] if first % 2 == 1 => {
                    let mut rest = slice;
                    while line.next(&mut rest).is_some() {}
                }
                slice => line.feed(slice, |_| ()),
            }
        }
        line.feed(&[], |_| ());
        let mut all = expected;
        if let Some(StreamStep::Event(event)) = stretch.last() {
            all = reference(&format(), &bytes, true).0;
            fed.line_event(*event, |found| {
                findings.receive(&bytes, found.map(|frame| frame.message()));
            });
            pushed.line_event(*event, |found| {
                frames.extend(found.message().map(|frame| frame.message().to_vec()));
            });
            line.line_event(*event, |_| ());
            counted.line_event(*event);
            assert_eq!((fed.pending(), pushed.pending(), line.pending()), (0, 0, 0));
            assert_eq!(findings.0, all, "line event: {steps:02X?}");
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
        let places = counters.frame_bytes + counters.discarded.total() + as_counter(line.pending());
        assert_eq!(
            counters.bytes, places,
            "every byte has one place: {steps:02X?}"
        );
        if !matches!(stretch.last(), Some(StreamStep::Event(_))) {
            return;
        }
    }
}

/// A format whose messages are the frames themselves.
#[derive(Clone, Copy)]
pub(crate) struct Frames<F>(pub(crate) F);

impl<F: Format> Format for Frames<F> {
    const LONGEST: usize = F::LONGEST;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.0.classify(bytes)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.0.classify_after(bytes, seen)
    }

    fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte)
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        let _ = self.0.decode(frame);
        frame
    }
}

/// The places behind the frames.
fn ends(findings: &[Found<usize>]) -> Vec<usize> {
    let end = |found: &Found<usize>| match *found {
        Found::Frame {
            length, message, ..
        } => Some(message + length),
        Found::Discarded { .. } => None,
    };
    findings.iter().filter_map(end).collect()
}

/// Whatever the format says: each byte is in one finding or pending, in order, and one question a byte.
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
        assert_eq!(findings.bytes() + fed.pending(), taken, "{steps:02X?}");
        let counters = pushed.counters();
        let placed =
            counters.frame_bytes + counters.discarded.total() + as_counter(pushed.pending());
        let taken = as_counter(taken);
        assert_eq!((placed, counters.bytes), (taken, taken), "{steps:02X?}");
    }
}

std::thread_local! {
    /// How often a [`Drawn`] format was asked about more than a start.
    static QUESTIONS: Cell<usize> = const { Cell::new(0) };
}

/// A format whose classification of some bytes is drawn by lot, the same for the same bytes.
#[derive(Clone, Copy)]
struct Drawn<const LONGEST: usize> {
    seed: u32,
    patience: u8,
    /// If not, it says anything.
    is_lawful: bool,
}

impl<const LONGEST: usize> Drawn<LONGEST> {
    fn draw(self, bytes: &[u8]) -> Classification {
        // FNV-1a, and its upper half, which is mixed best.
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

    /// Lawful: what is drawn for the first byte; if that is incomplete, for as many as it takes.
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

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}
