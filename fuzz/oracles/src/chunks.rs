//! Target `chunks`: a stream, how it is cut into slices, and resets and line events in between.

use arbitrary::{Arbitrary, Unstructured};
use framelock::{
    Accounting, Bin, BinCrc8, Counters, Discard, Discarded, Format, Lecture, LineEvent, Parser,
    Receiver, Setpoint, Sink,
};
use framelock_proofs::reference::{self, Policy};

use crate::expected::{Expected, counter};

/// What happens at the receiver, in order.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Step {
    /// These bytes are there at once.
    Slice(Vec<u8>),
    /// The parser is reset, and with it what is counted.
    Reset,
    Event(LineEvent),
}

const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

impl<'a> Arbitrary<'a> for Step {
    /// One byte says what it is, by its remainder of 8: 0 to 3: a slice of as many bytes as the
    /// next byte says, which follow. 4: as many frames as an eighth of that byte, all with the four
    /// bytes of payload that follow. 5: a slice of as many bytes as the next byte says, all the
    /// same as the one behind it. 6: a line event, the eighth says which. 7: a reset.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let what = u8::arbitrary(u)?;
        let number = usize::from(what >> 3);
        Ok(match what % 8 {
            0..=3 => {
                let length = usize::from(u8::arbitrary(u)?).min(u.len());
                Self::Slice(u.bytes(length)?.to_vec())
            }
            4 => {
                let [a, b, c, d]: [u8; 4] = u.arbitrary()?;
                Self::Slice([b'A', b'B', a, b, c, d, b'\r'].repeat(number))
            }
            5 => {
                let [length, byte]: [u8; 2] = u.arbitrary()?;
                Self::Slice(vec![byte; usize::from(length)])
            }
            6 => Self::Event(
                *EVENTS
                    .get(number % EVENTS.len())
                    .unwrap_or(&LineEvent::Idle),
            ),
            _ => Self::Reset,
        })
    }
}

/// The first byte of the input says which parser, the others are `Step`s. The frames, their
/// places, what was dropped and why, and the state are the same byte by byte and slice by slice,
/// and the reference's, however the stream is cut; nothing reaches across a reset or a line event;
/// every byte is accounted for; and a receiver made anew of the window that another shows is its equal.
///
/// # Panics
/// If one of these does not hold.
pub fn chunks(data: &[u8]) {
    let mut u = Unstructured::new(data);
    let which: u8 = u.arbitrary().unwrap_or_default();
    let mut steps = Vec::new();
    while !u.is_empty()
        && let Ok(step) = u.arbitrary()
    {
        steps.push(step);
    }
    match which % 5 {
        0 => check::<Receiver<Bin>, reference::Bin>(Policy::Rescan, &steps, remade),
        // All that this one is are its public fields.
        1 => check::<Lecture, reference::Bin>(Policy::Discard, &steps, |machine| machine),
        2 => check::<Receiver<Bin, Discard>, reference::Bin>(Policy::Discard, &steps, remade),
        3 => check::<Receiver<BinCrc8>, reference::BinCrc8>(Policy::Rescan, &steps, remade),
        _ => check::<_, reference::BinCrc8>(Policy::Discard, &steps, remade::<BinCrc8, Discard>),
    }
}

/// The receiver made anew of what it shows.
fn remade<F: Format, P: framelock::Policy>(receiver: Receiver<F, P>) -> Receiver<F, P> {
    let window = receiver.window();
    Receiver::holding(window.history(), window.count())
}

/// What was reported of the slices since the last interruption.
#[derive(Default)]
struct Reported {
    frames: Vec<(usize, Setpoint)>,
    dropped: Discarded,
}

/// Takes reports; `from` is where the slice begins.
struct Reporter<'a> {
    reported: &'a mut Reported,
    from: usize,
}

impl Sink<Setpoint> for Reporter<'_> {
    fn frame(&mut self, index: usize, setpoint: Setpoint) {
        self.reported.frames.push((self.from + index, setpoint));
    }

    fn dropped(&mut self, count: usize, why: framelock::Mismatch) {
        *counter(&mut self.reported.dropped, why) += count as u64;
    }
}

/// The same parser, driven in every way there is.
struct Ways<P> {
    pushed: P,
    fed: P,
    reporting: P,
    accounted: Accounting<P>,
    accounted_by_byte: Accounting<P>,
    /// Since the last interruption.
    stream: Vec<u8>,
    pushed_frames: Vec<(usize, Setpoint)>,
    fed_frames: Vec<(usize, Setpoint)>,
    reported: Reported,
    /// Since the last reset.
    expected: Counters,
    lost: bool,
}

fn check<P, F>(policy: Policy, steps: &[Step], remade: impl Fn(P) -> P)
where
    P: Parser<Message = Setpoint> + Copy + Default + PartialEq + std::fmt::Debug,
    F: reference::Format,
{
    let mut ways = Ways::<P>::new();
    for step in steps {
        assert_eq!(remade(ways.pushed), ways.pushed, "{steps:02X?}");
        match step {
            Step::Slice(slice) => ways.take(slice),
            Step::Event(event) => {
                ways.compare::<F>(policy, steps);
                ways.event(*event);
            }
            Step::Reset => {
                ways.compare::<F>(policy, steps);
                ways = Ways::resumed_by(ways, steps);
            }
        }
    }
    ways.compare::<F>(policy, steps);
}

impl<P> Ways<P>
where
    P: Parser<Message = Setpoint> + Copy + Default + PartialEq + std::fmt::Debug,
{
    fn new() -> Self {
        let parser = P::default();
        Self {
            pushed: parser,
            fed: parser,
            reporting: parser,
            accounted: Accounting::new(parser),
            accounted_by_byte: Accounting::new(parser),
            stream: Vec::new(),
            pushed_frames: Vec::new(),
            fed_frames: Vec::new(),
            reported: Reported::default(),
            expected: Counters::ZERO,
            lost: false,
        }
    }

    /// After a reset all is as at the beginning.
    fn resumed_by(mut before: Self, steps: &[Step]) -> Self {
        for parser in [&mut before.pushed, &mut before.fed, &mut before.reporting] {
            parser.reset();
            assert_eq!(*parser, P::default(), "{steps:02X?}");
        }
        Self {
            pushed: before.pushed,
            fed: before.fed,
            reporting: before.reporting,
            ..Self::new()
        }
    }

    fn take(&mut self, slice: &[u8]) {
        let from = self.stream.len();
        for (index, &byte) in slice.iter().enumerate() {
            let committed = self.pushed.push(byte);
            self.pushed_frames
                .extend(committed.map(|setpoint| (from + index, setpoint)));
            assert_eq!(self.accounted_by_byte.push(byte), committed);
        }
        let frames = &mut self.fed_frames;
        self.fed.feed(slice, &mut |index, setpoint| {
            frames.push((from + index, setpoint));
        });
        let reported = &mut self.reported;
        self.reporting.feed(slice, &mut Reporter { reported, from });
        self.accounted.feed(slice, |_, _| ());
        self.stream.extend(slice);
    }

    fn compare<F: reference::Format>(&mut self, policy: Policy, steps: &[Step]) {
        let Expected {
            frames,
            dropped,
            pending,
            resynchronisations,
            lost,
        } = Expected::after::<F>(self.lost, &self.stream, policy);
        assert_eq!(self.pushed_frames, frames, "pushed: {steps:02X?}");
        assert_eq!(self.fed_frames, frames, "fed: {steps:02X?}");
        assert_eq!(self.reported.frames, frames, "reported: {steps:02X?}");
        assert_eq!(self.reported.dropped, dropped, "reported: {steps:02X?}");
        assert_eq!(self.pushed.pending(), pending, "pushed: {steps:02X?}");
        for parser in [
            &self.fed,
            &self.reporting,
            self.accounted.parser(),
            self.accounted_by_byte.parser(),
        ] {
            assert_eq!(*parser, self.pushed, "{steps:02X?}");
        }

        self.lost = lost;
        let counters = &mut self.expected;
        counters.bytes += self.stream.len() as u64;
        counters.frames += frames.len() as u64;
        counters.resynchronisations += resynchronisations;
        counters.discarded.no_sync += dropped.no_sync;
        counters.discarded.broken_sync += dropped.broken_sync;
        counters.discarded.check += dropped.check;
        counters.discarded.terminator += dropped.terminator;
        let placed =
            P::FRAME_LENGTH as u64 * counters.frames + counters.discarded.total() + pending as u64;
        assert_eq!(placed, counters.bytes, "{steps:02X?}");
        for line in [&self.accounted, &self.accounted_by_byte] {
            assert_eq!(line.counters(), counters, "accounted: {steps:02X?}");
            assert_eq!(line.pending(), pending, "accounted: {steps:02X?}");
        }
    }

    /// Called behind [`compare`](Self::compare).
    fn event(&mut self, event: LineEvent) {
        let pending = self.pushed.pending();
        self.lost |= pending > 0;
        self.expected.discarded.line_event += pending as u64;
        let events = &mut self.expected.events;
        *match event {
            LineEvent::Framing => &mut events.framing,
            LineEvent::Parity => &mut events.parity,
            LineEvent::Overrun => &mut events.overrun,
            LineEvent::Break => &mut events.line_break,
            LineEvent::Idle => &mut events.idle,
        } += 1;
        self.accounted.line_event(event);
        self.accounted_by_byte.line_event(event);
        for parser in [&mut self.pushed, &mut self.fed, &mut self.reporting] {
            parser.reset();
        }
        self.stream.clear();
        self.pushed_frames.clear();
        self.fed_frames.clear();
        self.reported = Reported::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seeds are written in this layout.
    #[test]
    fn bytes_are_read_as_steps() {
        let mut u = Unstructured::new(b"\x00\x02AB\x14wxyz\x05\x03q\x26\x07\x03\xFFrest");
        let mut steps = Vec::<Step>::new();
        while !u.is_empty() {
            steps.push(u.arbitrary().expect("enough"));
        }
        assert_eq!(
            steps,
            [
                Step::Slice(b"AB".to_vec()),
                Step::Slice(b"ABwxyz\rABwxyz\r".to_vec()),
                Step::Slice(b"qqq".to_vec()),
                Step::Event(LineEvent::Idle),
                Step::Reset,
                Step::Slice(b"rest".to_vec()),
            ]
        );
    }
}
