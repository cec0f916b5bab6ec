//! A layout in Rust.

use framelock_formats::layout::{
    Algorithm, Appendix, Checksum, Crc, FixedBits, Layout, Length, LengthField, Message, Number,
    Patterns,
};
use framelock_formats::{ARDUPILOTMEGA, COMMON};

use super::code::{Code, add};

/// The layout as a constant.
pub(super) fn layout(code: &mut Code, layout: &Layout) {
    code.add("/// What a frame looks like.\npub const LAYOUT: Layout<'static> = Layout {");
    patterns(code, "sync", &layout.sync);
    match layout.length {
        Length::Field(LengthField {
            number,
            mask,
            factor,
            plus,
        }) => {
            code.add("length: layout::Length::Field(layout::LengthField {");
            place(code, &number);
            add!(
                code,
                "mask: {mask:#X},\nfactor: {factor},\nplus: {plus},\n}}),"
            );
        }
        other => add!(code, "length: layout::Length::{other:?},"),
    }
    let Layout {
        shortest, longest, ..
    } = layout;
    add!(code, "shortest: {shortest},\nlongest: {longest},");
    if !layout.fixed.is_empty() {
        let fixed = layout.fixed.iter().map(|FixedBits { at, mask, value }| {
            format!("layout::FixedBits {{\nat: {at},\nmask: {mask:#04X},\nvalue: {value:#04X},\n}}")
        });
        list(code, "fixed: ", fixed, ",");
    }
    if let Some(messages) = &layout.messages {
        code.add("messages: Some(layout::Messages {");
        place(code, &messages.number);
        known(code, messages.known);
        code.add("}),");
    }
    if let Some(it) = &layout.checksum {
        checksum(code, it);
    }
    patterns(code, "terminator", &layout.terminator);
    if let Some(Appendix { at, mask, bytes }) = layout.appendix {
        code.add("appendix: Some(layout::Appendix {");
        add!(code, "at: {at},\nmask: {mask:#04X},\nbytes: {bytes},\n}}),");
    }
    code.add("..Layout::NONE\n};");
}

fn patterns(code: &mut Code, name: &str, patterns: &Patterns) {
    if patterns.length > 0 {
        let bytes = patterns.bytes.iter().map(|byte| format!("{byte:#04X}"));
        add!(code, "{name}: layout::Patterns {{");
        list(code, "bytes: ", bytes, ",");
        add!(code, "length: {},\n}},", patterns.length);
    }
}

/// An array, in a line if it is short.
pub(super) fn list(code: &mut Code, name: &str, values: impl Iterator<Item = String>, end: &str) {
    let values: Vec<String> = values.collect();
    let line = values.join(", ");
    if values.len() == 1 || line.len() <= 60 && !line.contains('\n') {
        add!(code, "{name}&[{line}]{end}");
    } else {
        add!(code, "{name}&[\n{},\n]{end}", values.join(",\n"));
    }
}

fn place(code: &mut Code, number: &Number) {
    let Number { at, bytes, order } = number;
    add!(
        code,
        "number: layout::Number {{\nat: {at},\nbytes: {bytes},"
    );
    add!(code, "order: layout::ByteOrder::{order:?},\n}},");
}

fn known(code: &mut Code, known: &[Message]) {
    match known {
        COMMON => return code.add("known: framelock_formats::COMMON,"),
        ARDUPILOTMEGA => return code.add("known: framelock_formats::ARDUPILOTMEGA,"),
        _ => {}
    }
    let known = known.iter().map(|it| format!("layout::{it:#?}"));
    list(code, "known: ", known, ",");
}

fn checksum(code: &mut Code, checksum: &Checksum) {
    code.add("checksum: Some(layout::Checksum {");
    if let Algorithm::Crc(Crc {
        width,
        polynomial,
        initial,
        reflected_in,
        reflected_out,
        xor_out,
        ..
    }) = checksum.algorithm
    {
        code.add("algorithm: layout::Algorithm::Crc(layout::Crc {");
        add!(
            code,
            "width: {width},\npolynomial: {polynomial:#X},\ninitial: {initial:#X},"
        );
        add!(
            code,
            "reflected_in: {reflected_in},\nreflected_out: {reflected_out},"
        );
        add!(
            code,
            "xor_out: {xor_out:#X},\ntable: layout::Table::None,\n}}),"
        );
    } else {
        add!(
            code,
            "algorithm: layout::Algorithm::{:?},",
            checksum.algorithm
        );
    }
    let Checksum {
        bytes,
        written,
        at,
        from,
        to,
        ..
    } = checksum;
    add!(
        code,
        "bytes: {bytes},\nwritten: layout::Written::{written:?},"
    );
    add!(code, "at: {at},\nfrom: {from},\nto: {to},\n}}),");
}
