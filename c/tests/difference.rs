//! Tests that a generated C receiver and the Rust receiver deliver the same frames on the same faulty streams. After
//! each step, both receivers must have the same counters and the same pending bytes.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use framelock::motion::Bin;
use framelock::{BufferedReceiver, Counters, Format, Line, LineEvent, Receiver};
use framelock_description::{Description, Layouts, SHIPPED};
use framelock_description_oracles as drawn;
use framelock_generate::{CrcTable, c};
use framelock_oracles::broken;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compilers::{CLANG, CLANGXX, Compiler, GCC, beside, succeeds};

const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

/// The C names of the Rust receiver's reasons, in the order of [`Reference::counters`].
const REASONS: [&str; 8] = [
    "NO_SYNC",
    "BROKEN_SYNC",
    "BAD_HEADER",
    "TOO_LONG",
    "UNKNOWN_MESSAGE",
    "CHECKSUM_MISMATCH",
    "WRONG_TERMINATOR",
    "LINE_EVENT",
];

/// A description, its header, and a faulty stream.
pub(crate) struct Case {
    name: String,
    text: String,
    description: Description,
    header: String,
    steps: Vec<u8>,
}

impl Case {
    /// Returns a case with at least `bytes` received bytes.
    pub(crate) fn new(name: &str, text: &str, table: CrcTable, bytes: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(42);
        let description = Description::parse(name, text).unwrap();
        let name = name.replace('-', "_");
        let header = c(&description, &name, "framelock generate", table);
        let steps = steps(&description, &mut random, bytes);
        Self {
            name,
            text: text.to_owned(),
            description,
            header,
            steps,
        }
    }

    pub(crate) fn is_window(&self) -> bool {
        self.header.contains("_LONGEST]; /* the pending bytes */")
    }

    fn has_kinds(&self) -> bool {
        self.description.kinds.len() > 1
    }

    /// Writes the header, and the file `receiver.h`, which defines the header's names for `difference.c`.
    pub(crate) fn write(&self, folder: &Path) {
        let (name, upper) = (&self.name, self.name.to_uppercase());
        fs::write(folder.join(format!("{name}.h")), &self.header).unwrap();
        let reasons = REASONS.map(|reason| {
            let constant = format!("{upper}_{reason}");
            let is_there = self.header.contains(&format!("    {constant}, /*"));
            if is_there { constant } else { "-1".to_owned() }
        });
        let text = format!(
            "#include \"{name}.h\"\n#define F(name) {name}_##name\n#define M(name) {upper}_##name\n\
             #define IS_WINDOW {}\n#define HAS_KINDS {}\n\
             static const int8_t REASONS[8] = {{ {} }};\n",
            u8::from(self.is_window()),
            u8::from(self.has_kinds()),
            reasons.join(", "),
        );
        fs::write(folder.join("receiver.h"), text).unwrap();
    }

    /// Compiles the program with this compiler, and compares its output with the Rust receiver.
    fn check(&self, compiler: &Compiler) {
        let folder = TempDir::new().unwrap();
        self.write(folder.path());
        let program = folder.path().join("program");
        compiler.compile_with_sanitizers(&beside("difference.c"), &["-I."], &program);
        let run = |first: u32, last: u32| {
            let range = [first.to_le_bytes(), last.to_le_bytes()].concat();
            let input = [&range[..], &self.steps].concat();
            let output = succeeds(&mut Command::new(&program), &input, "");
            (output, self.expected(first, last))
        };
        let (found, expected) = run(u32::MAX, 0);
        if found != expected {
            let mut lines = found.lines().zip(expected.lines());
            let first = lines.position(|(found, expected)| found != expected);
            let first = u32::try_from(first.unwrap()).unwrap() * 1000;
            let (found, expected) = run(first + 1, first + 1000);
            for (found, expected) in found.lines().zip(expected.lines()) {
                assert_eq!(found, expected, "{}: {}", self.name, self.text);
            }
        }
    }

    /// Returns the output that `difference.c` must print.
    fn expected(&self, first: u32, last: u32) -> String {
        let mut reference = Reference::new(self);
        let (mut said, mut number, mut at) = (String::new(), 0, 0);
        while at < self.steps.len() {
            at += reference.step(&self.steps[at..]);
            number += 1;
            if (first..=last).contains(&number) {
                let counters = reference.counters().map(|it| it.to_string());
                let digest = reference.digest.0;
                writeln!(said, "step {number}: {} {digest:08x}", counters.join(" ")).unwrap();
            }
            if number % 1000 == 0 {
                writeln!(said, "{number}: {:08x}", reference.digest.0).unwrap();
            }
        }
        writeln!(said, "{number}: {:08x}", reference.digest.0).unwrap();
        self.demand_that_all_happened(&reference);
        said
    }

    /// Returns the counters and the digest after all steps.
    pub(crate) fn outcome(&self) -> ([u32; 18], u32) {
        let mut reference = Reference::new(self);
        let mut at = 0;
        while at < self.steps.len() {
            at += reference.step(&self.steps[at..]);
        }
        self.demand_that_all_happened(&reference);
        (reference.counters(), reference.digest.0)
    }

    /// Returns the longest of several random frames.
    pub(crate) fn longest_frame(&self) -> Vec<u8> {
        let mut random = ChaCha8Rng::seed_from_u64(43);
        let frames = (0..10).flat_map(|_| drawn::frames(&self.description, &mut random));
        frames.max_by_key(Vec::len).unwrap()
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns all bytes that the steps push.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let (mut bytes, mut rest) = (Vec::new(), &*self.steps);
        while let [kind, after @ ..] = rest {
            let taken = match (kind, after) {
                (0, [byte, ..]) => (&[*byte][..], 1),
                (1, [_, ..]) => (&[][..], 1),
                (2, _) => (&[][..], 0),
                (_, [count, slice @ ..]) => {
                    (&slice[..usize::from(*count)], 1 + usize::from(*count))
                }
                _ => panic!("half a step"),
            };
            bytes.extend_from_slice(taken.0);
            rest = &after[taken.1..];
        }
        bytes
    }

    pub(crate) fn steps(&self) -> &[u8] {
        &self.steps
    }

    /// Asserts that frames, line events and discarded bytes occur. Without all three, the comparison would prove
    /// nothing.
    fn demand_that_all_happened(&self, reference: &Reference) {
        let (name, counters) = (&self.name, reference.counters());
        assert!(
            counters[1] > 20,
            "{name}: {} frames\n{}",
            counters[1],
            self.text
        );
        for (reason, count) in REASONS.iter().zip(&counters[4..12]) {
            let is_there = self
                .header
                .contains(&format!("{}_{reason}, /*", name.to_uppercase()));
            assert!(
                *count == 0 || is_there,
                "{name}: the header has no {reason}"
            );
            // If frames have no sync, any byte may begin a frame.
            let is_certain = *reason != "NO_SYNC"
                || self
                    .description
                    .kinds
                    .iter()
                    .all(|kind| kind.layout().sync.length > 0);
            if is_there && is_certain && SHIPPED.iter().any(|it| it.1 == self.text) {
                assert!(*count > 0, "{name}: {reason} did not happen");
            }
        }
        assert!(
            counters[4..11].iter().sum::<u32>() > 0 || !reference.can_fail,
            "{name}: nothing discarded"
        );
        for count in &counters[12..17] {
            assert!(*count > 0, "{name}: a line event did not happen");
        }
    }
}

/// The digest of `difference.c`.
struct Digest(u32);

impl Digest {
    fn mix(&mut self, value: u32) {
        self.0 = (self.0 ^ value).wrapping_mul(16_777_619);
        self.0 ^= self.0 >> 15;
    }

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

/// The Rust receiver, which performs the same steps as `difference.c`.
struct Reference {
    line: Line<BufferedReceiver<Layouts, Vec<u8>>>,
    digest: Digest,
    is_window: bool,
    has_kinds: bool,
    can_fail: bool,
    /// For each reason, the number of bytes that the buffered receiver discarded at line events. A receiver with a
    /// window counts all these bytes as `LINE_EVENT`.
    at_events: [u32; 8],
    /// The Rust receiver with a window. If the format is BIN, this receiver takes the same bytes as the buffered
    /// receiver.
    bin: Option<Line<Receiver<Bin>>>,
}

impl Reference {
    fn new(case: &Case) -> Self {
        let format = case.description.format();
        let receiver = BufferedReceiver::with_buffer(format.clone(), vec![0; 2 * format.longest()]);
        let mut layouts = case.description.kinds.iter().map(|kind| kind.layout());
        Self {
            line: Line::new(receiver.unwrap()),
            digest: Digest(2_166_136_261),
            is_window: case.is_window(),
            has_kinds: case.has_kinds(),
            // With neither a sync nor a checksum, each terminator ends a frame, so no byte is discarded.
            can_fail: layouts.any(|it| it.sync.length > 0 || it.checksum.is_some()),
            at_events: [0; 8],
            bin: (case.name == "bin").then(|| Line::new(Receiver::new())),
        }
    }

    /// Performs the next step. Returns the number of bytes that describe the step.
    fn step(&mut self, steps: &[u8]) -> usize {
        let Self {
            line,
            digest,
            has_kinds,
            ..
        } = self;
        let length = match *steps {
            [0, byte, ..] => {
                if let Some(frame) = line.push(byte) {
                    digest.mix_frame(frame.message(), *has_kinds);
                }
                // A receiver with a window leaves no decision to later calls.
                if self.is_window {
                    self.poll();
                }
                if let Some(bin) = &mut self.bin {
                    bin.push(byte);
                }
                2
            }
            [1, event, ..] => {
                let before = discarded(line.counters());
                line.line_event(EVENTS[usize::from(event)], |found| {
                    if let Some(frame) = found.message() {
                        digest.mix_frame(frame.message(), *has_kinds);
                    }
                });
                if self.is_window {
                    let after = discarded(line.counters());
                    for reason in 0..7 {
                        let count = after[reason] - before[reason];
                        self.at_events[reason] += count;
                        self.at_events[7] = self.at_events[7].wrapping_sub(count);
                    }
                }
                if let Some(bin) = &mut self.bin {
                    bin.line_event(EVENTS[usize::from(event)], |_| ());
                }
                2
            }
            [2, ..] => {
                self.poll();
                1
            }
            [_, count, ref rest @ ..] => {
                let count = usize::from(count);
                line.feed(&rest[..count], |found| {
                    if let Some(frame) = found.message() {
                        digest.mix_frame(frame.message(), *has_kinds);
                    }
                });
                if let Some(bin) = &mut self.bin {
                    bin.feed(&rest[..count], |_| ());
                }
                2 + count
            }
            _ => panic!("half a step"),
        };
        for counter in self.counters() {
            self.digest.mix(counter);
        }
        if let Some(bin) = &self.bin {
            assert_eq!(self.counters(), numbers(bin.counters(), bin.pending()));
        }
        length
    }

    fn poll(&mut self) {
        while let Some(frame) = self.line.poll() {
            self.digest.mix_frame(frame.message(), self.has_kinds);
        }
    }

    fn counters(&self) -> [u32; 18] {
        let mut all = numbers(self.line.counters(), self.line.pending());
        for (count, other) in all[4..12].iter_mut().zip(self.at_events) {
            *count = count.wrapping_sub(other);
        }
        all
    }
}

/// Returns the counters of discarded bytes, in the order of [`REASONS`].
fn discarded(counters: &Counters) -> [u32; 8] {
    let all = &counters.discarded;
    [
        all.no_sync,
        all.broken_sync,
        all.bad_header,
        all.too_long,
        all.unknown_message,
        all.checksum_mismatch,
        all.wrong_terminator,
        all.line_event,
    ]
}

/// Returns the numbers that `difference.c` mixes into its digest after each step.
fn numbers(all: &Counters, pending: usize) -> [u32; 18] {
    let first = [
        all.bytes,
        all.frames,
        all.frame_bytes,
        all.resynchronisations,
    ];
    let events = &all.events;
    let last = [
        events.framing,
        events.parity,
        events.overrun,
        events.line_break,
        events.idle,
        u32::try_from(pending).unwrap(),
    ];
    [&first[..], &discarded(all), &last]
        .concat()
        .try_into()
        .unwrap()
}

/// Returns random steps with at least `bytes` bytes. The bytes are frames, broken frames, false starts and noise, which
/// arrive one by one or in slices. Some steps are line events and polls. In a long stream, polls occur, and slices of
/// every length up to 16 bytes. If the longest drawn frame is shorter than that, slices of every length up to this
/// frame's length occur.
fn steps(description: &Description, random: &mut ChaCha8Rng, bytes: usize) -> Vec<u8> {
    let mut pool = Vec::new();
    for _ in 0..30 {
        let frames = drawn::frames(description, random);
        pool.extend(
            frames
                .iter()
                .map(|frame| drawn::with_any_end(description, frame, random)),
        );
    }
    let layouts = description.kinds.iter().map(|kind| kind.layout());
    let syncs: Vec<&[u8]> = layouts.flat_map(|layout| layout.sync.each()).collect();
    let (mut steps, mut count) = (Vec::new(), 0);
    let (mut changes, mut slices, mut polls) = ([0; 24], HashSet::new(), 0);
    let mut events = 0;
    while count < bytes {
        let mut piece = pool.choose(random).unwrap().clone();
        let at = random.random_range(0..piece.len());
        let change = random.random_range(0..24);
        changes[change] += 1;
        match change {
            0..5 => piece = broken(&piece, |count| random.random_range(0..count)),
            5 => piece[at] = random.random(),
            6 => {
                piece = (0..random.random_range(0..20))
                    .map(|_| random.random())
                    .collect();
            }
            7 => {
                let sync = syncs.choose(random).copied().unwrap_or_default();
                let noise = (0..random.random_range(0..6)).map(|_| random.random());
                piece = sync.iter().copied().chain(noise).collect();
            }
            // Change a byte at the beginning of the frame, where the header is.
            8 => {
                let at = random.random_range(0..piece.len().min(10));
                piece[at] = random.random();
            }
            9 => piece = piece.repeat(2),
            _ => {}
        }
        count += piece.len();
        if random.random_range(0..4) == 0 {
            let most = if random.random() { 16 } else { 255 };
            for chunk in piece.chunks(random.random_range(1..=piece.len().clamp(1, most))) {
                slices.insert(chunk.len());
                steps.extend([3, u8::try_from(chunk.len()).unwrap()]);
                steps.extend(chunk);
            }
        } else {
            steps.extend(piece.iter().flat_map(|byte| [0, *byte]));
        }
        match random.random_range(0..40) {
            0..10 => {
                // Each sort of event occurs even in a short stream.
                steps.extend([1, events]);
                events = (events + 1) % 5;
            }
            10..13 => {
                polls += 1;
                steps.push(2);
            }
            _ => {}
        }
    }
    // A short stream, for a chip, need not contain slices of each length.
    if bytes >= BYTES {
        let longest = pool.iter().map(Vec::len).max().unwrap().min(16);
        let has_each = (1..=longest).all(|length| slices.contains(&length));
        assert!(has_each, "{slices:?}");
        assert!(polls > 5, "{polls} polls");
        let has_each = changes.iter().all(|count| *count > 0);
        assert!(has_each, "{changes:?}");
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

#[test]
fn shipped_receivers_do_the_same_in_c_and_rust() {
    check_shipped(BYTES);
}

#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_do_those_with_long_streams() {
    check_shipped(AT_NIGHT);
    check_shared(AT_NIGHT);
}

fn check_shipped(bytes: usize) {
    for (name, text) in SHIPPED {
        Case::new(name, text, CrcTable::Nibbles, bytes).check(&GCC);
    }
}

#[test]
fn shipped_receivers_do_the_same_in_cpp_with_byte_tables() {
    for (name, text) in SHIPPED {
        Case::new(name, text, CrcTable::Bytes, BYTES).check(&CLANGXX);
    }
}

/// Several kinds with the same header. The first kind that does not reject the bytes classifies them.
const SHARED_HEADER: &str = "
    sync = 'AA 55'
    longest = 21
    checksum = { name = 'CRC-16/MODBUS', type = 'u16le', at = -2, from = 2 }
    [[kinds]]
    name = 'request'
    length = 8
    fields = [{ name = 'register', at = 2, type = 'u16be' }, { name = 'count', at = 4, type = 'u16be' }]
    [[kinds]]
    name = 'response'
    length_field = { at = 2, type = 'u8', plus = 5 }
    fields = [{ name = 'values', at = 3, type = 'bytes' }]
    [[kinds]]
    name = 'error'
    sync = 'AA 55 | AA 56'
    length = 6
    fields = [{ name = 'code', at = 2, type = 'u8' }, { name = 'more', at = 3, type = 'u8' }]
";

#[test]
fn kinds_with_the_same_header_do_the_same() {
    check_shared(BYTES);
}

fn check_shared(bytes: usize) {
    Case::new("shared", SHARED_HEADER, CrcTable::Nibbles, bytes).check(&GCC);
}

/// Kinds with the same header, of which the first has the longest frames.
const LONGEST_FIRST: &str = "
    sync = 'AA'
    checksum = { name = 'sum', type = 'u8', at = -1 }
    [[kinds]]
    name = 'six'
    length = 6
    [[kinds]]
    name = 'four'
    length = 4
    fields = [{ name = 'a', at = 1, type = 'u8' }, { name = 'b', at = 2, type = 'u8' }]
";

#[test]
fn line_events_deliver_frames_of_later_kinds() {
    let case = Case::new("late", LONGEST_FIRST, CrcTable::Nibbles, BYTES);
    case.check(&GCC);
    let folder = TempDir::new().unwrap();
    case.write(folder.path());
    let source = folder.path().join("program.c");
    let text = r#"
        #include <stdio.h>
        #include "late.h"
        static void received(void *context, const late_message *message)
        {
            (void)context;
            printf("%d: %d %d\n", (int)message->kind, (int)message->of.four.a, (int)message->of.four.b);
        }
        int main(void)
        {
            static late_receiver receiver;
            static const uint8_t frame[] = {0xAAU, 1U, 2U, 0xADU};
            late_message message;
            uint8_t made[4];
            int event;
            size_t i;
            late_init(&receiver);
            for (event = 0; event < (int)LATE_EVENTS; event++) {
                for (i = 0U; i < sizeof frame; i++) {
                    if (late_push(&receiver, frame[i], &message)) {
                        return 1;
                    }
                }
                late_line_event(&receiver, (late_event)event, received, NULL);
            }
            message.kind = LATE_KIND_FOUR;
            message.of.four.a = 1U;
            message.of.four.b = 2U;
            return ((late_encode(&message, made, sizeof made) == 4U) && (made[3] == 0xADU)) ? 0 : 1;
        }
    "#;
    fs::write(&source, text).unwrap();
    let program = folder.path().join("program");
    GCC.compile_with_sanitizers(&source, &["-I."], &program);
    let output = succeeds(&mut Command::new(&program), &[], "");
    assert_eq!(output, "1: 1 2\n".repeat(EVENTS.len()));
}

#[test]
fn random_receivers_do_the_same_in_c_and_rust() {
    check_random(8, BYTES);
}

#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_do_those_of_many_random_descriptions() {
    check_random(200, AT_NIGHT);
}

fn check_random(count: usize, bytes: usize) {
    for (number, case) in random_cases(count, bytes).enumerate() {
        case.check(if number % 2 == 0 { &GCC } else { &CLANG });
    }
}
