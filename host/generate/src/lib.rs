//! Generates source code from a [`Description`]: the layout, a struct for the fields of each kind, and functions that
//! decode and encode frames.
//!
//! Each language has a template, which contains the text of the generated program. `rust` and `c` compute the values that
//! the templates insert.
#![forbid(unsafe_code)]
#![allow(clippy::format_push_string, reason = "speed does not matter here")]

mod c;
mod names;
mod render;
mod rust;

use std::collections::HashSet;

use framelock::Format as _;
use framelock_description::{Class, Description, Field, Kind, Type};
use framelock_formats::layout::{ByteOrder, CheckedLayout, Length};
use minijinja::{Value, context};
use serde::Serialize;

pub use c::CrcTable;
use names::{Language, free, module, one_line};

/// Returns the source of a `no_std` Rust module that receives and encodes the frames of a description. `name` is the
/// module's name, and `command` is the command that generates it.
#[must_use]
pub fn rust(description: &Description, name: &str, command: &str) -> String {
    let mut program = Program::new(description, name, command, &names::RUST);
    for kind in &mut program.kinds {
        kind.code = rust::value(kind);
    }
    let layouts = program
        .kinds
        .iter()
        .map(|kind| format!("{}::LAYOUT", kind.name));
    let layouts = rust::list(&layouts.collect::<Vec<_>>());
    let program = context! { layouts, ..Value::from_serialize(&program) };
    render::source(program, name, render::MODULE)
}

/// Returns a self-contained C header that receives and encodes the frames of a description. It is valid C99 and C++17.
/// `name` is the header's name, and `command` is the command that generates it.
#[must_use]
pub fn c(description: &Description, name: &str, command: &str, table: CrcTable) -> String {
    let mut program = Program::new(description, name, command, &names::C);
    let layouts: Vec<CheckedLayout> = program
        .kinds
        .iter()
        .map(|kind| kind.checked_layout)
        .collect();
    for kind in &mut program.kinds {
        kind.layout = c::value(&kind.checked_layout, table);
        for item in &mut kind.items {
            item.in_c = c::access(item);
        }
    }
    let program = context! { ..Value::from_serialize(&program), ..c::program(&layouts) };
    render::source(program, name, render::HEADER)
}

/// The values from which a program is made.
#[derive(Serialize)]
struct Program<'d> {
    /// The name of the module, or the prefix of a header's names.
    name: String,
    command: String,
    /// The version of framelock.
    version: &'static str,
    /// The number of bytes in the longest frame.
    longest: usize,
    has_kinds: bool,
    kinds: Vec<KindItem<'d>>,
}

/// A kind of frames.
#[derive(Serialize)]
struct KindItem<'d> {
    /// The kind's name in the description.
    described_name: String,
    /// The kind's name in the program. In Rust it is the name of the kind's type. In C it is a part of the names of the
    /// kind's type and functions.
    name: String,
    #[serde(skip)]
    checked_layout: CheckedLayout<'d>,
    /// The layout as the template of headers needs it.
    layout: Value,
    /// The code that the template of modules inserts.
    code: Value,
    /// The number of bytes in the longest frame.
    longest: usize,
    /// The fields whose values differ between frames.
    items: Vec<Item>,
    /// Whether the kind's values borrow bytes of the frame.
    borrows: bool,
    /// The length of the shortest frame. It includes zero bytes that a sender may leave out, but not the trailer.
    start: usize,
    /// A divisor and a remainder. The length of every frame is a multiple of the divisor, plus the remainder.
    multiple: Option<(usize, usize)>,
    /// The zero bytes that the sender leaves out; `None` if it leaves out none.
    zeros: Option<Zeros>,
}

/// The zero bytes at the end of the payload that the sender leaves out.
#[derive(Serialize)]
struct Zeros {
    /// The index of the first byte that may be left out.
    first: usize,
    /// The number of bytes that follow the payload in a frame without its trailer.
    margin: usize,
    /// Whether `encode` leaves out these zero bytes. `encode` writes the zero bytes if a field takes the rest of the
    /// frame, or if some lengths are not possible.
    are_left_out: bool,
}

/// A field as the program reads and writes it.
#[derive(Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "templates ask for each")]
struct Item {
    /// The field's name in the program.
    name: String,
    /// The length of the shortest frame that has the field, for decoding; `None` if every frame has it.
    needs: Option<usize>,
    /// The minimum length of a frame with this field, for encoding. `None` if this field never makes a frame longer
    /// than `start`.
    least: Option<usize>,
    /// The index of the field's first byte. A negative index counts from the end of the frame.
    at: i16,
    /// The number of bytes between the field and the frame's end, if the field takes the rest.
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
    /// The number of bytes in a number.
    bytes: usize,
    /// The order of the number's bytes: `le` or `be`.
    order: &'static str,
    /// The index of a bit field's first bit, counted from the lowest bit of the byte at `at`.
    first: Option<usize>,
    /// The number of bits in the value.
    width: usize,
    mask: Option<u64>,
    /// The index of the mask's lowest bit.
    shift: u32,
    #[serde(flatten)]
    in_c: c::Access,
}

impl<'d> Program<'d> {
    fn new(description: &'d Description, name: &str, command: &str, language: &Language) -> Self {
        let has_kinds = description.kinds.len() > 1;
        let mut reserved = language.reserved();
        let kinds = description.kinds.iter().map(|kind| {
            let name = if has_kinds {
                free(&(language.kind)(&kind.name), &mut reserved)
            } else {
                language.message.to_owned()
            };
            KindItem::new(kind, name, language)
        });
        Self {
            name: module(name),
            command: one_line(command),
            version: env!("CARGO_PKG_VERSION"),
            longest: description.format().longest(),
            has_kinds,
            kinds: kinds.collect(),
        }
    }
}

impl<'d> KindItem<'d> {
    fn new(kind: &'d Kind, name: String, language: &Language) -> Self {
        let is_fixed = kind.layout().length == Length::Fixed;
        let is_cut = |field: &Field| {
            let is_alone = !field.is_appended && field.length().is_some();
            kind.has_truncated_zeros && is_alone && kind.shortest_with(field).is_some()
        };
        let start = if is_fixed {
            kind.layout().longest
        } else {
            let fields = kind.fields.iter();
            let always =
                fields.filter(|field| kind.shortest_with(field).is_none() || is_cut(field));
            let least = kind.least_length(always.filter_map(|field| field.end(0)));
            least.max(kind.layout().shortest)
        };
        let mut used = language.keywords();
        let items = kind.varying_fields().map(|field| {
            let least = field.end(0).map(|end| end + kind.from_end);
            let may_be_longer = |least: &usize| *least > start || field.length().is_none();
            let item = Item::new(kind, field, &mut used);
            Item {
                least: least.filter(may_be_longer).filter(|_| !is_fixed),
                needs: item.needs.filter(|_| !is_cut(field)),
                ..item
            }
        });
        let items: Vec<Item> = items.collect();
        Self {
            described_name: kind.name.clone(),
            name,
            checked_layout: *kind.layout(),
            layout: Value::UNDEFINED,
            code: Value::UNDEFINED,
            longest: kind.layout().longest,
            borrows: items.iter().any(|item| item.is_rest),
            items,
            start,
            multiple: kind.multiple(),
            zeros: kind.varying_fields().any(is_cut).then(|| Zeros {
                first: kind.first_zero(),
                margin: kind.from_end,
                are_left_out: kind.multiple().is_none()
                    && kind.fields.iter().all(|it| it.length().is_some()),
            }),
        }
    }
}

impl Item {
    fn new(kind: &Kind, field: &Field, used: &mut HashSet<String>) -> Self {
        let (bytes, order, first) = match field.kind {
            Type::Number(number) if number.bytes > 1 && number.order == ByteOrder::Big => {
                (number.bytes, "be", None)
            }
            Type::Number(number) => (number.bytes, "le", None),
            Type::Bits { first, .. } => (0, "", Some(first)),
            Type::Bytes | Type::Text => (0, "", None),
        };
        let class = match field.class() {
            Class::Unsigned => 'u',
            Class::Signed => 'i',
            Class::Float => 'f',
        };
        let width = field.value_width();
        let type_width = width.next_power_of_two().max(8);
        Self {
            name: free(&names::words(&field.name).join("_"), used),
            needs: kind.shortest_with(field),
            least: None,
            at: field.at,
            margin: field.margin,
            meaning: meaning(field),
            is_text: field.is_text(),
            is_rest: field.length().is_none(),
            is_array: field.is_array(),
            is_appended: field.is_appended,
            count: field.count,
            number: format!("{class}{type_width}"),
            is_narrow_signed: field.class() == Class::Signed && width < type_width,
            bytes,
            order,
            first,
            width,
            mask: field.mask,
            shift: field.mask.map_or(0, u64::trailing_zeros),
            in_c: c::Access::default(),
        }
    }
}

/// Returns the position and the meaning of a field, for a comment.
fn meaning(field: &Field) -> String {
    let place = match field.kind {
        _ if field.is_appended => "After the frame".to_owned(),
        Type::Bits { first, width: 1 } => format!("At {}, bit {first}: 1 bit", field.at),
        Type::Bits { first, width } => format!("At {}, bit {first}: {width} bits", field.at),
        Type::Number(number) => format!("At {}: {number}", field.at),
        Type::Bytes => format!("At {}: bytes", field.at),
        Type::Text => format!("At {}: text", field.at),
    };
    let mask = field
        .mask
        .map_or(String::new(), |mask| format!(", mask {mask:#X}"));
    let scale = field
        .scale
        .as_ref()
        .map_or(String::new(), |scale| format!("; times {scale}"));
    let unit = field
        .unit
        .as_ref()
        .map_or(String::new(), |unit| format!("; in `{}`", one_line(unit)));
    format!("{place}{mask}{scale}{unit}.")
}
