//! C99, which is C++17 as well: a header.

use std::collections::HashSet;

use framelock_formats::layout::Appendix;

use super::code::{Code, add};
use super::{Item, c_layout, called, free, items, length, module, one_line};
use crate::Description;
use crate::field::{Class, Field};
use crate::kind::Kind;

/// Names that nothing can have, in C or in C++.
#[rustfmt::skip]
const KEYWORDS: &[&str] = &[
    "alignas", "alignof", "and", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch", "char", "class",
    "compl", "concept", "const", "constexpr", "continue", "decltype", "default", "delete", "do", "double", "else",
    "enum", "explicit", "export", "extern", "false", "float", "for", "friend", "goto", "if", "inline", "int", "long",
    "mutable", "namespace", "new", "noexcept", "not", "nullptr", "operator", "or", "private", "protected", "public",
    "register", "requires", "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "template",
    "this", "throw", "true", "try", "typedef", "typeid", "typename", "union", "unsigned", "using", "virtual", "void",
    "volatile", "while", "xor",
];

/// Names that no kind can have besides.
const OTHERS: &[&str] = &[
    "be", "bits", "bits_of", "decode", "encode", "kind", "layouts", "le", "longest", "message",
    "put", "put_be", "put_bits", "put_le",
];

/// A kind, and what is called after it.
struct Named<'a> {
    kind: &'a Kind,
    name: String,
    /// What its type is called, and its functions begin with.
    type_name: String,
    functions: String,
    prefix: &'a str,
    number: usize,
    items: Vec<Item<'a>>,
}

/// The header that receives and makes a description's frames. `name` is what it is called, `command` what made it.
#[must_use]
pub fn c(description: &Description, name: &str, command: &str) -> String {
    let prefix = &module(name);
    let taken = KEYWORDS.iter().chain(OTHERS);
    let mut taken: HashSet<String> = taken.map(|&name| name.to_owned()).collect();
    let kinds = description.kinds.iter().enumerate().map(|(number, kind)| {
        let mut name = "message".to_owned();
        let mut functions = prefix.clone();
        if description.has_kinds() {
            name = free(&module(&kind.name), &mut taken);
            functions = format!("{prefix}_{name}");
        }
        Named {
            kind,
            type_name: format!("{prefix}_{name}"),
            functions,
            name,
            prefix,
            number,
            items: items(kind, KEYWORDS),
        }
    });
    let kinds: Vec<Named> = kinds.collect();
    let mut functions = Code::default();
    for kind in &kinds {
        decode(&mut functions, kind);
        encode(&mut functions, kind);
    }
    let mut code = Code::default();
    head(&mut code, description, prefix, &one_line(command));
    let layouts = kinds.iter().map(|kind| (&*kind.name, &kind.kind.layout));
    c_layout::layouts(&mut code, prefix, &layouts.collect::<Vec<_>>());
    for kind in &kinds {
        structure(&mut code, kind);
    }
    if description.has_kinds() {
        any_kind(&mut code, &mut functions, prefix, &kinds);
    }
    code.add("");
    let helpers = concat!(include_str!("helpers.h.txt"), "\n").replace("PREFIX", prefix);
    code.text += &called(&functions.text, &helpers);
    code.text += functions.text.trim_start();
    code.add("");
    code.add("#endif");
    code.text
}

fn head(code: &mut Code, description: &Description, name: &str, command: &str) {
    let longest = description.kinds.iter().map(|kind| kind.layout.longest);
    let longest = longest.max().unwrap_or_default();
    let (upper, count) = (name.to_ascii_uppercase(), description.kinds.len());
    add!(
        code,
        "/* Frames of {name}, made by `{command}`.
*
* Save it as {name}.h, beside framelock.h. To receive:
*
*   static framelock_layout_receiver receiver;
*   static framelock_made_layout made[{count}];
*   static uint8_t buffer[2 * {upper}_LONGEST];
*
*   framelock_layout_receiver_init(&receiver, {name}_layouts, made, {count}, buffer, sizeof buffer);
*
*   if (framelock_layout_receiver_push(&receiver, byte, &frame)) {{
*       {name}_decode(&frame, &message);
*   }}
*
* To send: {name}_encode(&message, bytes, sizeof bytes) gives the length of the frame that it writes. */
#ifndef {upper}_H
#define {upper}_H"
    );
    code.add("");
    code.add("#include <string.h>");
    code.add("");
    code.add("#include \"framelock.h\"");
    code.add("");
    add!(
        code,
        "/* Bytes in the longest frame. */\n#define {upper}_LONGEST {longest}"
    );
    code.add("");
}

fn structure(code: &mut Code, named: &Named) {
    let Named {
        type_name, items, ..
    } = named;
    code.add("");
    add!(
        code,
        "/* What a frame says. */\ntypedef struct {type_name} {{"
    );
    for Item { field, name, needs } in items {
        add!(code, "/* {} */", field.told());
        if needs.is_some() {
            add!(code, "bool has_{name};");
        }
        match (field.is_text(), field.count) {
            (true, None) => add!(code, "const uint8_t *{name};\nsize_t {name}_length;"),
            (true, Some(count)) => add!(code, "uint8_t {name}[{count}];"),
            (false, Some(count)) => add!(code, "{} {name}[{count}];", number(field)),
            (false, None) => add!(code, "{} {name};", number(field)),
        }
    }
    if items.is_empty() {
        code.add("char nothing;");
    }
    add!(code, "}} {type_name};");
}

/// The smallest type that holds a value.
fn number(field: &Field) -> String {
    match field.number() {
        (Class::Unsigned, bits) => format!("uint{bits}_t"),
        (Class::Signed, bits) => format!("int{bits}_t"),
        (Class::Float, _) => "float".into(),
    }
}

/// The message of a description with several kinds, and its functions.
fn any_kind(code: &mut Code, functions: &mut Code, prefix: &str, kinds: &[Named]) {
    let upper = |name: &str| format!("{prefix}_{name}").to_ascii_uppercase();
    code.add("");
    code.add("/* The kinds, in the order in which they are tried. */\nenum {");
    for Named { name, .. } in kinds {
        add!(code, "{},", upper(name));
    }
    code.add("};");
    code.add("");
    add!(
        code,
        "/* What a frame says, of any kind. */\ntypedef struct {prefix}_message {{"
    );
    code.add("size_t kind;\nunion {");
    for Named {
        name, type_name, ..
    } in kinds
    {
        add!(code, "{type_name} {name};");
    }
    add!(code, "}} of;\n}} {prefix}_message;");

    functions.add("");
    functions.add(DECODE);
    add!(
        functions,
        "static inline void {prefix}_decode(const framelock_frame *received, {prefix}_message *message)\n{{"
    );
    functions.add("memset(message, 0, sizeof *message);\nmessage->kind = received->layout;");
    for Named { name, .. } in kinds {
        add!(functions, "if (message->kind == {}) {{", upper(name));
        add!(
            functions,
            "{prefix}_{name}_decode(received, &message->of.{name});\n}}"
        );
    }
    functions.add("}");
    functions.add("");
    functions.add(ENCODE);
    add!(
        functions,
        "static inline size_t {prefix}_encode(const {prefix}_message *message, uint8_t *frame, size_t size)\n{{"
    );
    for Named { name, .. } in kinds {
        add!(functions, "if (message->kind == {}) {{", upper(name));
        add!(
            functions,
            "return {prefix}_{name}_encode(&message->of.{name}, frame, size);\n}}"
        );
    }
    functions.add("return 0;\n}");
}

const DECODE: &str = "/* The values of a frame that was received. */";
const ENCODE: &str = "\
/* Writes the frame that says it to `frame`, and returns its length; 0 if there are fewer than so many bytes, or no such
* frame. */";

fn decode(code: &mut Code, named: &Named) {
    let Named {
        type_name,
        functions,
        kind,
        ..
    } = named;
    code.add("");
    code.add(DECODE);
    add!(
        code,
        "static inline void {functions}_decode(const framelock_frame *received, {type_name} *message)\n{{"
    );
    if named.items.is_empty() {
        code.add("(void)received;");
    } else {
        code.add("const uint8_t *frame = received->bytes;\nsize_t length = received->length;");
        code.add("(void)length;");
    }
    code.add("memset(message, 0, sizeof *message);");
    if let Some(Appendix { at, mask, bytes }) = kind.layout.appendix {
        add!(
            code,
            "const size_t appended = (frame[{at}] & {mask:#04X}) != 0 ? {bytes} : 0;"
        );
        code.add("length -= appended;");
    }
    for Item { field, name, needs } in &named.items {
        let statement = value(field, name, named.prefix);
        if let Some(needs) = needs {
            let is_there = if field.is_appended {
                "appended > 0".into()
            } else {
                format!("length >= {needs}")
            };
            add!(
                code,
                "message->has_{name} = {is_there};\nif (message->has_{name}) {{\n{statement}\n}}"
            );
        } else {
            code.add(&statement);
        }
    }
    code.add("}");
}

/// The statement that reads a field.
fn value(field: &Field, name: &str, prefix: &str) -> String {
    let end = |distance| format!("length - {distance}");
    let at = field.place(end);
    match (field.is_text(), field.count) {
        (true, Some(count)) if field.is_appended => {
            format!("memcpy(message->{name}, frame + length, {count});")
        }
        (true, Some(count)) => format!("memcpy(message->{name}, frame + {at}, {count});"),
        (true, None) => {
            let others = usize::from(field.at.unsigned_abs()) + field.margin;
            format!("message->{name} = frame + {at};\nmessage->{name}_length = length - {others};")
        }
        (false, count) => {
            let value = field.reading(&format!("{prefix}_"), end);
            let value = match number(field).as_str() {
                "uint64_t" => value,
                "float" => format!("{prefix}_float({value})"),
                kind => format!("({kind}){value}"),
            };
            match count {
                None => format!("message->{name} = {value};"),
                Some(count) => format!(
                    "for (size_t i = 0; i < {count}; i++) {{\nmessage->{name}[i] = {value};\n}}"
                ),
            }
        }
    }
}

fn encode(code: &mut Code, named: &Named) {
    let Named {
        type_name,
        functions,
        kind,
        items,
        prefix,
        ..
    } = named;
    code.add("");
    code.add(ENCODE);
    add!(
        code,
        "static inline size_t {functions}_encode(const {type_name} *message, uint8_t *frame, size_t size)\n{{"
    );
    size(code, named);
    let appended = items
        .iter()
        .find(|item| item.field.is_appended)
        .zip(kind.layout.appendix);
    let mut whole = "length";
    if let Some((item, Appendix { bytes, .. })) = appended {
        whole = "whole";
        add!(
            code,
            "const size_t whole = length + (message->has_{} ? {bytes} : 0);",
            item.name
        );
    }
    add!(
        code,
        "if (size < {whole}) {{\nreturn 0;\n}}\nmemset(frame, 0, {whole});"
    );
    if let Some((Item { name, .. }, Appendix { at, mask, bytes })) = appended {
        add!(
            code,
            "if (message->has_{name}) {{\nframe[{at}] |= {:#04X};",
            mask & mask.wrapping_neg()
        );
        add!(
            code,
            "memcpy(frame + length, message->{name}, {bytes});\n}}"
        );
    }
    for item in items.iter().filter(|item| !item.field.is_appended) {
        put(code, item, prefix);
    }
    add!(
        code,
        "if (!framelock_seal(&{prefix}_layouts[{}], frame, {whole})) {{\nreturn 0;\n}}",
        named.number
    );
    if items.is_empty() {
        code.add("(void)message;");
        add!(code, "return {whole};\n}}");
        return;
    }
    add!(
        code,
        "const framelock_frame made = {{frame, {whole}, {}}};",
        named.number
    );
    add!(
        code,
        "{type_name} again;\n{functions}_decode(&made, &again);\nbool is_same = true;"
    );
    for Item { field, name, needs } in items {
        let same = match field.length() {
            Some(_) => format!("memcmp(&again.{name}, &message->{name}, sizeof again.{name}) == 0"),
            None => format!(
                "again.{name}_length == message->{name}_length &&\n\
                 (again.{name}_length == 0 || memcmp(again.{name}, message->{name}, again.{name}_length) == 0)"
            ),
        };
        let same = match needs {
            Some(_) => format!(
                "again.has_{name} == message->has_{name} && (!again.has_{name} || ({same}))"
            ),
            None => same,
        };
        add!(code, "is_same = is_same && {same};");
    }
    add!(code, "return is_same ? {whole} : 0;\n}}");
}

/// The length of the frame, without what is appended.
fn size(
    code: &mut Code,
    Named {
        kind,
        items,
        prefix,
        ..
    }: &Named,
) {
    let (start, longer) = length(kind, items);
    add!(code, "size_t length = {start};");
    for (Item { field, name, needs }, least) in longer {
        let is_there = needs.map_or(String::new(), |_| format!("message->has_{name} && "));
        let mut least = least.to_string();
        if field.length().is_none() {
            let upper = prefix.to_ascii_uppercase();
            let is_long = format!("{is_there}message->{name}_length > {upper}_LONGEST");
            add!(code, "if ({is_long}) {{\nreturn 0;\n}}");
            least = format!("{least} + message->{name}_length");
        }
        add!(
            code,
            "if ({is_there}length < {least}) {{\nlength = {least};\n}}"
        );
    }
    if let Some((factor, more)) = kind.multiple() {
        add!(code, "/* It is {more} more than a multiple of {factor}. */");
        add!(
            code,
            "length += ({} - length % {factor}) % {factor};",
            factor + more
        );
    }
}

/// Writes a field into `frame`.
fn put(code: &mut Code, Item { field, name, needs }: &Item, prefix: &str) {
    let end = |distance| format!("length - {distance}");
    let begin = format!("{prefix}_");
    let one = if field.is_array() {
        format!("message->{name}[i]")
    } else {
        format!("message->{name}")
    };
    let mut put = match number(field).as_str() {
        _ if field.is_text() => {
            let count = field
                .count
                .map_or(format!("message->{name}_length"), |count| count.to_string());
            format!("{begin}put(frame, {}, {one}, {count});", field.place(end))
        }
        "uint64_t" => field.writing(&begin, &one, end),
        "float" => field.writing(&begin, &format!("{begin}bits_of({one})"), end),
        _ => field.writing(&begin, &format!("(uint64_t){one}"), end),
    };
    if let (Some(count), false) = (field.count, field.is_text()) {
        put = format!("for (size_t i = 0; i < {count}; i++) {{\n{put}\n}}");
    }
    if needs.is_some() {
        put = format!("if (message->has_{name}) {{\n{put}\n}}");
    }
    code.add(&put);
}
