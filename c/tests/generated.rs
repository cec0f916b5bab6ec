//! Compiles and runs generated code. On faulty streams, the code must find the same frames as a receiver that
//! interprets the description, and must encode the same frames.

use std::collections::HashSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::slice;

use framelock::{BufferedReceiver, Format, Found, Frame, LineEvent, PacketReceiver, Parser};
use framelock_description::hex::glued;
use framelock_description::{Description, Field, Kind, Layouts, Notation, Pattern, SHIPPED, Value};
use framelock_description_oracles as drawn;
use framelock_generate::{CrcTable, c, is_repeated, rust};
use framelock_oracles::faulty;
use minijinja::{Environment, context};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compilers::{CLANGXX, GCC, assert_same, succeeds};
use crate::descriptions::{forms, others};

/// A description, a stream, and the output that the generated code must print for the stream.
struct Case {
    name: String,
    description: Description,
    /// The parts of the stream. A line event follows each part.
    stream: Vec<Vec<u8>>,
    expected: String,
}

impl Case {
    fn new(name: &str, text: &str, random: &mut ChaCha8Rng) -> Self {
        let description = Description::parse(name, text).unwrap();
        // If an event ends frames, the first part stays empty, so that an event precedes each frame.
        let mut stream = vec![Vec::new()];
        for _ in 0..30 {
            let mut frames = drawn::frames(&description, random);
            let kind = description.kinds.choose(random).unwrap();
            frames.extend(drawn::text_frame(kind, random));
            for frame in &mut frames {
                *frame = drawn::with_any_end(&description, frame, random);
            }
            let sent = frames.iter().filter_map(|frame| description.sent(frame));
            let sent: Vec<Vec<u8>> = sent.collect();
            if description.ending_event().is_some() {
                let part = |frame: &Vec<u8>| sometimes_faulty(frame, random);
                stream.extend(sent.iter().map(part));
            } else {
                stream[0].extend(faulty(&sent, random));
            }
        }
        assert!(stream.concat().len() > 5, "no frames of {name}:\n{text}");
        let expected = expected(name, &description, &stream);
        Self {
            name: name.replace('-', "_"),
            description,
            stream,
            expected,
        }
    }
}

/// Returns the frame alone, or the bytes that arrive when a faulty line carries the frame.
pub(crate) fn sometimes_faulty(frame: &Vec<u8>, random: &mut ChaCha8Rng) -> Vec<u8> {
    if random.random() {
        frame.clone()
    } else {
        faulty(slice::from_ref(frame), random)
    }
}

/// Returns cases with the shipped descriptions, with those of `others` and `forms`, and with random ones.
fn cases(random_ones: usize) -> Vec<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(26);
    let shipped = SHIPPED.iter().copied().chain(others()).chain(forms());
    let mut cases: Vec<Case> = shipped
        .map(|(name, text)| Case::new(name, text, &mut random))
        .collect();
    let shipped = cases.len();
    while cases.len() < shipped + random_ones {
        let text = drawn::description(&mut random);
        if Description::parse("random", &text).is_ok() {
            let name = format!("random{}", cases.len() - shipped);
            cases.push(Case::new(&name, &text, &mut random));
        }
    }
    cases
}

/// Returns the expected output for a stream, according to the description.
fn expected(name: &str, description: &Description, stream: &[Vec<u8>]) -> String {
    let format = description.format().clone();
    let buffer = vec![0; 2 * format.longest()];
    if format.packets().is_some() {
        let receiver = PacketReceiver::with_buffer(format, buffer).unwrap();
        expected_of(name, description, receiver, stream)
    } else {
        let receiver = BufferedReceiver::with_buffer(format, buffer).unwrap();
        expected_of(name, description, receiver, stream)
    }
}

/// Returns the expected output for a stream, according to this receiver.
fn expected_of<P>(
    name: &str,
    description: &Description,
    mut receiver: P,
    stream: &[Vec<u8>],
) -> String
where
    P: for<'a> Parser<Message<'a> = Frame<'a, Layouts>> + 'static,
{
    let (mut text, mut frames, mut discarded) = (String::new(), 0, 0);
    let mut note = |found: Found<Frame<'_, Layouts>>| match found {
        Found::Frame { message, .. } => {
            let (kind, frame) = message.message();
            let Some(shown) = raw_values(&description.kinds[kind], frame) else {
                return;
            };
            frames += 1;
            write!(text, "frame {kind}\n{}", shown.text).unwrap();
            match description.encode(&drawn::values(description, frame)) {
                // `Description::encode` leaves out an empty text and a value that means "missing", and does not round.
                // Generated code treats an empty text as a field, so it may encode a longer frame.
                Ok(_) if shown.has_empty || shown.is_rounded => text.push_str("= any\n"),
                Ok(made) => match description.sent(&made) {
                    Some(sent) => writeln!(text, "= {}", glued(&sent)).unwrap(),
                    None => text.push_str("= none\n"),
                },
                Err(_) => text.push_str("= none\n"),
            }
        }
        Found::Discarded { count, .. } => discarded += count,
    };
    for part in stream {
        receiver.feed(part, &mut note);
        receiver.line_event(
            description.ending_event().unwrap_or(LineEvent::Idle),
            &mut note,
        );
    }
    // Frames and discarded bytes must occur. Otherwise the comparison proves nothing. The exceptions are DMX512, and
    // layouts with neither a sync nor a checksum: their receivers may discard no byte.
    let layout = description.kinds[0].layout();
    let takes_all = layout.sync.length == 0 && layout.checksum.is_none() || name == "dmx512";
    assert!(
        frames > 5 && (takes_all || discarded > 5),
        "{name}: {frames} {discarded}"
    );
    let name = name.replace('-', "_");
    writeln!(text, "{name}: {frames} frames, {discarded} bytes discarded").unwrap();
    text
}

/// The values of a frame as generated code represents them: unscaled, and without names.
#[derive(Default)]
struct RawValues {
    text: String,
    has_empty: bool,
    is_rounded: bool,
}

/// Returns the values of a frame. Returns `None` if a value is no number or does not fit, or if a text differs from its
/// pattern.
fn raw_values(kind: &Kind, frame: &[u8]) -> Option<RawValues> {
    let (mut raw, mut parts) = (kind.clone(), kind.clone());
    for field in &mut raw.fields {
        field.scale = None;
        field.names.clear();
    }
    for field in &mut parts.fields {
        if field.text.is_some() {
            field.notation = Notation::Text;
        }
    }
    let part = |name: &str| {
        let mut values = parts.values(frame);
        let (_, content) = values.find(|(field, _)| field.name == name)?;
        match content.value() {
            Value::Text(part) => Some(part.to_vec()),
            _ => None,
        }
    };
    if !kind
        .texts
        .iter()
        .all(|text| has_pattern(kind, text, frame, part))
    {
        return None;
    }
    let mut shown = RawValues::default();
    for field in raw.varying_fields().filter(|it| !is_repeated(kind, it)) {
        let numbers = match raw.contents(frame).of(field) {
            // Degrees, times and texts stay texts.
            Some(_) if field.text.is_some() && !is_number_in_text(field) => {
                bytes(&part(&field.name)?)
            }
            Some(content) => {
                let value = content.value();
                shown.has_empty |=
                    matches!(value, Value::Bytes([]) | Value::Text([]) | Value::Missing);
                let numbers = content
                    .values()
                    .map(|value| said(field, value, &mut shown.is_rounded));
                numbers.collect::<Option<String>>()?
            }
            None if field.text.is_some() => return None,
            None => continue,
        };
        writeln!(shown.text, "{}{numbers}", field.name).unwrap();
    }
    Some(shown)
}

/// Returns whether the whole text of a frame matches this pattern. `part` returns a value's text.
fn has_pattern(
    kind: &Kind,
    text: &Pattern,
    frame: &[u8],
    part: impl Fn(&str) -> Option<Vec<u8>>,
) -> bool {
    let end = kind.layout().counted_length(frame) - kind.from_end;
    // The pattern has one blank for each run of blanks in the text.
    let squeezed = |text: &[u8]| {
        let mut text = text.to_vec();
        text.dedup_by(|one, other| (*one, *other) == (b' ', b' '));
        text
    };
    let mut expected = vec![text.first.clone()];
    for value in &text.values {
        match &value.name {
            Some(name) => match part(name) {
                Some(part) => expected.last_mut().unwrap().extend(part),
                None => return false,
            },
            None => expected.push(Vec::new()),
        }
        expected.last_mut().unwrap().extend(&value.after);
    }
    let text = squeezed(&frame[kind.text_at..end]);
    let mut rest = &*text;
    for (number, piece) in expected.iter().map(|piece| squeezed(piece)).enumerate() {
        let mut starts = 0..if number == 0 { 1 } else { rest.len() + 1 };
        match starts.find_map(|at| rest[at..].strip_prefix(&*piece)) {
            Some(others) => rest = others,
            None => return false,
        }
    }
    rest.is_empty() || expected.len() > 1 && expected.last().is_some_and(Vec::is_empty)
}

fn is_number_in_text(field: &Field) -> bool {
    field.text.is_some() && matches!(field.notation, Notation::Decimal | Notation::Hex)
}

fn bytes(bytes: &[u8]) -> String {
    let numbers: Vec<String> = bytes.iter().map(|byte| format!(" {byte}")).collect();
    numbers.concat()
}

/// Returns a value as the generated code represents it: the unscaled value in the frame. Returns `None` if the value is
/// no number, or does not fit.
fn said(field: &Field, value: Value, is_rounded: &mut bool) -> Option<String> {
    Some(match value {
        Value::Unsigned(number) if field.text.is_some() => {
            format!(" {}", u32::try_from(number).ok()?)
        }
        Value::Unsigned(number) => format!(" {number}"),
        Value::Signed(number) => format!(" {number}"),
        Value::Float(number) => format!(" {}", number.to_bits()),
        Value::Double(number) => format!(" {}", number.to_bits()),
        Value::Decimal(number, decimals) => {
            let wanted = field.decimals.unwrap_or_default();
            let number = number * 10_i128.pow(wanted);
            let unit = 10_i128.pow(decimals);
            *is_rounded |= field.decimals.is_none() || number % unit != 0;
            let rounded = (2 * number.abs() + unit) / (2 * unit) * number.signum();
            format!(" {}", i32::try_from(rounded).ok()?)
        }
        Value::Bytes(all) | Value::Text(all) => bytes(all),
        // Generated code returns the number that means "missing". Without such a number, the value is unreadable.
        Value::Missing => said(field, field.missing?, is_rounded)?,
    })
}

/// Returns the values for the template of a program that runs the generated code.
fn values(case: &Case, code: &str) -> minijinja::Value {
    let name = &case.name;
    let field = |field: &Field| {
        // Generated code appends an underscore to a field name that is a keyword.
        let keyword = format!("{}_", field.name);
        let is_member = |end| code.contains(&format!(" {keyword}{end}"));
        let is_keyword = [":", ";", "["].into_iter().any(is_member);
        let name = if is_keyword {
            keyword
        } else {
            field.name.clone()
        };
        let declaration = format!(" {name};");
        let mut lines = code.lines();
        context! {
            label => field.name,
            type => lines.find_map(|line| line.trim().strip_suffix(&declaration)),
            may_be_missing => code.contains(&format!("bool has_{name};")),
            in_bits => rust_bits(code, &name),
            is_rest => code.contains(&format!(" {name}_length;")),
            has_fewer => code.contains(&format!(" {name}_count: usize,")) || code.contains(&format!(" {name}_count; /*")),
            is_array => field.is_array() || field.is_bytes() && !is_number_in_text(field),
            count => field.count.unwrap_or(1),
            name,
        }
    };
    let kinds = case.description.kinds.iter().map(|kind| {
        let fields = kind.varying_fields().filter(|it| !is_repeated(kind, it));
        let fields: Vec<_> = fields.map(field).collect();
        context! { name => kind.name, fields }
    });
    let decode = format!(" {name}_decode(const uint8_t *frame, ");
    let index = code
        .split_once(&decode)
        .and_then(|(_, rest)| rest.split_once(' '));
    context! {
        name,
        is_window => code.contains("_LONGEST]; /* the pending bytes */"),
        may_fail => code.contains("type Message<'a> = Option<Message"),
        are_packets => case.description.format().packets().is_some(),
        ends_with_break => case.description.ending_event() == Some(LineEvent::Break),
        index => index.map(|(index, _)| index),
        kinds => kinds.collect::<Vec<_>>(),
    }
}

/// Returns the Rust call that converts the floating-point numbers of a field to their bits.
fn rust_bits(code: &str, name: &str) -> &'static str {
    let declaration = format!("pub {name}: ");
    let kind = code.split_once(&declaration).map_or("", |(_, rest)| rest);
    match kind.split_once(",\n").map_or("", |(kind, _)| kind) {
        "f32" | "f64" => ".to_bits()",
        "Option<f32>" => ".map(f32::to_bits)",
        "Option<f64>" => ".map(f64::to_bits)",
        kind if kind.starts_with("[f32") => ".map(f32::to_bits)",
        kind if kind.starts_with("Option<[f32") => ".map(|all| all.map(f32::to_bits))",
        _ => "",
    }
}

/// Renders the template of a program. `code` has the generated code of each case.
fn program(template: &str, cases: &[Case], code: &[String]) -> String {
    let cases = cases
        .iter()
        .zip(code)
        .map(|(case, code)| values(case, code));
    let mut environment = Environment::new();
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    let values = context! { cases => cases.collect::<Vec<_>>() };
    environment.render_str(template, values).unwrap()
}

fn input(cases: &[Case]) -> Vec<u8> {
    let number = |number: usize| u32::try_from(number).unwrap().to_le_bytes();
    let mut all = Vec::new();
    for case in cases {
        all.extend(number(case.stream.len()));
        for part in &case.stream {
            all.extend(number(part.len()));
            all.extend(part);
        }
    }
    all
}

/// Asserts that the output is the expected output of all cases.
fn check(found: &str, cases: &[Case]) {
    let expected: String = cases.iter().map(|case| &*case.expected).collect();
    let lines = found.lines().zip(expected.lines());
    let any = lines.map(|(found, expected)| match expected {
        "= any" if found.starts_with("= ") => expected,
        _ => found,
    });
    assert_same(&any.collect::<Vec<_>>().join("\n"), &expected);
    assert_eq!(found.lines().count(), expected.lines().count());
}

const LIBRARY: &str = "//! Generated.
#![no_std]
#![deny(missing_docs, warnings, clippy::pedantic)]
#![deny(clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]
";

/// Compiles the modules as a library without `std`, and runs a program that uses the library. clippy must find nothing
/// in the library, and rustfmt must find nothing in the modules of the shipped descriptions and of two others.
fn in_rust(cases: &[Case]) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("generated");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    if folder.join("src").exists() {
        fs::remove_dir_all(folder.join("src")).unwrap();
    }
    fs::create_dir_all(folder.join("src")).unwrap();
    let manifest = format!(
        "[package]\nname = 'generated'\nedition = '2024'\n\n[workspace]\n\n[dependencies]\n\
         framelock = {{ path = '{root}/core' }}\nframelock-formats = {{ path = '{root}/formats' }}\n\n\
         [profile.dev]\ndebug = false\nincremental = false\n",
        root = root.display()
    );
    write("Cargo.toml", &manifest);
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let generated = |case: &Case| rust(&case.description, &case.name, "framelock generate");
    let code: Vec<String> = cases.iter().map(generated).collect();
    for (Case { name, .. }, code) in cases.iter().zip(&code) {
        write(&format!("src/{name}.rs"), code);
    }
    let modules = cases.iter().map(|case| format!("pub mod {};\n", case.name));
    write(
        "src/lib.rs",
        &(LIBRARY.to_owned() + &modules.collect::<String>()),
    );
    let main = program(include_str!("generated.rs.j2"), cases, &code);
    write("src/main.rs", &main);
    let cargo = |arguments: &[&str], input: &[u8]| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(arguments).current_dir(&folder);
        cargo.args(["--quiet", "--offline", "--target-dir", "target"]);
        succeeds(&mut cargo, input, "rustup component add clippy")
    };
    cargo(&["clippy", "--lib"], &[]);
    let shipped = cases.iter().take(SHIPPED.len() + 2);
    let mut rustfmt = Command::new("rustfmt");
    rustfmt.args(["--edition", "2024", "--check"]);
    rustfmt.args(shipped.map(|case| folder.join(format!("src/{}.rs", case.name))));
    succeeds(&mut rustfmt, &[], "rustup component add rustfmt");
    check(&cargo(&["run"], &input(cases)), cases);
}

/// Compiles and runs programs that include the headers, as C99 and as C++17. One program with all headers would take
/// too long to compile.
fn in_c(cases: &[Case]) {
    cases.chunks(15).for_each(part_in_c);
}

fn part_in_c(cases: &[Case]) {
    let command = "framelock generate";
    let generated = |case: &Case| c(&case.description, &case.name, command, CrcTable::Nibbles);
    let code: Vec<String> = cases.iter().map(generated).collect();
    let main = program(include_str!("generated.c.j2"), cases, &code);
    let names: Vec<String> = cases.iter().map(|case| case.name.clone() + ".h").collect();
    let mut files = vec![("generated.c", &*main)];
    files.extend(
        names
            .iter()
            .map(String::as_str)
            .zip(code.iter().map(String::as_str)),
    );
    for compiler in [&GCC, &CLANGXX] {
        let program = compiler.program("generated.c", &files, &[]);
        check(&program.run(&input(cases)), cases);
    }
}

#[test]
fn generated_code_does_what_its_description_says() {
    let cases = cases(6);
    let mut each = cases.iter();
    let truncated = each.find(|case| case.name == "truncated").unwrap();
    let lengths = truncated.expected.lines();
    let lengths = lengths.filter_map(|line| line.strip_prefix("= "));
    let lengths: HashSet<usize> = lengths.map(str::len).collect();
    assert!(lengths.len() > 5, "{lengths:?}");
    in_rust(&cases);
    in_c(&cases);
}

#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_does_that_of_many_random_descriptions() {
    let cases = cases(200);
    in_rust(&cases);
    in_c(&cases);
}
