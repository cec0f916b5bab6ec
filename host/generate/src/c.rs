//! C99, which is C++17 as well: a header.

use std::collections::HashSet;

use framelock::Format as _;
use framelock_description::{Class, Description, Field, Kind};
use framelock_formats::layout::Appendix;

use crate::code::{Code, add};
use crate::{FieldCode as _, Item, c_layout, called, free, items, length, module, one_line};

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
    let helpers =
        concat!(include_str!("../templates/helpers.h.txt"), "\n").replace("PREFIX", prefix);
    code.text += &called(&functions.text, &helpers);
    code.text += functions.text.trim_start();
    code.add("\n#endif");
    code.text
}

fn head(code: &mut Code, description: &Description, name: &str, command: &str) {
    let longest = description.format().longest();
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
#define {upper}_H

#include <string.h>

#include \"framelock.h\"

/* Bytes in the longest frame. */
#define {upper}_LONGEST {longest}

"
    );
}

fn structure(code: &mut Code, named: &Named) {
    let name = &named.type_name;
    add!(code, "\n/* What a frame says. */\ntypedef struct {name} {{");
    for Item { field, name, needs } in &named.items {
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
    if named.items.is_empty() {
        code.add("char nothing;");
    }
    add!(code, "}} {name};");
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
    let of_each = |text: &dyn Fn(&str, &str) -> String| {
        let upper = |name: &str| format!("{prefix}_{name}").to_ascii_uppercase();
        let each = kinds
            .iter()
            .map(|kind| text(&upper(&kind.name), &kind.name));
        each.collect::<String>()
    };
    let constants = of_each(&|upper, _| format!("{upper},\n"));
    let members = of_each(&|_, name| format!("{prefix}_{name} {name};\n"));
    add!(
        code,
        "
/* The kinds, in the order in which they are tried. */
enum {{
{constants}}};

/* What a frame says, of any kind. */
typedef struct {prefix}_message {{
size_t kind;
union {{
{members}}} of;
}} {prefix}_message;"
    );
    let decode = of_each(&|upper, name| {
        let call = format!("{prefix}_{name}_decode(received, &message->of.{name});");
        format!("if (message->kind == {upper}) {{\n{call}\n}}\n")
    });
    let encode = of_each(&|upper, name| {
        let call = format!("{prefix}_{name}_encode(&message->of.{name}, frame, size);");
        format!("if (message->kind == {upper}) {{\nreturn {call}\n}}\n")
    });
    let [decoder, encoder] = signatures(prefix, &format!("{prefix}_message"));
    add!(
        functions,
        "{decoder}
memset(message, 0, sizeof *message);
message->kind = received->layout;
{decode}}}
{encoder}
{encode}return 0;
}}"
    );
}

/// How the functions of a type begin.
fn signatures(functions: &str, of: &str) -> [String; 2] {
    let decode = format!(
        "
/* The values of a frame that was received. */
static inline void {functions}_decode(const framelock_frame *received, {of} *message)
{{"
    );
    let encode = format!(
        "
/* Writes the frame that says it to `frame`, and returns its length; 0 if there are fewer than so many bytes, or no such
* frame. */
static inline size_t {functions}_encode(const {of} *message, uint8_t *frame, size_t size)
{{"
    );
    [decode, encode]
}

fn decode(code: &mut Code, named: &Named) {
    let [signature, _] = signatures(&named.functions, &named.type_name);
    code.add(&signature);
    code.add(if named.items.is_empty() {
        "(void)received;"
    } else {
        "const uint8_t *frame = received->bytes;\nsize_t length = received->length;\n(void)length;"
    });
    code.add("memset(message, 0, sizeof *message);");
    if let Some(Appendix { at, mask, bytes }) = named.kind.layout.appendix {
        let is_there = format!("(frame[{at}] & {mask:#04X}) != 0");
        add!(
            code,
            "const size_t appended = {is_there} ? {bytes} : 0;\nlength -= appended;"
        );
    }
    for Item { field, name, needs } in &named.items {
        let statement = value(field, name, named.prefix);
        let is_there = match needs {
            None => {
                code.add(&statement);
                continue;
            }
            Some(_) if field.is_appended => "appended > 0".into(),
            Some(needs) => format!("length >= {needs}"),
        };
        add!(
            code,
            "message->has_{name} = {is_there};\nif (message->has_{name}) {{\n{statement}\n}}"
        );
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
                Some(count) => each(count, &format!("message->{name}[i] = {value};")),
            }
        }
    }
}

fn each(count: usize, statement: &str) -> String {
    format!("for (size_t i = 0; i < {count}; i++) {{\n{statement}\n}}")
}

fn encode(code: &mut Code, named: &Named) {
    let (items, prefix, number) = (&named.items, named.prefix, named.number);
    let [_, signature] = signatures(&named.functions, &named.type_name);
    code.add(&signature);
    size(code, named);
    let appended = items.iter().find(|item| item.field.is_appended);
    let mut whole = "length";
    if let Some((Item { name, .. }, it)) = appended.zip(named.kind.layout.appendix) {
        whole = "whole";
        let (at, lowest, bytes) = (it.at, it.mask & it.mask.wrapping_neg(), it.bytes);
        add!(
            code,
            "const size_t whole = length + (message->has_{name} ? {bytes} : 0);
if (size < whole) {{
return 0;
}}
memset(frame, 0, whole);
if (message->has_{name}) {{
frame[{at}] |= {lowest:#04X};
memcpy(frame + length, message->{name}, {bytes});
}}"
        );
    } else {
        code.add("if (size < length) {\nreturn 0;\n}\nmemset(frame, 0, length);");
    }
    for item in items.iter().filter(|item| !item.field.is_appended) {
        put(code, item, prefix);
    }
    let seal = format!("framelock_seal(&{prefix}_layouts[{number}], frame, {whole})");
    add!(code, "if (!{seal}) {{\nreturn 0;\n}}");
    if items.is_empty() {
        add!(code, "(void)message;\nreturn {whole};\n}}");
        return;
    }
    let (functions, type_name) = (&named.functions, &named.type_name);
    add!(
        code,
        "const framelock_frame made = {{frame, {whole}, {number}}};
{type_name} again;
{functions}_decode(&made, &again);
bool is_same = true;"
    );
    for Item { field, name, needs } in items {
        let same = match field.length() {
            Some(_) => format!("memcmp(&again.{name}, &message->{name}, sizeof again.{name}) == 0"),
            None => format!(
                "again.{name}_length == message->{name}_length &&
(again.{name}_length == 0 || memcmp(again.{name}, message->{name}, again.{name}_length) == 0)"
            ),
        };
        let has = format!("again.has_{name} == message->has_{name} && (!again.has_{name} || (");
        let same = needs.map_or(same.clone(), |_| format!("{has}{same}))"));
        add!(code, "is_same = is_same && {same};");
    }
    add!(code, "return is_same ? {whole} : 0;\n}}");
}

/// The length of the frame, without what is appended.
fn size(code: &mut Code, named: &Named) {
    let (start, longer) = length(named.kind, &named.items);
    add!(code, "size_t length = {start};");
    for (Item { field, name, needs }, least) in longer {
        let is_there = needs.map_or(String::new(), |_| format!("message->has_{name} && "));
        let mut least = least.to_string();
        if field.length().is_none() {
            let upper = named.prefix.to_ascii_uppercase();
            let is_long = format!("{is_there}message->{name}_length > {upper}_LONGEST");
            add!(code, "if ({is_long}) {{\nreturn 0;\n}}");
            least = format!("{least} + message->{name}_length");
        }
        add!(
            code,
            "if ({is_there}length < {least}) {{\nlength = {least};\n}}"
        );
    }
    if let Some((factor, more)) = named.kind.multiple() {
        let up_to = factor + more;
        add!(code, "/* It is {more} more than a multiple of {factor}. */");
        add!(code, "length += ({up_to} - length % {factor}) % {factor};");
    }
}

/// Writes a field into `frame`.
fn put(code: &mut Code, Item { field, name, needs }: &Item, prefix: &str) {
    let end = |distance| format!("length - {distance}");
    let begin = &format!("{prefix}_");
    let index = if field.is_array() { "[i]" } else { "" };
    let one = format!("message->{name}{index}");
    let mut put = match number(field).as_str() {
        _ if field.is_text() => {
            let length = format!("message->{name}_length");
            let count = field.count.map_or(length, |count| count.to_string());
            format!("{begin}put(frame, {}, {one}, {count});", field.place(end))
        }
        "uint64_t" => field.writing(begin, &one, end),
        "float" => field.writing(begin, &format!("{begin}bits_of({one})"), end),
        _ => field.writing(begin, &format!("(uint64_t){one}"), end),
    };
    if let (Some(count), false) = (field.count, field.is_text()) {
        put = each(count, &put);
    }
    if needs.is_some() {
        put = format!("if (message->has_{name}) {{\n{put}\n}}");
    }
    code.add(&put);
}
