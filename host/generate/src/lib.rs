//! A description as source code: the layout, a struct of each kind's fields, decode and encode. What is here the languages
//! have in common.

#![forbid(unsafe_code)]

mod c;
mod c_layout;
mod code;
mod rust;
mod rust_layout;

use std::collections::HashSet;

use framelock_description::{Class, Field, Kind, NumberType, Type};
use framelock_formats::layout::{ByteOrder, Length};

pub use c::c;
pub use rust::rust;

/// A field as code reads and writes it.
struct Item<'a> {
    field: &'a Field,
    /// What it is called.
    name: String,
    /// The bytes of the shortest frame that has it, if not each has.
    needs: Option<usize>,
}

/// The fields that frames differ in, by names that are free.
fn items<'a>(kind: &'a Kind, taken: &[&str]) -> Vec<Item<'a>> {
    let mut taken = taken.iter().map(|&name| name.to_owned()).collect();
    let fields = kind.fields.iter().filter(|field| field.constant.is_none());
    let item = fields.map(|field| Item {
        field,
        name: free(&words(&field.name).join("_"), &mut taken),
        needs: kind.shortest_with(field),
    });
    item.collect()
}

/// A name, or the same with underscores behind it, which nothing has yet.
fn free(name: &str, taken: &mut HashSet<String>) -> String {
    let mut name = name.to_owned();
    while !taken.insert(name.clone()) {
        name.push('_');
    }
    name
}

/// The parts of a name, in small letters.
fn words(name: &str) -> Vec<String> {
    let parts = name.split(|c: char| !c.is_ascii_alphanumeric());
    let words = parts.filter(|part| !part.is_empty());
    words.map(str::to_ascii_lowercase).collect()
}

/// The name of a module or a file's functions.
fn module(name: &str) -> String {
    let name = words(name).join("_");
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("frame{name}")
    }
}

/// What the generated code says of a field.
trait FieldCode {
    fn number(&self) -> (Class, usize);
    fn told(&self) -> String;
    fn place(&self, end: impl Fn(usize) -> String) -> String;
    fn reading(&self, prefix: &str, end: impl Fn(usize) -> String) -> String;
    fn writing(&self, prefix: &str, value: &str, end: impl Fn(usize) -> String) -> String;
    fn place_of_bits(&self, at: &str) -> String;
}

impl FieldCode for Field {
    /// What the bits of its values mean, and how many the smallest type has that holds them.
    fn number(&self) -> (Class, usize) {
        let class = match self.kind {
            Type::Number(number) => number.class,
            _ => Class::Unsigned,
        };
        (class, self.value_width().next_power_of_two().max(8))
    }

    /// Where it is and what, for its documentation.
    fn told(&self) -> String {
        let at = self.at;
        let place = match self.kind {
            _ if self.is_appended => "Behind the frame".to_owned(),
            Type::Bits { first, width } => format!("At {at}, bit {first}: {width} bits"),
            Type::Number(number) => format!("At {at}: {number}"),
            Type::Bytes => format!("At {at}: bytes"),
            Type::Text => format!("At {at}: text"),
        };
        let mask = self.mask.map(|mask| format!(", mask {mask:#X}"));
        let scale = self.scale.as_ref();
        let scale = scale.map(|scale| format!("; times {}", scale.text(1)));
        let unit = self.unit.as_ref().map(|unit| format!("; in `{unit}`"));
        let told = [Some(place), mask, scale, unit].into_iter().flatten();
        one_line(&told.collect::<String>()) + "."
    }

    /// Its first byte, or that of each of an array; `end` is the length of the frame, less what is put in.
    fn place(&self, end: impl Fn(usize) -> String) -> String {
        let distance = usize::from(self.at.unsigned_abs());
        let first = match self.at {
            ..0 => end(distance),
            _ => distance.to_string(),
        };
        match self.kind {
            Type::Number(number) if self.is_array() => format!("{first} + {} * i", number.bytes),
            _ => first,
        }
    }

    /// One of its values in `frame`, by the functions of the generated code: an expression of the widest type.
    fn reading(&self, prefix: &str, end: impl Fn(usize) -> String) -> String {
        let at = self.place(end);
        match self.kind {
            Type::Number(number) => {
                let order = order(number);
                let mut value = format!("{prefix}{order}(frame, {at}, {})", number.bytes);
                if let Some(mask) = self.mask {
                    value = match mask.trailing_zeros() {
                        0 => format!("({value} & {mask:#X})"),
                        shift => format!("(({value} & {mask:#X}) >> {shift})"),
                    };
                }
                let width = self.value_width();
                if number.class == Class::Signed && width < self.number().1 {
                    value = format!("{prefix}signed({value}, {width})");
                }
                value
            }
            _ => format!("{prefix}bits(frame, {})", self.place_of_bits(&at)),
        }
    }

    /// The statement that writes one of its values, an expression of the widest type, into `frame`.
    fn writing(&self, prefix: &str, value: &str, end: impl Fn(usize) -> String) -> String {
        let at = self.place(end);
        match self.kind {
            Type::Number(number) => {
                let value = match self.mask.map(|mask| (mask, mask.trailing_zeros())) {
                    None => value.to_owned(),
                    Some((mask, 0)) => format!("{value} & {mask:#X}"),
                    Some((mask, shift)) => format!("(({value}) << {shift}) & {mask:#X}"),
                };
                let (order, bytes) = (order(number), number.bytes);
                format!("{prefix}put_{order}(frame, {at}, {bytes}, {value});")
            }
            _ => format!(
                "{prefix}put_bits(frame, {}, {value});",
                self.place_of_bits(&at)
            ),
        }
    }

    /// Its first bit, counted from the frame's, or that of each of an array; and how many bits it has.
    fn place_of_bits(&self, at: &str) -> String {
        let (first, width) = match self.kind {
            Type::Bits { first, width } => (first, width),
            _ => (0, 0),
        };
        let first = match at.parse::<usize>() {
            Ok(at) => (8 * at + first).to_string(),
            Err(_) => format!("8 * ({at}) + {first}"),
        };
        let each = if self.is_array() {
            format!(" + {width} * i")
        } else {
            String::new()
        };
        format!("{first}{each}, {width}")
    }
}

fn order(number: NumberType) -> &'static str {
    match number.order {
        ByteOrder::Big if number.bytes > 1 => "be",
        _ => "le",
    }
}

/// The bytes that each frame has without its appendix; and the fields that make it longer: if it has one, it has so many
/// bytes at least, and those of what takes the rest.
fn length<'a>(kind: &Kind, items: &'a [Item]) -> (usize, Vec<(&'a Item<'a>, usize)>) {
    if kind.layout.length == Length::Fixed {
        return (kind.layout.longest, vec![]);
    }
    let always = kind.fields.iter();
    let always = always.filter(|field| kind.shortest_with(field).is_none());
    let start = kind.least_length(always.filter_map(|field| field.end(0)));
    let start = start.max(kind.layout.shortest);
    let longer = items.iter();
    let longer = longer.filter_map(|item| Some((item, item.field.end(0)? + kind.trailer)));
    let longer = longer.filter(|(item, least)| *least > start || item.field.length().is_none());
    (start, longer.collect())
}

/// Those of the functions, each with a blank line behind it, that code calls.
fn called(code: &str, functions: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || "_.".contains(c);
    let is_called = |function: &&str| {
        let (before, _) = function.split_once(['(', '<']).unwrap_or_default();
        let name = before.rsplit(|c| !is_name(c)).next().unwrap_or_default();
        let call = format!("{name}(");
        let mut calls = code.match_indices(&call);
        calls.any(|(at, _)| !code[..at].ends_with(is_name))
    };
    let functions = functions.split_inclusive("\n\n");
    functions.filter(is_called).collect()
}

/// What stands in a comment: one line of it.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ").replace("*/", "* /")
}
