//! Layouts in C, member by member: C++17 knows no other way.

use framelock_formats::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Layout, Length, Number, Patterns, Written,
};

use crate::code::{Code, add};

/// What the layouts point to, each by the name of its kind; then the layouts themselves.
pub(super) fn layouts(code: &mut Code, prefix: &str, kinds: &[(&str, &Layout)]) {
    let layouts = kinds
        .iter()
        .map(|(name, it)| layout(code, &format!("{prefix}_{name}"), it));
    let layouts = layouts.collect::<String>();
    code.add("\n/* What the frames look like. */");
    add!(
        code,
        "static const framelock_layout {prefix}_layouts[] = {{\n{layouts}}};"
    );
}

fn layout(code: &mut Code, name: &str, layout: &Layout) -> String {
    let sync = patterns(code, &format!("{name}_sync"), &layout.sync);
    let terminator = patterns(code, &format!("{name}_terminator"), &layout.terminator);
    let fixed = layout.fixed.iter();
    let fixed = fixed.map(|it| format!("{{{}, {:#04X}, {:#04X}}}", it.at, it.mask, it.value));
    let fixed = array(code, &format!("framelock_fixed_bits {name}_fixed"), fixed);
    let known = layout.messages.map_or(&[][..], |messages| messages.known);
    let known = known.iter().map(|it| {
        let (number, most, extra, has_extra) = (it.number, it.most, it.extra, it.has_extra);
        format!("{{{number}, {most}, {extra}, {has_extra}}}")
    });
    let known = array(code, &format!("framelock_message {name}_known"), known);
    let number = layout.messages.map(|messages| messages.number);
    let number = place(number.as_ref());
    let (kind, field) = match &layout.length {
        Length::Fixed => ("FRAMELOCK_FIXED_LENGTH", None),
        Length::Delimiter => ("FRAMELOCK_DELIMITER", None),
        Length::Field(field) => ("FRAMELOCK_LENGTH_FIELD", Some(field)),
    };
    let place = place(field.map(|it| &it.number));
    let length = field.map_or("0, 0, 0".into(), |it| {
        format!("{:#X}, {}, {}", it.mask, it.factor, it.plus)
    });
    let checksum = checksum(layout.checksum.as_ref());
    let appendix = layout.appendix.map_or("0, 0, 0".into(), |it| {
        format!("{}, {}, {}", it.at, it.mask, it.bytes)
    });
    let (shortest, longest) = (layout.shortest, layout.longest);
    format!(
        "{{
{sync}, /* sync */
{{{kind}, {place}, {length}}},
{shortest}, /* shortest */
{longest}, /* longest */
{fixed}, /* fixed bits */
{{{number}, {known}}}, /* messages */
{checksum}, /* checksum */
{terminator}, /* terminator */
{{{appendix}}}, /* appendix */
NULL, /* shipped */
}},
"
    )
}

/// Writes an array down, if anything is in it; its name, and how many there are.
fn array(code: &mut Code, what: &str, values: impl Iterator<Item = String>) -> String {
    let values: Vec<String> = values.collect();
    if values.is_empty() {
        return "NULL, 0".into();
    }
    add!(code, "static const {what}[] = {{");
    for values in values.chunks(6) {
        add!(code, "{},", values.join(", "));
    }
    code.add("};");
    let name = what.split(' ').next_back().unwrap_or_default();
    format!("{name}, {}", values.len())
}

fn patterns(code: &mut Code, name: &str, patterns: &Patterns) -> String {
    let bytes = patterns.bytes.iter().map(|byte| format!("{byte:#04X}"));
    array(code, &format!("uint8_t {name}"), bytes);
    let length = patterns.length;
    match patterns.bytes.len().checked_div(length) {
        Some(count) => format!("{{{name}, {length}, {count}}}"),
        None => "{NULL, 0, 0}".into(),
    }
}

fn place(number: Option<&Number>) -> String {
    number.map_or("{0, 0, false}".into(), |it| {
        format!(
            "{{{}, {}, {}}}",
            it.at,
            it.bytes,
            it.order == ByteOrder::Big
        )
    })
}

fn checksum(checksum: Option<&Checksum>) -> String {
    let Some(it) = checksum else {
        return "{FRAMELOCK_NO_CHECKSUM, 0, 0, 0, 0, 0, {0, false, false, 0, 0, 0}}".into();
    };
    let (algorithm, crc) = match it.algorithm {
        Algorithm::Crc(crc) => ("CRC", crc),
        Algorithm::Sum => ("SUM", Crc::ZERO),
        Algorithm::InvertedSum => ("INVERTED_SUM", Crc::ZERO),
        Algorithm::NegatedSum => ("NEGATED_SUM", Crc::ZERO),
        Algorithm::Xor => ("XOR", Crc::ZERO),
        Algorithm::Fletcher => ("FLETCHER", Crc::ZERO),
    };
    let written = match it.written {
        Written::Little => "LITTLE_ENDIAN",
        Written::Big => "BIG_ENDIAN",
        Written::Hex => "HEX",
    };
    let (bytes, at, from, to) = (it.bytes, it.at, it.from, it.to);
    let (width, input, output) = (crc.width, crc.reflected_in, crc.reflected_out);
    let (polynomial, initial, xor_out) = (crc.polynomial, crc.initial, crc.xor_out);
    format!(
        "{{FRAMELOCK_{algorithm}, FRAMELOCK_{written}, {bytes}, {at}, {from}, {to},
{{{width}, {input}, {output}, {polynomial:#X}, {initial:#X}, {xor_out:#X}}}}}"
    )
}
