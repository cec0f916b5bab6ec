//! Rust: a module without `std`.

use std::collections::HashSet;

use framelock::Format as _;
use framelock_description::{Class, Description, Field, Kind};
use framelock_formats::layout::Appendix;

use crate::code::{Code, add};
use crate::rust_layout::{layout, list};
use crate::{FieldCode as _, Item, called, free, items, length, module, one_line, words};

/// Names that no field can have.
#[rustfmt::skip]
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod",
    "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super", "trait", "true",
    "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// Names that no kind can have.
const TYPES: &[&str] = &[
    "AnyOf", "Format", "Frames", "Layout", "Message", "None", "Option", "Self", "Some", "Verdict",
];

/// A kind, and what is called after it.
struct Named<'a> {
    kind: &'a Kind,
    name: String,
    /// If it borrows bytes of a frame, their lifetime.
    of: &'static str,
    items: Vec<Item<'a>>,
}

/// The module that receives and makes a description's frames. `name` is what it is called, `command` what made it.
#[must_use]
pub fn rust(description: &Description, name: &str, command: &str) -> String {
    let mut taken: HashSet<String> = TYPES.iter().map(|&name| name.to_owned()).collect();
    let kinds = description.kinds.iter().map(|kind| {
        let items = items(kind, KEYWORDS);
        let borrows = items.iter().any(|item| item.field.length().is_none());
        Named {
            kind,
            name: if description.has_kinds() {
                free(&camel(&kind.name), &mut taken)
            } else {
                "Message".into()
            },
            of: if borrows { "<'a>" } else { "" },
            items,
        }
    });
    let kinds: Vec<Named> = kinds.collect();
    let mut code = Code::default();
    head(&mut code, description, &module(name), &one_line(command));
    format(&mut code, &kinds);
    if description.has_kinds() {
        any_kind(&mut code, &kinds);
    }
    for kind in &kinds {
        structure(&mut code, kind);
        add!(code, "\nimpl{of} {}{of} {{", kind.name, of = kind.of);
        layout(&mut code, &kind.kind.layout);
        code.add("");
        decode(&mut code, kind);
        encode(&mut code, kind, kinds.len() > 1);
        code.add("}");
    }
    code.add("");
    let helpers = called(&code.text, include_str!("../templates/helpers.rs.txt"));
    (code.text + &helpers).trim_end().to_owned() + "\n"
}

/// `MotorState`.
fn camel(name: &str) -> String {
    let words = words(name).into_iter();
    let capital = |word: String| word[..1].to_ascii_uppercase() + &word[1..];
    let name: String = words.map(capital).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("Kind{name}")
    }
}

fn head(code: &mut Code, description: &Description, name: &str, command: &str) {
    let longest = description.format().longest();
    add!(
        code,
        "//! Frames of `{name}`, made by `{command}`.
//!
//! Save it as `{name}.rs`, a module of a crate that depends on `framelock` and `framelock-formats`. To receive:
//! ```ignore
//! let mut receiver = framelock::BufferedReceiver::<_, {{ 2 * {name}::LONGEST }}>::new({name}::Frames);
//! if let Some(message) = receiver.push(byte) {{}}
//! ```
//! To send: `message.encode(&mut buffer)` gives the length of the frame that it writes.
#![allow(
dead_code,
clippy::cast_lossless,
clippy::cast_possible_truncation,
clippy::cast_possible_wrap,
clippy::cast_sign_loss,
clippy::struct_field_names,
clippy::too_many_lines,
clippy::unreadable_literal,
reason = \"names, numbers and what is used are not this module's to say\"
)]"
    );
    code.add(if description.has_kinds() {
        "
use framelock::{Format, Verdict};
use framelock_formats::layout::{self, Layout};
use framelock_formats::{AnyOf, judged_by};"
    } else {
        "
use framelock::Format;
use framelock_formats::judged_by;
use framelock_formats::layout::{self, Layout};"
    });
    add!(
        code,
        "
/// Bytes in the longest frame.
pub const LONGEST: usize = {longest};

/// For a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frames;

"
    );
}

/// What a receiver asks.
fn format(code: &mut Code, kinds: &[Named]) {
    let of = kinds.iter().map(|kind| kind.of).max().unwrap_or_default();
    let lifetime = if of.is_empty() { "" } else { "'a " };
    code.add("impl Format for Frames {");
    code.add(match kinds {
        [_] => "judged_by!(Message::LAYOUT);",
        _ => {
            "judged_by!(\nLayout {\nlongest: LONGEST,\n..Layout::NONE\n},\n|_format| AnyOf(LAYOUTS)\n);"
        }
    });
    add!(code, "type Message<'a> = Message{of};");
    code.add("");
    add!(
        code,
        "fn decode{of}(&self, frame: &{lifetime}[u8]) -> Message{of} {{"
    );
    if let [_] = kinds {
        code.add("Message::decode(frame)");
    } else {
        code.add("match AnyOf(LAYOUTS).decode(frame) {");
        for (number, Named { name, .. }) in kinds.iter().enumerate() {
            let is_last = number + 1 == kinds.len();
            let number = if is_last { "_" } else { &number.to_string() };
            add!(
                code,
                "({number}, frame) => Message::{name}({name}::decode(frame)),"
            );
        }
        code.add("}");
    }
    code.add("}\n}");
}

/// The message of a description with several kinds.
fn any_kind(code: &mut Code, kinds: &[Named]) {
    code.add("\n/// In the order in which they are tried.");
    let layouts = kinds.iter().map(|kind| format!("{}::LAYOUT", kind.name));
    list(code, "const LAYOUTS: &[Layout<'static>] = ", layouts, ";");
    let of = kinds.iter().map(|kind| kind.of).max().unwrap_or_default();
    code.add("\n/// What a frame says, of any kind.\n#[derive(Clone, PartialEq, Debug)]");
    add!(code, "pub enum Message{of} {{");
    for Named { kind, name, of, .. } in kinds {
        add!(
            code,
            "/// Of the kind `{}`.\n{name}({name}{of}),",
            kind.name
        );
    }
    add!(code, "}}\n\nimpl Message{} {{", of.replace('a', "_"));
    code.add(ENCODE);
    code.add("match self {");
    for Named { name, .. } in kinds {
        add!(code, "Self::{name}(message) => message.encode(into),");
    }
    code.add("}\n}\n}");
}

const ENCODE: &str = "\
/// Writes the frame that says it to the front of `into`, and gives its length; nothing if there is no room
/// or no such frame.
pub fn encode(&self, into: &mut [u8]) -> Option<usize> {";

fn structure(code: &mut Code, named: &Named) {
    let (name, of) = (&named.name, named.of);
    code.add("\n/// What a frame says.\n#[derive(Clone, PartialEq, Debug)]");
    add!(code, "pub struct {name}{of} {{");
    for Item { field, name, needs } in &named.items {
        let one = number(field);
        let all = match field.count {
            Some(count) => format!("[{one}; {count}]"),
            None if field.is_text() => "&'a [u8]".into(),
            None => one,
        };
        let all = match needs {
            Some(_) => format!("Option<{all}>"),
            None => all,
        };
        add!(code, "/// {}\npub {name}: {all},", field.told());
    }
    code.add("}");
}

/// The smallest type that holds a value.
fn number(field: &Field) -> String {
    match field.number() {
        (Class::Unsigned, bits) => format!("u{bits}"),
        (Class::Signed, bits) => format!("i{bits}"),
        (Class::Float, bits) => format!("f{bits}"),
    }
}

fn decode(code: &mut Code, named: &Named) {
    let lifetime = if named.of.is_empty() { "" } else { "'a " };
    let unused = if named.items.is_empty() { "_" } else { "" };
    code.add("/// The values of a frame that was received.\n#[must_use]");
    add!(
        code,
        "pub fn decode({unused}frame: &{lifetime}[u8]) -> Self {{"
    );
    if let Some(Appendix { at, mask, bytes }) = named.kind.layout.appendix {
        add!(
            code,
            "let is_appended = le(frame, {at}, 1) & {mask:#04X} != 0;
let appended = if is_appended {{ {bytes} }} else {{ 0 }};
let end = frame.len().saturating_sub(appended);
let (frame, appended) = frame.split_at_checked(end).unwrap_or_default();"
        );
    }
    code.add("Self {");
    for item in &named.items {
        add!(code, "{}: {},", item.name, value(item));
    }
    code.add("}\n}\n\n");
}

/// What a field is in `frame`.
fn value(Item { field, needs, .. }: &Item) -> String {
    let end = |distance| format!("frame.len().saturating_sub({distance})");
    let value = match (field.is_text(), field.count) {
        _ if field.is_appended => return "appended.first_chunk().copied()".into(),
        (true, None) => {
            let rest = format!("rest(frame, {}, {})", field.place(end), field.margin);
            return if needs.is_some() {
                rest
            } else {
                rest + ".unwrap_or_default()"
            };
        }
        (true, Some(_)) => format!("bytes(frame, {})", field.place(end)),
        (false, count) => {
            let value = field.reading("", end);
            let value = match number(field).as_str() {
                "u64" => value,
                "f32" => format!("f32::from_bits({value} as u32)"),
                kind => format!("{value} as {kind}"),
            };
            match count {
                Some(_) => format!("core::array::from_fn(|i| {value})"),
                None => value,
            }
        }
    };
    match needs {
        Some(needs) => format!("(frame.len() >= {needs}).then(|| {value})"),
        None => value,
    }
}

fn encode(code: &mut Code, named: &Named, is_one_of_many: bool) {
    let (items, name) = (&named.items, &named.name);
    code.add(ENCODE);
    size(code, named.kind, items);
    let appended = items.iter().find(|item| item.field.is_appended);
    let mut whole = "length";
    if let Some((Item { name, .. }, it)) = appended.zip(named.kind.layout.appendix) {
        whole = "whole";
        let (at, lowest, bytes) = (it.at, it.mask & it.mask.wrapping_neg(), it.bytes);
        add!(
            code,
            "let appended = self.{name}.as_ref();
let whole = length + appended.map_or(0, |_| {bytes});
let frame = into.get_mut(..whole)?;
frame.fill(0);
if let Some(appended) = appended {{
put(frame, {at}, &[{lowest:#04X}]);
put(frame, length, appended);
}}"
        );
    } else {
        code.add("let frame = into.get_mut(..length)?;\nframe.fill(0);");
    }
    for item in items.iter().filter(|item| !item.field.is_appended) {
        put(code, item);
    }
    code.add("if !Self::LAYOUT.seal(frame) {\nreturn None;\n}");
    if is_one_of_many {
        let judged = format!("Frames.judge(frame) != Verdict::Frame({whole})");
        code.add("// Headers of other kinds may be tried before.");
        add!(code, "if {judged} {{\nreturn None;\n}}");
        let again = format!("let Message::{name}(again) = Frames.decode(frame)");
        add!(code, "{again} else {{\nreturn None;\n}};");
    } else {
        add!(code, "let again = {name}::decode(frame);");
    }
    let same = same(code, items);
    add!(code, "{same}.then_some({whole})\n}}");
}

/// Whether a frame says the same again, after the statements that it takes.
fn same(code: &mut Code, items: &[Item]) -> &'static str {
    let is_float = |item: &Item| item.field.number().0 == Class::Float;
    if !items.iter().any(is_float) {
        return "(again == *self)";
    }
    code.add("// What is not a number is not equal to itself.\nlet mut is_same = true;");
    for item in items {
        let bits = match (item.field.is_array(), item.needs) {
            _ if !is_float(item) => "",
            (false, None) => ".to_bits()",
            (true, None) | (false, Some(_)) => ".map(f32::to_bits)",
            (true, Some(_)) => ".map(|all| all.map(f32::to_bits))",
        };
        add!(
            code,
            "is_same &= again.{name}{bits} == self.{name}{bits};",
            name = item.name
        );
    }
    "is_same"
}

/// The length of the frame, without what is appended.
fn size(code: &mut Code, kind: &Kind, items: &[Item]) {
    let (start, longer) = length(kind, items);
    match &*longer {
        [] => add!(code, "let length = {start};"),
        [(item, least)] if item.needs.is_none() && *least == start => {
            add!(code, "let length = {least} + self.{}.len();", item.name);
        }
        _ => add!(code, "let mut length = {start};\n{}", {
            let longer = longer.iter().map(|(Item { field, name, needs }, least)| {
                match (field.length(), needs) {
                    (Some(_), _) => format!("if self.{name}.is_some() {{\nlength = length.max({least});\n}}\n"),
                    (None, None) => format!("length = length.max({least} + self.{name}.len());\n"),
                    (None, Some(_)) => format!(
                        "if let Some(rest) = self.{name} {{\nlength = length.max({least} + rest.len());\n}}\n"
                    ),
                }
            });
            longer.collect::<String>()
        }),
    }
    if let Some((factor, more)) = kind.multiple() {
        add!(code, "// It is {more} more than a multiple of {factor}.");
        let up_to = factor + more;
        add!(
            code,
            "let length = length + ({up_to} - length % {factor}) % {factor};"
        );
    }
}

/// Writes a field into `frame`.
fn put(code: &mut Code, Item { field, name, needs }: &Item) {
    let end = |distance| format!("length - {distance}");
    let is_whole = field.is_text() || field.is_array();
    let all = match needs {
        Some(_) => "value".into(),
        None if field.is_text() && field.count.is_some() => format!("&self.{name}"),
        None => format!("self.{name}"),
    };
    let one = if field.is_array() { "value" } else { &all };
    let mut put = match number(field).as_str() {
        _ if field.is_text() => format!("put(frame, {}, {all});", field.place(end)),
        "u64" => field.writing("", one, end),
        "f32" => field.writing("", &format!("{one}.to_bits() as u64"), end),
        _ => field.writing("", &format!("{one} as u64"), end),
    };
    if field.is_array() {
        put = format!("for (i, &value) in {all}.iter().enumerate() {{\n{put}\n}}");
    }
    if needs.is_some() {
        let of = if is_whole { "&" } else { "" };
        put = format!("if let Some(value) = {of}self.{name} {{\n{put}\n}}");
    }
    code.add(&put);
}
