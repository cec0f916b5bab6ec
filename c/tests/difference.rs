//! Tests that a generated C receiver and the Rust receiver deliver the same frames on the same faulty streams. After
//! each step, both receivers must have the same counters and the same number of pending bytes.

use std::fs;
use std::path::Path;
use std::slice;

use framelock::motion::Bin;
use framelock::{BufferedReceiver, Counters, Format, Line, LineEvents, PacketReceiver, Receiver};
use framelock_description::{Description, Layouts, SHIPPED};
use framelock_description_oracles as drawn;
use framelock_formats::layout::Length;
use framelock_generate::{CrcTable, c};
use framelock_oracles::{EVENTS, faulty};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compilers::{CLANG, CLANGXX, Compiler, GCC, Program};
use crate::descriptions::{forms, other};
use crate::generated::sometimes_faulty;

/// The C names of the Rust receiver's reasons, in the order of [`Reference::counters`].
const REASONS: [&str; 9] = [
    "NO_SYNC",
    "BROKEN_SYNC",
    "BAD_HEADER",
    "TOO_LONG",
    "UNKNOWN_MESSAGE",
    "CHECKSUM_MISMATCH",
    "WRONG_TERMINATOR",
    "BROKEN_STUFFING",
    "LINE_EVENT",
];

/// The number of counters: see [`numbers`].
const COUNTERS: usize = 19;

/// A step of `difference.c`.
#[derive(Debug)]
enum Step {
    Push(u8),
    Event(u8),
    Poll,
}

impl Step {
    fn encode(&self) -> Vec<u8> {
        match self {
            Self::Push(byte) => vec![0, *byte],
            Self::Event(event) => vec![1, *event],
            Self::Poll => vec![2],
        }
    }
}

/// A description, its header, and a faulty stream.
pub(crate) struct Case {
    pub(crate) name: String,
    text: String,
    description: Description,
    header: String,
    steps: Vec<Step>,
}

impl Case {
    /// Returns a case with at least `bytes` received bytes.
    pub(crate) fn new(name: &str, text: &str, table: CrcTable, bytes: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(42);
        let description = Description::parse(name, text).unwrap();
        let name = name.replace('-', "_");
        Self {
            header: c(&description, &name, "framelock generate", table),
            steps: steps(&description, &mut random, bytes),
            name,
            text: text.to_owned(),
            description,
        }
    }

    pub(crate) fn is_window(&self) -> bool {
        self.header.contains("_LONGEST]; /* the pending bytes */")
    }

    pub(crate) fn are_packets(&self) -> bool {
        self.description.format().packets().is_some()
    }

    /// Returns whether only a line event ends a frame.
    pub(crate) fn needs_events(&self) -> bool {
        self.description.ending_event().is_some()
    }

    fn has_kinds(&self) -> bool {
        self.description.kinds.len() > 1
    }

    /// Returns whether the header has this reason to discard bytes.
    fn has_reason(&self, reason: &str) -> bool {
        let upper = self.name.to_uppercase();
        self.header.contains(&format!("    {upper}_{reason}, /*"))
    }

    /// Returns the files that programs include, with their names: the header, and `receiver.h`, which defines the
    /// header's names for `difference.c`.
    fn files(&self) -> [(String, String); 2] {
        let (name, upper) = (&self.name, self.name.to_uppercase());
        let reasons = REASONS.map(|reason| {
            if self.has_reason(reason) {
                format!("{upper}_{reason}")
            } else {
                "-1".to_owned()
            }
        });
        let text = format!(
            "#include \"{name}.h\"\n#define F(name) {name}_##name\n#define M(name) {upper}_##name\n\
             #define IS_WINDOW {}\n#define IS_PACKETS {}\n#define HAS_KINDS {}\n\
             static const int8_t REASONS[9] = {{ {} }};\n",
            u8::from(self.is_window()),
            u8::from(self.are_packets()),
            u8::from(self.has_kinds()),
            reasons.join(", "),
        );
        // Frames whose values are unreadable are compared, too.
        let read = format!("{name}_decode(frame, length, message);\n");
        let is_delivered = format!("(void){read}    return true;\n");
        let header = self
            .header
            .replace(&format!("return {read}"), &is_delivered);
        [
            (format!("{name}.h"), header),
            ("receiver.h".to_owned(), text),
        ]
    }

    pub(crate) fn write(&self, folder: &Path) {
        for (name, text) in self.files() {
            fs::write(folder.join(name), text).unwrap();
        }
    }

    /// Compiles a program that uses the receiver.
    pub(crate) fn program(&self, compiler: &Compiler, source: &str, option: &[&str]) -> Program {
        let files = self.files();
        let files = files.each_ref().map(|(name, text)| (&**name, &**text));
        compiler.program(source, &files, option)
    }

    /// Compares the digest after each step with that of the Rust receiver.
    fn check(&self, compiler: &Compiler) {
        let program = self.program(compiler, "difference.c", &[]);
        let found = program.run(&self.encoded_steps());
        let mut digests = found.lines();
        let mut reference = Reference::new(self);
        for (number, step) in self.steps.iter().enumerate() {
            reference.step(step);
            let digest = format!("{:08x}", reference.digest.0);
            if digests.next() != Some(&*digest) {
                let Self { name, text, .. } = self;
                let expected = reference.counters();
                panic!("{name}: step {number}, {step:?}: not {expected:?}\n{text}");
            }
        }
        assert_eq!(digests.next(), None);
        self.demand_that_all_happened(&reference);
    }

    /// Returns the counters and the digest after all steps.
    pub(crate) fn outcome(&self) -> ([u32; COUNTERS], u32) {
        let mut reference = Reference::new(self);
        self.steps.iter().for_each(|step| reference.step(step));
        self.demand_that_all_happened(&reference);
        (reference.counters(), reference.digest.0)
    }

    /// Returns the longest of several random frames.
    pub(crate) fn longest_frame(&self) -> Vec<u8> {
        let mut random = ChaCha8Rng::seed_from_u64(43);
        let frames = (0..10).flat_map(|_| drawn::frames(&self.description, &mut random));
        let sent = frames.filter_map(|frame| self.description.sent(&frame));
        sent.max_by_key(Vec::len).unwrap()
    }

    /// Returns all bytes that the steps push.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let pushed = self.steps.iter().filter_map(|step| match step {
            Step::Push(byte) => Some(*byte),
            _ => None,
        });
        pushed.collect()
    }

    pub(crate) fn encoded_steps(&self) -> Vec<u8> {
        self.steps.iter().flat_map(Step::encode).collect()
    }

    /// Asserts that frames and each kind of line event occur, and discarded bytes if the format can reject bytes.
    /// Without them, the comparison would prove nothing.
    fn demand_that_all_happened(&self, reference: &Reference) {
        let (name, counters) = (&self.name, reference.counters());
        let frames = counters[1];
        assert!(frames > 20, "{name}: {frames} frames\n{}", self.text);
        let is_shipped = SHIPPED.iter().any(|it| it.1 == self.text);
        let mut layouts = self.description.kinds.iter().map(|kind| kind.layout());
        let has_syncs = layouts.all(|layout| layout.sync.length > 0);
        let has_long_runs = has_long_runs(&self.description, counters[0] as usize);
        for (reason, count) in REASONS.iter().zip(&counters[4..13]) {
            let has_reason = self.has_reason(reason);
            assert!(
                *count == 0 || has_reason,
                "{name}: the header has no {reason}"
            );
            // If frames have no sync, any byte may begin a frame.
            let is_certain = match *reason {
                "NO_SYNC" => has_syncs,
                "TOO_LONG" | "WRONG_TERMINATOR" => has_long_runs,
                _ => true,
            };
            let must_happen = is_shipped && has_reason && is_certain;
            assert!(
                *count > 0 || !must_happen,
                "{name}: {reason} did not happen"
            );
        }
        let discarded = counters[4..12].iter().sum::<u32>();
        assert!(
            discarded > 0 || !reference.can_fail,
            "{name}: nothing discarded"
        );
        let has_each = counters[13..18].iter().all(|count| *count > 0);
        assert!(has_each, "{name}: a line event did not happen");
    }
}

/// The digest of `difference.c`.
struct Digest(u32);

impl Digest {
    fn mix(&mut self, value: u32) {
        self.0 = (self.0 ^ value).wrapping_mul(16_777_619);
        self.0 ^= self.0 >> 15;
    }

    /// Mixes a frame and the number of its kind.
    fn mix_frame(&mut self, (kind, frame): (usize, &[u8]), has_kinds: bool) {
        self.mix(u32::try_from(frame.len()).unwrap());
        for byte in frame {
            self.mix((*byte).into());
        }
        if has_kinds {
            self.mix(u32::try_from(kind).unwrap());
        }
    }
}

/// The Rust receiver of a description.
enum Machine {
    Buffered(Line<BufferedReceiver<Layouts, Vec<u8>>>),
    Packets(Line<PacketReceiver<Layouts, Vec<u8>>>),
}

/// Evaluates an expression with the line of either machine.
macro_rules! with_line {
    ($machine:expr, $line:ident => $does:expr) => {
        match $machine {
            Machine::Buffered($line) => $does,
            Machine::Packets($line) => $does,
        }
    };
}

/// The Rust receiver, which performs the same steps as `difference.c`.
struct Reference {
    line: Machine,
    digest: Digest,
    is_window: bool,
    has_kinds: bool,
    can_fail: bool,
    /// Rust's receiver with a window, for BIN only. It takes the same bytes as the buffered receiver.
    bin: Option<Line<Receiver<Bin>>>,
}

impl Reference {
    fn new(case: &Case) -> Self {
        let format = case.description.format().clone();
        let buffer = vec![0; 2 * format.longest()];
        let line = if case.are_packets() {
            Machine::Packets(Line::new(
                PacketReceiver::with_buffer(format, buffer).unwrap(),
            ))
        } else {
            Machine::Buffered(Line::new(
                BufferedReceiver::with_buffer(format, buffer).unwrap(),
            ))
        };
        let mut layouts = case.description.kinds.iter().map(|kind| kind.layout());
        Self {
            line,
            digest: Digest(2_166_136_261),
            is_window: case.is_window(),
            has_kinds: case.has_kinds(),
            // With neither a sync nor a checksum, each terminator ends a frame, so no byte is rejected.
            can_fail: layouts.any(|it| it.sync.length > 0 || it.checksum.is_some()),
            bin: (case.name == "bin").then(|| Line::new(Receiver::new())),
        }
    }

    fn step(&mut self, step: &Step) {
        match *step {
            Step::Push(byte) => {
                with_line!(&mut self.line, line => if let Some(frame) = line.push(byte) {
                    self.digest.mix_frame(frame.message(), self.has_kinds);
                });
                // A C receiver with a window leaves nothing undecided. The Rust receiver has a buffer, so poll it.
                if self.is_window {
                    self.poll();
                }
            }
            Step::Event(event) => {
                with_line!(&mut self.line, line => line.line_event(EVENTS[usize::from(event)], |found| {
                    if let Some(frame) = found.message() {
                        self.digest.mix_frame(frame.message(), self.has_kinds);
                    }
                }));
            }
            Step::Poll => self.poll(),
        }
        let counters = self.counters();
        for counter in counters {
            self.digest.mix(counter);
        }
        if let Some(bin) = &mut self.bin {
            match *step {
                Step::Push(byte) => drop(bin.push(byte)),
                Step::Event(event) => bin.line_event(EVENTS[usize::from(event)], |_| ()),
                Step::Poll => {}
            }
            assert_eq!(counters, numbers(bin.counters(), bin.pending()));
        }
    }

    fn poll(&mut self) {
        with_line!(&mut self.line, line => while let Some(frame) = line.poll() {
            self.digest.mix_frame(frame.message(), self.has_kinds);
        });
    }

    fn counters(&self) -> [u32; COUNTERS] {
        with_line!(&self.line, line => numbers(line.counters(), line.pending()))
    }
}

/// Returns the counters of discarded bytes, in the order of [`REASONS`].
fn discarded(counters: &Counters) -> [u32; 9] {
    let all = &counters.discarded;
    [
        all.no_sync,
        all.broken_sync,
        all.bad_header,
        all.too_long,
        all.unknown_message,
        all.checksum_mismatch,
        all.wrong_terminator,
        all.broken_stuffing,
        all.line_event,
    ]
}

/// Returns the numbers that `difference.c` mixes into its digest after each step.
fn numbers(all: &Counters, pending: usize) -> [u32; COUNTERS] {
    let Counters {
        bytes,
        frames,
        frame_bytes,
        resynchronisations,
        events,
        ..
    } = all;
    let first = [*bytes, *frames, *frame_bytes, *resynchronisations];
    let LineEvents {
        framing,
        parity,
        overrun,
        line_break,
        idle,
        ..
    } = events;
    let last = [
        *framing,
        *parity,
        *overrun,
        *line_break,
        *idle,
        u32::try_from(pending).unwrap(),
    ];
    let numbers = [&first[..], &discarded(all), &last].concat();
    numbers.try_into().unwrap()
}

/// Returns whether a stream of this length contains frames that are about as long as possible.
fn has_long_runs(description: &Description, bytes: usize) -> bool {
    20 * description.format().longest() < bytes
}

/// Makes a frame about as long as possible, or a few bytes too long: repeats the byte in its middle. Returns `None`
/// unless a terminator, silence or a delimiter ends the frames.
fn long_run(description: &Description, frame: &[u8], random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let layout = description.kinds[description.number(frame)].layout();
    let has_any_length = [Length::Delimiter, Length::Silence].contains(&layout.length);
    let end = layout.terminator.length + layout.behind;
    let middle = layout.sync.length.max(frame.len().checked_sub(end)? / 2);
    let (first, last) = frame.split_at_checked(middle).filter(|_| has_any_length)?;
    let missing = (layout.longest + random.random_range(0..4)).checked_sub(frame.len())?;
    let byte = *first.last().or(last.first())?;
    let all = [first, &vec![byte; missing], last].concat();
    description.sent(&all)
}

/// Returns random steps with at least `bytes` bytes, which arrive on a faulty line. Some steps are line events and
/// polls. If an event ends frames, most frames are between two such events.
fn steps(description: &Description, random: &mut ChaCha8Rng, bytes: usize) -> Vec<Step> {
    let frames: Vec<Vec<u8>> = (0..30)
        .flat_map(|_| drawn::frames(description, random))
        .collect();
    let frames = frames
        .iter()
        .map(|frame| drawn::with_any_end(description, frame, random));
    let pool: Vec<Vec<u8>> = frames.collect();
    let (mut steps, mut count) = (Vec::new(), 0);
    // Each sort of event occurs even in a short stream.
    let mut events = (0..5).cycle();
    let ending = description.ending_event();
    let ending = EVENTS.iter().position(|event| Some(*event) == ending);
    let ending = ending.map(|event| u8::try_from(event).unwrap());
    while count < bytes {
        let frame = pool.choose(random).unwrap();
        let is_long = has_long_runs(description, bytes) && random.random_range(0..64) == 0;
        let long = is_long
            .then(|| long_run(description, frame, random))
            .flatten();
        let Some(sent) = long.or_else(|| description.sent(frame)) else {
            continue;
        };
        let mut piece = if ending.is_some() {
            sometimes_faulty(&sent, random)
        } else {
            faulty(slice::from_ref(&sent), random)
        };
        // Change a byte of the header.
        if random.random_range(0..8) == 0 {
            let at = random.random_range(0..piece.len().min(10));
            piece[at] = random.random();
        }
        count += piece.len();
        // A program may poll rarely, or never.
        let polls = [0.0, 0.0, 0.02, 0.3][random.random_range(0..4)];
        steps.extend(
            ending
                .filter(|_| random.random_range(0..8) > 0)
                .map(Step::Event),
        );
        // An event may come at any place, often directly before or after the first byte.
        let cut = [0, 1, random.random_range(0..=piece.len())][random.random_range(0..3)];
        let cut = (random.random_range(0..8) == 0).then_some(cut);
        for (at, byte) in piece.into_iter().enumerate() {
            if cut == Some(at) {
                steps.push(Step::Event(events.next().unwrap()));
            }
            steps.push(Step::Push(byte));
            if random.random_bool(polls) {
                steps.push(Step::Poll);
            }
        }
        steps.extend(
            ending
                .filter(|_| random.random_range(0..8) > 0)
                .map(Step::Event),
        );
        if random.random_range(0..4) == 0 {
            steps.push(Step::Event(events.next().unwrap()));
        }
    }
    steps
}

/// Returns cases with random descriptions that do not contradict themselves.
pub(crate) fn random_cases(count: usize, bytes: usize) -> impl Iterator<Item = Case> {
    let texts = (0..).map(|seed| drawn::description(&mut ChaCha8Rng::seed_from_u64(seed)));
    let right = texts.filter(|text| Description::parse("drawn", text).is_ok());
    right.take(count).enumerate().map(move |(number, text)| {
        let table = if number % 3 == 0 {
            CrcTable::Bytes
        } else {
            CrcTable::Nibbles
        };
        Case::new(&format!("drawn{number}"), &text, table, bytes)
    })
}

/// The minimum number of received bytes in a stream. The tests that run at night have longer streams.
const BYTES: usize = 200_000;
const AT_NIGHT: usize = 5 * BYTES;

fn check(cases: &[(&str, &str)], table: CrcTable, compiler: &Compiler, bytes: usize) {
    for (name, text) in cases {
        Case::new(name, text, table, bytes).check(compiler);
    }
}

/// Checks random descriptions, and returns their texts.
fn check_random(count: usize, bytes: usize) -> String {
    let mut texts = String::new();
    for (number, case) in random_cases(count, bytes).enumerate() {
        case.check(if number % 2 == 0 { &GCC } else { &CLANG });
        texts += &case.text;
    }
    texts
}

/// Parts of descriptions. The long random test must draw a description with each of these parts.
const DRAWN: &[&str] = &[
    "packets = 'slip'",
    "packets = 'hdlc'",
    "packets = 'cobs'",
    "packets = 'dle'",
    "packets = 'break'",
    "packets = { escape",
    "ends = 'silence'",
    "behind = ",
    "initial = ",
    "carry-sum",
    "sum-words",
    "xor-words",
    "over = 'hex digits'",
];

#[test]
fn shipped_receivers_do_the_same_in_c_and_rust() {
    check(SHIPPED, CrcTable::Nibbles, &GCC, BYTES);
}

/// Only headers with a CRC depend on the table of the CRC. `no_compiler_warns_of_headers` compiles the other headers as
/// C++.
#[test]
fn receivers_with_byte_tables_do_the_same_in_cpp() {
    let mut count = 0;
    for (name, text) in SHIPPED {
        let case = Case::new(name, text, CrcTable::Bytes, BYTES);
        if case.header.contains("The CRC remainder of each byte.") {
            case.check(&CLANGXX);
            count += 1;
        }
    }
    assert!(count > 5, "{count} descriptions with a CRC");
}

#[test]
fn kinds_with_the_same_header_do_the_same() {
    let cases = ["shared", "late"].map(other);
    check(&cases, CrcTable::Nibbles, &GCC, BYTES);
}

#[test]
fn every_way_to_end_a_frame_is_the_same() {
    check(&forms(), CrcTable::Nibbles, &GCC, BYTES);
}

#[test]
fn random_receivers_do_the_same_in_c_and_rust() {
    check_random(8, BYTES);
}

#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_do_those_with_long_streams() {
    check(SHIPPED, CrcTable::Nibbles, &GCC, AT_NIGHT);
    check(&[other("shared")], CrcTable::Nibbles, &GCC, AT_NIGHT);
}

#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_do_those_of_many_random_descriptions() {
    let texts = check_random(200, AT_NIGHT);
    for form in DRAWN {
        assert!(texts.contains(form), "no description with {form}");
    }
}
