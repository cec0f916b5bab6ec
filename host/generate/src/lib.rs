//! Generates source code from a [`Description`]: the layout, a struct for the fields of each kind, and functions that
//! decode and encode frames.
//!
//! The plan of a program is plain data: its kinds, their layouts, and their fields with positions and types. Each
//! language has a template, which walks this plan and contains the text of the program. The module `c` computes values
//! that only C needs.
#![forbid(unsafe_code)]

mod c;
mod layout;
mod names;
mod render;

use std::collections::HashSet;

use framelock::Format as _;
use framelock_description::{Class, Description, Field, Kind, Notation, Pattern, Type};
use framelock_formats::layout::{CheckedLayout, Length};
use minijinja::{Value, context};
use serde::Serialize;

pub use c::CrcTable;
use names::{Language, free, module, one_line};

/// Returns the source of a `no_std` Rust module that receives and encodes the frames of a description. `name` is the
/// module's name, and `command` is the command that generates it.
#[must_use]
pub fn rust(description: &Description, name: &str, command: &str) -> String {
    let program = Program::new(description, name, command, &names::RUST);
    render::source(&Value::from_serialize(&program), render::MODULE)
}

/// Returns a self-contained C header that receives and encodes the frames of a description. It is valid C99 and C++17.
/// `name` is the header's name, and `command` is the command that generates it.
#[must_use]
pub fn c(description: &Description, name: &str, command: &str, table: CrcTable) -> String {
    let mut program = Program::new(description, name, command, &names::C);
    let layouts = description.kinds.iter().map(|kind| *kind.layout());
    let layouts: Vec<CheckedLayout> = layouts.collect();
    for (kind, layout) in program.kinds.iter_mut().zip(&layouts) {
        kind.in_c = c::value(layout, table);
    }
    let are_packets = description.format().packets().is_some();
    let in_c = c::program(&layouts, program.longest, are_packets);
    let program = context! { ..Value::from_serialize(&program), ..in_c };
    render::source(&program, render::HEADER)
}

/// The values from which a program is made.
#[derive(Serialize)]
struct Program {
    /// The name of the module, or the prefix of a header's names.
    name: String,
    command: String,
    /// The version of framelock.
    version: &'static str,
    /// The number of bytes in the longest frame, plus 1 if only silence or a packet's delimiter ends it.
    longest: usize,
    /// The stuffing, if the frames are packets.
    packets: Value,
    has_kinds: bool,
    /// Whether decoding may fail for some kind of frames.
    may_fail: bool,
    kinds: Vec<KindItem>,
}

/// A kind of frames.
#[derive(Serialize)]
struct KindItem {
    /// The kind's name in the description.
    described_name: String,
    /// The kind's name in the program. In Rust it is the name of the kind's type. In C it is a part of the names of the
    /// kind's type and functions.
    name: String,
    layout: Value,
    /// Values that only the template of C headers needs.
    in_c: Value,
    /// The fields that the program reads and writes.
    items: Vec<Item>,
    /// Whether the kind's values borrow bytes of the frame.
    borrows: bool,
    /// The length of the shortest frame. It includes zero bytes that a sender may leave out, but not the trailer.
    start: usize,
    /// A divisor and a remainder. The length of every frame is a multiple of the divisor, plus the remainder.
    multiple: Option<(usize, usize)>,
    /// The zero bytes that a sender may leave out; `None` if there are none.
    zeros: Option<Zeros>,
    /// The patterns of the text.
    texts: Vec<Value>,
    /// The index of the first byte of the text.
    text_at: usize,
    /// The number of bytes at the frame's end that hold the parts whose offsets count from the end.
    from_end: usize,
    /// Whether decoding may fail: the text may differ from its patterns, or a value may be no number.
    may_fail: bool,
    /// Whether frames can be encoded: there is at most one pattern, and each value in it has a name.
    may_encode: bool,
}

/// The zero bytes at the end of the payload that a sender may leave out.
#[derive(Serialize)]
struct Zeros {
    /// The index of the first byte that may be left out.
    first: usize,
    /// Whether `encode` leaves out these zero bytes. `encode` writes the zero bytes if a field takes the rest of the
    /// frame, or if the frame's length must be a multiple of a number.
    are_left_out: bool,
}

/// A field as the program reads and writes it.
#[derive(Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "templates ask for each")]
struct Item {
    /// The field's name in the description.
    described_name: String,
    /// The field's name in the program.
    name: String,
    /// If decoding reports whether a frame has the field: the length of the shortest frame that has it.
    needs: Option<usize>,
    /// The minimum length of a frame with this field, for encoding. `None` if this field never makes a frame longer
    /// than the kind's `start`, or if it is a value in the text.
    least: Option<usize>,
    /// The index of the field's first byte. A negative index counts from the end of the frame.
    at: i16,
    /// The number of bytes at the end of the frame that the field cannot occupy.
    margin: usize,
    /// The field's position and meaning, for a comment.
    meaning: String,
    /// Whether the field consists of bytes instead of numbers.
    is_text: bool,
    /// Whether the field takes the rest of the frame.
    is_rest: bool,
    is_array: bool,
    is_appended: bool,
    /// The number of values in an array, or of bytes in a text.
    count: Option<usize>,
    /// The smallest Rust type that holds the number.
    number: String,
    /// Whether the number has a sign and fewer bits than its type.
    is_narrow_signed: bool,
    /// The name of the member that counts the values, if a shorter frame may have fewer of them.
    values: Option<String>,
    /// Whether the field is a value in the text of the frame.
    in_text: bool,
    /// The name of the variant of [`Notation`].
    notation: String,
    /// The number of decimals of a number in decimal notation.
    decimals: u32,
    /// Whether reading the field fails for some bytes, because they are no number in the field's notation.
    is_fallible: bool,
    /// The number of bytes in a number.
    bytes: usize,
    /// The encoding of a number: `le`, `be`, or `bits` for a bit field.
    encoding: &'static str,
    /// The index of a bit field's first bit, counted from the lowest bit of the byte at `at`.
    first: Option<usize>,
    /// The number of bits in the value.
    width: usize,
    /// The number of bits that the value takes in a frame.
    bits: usize,
    mask: Option<u64>,
    /// The index of the mask's lowest bit.
    shift: u32,
}

impl Program {
    fn new(description: &Description, name: &str, command: &str, language: &Language) -> Self {
        let has_kinds = description.kinds.len() > 1;
        let packets = description.format().packets();
        let mut reserved = language.reserved();
        let kinds = description.kinds.iter().map(|kind| {
            let name = if has_kinds {
                free(&(language.kind)(&kind.name), &mut reserved)
            } else {
                language.message.to_owned()
            };
            KindItem::new(kind, name, language)
        });
        let kinds: Vec<KindItem> = kinds.collect();
        Self {
            name: module(name),
            command: one_line(command),
            version: env!("CARGO_PKG_VERSION"),
            longest: description.format().longest(),
            packets: packets.map_or(().into(), layout::packets),
            has_kinds,
            may_fail: kinds.iter().any(|kind| kind.may_fail),
            kinds,
        }
    }
}

impl KindItem {
    fn new(kind: &Kind, name: String, language: &Language) -> Self {
        let is_fixed = kind.layout().length == Length::Fixed;
        // A sender may leave out trailing zero bytes of these fields.
        let is_cut = |field: &Field| {
            let is_alone = !field.is_appended && field.length().is_some();
            kind.has_truncated_zeros && is_alone && kind.shortest_with(field).is_some()
        };
        let is_always_there = |field: &&Field| kind.shortest_with(field).is_none() || is_cut(field);
        let always = kind.fields.iter().filter(is_always_there);
        let least = kind.least_length(always.filter_map(|field| field.end(0)));
        let start = least.max(kind.layout().shortest);
        let mut used = language.keywords();
        let items = kind
            .varying_fields()
            .filter(|field| !is_repeated(kind, field));
        let items = items.map(|field| {
            let least = field.end(0).map(|end| end + kind.from_end);
            let may_be_longer = |least: &usize| *least > start || field.length().is_none();
            let has_place = field.text.is_none();
            let needs = kind.shortest_with(field);
            let needs = needs.filter(|_| has_place && !is_cut(field));
            let item = Item::new(field, &mut used);
            let has_fewer = needs.is_some() && item.is_array;
            let values = has_fewer.then(|| free(&format!("{}_count", item.name), &mut used));
            Item {
                least: least.filter(|least| has_place && !is_fixed && may_be_longer(least)),
                needs: needs.filter(|_| values.is_none()),
                values,
                ..item
            }
        });
        let items: Vec<Item> = items.collect();
        let mut in_text = kind.texts.iter().flat_map(|text| &text.values);
        Self {
            described_name: kind.name.clone(),
            name,
            layout: layout::value(kind.layout()),
            in_c: Value::UNDEFINED,
            borrows: items.iter().any(|item| item.is_rest),
            items,
            start,
            multiple: kind.multiple(),
            zeros: kind.varying_fields().any(is_cut).then(|| Zeros {
                first: kind.first_zero(),
                are_left_out: kind.multiple().is_none()
                    && kind.fields.iter().all(|field| field.length().is_some()),
            }),
            may_fail: !kind.texts.is_empty() || kind.fields.iter().any(is_fallible),
            may_encode: kind.texts.len() < 2 && in_text.all(|value| value.name.is_some()),
            texts: kind.texts.iter().map(text).collect(),
            text_at: kind.text_at,
            from_end: kind.from_end,
        }
    }
}

/// Returns whether a field of bytes lies in another field that takes the rest of the frame. Generated code leaves out
/// the inner field.
#[must_use]
pub fn is_repeated(kind: &Kind, field: &Field) -> bool {
    let fields = kind.fields.iter();
    let mut others = fields.filter(|it| it.text.is_none() && it.at >= 0);
    let has_whole = others.any(|it| it.is_bytes() && it.count.is_none() && it.at <= field.at);
    has_whole && field.is_bytes() && field.count.is_some() && !field.is_appended
}

/// Returns whether some bytes are no number in the field's notation.
fn is_fallible(field: &Field) -> bool {
    !field.is_bytes() && matches!(field.notation, Notation::Hex | Notation::Bcd)
}

/// Returns the template values for a pattern of a text.
fn text(text: &Pattern) -> Value {
    let values = text.values.iter();
    let values = values.map(|value| context! { name => value.name, after => value.after });
    context! { first => text.first, values => values.collect::<Vec<_>>() }
}

impl Item {
    fn new(field: &Field, used: &mut HashSet<String>) -> Self {
        let (bytes, encoding, first) = match field.kind {
            Type::Number(number) if number.bytes == 1 => (1, "le", None),
            Type::Number(number) => (number.bytes, layout::order(number.order), None),
            Type::Bits { first, .. } => (0, "bits", Some(first)),
            Type::Bytes | Type::Text => (0, "", None),
        };
        let has_pattern = field.text.is_some();
        let is_text = field.is_bytes()
            && !(has_pattern && matches!(field.notation, Notation::Decimal | Notation::Hex));
        let class = match field.class() {
            Class::Signed if is_text => 'u',
            Class::Unsigned => 'u',
            Class::Signed => 'i',
            Class::Float => 'f',
        };
        let width = if has_pattern { 32 } else { field.value_width() };
        let digits = 1 + usize::from(field.notation == Notation::Hex);
        let type_width = width.next_power_of_two().max(8);
        Self {
            described_name: field.name.clone(),
            name: free(&names::words(&field.name).join("_"), used),
            needs: None,
            least: None,
            at: field.at,
            margin: field.margin,
            meaning: meaning(field),
            is_text,
            is_rest: is_text && field.length().is_none(),
            is_array: field.is_array(),
            is_appended: field.is_appended,
            count: field.count,
            number: format!("{class}{type_width}"),
            is_narrow_signed: class == 'i' && width < type_width,
            values: None,
            in_text: has_pattern,
            notation: format!("{:?}", field.notation),
            decimals: field.decimals.unwrap_or_default(),
            is_fallible: is_fallible(field),
            bytes,
            encoding,
            first,
            width,
            bits: first.map_or(8 * bytes * digits, |_| width),
            mask: field.mask,
            shift: field.mask.map_or(0, u64::trailing_zeros),
        }
    }
}

/// Returns the position and the meaning of a field, for a comment.
fn meaning(field: &Field) -> String {
    let place = match field.kind {
        _ if field.is_appended => "After the frame".to_owned(),
        _ if field.text.is_some() => "In the text".to_owned(),
        Type::Bits { first, width: 1 } => format!("At {}, bit {first}: 1 bit", field.at),
        Type::Bits { first, width } => format!("At {}, bit {first}: {width} bits", field.at),
        Type::Number(number) => format!("At {}: {number}", field.at),
        Type::Bytes => format!("At {}: bytes", field.at),
        Type::Text => format!("At {}: text", field.at),
    };
    let notation = match field.notation {
        Notation::SignMagnitude => Some(", sign and magnitude"),
        Notation::Bcd => Some(", BCD"),
        Notation::Hex => Some(", hex digits"),
        _ => None,
    };
    let decimals = field.decimals.filter(|decimals| *decimals > 0);
    let (scale, unit) = (field.scale.as_ref(), field.unit.as_ref());
    let parts = [
        field.mask.map(|mask| format!(", mask {mask:#X}")),
        notation.map(str::to_owned),
        decimals.map(|decimals| format!(", times 10^{decimals}")),
        scale.map(|scale| format!("; times {scale}")),
        unit.map(|unit| format!("; in `{}`", one_line(unit))),
    ];
    let names = field
        .names
        .iter()
        .map(|(number, name)| format!("; {number}: {}", one_line(name)));
    let missing = field.missing.as_ref();
    let missing = missing.map(|missing| format!("; {missing}: no value"));
    let parts = parts.into_iter().flatten().chain(names).chain(missing);
    place + &parts.collect::<String>() + "."
}
