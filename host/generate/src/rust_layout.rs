//! A layout in Rust.

use framelock_formats::layout::{Algorithm, Checksum, Layout, Length, Number, Patterns};
use framelock_formats::{ARDUPILOTMEGA, COMMON};

use crate::code::{Code, add};

/// The layout as a constant.
pub(super) fn layout(code: &mut Code, layout: &Layout) {
    code.add("/// What a frame looks like.\npub const LAYOUT: Layout<'static> = Layout {");
    patterns(code, "sync", &layout.sync);
    match &layout.length {
        Length::Field(it) => {
            let (mask, factor, plus) = (it.mask, it.factor, it.plus);
            code.add("length: layout::Length::Field(layout::LengthField {");
            code.add(&number(&it.number));
            add!(code, "mask: {mask:#X},\nfactor: {factor},");
            add!(code, "plus: {plus},\n}}),");
        }
        other => add!(code, "length: layout::Length::{other:?},"),
    }
    let (shortest, longest) = (layout.shortest, layout.longest);
    add!(code, "shortest: {shortest},\nlongest: {longest},");
    if !layout.fixed.is_empty() {
        let fixed = layout.fixed.iter().map(|it| {
            let (at, mask, value) = (it.at, it.mask, it.value);
            format!("layout::FixedBits {{\nat: {at},\nmask: {mask:#04X},\nvalue: {value:#04X},\n}}")
        });
        list(code, "fixed: ", fixed, ",");
    }
    if let Some(messages) = &layout.messages {
        let number = number(&messages.number);
        add!(code, "messages: Some(layout::Messages {{\n{number}");
        match messages.known {
            COMMON => code.add("known: framelock_formats::COMMON,"),
            ARDUPILOTMEGA => code.add("known: framelock_formats::ARDUPILOTMEGA,"),
            known => {
                let known = known.iter().map(|it| format!("layout::{it:#?}"));
                list(code, "known: ", known, ",");
            }
        }
        code.add("}),");
    }
    if let Some(it) = &layout.checksum {
        checksum(code, it);
    }
    patterns(code, "terminator", &layout.terminator);
    if let Some(it) = &layout.appendix {
        let (at, mask, bytes) = (it.at, it.mask, it.bytes);
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

fn number(number: &Number) -> String {
    let number = format!("number: layout::{number:#?},");
    number.replace("order: ", "order: layout::ByteOrder::")
}

fn checksum(code: &mut Code, it: &Checksum) {
    let algorithm = match &it.algorithm {
        Algorithm::Crc(crc) => {
            let (width, polynomial, initial) = (crc.width, crc.polynomial, crc.initial);
            let (reflected_in, reflected_out) = (crc.reflected_in, crc.reflected_out);
            format!(
                "Crc(layout::Crc {{
width: {width},
polynomial: {polynomial:#X},
initial: {initial:#X},
reflected_in: {reflected_in},
reflected_out: {reflected_out},
xor_out: {:#X},
table: layout::Table::None,
}})",
                crc.xor_out
            )
        }
        sum => format!("{sum:?}"),
    };
    let (bytes, written, at, from, to) = (it.bytes, it.written, it.at, it.from, it.to);
    add!(
        code,
        "checksum: Some(layout::Checksum {{
algorithm: layout::Algorithm::{algorithm},
bytes: {bytes},
written: layout::Written::{written:?},
at: {at},
from: {from},
to: {to},
}}),"
    );
}
