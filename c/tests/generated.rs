//! Compiles and runs generated code. On faulty streams, the code must find the same frames as a receiver that
//! interprets the description, and must encode the same frames.

use std::collections::HashSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use framelock::{BufferedReceiver, Format};
use framelock_description::{Description, Field, SHIPPED, Value};
use framelock_description_oracles as drawn;
use framelock_generate::{CrcTable, c, rust};
use framelock_oracles::faulty;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compilers::{CLANGXX, GCC, assert_same, beside, succeeds};

/// A description, the code generated from it, and the expected output of this code for a stream.
struct Case {
    name: String,
    description: Description,
    stream: Vec<u8>,
    expected: String,
}

/// Several kinds of frames, from the guide in `docs/own-frame.md`.
const MOTOR: &str = "
    sync = 'AA 55'
    length_field = { at = 2, type = 'u8', plus = 5 }
    longest = 21
    checksum = { name = 'CRC-16/MODBUS', type = 'u16le', at = -2, from = 2 }
    [[kinds]]
    name = 'measurement'
    shortest = 11
    fields = [
        { name = 'number', at = 3, type = 'u8', value = 1 },
        { name = 'position', at = 4, type = 'i16le', scale = 0.01, unit = 'deg' },
        { name = 'current', at = 6, type = 'u16le', unit = 'mA' },
        { name = 'temperature', at = 8, type = 'i8', unit = 'C' },
    ]
    [[kinds]]
    name = 'state'
    shortest = 7
    fields = [
        { name = 'number', at = 3, type = 'u8', value = 2 },
        { name = 'state', at = 4, type = 'u8' },
    ]
";

/// Senders leave out zero bytes at the end of the payload, as `MAVLink` 2 senders do.
pub(crate) const TRUNCATED: &str = "
    sync = 'FD'
    length_field = { at = 1, type = 'u8', plus = 6 }
    longest = 60
    truncated_zeros = true
    trailer = { name = 'signature', at = 2, mask = 1, bytes = 4 }
    checksum = { name = 'CRC-16/MCRF4XX', type = 'u16le', at = -2, from = 1 }
    fields = [
        { name = 'flags', at = 2, type = 'u8', mask = 0xFE, value = 0 },
        { name = 'sequence', at = 3, type = 'u8' },
        { name = 'ms', at = 4, type = 'u32le' },
        { name = 'large', at = 8, type = 'u64be' },
        { name = 'signed', at = 16, type = 'i16be', count = 3 },
        { name = 'single', at = 22, type = 'f32le' },
        { name = 'bits', at = 26, bits = 11, count = 4 },
        { name = 'last', at = 32, type = 'i32le', scale = 0.01 },
        { name = 'big', at = 36, type = 'u16be' },
    ]
";

impl Case {
    fn new(name: &str, text: &str, random: &mut ChaCha8Rng) -> Self {
        let description = Description::parse(name, text).unwrap();
        let mut stream = Vec::new();
        for _ in 0..30 {
            let mut frames = drawn::frames(&description, random);
            for frame in &mut frames {
                *frame = drawn::with_any_end(&description, frame, random);
            }
            stream.extend(faulty(&frames, random));
        }
        assert!(!stream.is_empty(), "no frames of {name}:\n{text}");
        let expected = expected(name, &description, &stream);
        Self {
            name: name.replace('-', "_"),
            description,
            stream,
            expected,
        }
    }
}

/// Returns the shipped descriptions, [`MOTOR`], [`TRUNCATED`], and random descriptions.
fn cases(random_ones: usize) -> Vec<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(26);
    let others = [("motor", MOTOR), ("truncated", TRUNCATED)];
    let shipped = SHIPPED.iter().chain(&others);
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
fn expected(name: &str, description: &Description, stream: &[u8]) -> String {
    let format = description.format();
    let mut receiver =
        BufferedReceiver::with_buffer(format.clone(), vec![0; 2 * format.longest()]).unwrap();
    let (mut text, mut frames, mut discarded) = (String::new(), 0, 0);
    let mut note = |found: framelock::Found<(usize, &[u8])>| match found {
        framelock::Found::Frame {
            message: (kind, frame),
            ..
        } => {
            frames += 1;
            writeln!(text, "frame {kind}").unwrap();
            let mut has_empty = false;
            for (field, content) in description.kinds[kind].values(frame) {
                has_empty |= matches!(content.value(), Value::Bytes([]) | Value::Text([]));
                let values: String = content.values().map(|value| said(field, value)).collect();
                writeln!(text, "{}{values}", field.name).unwrap();
            }
            match description.encode(&drawn::values(description, frame)) {
                // `Description::encode` treats an empty text as a missing field. Generated code treats it as a field, so it
                // may encode a longer frame.
                Ok(_) if has_empty => text.push_str("= any\n"),
                Ok(made) => {
                    text.push_str("= ");
                    hex(&mut text, &made);
                }
                Err(_) => text.push_str("= none\n"),
            }
        }
        framelock::Found::Discarded { count, .. } => discarded += count,
    };
    receiver.feed(stream, |found| note(found.map(|frame| frame.message())));
    let idle = framelock::LineEvent::Idle;
    receiver.line_event(idle, |found| note(found.map(|frame| frame.message())));
    // Frames and discarded bytes must occur. Otherwise the comparison proves nothing. The exceptions are layouts with
    // neither a sync nor a checksum. With such a layout, each terminator ends a frame, so no byte is discarded.
    let layout = description.kinds[0].layout();
    let takes_all = layout.sync.length == 0 && layout.checksum.is_none();
    assert!(
        frames > 5 && (takes_all || discarded > 5),
        "{name}: {frames} {discarded}"
    );
    let name = name.replace('-', "_");
    writeln!(text, "{name}: {frames} frames, {discarded} bytes discarded").unwrap();
    text
}

/// Returns a value as the generated code represents it: the unscaled value in the frame.
fn said(field: &Field, value: Value) -> String {
    match (value, &field.scale) {
        (Value::Unsigned(number), _) => format!(" {number}"),
        (Value::Signed(number), _) => format!(" {number}"),
        (Value::Float(number), _) => format!(" {}", number.to_bits()),
        (Value::Decimal(number, _), Some(scale)) => format!(" {}", number / scale.factor),
        (Value::Bytes(bytes) | Value::Text(bytes), _) => {
            let bytes: Vec<String> = bytes.iter().map(|byte| format!(" {byte}")).collect();
            bytes.concat()
        }
        (Value::Decimal(..), None) => panic!("no scale"),
    }
}

fn fields(kind: &framelock_description::Kind) -> impl Iterator<Item = &Field> {
    kind.fields.iter().filter(|field| field.constant.is_none())
}

/// Returns the name of a field in code. An underscore follows a keyword.
fn member(field: &Field, code: &str) -> String {
    let name = format!("{}_", field.name);
    let is_it = [":", ";", "["]
        .iter()
        .any(|end| code.contains(&format!(" {name}{end}")));
    if is_it { name } else { field.name.clone() }
}

fn input(cases: &[Case]) -> Vec<u8> {
    let each = cases.iter().flat_map(|case| {
        let length = u32::try_from(case.stream.len()).unwrap().to_le_bytes();
        [length.to_vec(), case.stream.clone()].concat()
    });
    each.collect()
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

/// Compiles the modules as a library without `std`, in which clippy and rustfmt must find nothing, and runs a program
/// that uses the library.
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
         framelock = {{ path = '{root}/core' }}\nframelock-formats = {{ path = '{root}/formats' }}\n",
        root = root.display()
    );
    write("Cargo.toml", &manifest);
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let mut library =
        "//! Generated.\n#![no_std]\n#![deny(missing_docs, warnings, clippy::pedantic)]\n\
                       #![deny(clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]\n"
            .to_owned();
    let (mut says, mut main) = (
        String::new(),
        "impossible();\nlet input = input();\nlet mut rest = &*input;\n".to_owned(),
    );
    for Case {
        name, description, ..
    } in cases
    {
        let code = rust(description, name, "framelock generate");
        write(&format!("src/{name}.rs"), &code);
        writeln!(library, "pub mod {name};").unwrap();
        writeln!(says, "mod {name} {{\nuse generated::{name}::*;").unwrap();
        writeln!(says, "pub fn say(message: &Message) {{").unwrap();
        for (number, kind) in description.kinds.iter().enumerate() {
            let it = if description.kinds.len() > 1 {
                let name = kind.name[..1].to_uppercase() + &kind.name[1..];
                format!("if let Message::{name}(it) = message")
            } else {
                "let it = message;".to_owned()
            };
            writeln!(says, "{it} {{\nprintln!(\"frame {number}\");\nlet _ = it;").unwrap();
            for field in fields(kind) {
                writeln!(
                    says,
                    "super::field({:?}, &it.{});",
                    field.name,
                    member(field, &code)
                )
                .unwrap();
            }
            says.push_str("}\n");
        }
        says.push_str("}\n}\n");
        writeln!(main, "receive!({name}, stream(&mut rest));").unwrap();
    }
    write("src/lib.rs", &library);
    let skeleton = fs::read_to_string(beside("generated_program.rs")).unwrap();
    write(
        "src/main.rs",
        &format!("{skeleton}\n{says}\nfn main() {{\n{main}\n}}\n"),
    );
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

/// Compiles and runs a program that includes the headers, as C99 and as C++17.
fn in_c(cases: &[Case]) {
    let folder = TempDir::new().unwrap();
    let mut text = "#include \"generated.h\"\n".to_owned();
    let mut main = String::new();
    for Case {
        name, description, ..
    } in cases
    {
        let code = c(description, name, "framelock generate", CrcTable::default());
        fs::write(folder.path().join(format!("{name}.h")), &code).unwrap();
        let upper = name.to_uppercase();
        writeln!(text, "#include \"{name}.h\"").unwrap();
        writeln!(
            text,
            "static void say_{name}(void *context, const {name}_message *message)\n{{"
        )
        .unwrap();
        writeln!(
            text,
            "size_t length;\nsize_t i;\n(void)context;\n(void)i;\nframes++;"
        )
        .unwrap();
        for (number, kind) in description.kinds.iter().enumerate() {
            if description.kinds.len() > 1 {
                let (of, of_upper) = (&kind.name, kind.name.to_uppercase());
                writeln!(text, "if (message->kind == {upper}_KIND_{of_upper}) {{").unwrap();
                writeln!(text, "const {name}_{of}_message *it = &message->of.{of};").unwrap();
            } else {
                writeln!(text, "{{\nconst {name}_message *it = message;").unwrap();
            }
            writeln!(text, "(void)it;\nprintf(\"frame {number}\\n\");").unwrap();
            fields(kind).for_each(|field| text.push_str(&said_in_c(field, &code)));
            text.push_str("}\n");
            if description.kinds.len() == 1 {
                let optional = fields(kind).filter_map(|field| without_in_c(name, field, &code));
                optional.for_each(|check| text.push_str(&check));
            }
        }
        writeln!(
            text,
            "length = {name}_encode(message, made, {upper}_LONGEST);\nsay_made(length);\n\
             if (length > 0 && {name}_encode(message, made, length - 1) != 0) {{\nabort();\n}}\n}}"
        )
        .unwrap();
        let is_window = !code.contains(&format!("bool {name}_poll("));
        let event = if is_window {
            ""
        } else {
            &format!(", say_{name}, NULL")
        };
        writeln!(
            main,
            "{{\nstatic {name}_receiver receiver;\nstatic {name}_message message;\n\
             const size_t length = next_stream();\nsize_t i;\nframes = 0;\n{name}_init(&receiver);\n\
             for (i = 0; i < length; i++) {{\nif ({name}_push(&receiver, stream[i], &message)) {{\n\
             say_{name}(NULL, &message);\n}}\n}}\n{name}_line_event(&receiver, {upper}_IDLE_LINE{event});\n\
             printf(\"{name}: %lu frames, %lu bytes discarded\\n\", (unsigned long)frames,\n\
             (unsigned long)(receiver.counters.bytes - receiver.counters.frame_bytes));\n}}"
        )
        .unwrap();
    }
    text.push_str(IMPOSSIBLE);
    writeln!(
        text,
        "int main(void)\n{{\nimpossible();\n{main}return 0;\n}}"
    )
    .unwrap();
    fs::write(folder.path().join("generated.c"), text).unwrap();
    let program = folder.path().join("program");
    let include = format!("-I{}", beside("").display());
    for compiler in [&GCC, &CLANGXX] {
        compiler.compile_with_sanitizers("generated.c".as_ref(), &[&include], &program);
        let found = succeeds(&mut Command::new(&program), &input(cases), "");
        check(&found, cases);
    }
}

fn hex(text: &mut String, bytes: &[u8]) {
    for byte in bytes {
        write!(text, "{byte:02X}").unwrap();
    }
    text.push('\n');
}

/// A function that checks that `encode` fails for values that no frame can contain: a channel of twelve bits, a payload
/// that is too long, an address that does not exist.
const IMPOSSIBLE: &str = "
static void impossible(void)
{
    sbus_message channels;
    crsf_message crsf;
    memset(&channels, 0, sizeof channels);
    channels.channel[3] = 2047;
    if (sbus_encode(&channels, made, 25) != 25) { abort(); }
    channels.channel[3] = 2048;
    if (sbus_encode(&channels, made, 25) != 0) { abort(); }
    memset(&crsf, 0, sizeof crsf);
    crsf.payload = stream;
    crsf.payload_length = 60;
    if (crsf_encode(&crsf, made, 64) != 64) { abort(); }
    crsf.payload_length = 255;
    if (crsf_encode(&crsf, made, 64) != 0) { abort(); }
    crsf.payload_length = 61;
    if (crsf_encode(&crsf, made, sizeof made) != 0) { abort(); }
    crsf.payload_length = 0;
    crsf.address = 0x55;
    if (crsf_encode(&crsf, made, 64) != 0) { abort(); }
}
";

/// Returns the statements that print a field of `it`.
fn said_in_c(field: &Field, code: &str) -> String {
    let name = member(field, code);
    let (count, value) = match (field.count, field.is_text()) {
        (Some(count), _) => (count.to_string(), format!("it->{name}[i]")),
        (None, true) => (format!("it->{name}_length"), format!("it->{name}[i]")),
        (None, false) => ("1".to_owned(), format!("it->{name}")),
    };
    let say = match code
        .lines()
        .find_map(|line| line.trim().strip_suffix(&format!(" {name};")))
    {
        Some("float") => format!("say_float({value});"),
        Some("uint64_t") => format!("printf(\" %llu\", (unsigned long long){value});"),
        _ => format!("printf(\" %lld\", (long long){value});"),
    };
    let condition = if code.contains(&format!("bool has_{name};")) {
        format!("it->has_{name}")
    } else {
        "true".into()
    };
    format!(
        "if ({condition}) {{\nprintf(\"{}\");\nfor (i = 0; i < {count}; i++) {{\n{say}\n}}\nprintf(\"\\n\");\n}}\n",
        field.name
    )
}

/// Returns C code that encodes the message without this field, which short frames lack. The code aborts if the result is
/// a frame that has the field. Returns `None` if all frames have the field.
fn without_in_c(name: &str, field: &Field, code: &str) -> Option<String> {
    let has = format!("has_{}", member(field, code));
    let index = code
        .split_once(&format!("void {name}_decode(const uint8_t *frame, "))?
        .1;
    let index = index.split_once(' ')?.0;
    code.contains(&format!("bool {has};")).then(|| {
        let upper = name.to_uppercase();
        format!(
            "if (message->{has}) {{\n{name}_message other = *message;\n{name}_message again;\nother.{has} = false;\n\
             length = {name}_encode(&other, made, {upper}_LONGEST);\n\
             if (length > 0) {{\n{name}_decode(made, ({index})length, &again);\n\
             if (again.{has}) {{\nabort();\n}}\n}}\n}}\n"
        )
    })
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
