//! Computes the code that the template of a Rust module inserts.

use framelock_formats::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Encoding, KnownMessage, Layout, Length, LengthField,
    Messages, Number, Patterns,
};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use minijinja::{Value, context};

use crate::{Item, KindItem};

/// Returns the template values for a kind.
pub(crate) fn value(kind: &KindItem) -> Value {
    let layout = &kind.checked_layout;
    let counts_from_end = |item: &Item| item.is_rest || item.needs.is_some() || item.at < 0;
    let is_counted =
        layout.other_terminators[0].length > 0 && kind.items.iter().any(counts_from_end);
    let length = if is_counted { "counted" } else { "frame.len()" };
    let leaves_out = kind.zeros.as_ref().is_some_and(|zeros| zeros.are_left_out);
    let items = kind.items.iter().map(|item| {
        let read = match &kind.zeros {
            Some(_) if item.at >= 0 && !item.is_rest && !item.is_appended => read(item, "", true),
            Some(_) if !item.is_appended => read_if_present(item, length).replace("frame", "whole"),
            _ => read_if_present(item, length),
        };
        let to_bits = match (&*item.number, item.is_array, item.needs) {
            ("f32", true, Some(_)) => ".map(|all| all.map(f32::to_bits))",
            ("f32", false, None) => ".to_bits()",
            ("f32", true, None) | ("f32", false, Some(_)) => ".map(f32::to_bits)",
            _ => "",
        };
        // Fields that are counted from the front are written before zeros at the end are left out.
        let is_put_first = leaves_out && !item.is_appended && item.at >= 0;
        context! { type => type_of(item), read, to_bits, is_put_first, put => put(item, is_put_first) }
    });
    let appended = kind.items.iter().find(|item| item.is_appended);
    context! {
        layout => self::layout(layout),
        is_counted,
        items => items.collect::<Vec<_>>(),
        set_length => set_length(kind),
        appended => appended.map(|item| &item.name),
        trailer => layout.trailer.map(|it| context! {
            at => it.at,
            mask => byte(it.mask),
            bytes => it.bytes,
            lowest_bit => byte(it.mask & it.mask.wrapping_neg()),
        }),
    }
}

/// Returns a struct literal in the style of rustfmt. Leaves out fields without a value, which `base` has.
fn literal<const N: usize>(name: &str, fields: [(&str, Option<String>); N], base: &str) -> String {
    let mut text = format!("{name} {{\n");
    for (name, value) in fields {
        if let Some(value) = value {
            text += &format!("    {name}: {},\n", value.replace('\n', "\n    "));
        }
    }
    if !base.is_empty() {
        text += &format!("    ..{base}\n");
    }
    text + "}"
}

/// Returns a reference to a list in the style of rustfmt: in one line if it is short.
pub(crate) fn list(each: &[String]) -> String {
    let line = each.join(", ");
    match each {
        [_] => format!("&[{line}]"),
        _ if line.len() <= 60 && !line.contains('\n') => format!("&[{line}]"),
        _ => format!("&[\n    {},\n]", each.join(",\n").replace('\n', "\n    ")),
    }
}

/// Returns a value that differs from the usual one.
fn unusual<T: Copy + PartialEq + ToString>(value: T, usual: T) -> Option<String> {
    (value != usual).then(|| value.to_string())
}

fn byte(byte: u8) -> String {
    format!("{byte:#04X}")
}

fn number(number: &Number) -> String {
    match (number.bytes, number.order) {
        (1, ByteOrder::Little) => format!("byte({})", number.at),
        (bytes, order) => format!("new({}, {bytes}, layout::ByteOrder::{order:?})", number.at),
    }
}

fn patterns(patterns: &Patterns) -> Option<String> {
    let bytes = list(
        &patterns
            .bytes
            .iter()
            .map(|it| byte(*it))
            .collect::<Vec<_>>(),
    );
    match patterns.length {
        0 => None,
        length if length == patterns.bytes.len() => Some(format!("layout::Patterns::one({bytes})")),
        length => Some(format!("layout::Patterns::any_of({bytes}, {length})")),
    }
}

fn layout(layout: &Layout) -> String {
    let fixed = layout.fixed.iter().map(|bits| {
        let fields = [
            ("at", Some(bits.at.to_string())),
            ("mask", Some(byte(bits.mask))),
            ("value", Some(byte(bits.value))),
        ];
        literal("layout::FixedBits", fields, "")
    });
    let fixed: Vec<String> = fixed.collect();
    let content = layout
        .content
        .iter()
        .map(|(a, b)| format!("({}, {})", byte(*a), byte(*b)));
    let content: Vec<String> = content.collect();
    let [other, another] = layout.other_terminators.map(|other| patterns(&other));
    let other_terminators = other.map(|other| {
        let another = another.unwrap_or_else(|| "layout::Patterns::NONE".to_owned());
        format!("[\n    {other},\n    {another},\n]")
    });
    let trailer = layout.trailer.map(|it| {
        let fields = [
            ("at", Some(it.at.to_string())),
            ("mask", Some(byte(it.mask))),
            ("bytes", Some(it.bytes.to_string())),
        ];
        format!("Some({})", literal("layout::Trailer", fields, ""))
    });
    let fields = [
        ("sync", patterns(&layout.sync)),
        ("length", length(&layout.length)),
        ("shortest", Some(layout.shortest.to_string())),
        ("longest", Some(layout.longest.to_string())),
        ("fixed", (!fixed.is_empty()).then(|| list(&fixed))),
        ("messages", layout.messages.as_ref().map(messages)),
        ("checksum", layout.checksum.as_ref().map(checksum)),
        ("terminator", patterns(&layout.terminator)),
        ("content", (!content.is_empty()).then(|| list(&content))),
        ("other_terminators", other_terminators),
        ("trailer", trailer),
    ];
    literal("Layout", fields, "Layout::NONE")
}

fn length(length: &Length) -> Option<String> {
    let field = match length {
        Length::Field(field) => field,
        Length::Delimiter => return Some("layout::Length::Delimiter".to_owned()),
        _ => return None,
    };
    let usual = LengthField::new(field.number);
    let base = match number(&field.number) {
        byte if byte.starts_with("byte") => format!("layout::LengthField::{byte}"),
        new => format!("layout::LengthField::new(layout::Number::{new})"),
    };
    let mask = (field.mask != usual.mask).then(|| format!("{:#X}", field.mask));
    let fields = [
        ("mask", mask),
        ("factor", unusual(field.factor, usual.factor)),
        ("plus", unusual(field.plus, usual.plus)),
    ];
    let field = if *field == usual {
        base
    } else {
        literal("layout::LengthField", fields, &base)
    };
    Some(format!("layout::Length::Field({field})"))
}

fn messages(messages: &Messages) -> String {
    // A large table is a constant of `framelock-formats`.
    let known = match messages.known {
        COMMON => "framelock_formats::mavlink::COMMON".to_owned(),
        ARDUPILOTMEGA => "framelock_formats::mavlink::ARDUPILOTMEGA".to_owned(),
        known => list(&known.iter().copied().map(known_message).collect::<Vec<_>>()),
    };
    let number = format!("layout::Number::{}", number(&messages.number));
    let fields = [("number", Some(number)), ("known", Some(known))];
    format!("Some({})", literal("layout::Messages", fields, ""))
}

fn known_message(message: KnownMessage) -> String {
    if message == KnownMessage::new(message.number) {
        return format!("layout::KnownMessage::new({})", message.number);
    }
    let fields = [
        ("number", Some(message.number.to_string())),
        ("longest_payload", Some(message.longest_payload.to_string())),
        ("extra", Some(format!("{:?}", message.extra))),
    ];
    literal("layout::KnownMessage", fields, "")
}

fn checksum(checksum: &Checksum) -> String {
    let usual = Checksum::at_the_end(checksum.bytes);
    let algorithm = match &checksum.algorithm {
        Algorithm::Crc(crc) => format!("layout::Algorithm::Crc({})", self::crc(crc)),
        sum => format!("layout::Algorithm::{sum:?}"),
    };
    let encoding = format!("layout::Encoding::{:?}", checksum.encoding);
    let fields = [
        ("algorithm", Some(algorithm)),
        (
            "encoding",
            Some(encoding).filter(|_| checksum.encoding != Encoding::Little),
        ),
        ("at", unusual(checksum.at, usual.at)),
        ("from", unusual(checksum.from, usual.from)),
        ("to", unusual(checksum.to, usual.to)),
    ];
    let base = format!("layout::Checksum::at_the_end({})", checksum.bytes);
    format!("Some({})", literal("layout::Checksum", fields, &base))
}

fn crc(crc: &Crc) -> String {
    let base = format!("layout::Crc::new({}, {:#X})", crc.width, crc.polynomial);
    let hex = |number: u32| (number > 0).then(|| format!("{number:#X}"));
    let fields = [
        ("initial", hex(crc.initial)),
        ("xor_out", hex(crc.xor_out)),
        ("reflected_in", unusual(crc.reflected_in, false)),
        ("reflected_out", unusual(crc.reflected_out, false)),
    ];
    if fields.iter().all(|(_, value)| value.is_none()) {
        return base;
    }
    literal("layout::Crc", fields, &base)
}

fn type_of(item: &Item) -> String {
    let all = match (item.is_rest, item.count) {
        (true, _) => "&'a [u8]".to_owned(),
        (false, Some(count)) => format!("[{}; {count}]", item.number),
        (false, None) => item.number.clone(),
    };
    match item.needs {
        None => all,
        Some(_) => format!("Option<{all}>"),
    }
}

/// Returns the index of a field's first byte. A negative position counts back from `length`.
fn index(item: &Item, length: &str) -> String {
    match (item.at, item.at.unsigned_abs()) {
        (0.., at) => at.to_string(),
        (_, distance) if length == "length" => format!("length - {distance}"),
        (_, distance) => format!("{length}.saturating_sub({distance})"),
    }
}

/// Returns the arguments that select a number or bits, after the frame.
fn place(item: &Item, at: &str) -> String {
    let index = |size: usize| format!(" + {size} * i");
    let each = |size: usize| {
        Some(size)
            .filter(|_| item.is_array)
            .map_or(String::new(), index)
    };
    match item.first {
        None => format!("{at}{}, {}", each(item.bytes), item.bytes),
        Some(first) => {
            let first = match usize::try_from(item.at) {
                Ok(at) => (8 * at + first).to_string(),
                Err(_) => format!("8 * ({at}) + {first}"),
            };
            format!("{first}{}, {}", each(item.width), item.width)
        }
    }
}

/// Returns an expression that reads a number from `frame`.
fn read_number(item: &Item, at: &str) -> String {
    let place = place(item, at);
    let mut value = match item.first {
        Some(_) => format!("bits(frame, {place})"),
        None => format!("{}(frame, {place})", item.order),
    };
    if let Some(mask) = item.mask {
        value = match item.shift {
            0 => format!("({value} & {mask:#X})"),
            shift => format!("(({value} & {mask:#X}) >> {shift})"),
        };
    }
    if item.is_narrow_signed {
        value = format!("signed({value}, {})", item.width);
    }
    match &*item.number {
        "u64" => value,
        "f32" => format!("f32::from_bits({value} as u32)"),
        number => format!("{value} as {number}"),
    }
}

/// Returns an expression that reads a field which every frame has from `frame`.
fn read(item: &Item, length: &str, is_truncated: bool) -> String {
    let at = index(item, length);
    if item.is_text && is_truncated {
        return format!(
            "core::array::from_fn(|i| frame.get({at} + i).copied().unwrap_or_default())"
        );
    }
    match (item.is_text, item.is_array) {
        (true, _) => format!("bytes(frame, {at})"),
        (false, true) => format!("core::array::from_fn(|i| {})", read_number(item, &at)),
        (false, false) => read_number(item, &at),
    }
}

/// Returns an expression that reads a field from `frame`, if the frame is long enough.
fn read_if_present(item: &Item, length: &str) -> String {
    if item.is_appended {
        return "appended.first_chunk().copied()".to_owned();
    }
    if item.is_rest {
        let margin = match length {
            "frame.len()" => item.margin.to_string(),
            length => format!("{} + frame.len() - {length}", item.margin),
        };
        let rest = format!("rest(frame, {}, {margin})", index(item, length));
        return match item.needs {
            None => format!("{rest}.unwrap_or_default()"),
            Some(_) => rest,
        };
    }
    let value = read(item, length, false);
    match item.needs {
        None => value,
        Some(least) => format!("({length} >= {least}).then(|| {value})"),
    }
}

/// Returns the statements that write a field into `frame`; none for a trailer. If the field may be missing, `encode`
/// writes it if there is a value, or `is_put_first` is true.
fn put(item: &Item, is_put_first: bool) -> String {
    let (name, is_text) = (&item.name, item.is_text);
    if item.is_appended {
        return String::new();
    }
    if item.needs.is_none() || is_put_first {
        let is_array_of_bytes = is_text && item.count.is_some();
        return put_value(
            item,
            &format!("{}self.{name}", if is_array_of_bytes { "&" } else { "" }),
        );
    }
    let reference = if is_text || item.is_array { "&" } else { "" };
    let put = put_value(item, "value").replace('\n', "\n    ");
    format!("if let Some(value) = {reference}self.{name} {{\n    {put}\n}}")
}

fn put_value(item: &Item, value: &str) -> String {
    let at = index(item, "length");
    if item.is_text {
        return format!("put(frame, {at}, {value});");
    }
    let mut number = if item.is_array { "value" } else { value }.to_owned();
    number += match &*item.number {
        "u64" => "",
        "f32" => ".to_bits() as u64",
        _ => " as u64",
    };
    if item.shift > 0 {
        number = format!("(({number}) << {})", item.shift);
    }
    if let Some(mask) = item.mask {
        number += &format!(" & {mask:#X}");
    }
    let function = if item.first.is_some() {
        "bits"
    } else {
        item.order
    };
    let put = format!("put_{function}(frame, {}, {number});", place(item, &at));
    if item.is_array {
        return format!("for (i, &value) in {value}.iter().enumerate() {{\n    {put}\n}}");
    }
    put
}

/// Returns the statements that set `length` to the length of the frame with these values, without the trailer.
fn set_length(kind: &KindItem) -> String {
    let longer = kind
        .items
        .iter()
        .filter_map(|item| Some((item, item.least?)));
    let longer: Vec<(&Item, usize)> = longer.collect();
    let start = kind.start;
    let mut text = match &*longer {
        [] => format!("let length = {start};"),
        [(item, least)] if item.needs.is_none() && *least == start => {
            format!("let length = {start} + self.{}.len();", item.name)
        }
        longer => {
            let mut text = format!("let mut length = {start};");
            for (
                Item {
                    name,
                    is_rest,
                    needs,
                    ..
                },
                least,
            ) in longer
            {
                text += &match (is_rest, needs) {
                    (false, _) => format!(
                        "\nif self.{name}.is_some() {{\n    length = length.max({least});\n}}"
                    ),
                    (true, None) => format!("\nlength = length.max({least} + self.{name}.len());"),
                    (true, Some(_)) => format!(
                        "\nif let Some(rest) = self.{name} {{\n    length = length.max({least} + rest.len());\n}}"
                    ),
                };
            }
            text
        }
    };
    if let Some((factor, more)) = kind.multiple {
        let sum = factor + more;
        text += &format!("\n// Round up: every length is {more} more than a multiple of {factor}.");
        text += &format!("\nlet length = length + ({sum} - length % {factor}) % {factor};");
    }
    text
}
