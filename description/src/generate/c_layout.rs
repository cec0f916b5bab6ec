//! Layouts in C, member by member: C++17 knows no other way.

use framelock_formats::layout::{
    Algorithm, Appendix, ByteOrder, Checksum, Crc, FixedBits, Layout, Length, LengthField,
    Messages, Number, Patterns, Written,
};

use super::code::{Code, add};

/// What the layouts point to, each by the name of its kind; then the layouts themselves.
pub(super) fn layouts(code: &mut Code, prefix: &str, kinds: &[(&str, &Layout)]) {
    for (name, layout) in kinds {
        for (of, patterns) in [("sync", layout.sync), ("terminator", layout.terminator)] {
            let bytes = patterns.bytes.iter().map(|byte| format!("{byte:#04X}"));
            array(code, &format!("uint8_t {prefix}_{name}_{of}"), bytes);
        }
        let fixed = layout.fixed.iter();
        let fixed = fixed
            .map(|FixedBits { at, mask, value }| format!("{{{at}, {mask:#04X}, {value:#04X}}}"));
        array(
            code,
            &format!("framelock_fixed_bits {prefix}_{name}_fixed"),
            fixed,
        );
        let known = layout.messages.map_or(&[][..], |messages| messages.known);
        let known = known.iter().map(|it| {
            let (most, extra, has_extra) = (it.most, it.extra, it.has_extra);
            format!("{{{}, {most}, {extra}, {has_extra}}}", it.number)
        });
        array(
            code,
            &format!("framelock_message {prefix}_{name}_known"),
            known,
        );
    }
    add!(
        code,
        "\n/* What the frames look like. */\nstatic const framelock_layout {prefix}_layouts[] = {{"
    );
    for (name, it) in kinds {
        layout(code, &format!("{prefix}_{name}"), it);
    }
    code.add("};");
}

fn array(code: &mut Code, what: &str, values: impl Iterator<Item = String>) {
    let values: Vec<String> = values.collect();
    if values.is_empty() {
        return;
    }
    add!(code, "static const {what}[] = {{");
    for values in values.chunks(6) {
        add!(code, "{},", values.join(", "));
    }
    code.add("};");
}

fn layout(code: &mut Code, name: &str, layout: &Layout) {
    let Layout {
        shortest, longest, ..
    } = layout;
    code.add("{");
    add!(code, "{}, /* sync */", patterns(name, "sync", &layout.sync));
    let (kind, field) = match layout.length {
        Length::Fixed => ("FRAMELOCK_FIXED_LENGTH", None),
        Length::Delimiter => ("FRAMELOCK_DELIMITER", None),
        Length::Field(field) => ("FRAMELOCK_LENGTH_FIELD", Some(field)),
    };
    let field = match field {
        Some(LengthField {
            number,
            mask,
            factor,
            plus,
        }) => {
            format!("{}, {mask:#X}, {factor}, {plus}", place(&number))
        }
        None => "{0, 0, false}, 0, 0, 0".into(),
    };
    add!(
        code,
        "{{{kind}, {field}}},\n{shortest}, /* shortest */\n{longest}, /* longest */"
    );
    add!(
        code,
        "{}, /* fixed bits */",
        pointer(name, "fixed", layout.fixed.len())
    );
    add!(
        code,
        "{}, /* messages */",
        messages(name, layout.messages.as_ref())
    );
    add!(
        code,
        "{}, /* checksum */",
        checksum(layout.checksum.as_ref())
    );
    add!(
        code,
        "{}, /* terminator */",
        patterns(name, "terminator", &layout.terminator)
    );
    let Appendix { at, mask, bytes } = layout.appendix.unwrap_or(Appendix {
        at: 0,
        mask: 0,
        bytes: 0,
    });
    add!(
        code,
        "{{{at}, {mask}, {bytes}}}, /* appendix */\nNULL, /* shipped */\n}},"
    );
}

/// An array, and how many there are in it.
fn pointer(name: &str, of: &str, count: usize) -> String {
    if count == 0 {
        "NULL, 0".into()
    } else {
        format!("{name}_{of}, {count}")
    }
}

fn patterns(name: &str, of: &str, patterns: &Patterns) -> String {
    let Patterns { bytes, length } = patterns;
    match bytes.len().checked_div(*length) {
        Some(count) => format!("{{{name}_{of}, {length}, {count}}}"),
        None => "{NULL, 0, 0}".into(),
    }
}

fn place(number: &Number) -> String {
    let Number { at, bytes, order } = number;
    format!("{{{at}, {bytes}, {}}}", *order == ByteOrder::Big)
}

fn messages(name: &str, messages: Option<&Messages>) -> String {
    let Some(Messages { number, known }) = messages else {
        return "{{0, 0, false}, NULL, 0}".into();
    };
    format!(
        "{{{}, {}}}",
        place(number),
        pointer(name, "known", known.len())
    )
}

fn checksum(checksum: Option<&Checksum>) -> String {
    let Some(checksum) = checksum else {
        return "{FRAMELOCK_NO_CHECKSUM, 0, 0, 0, 0, 0, {0, false, false, 0, 0, 0}}".into();
    };
    let (algorithm, crc) = match checksum.algorithm {
        Algorithm::Crc(crc) => ("CRC", crc),
        Algorithm::Sum => ("SUM", Crc::ZERO),
        Algorithm::InvertedSum => ("INVERTED_SUM", Crc::ZERO),
        Algorithm::NegatedSum => ("NEGATED_SUM", Crc::ZERO),
        Algorithm::Xor => ("XOR", Crc::ZERO),
        Algorithm::Fletcher => ("FLETCHER", Crc::ZERO),
    };
    let written = match checksum.written {
        Written::Little => "LITTLE_ENDIAN",
        Written::Big => "BIG_ENDIAN",
        Written::Hex => "HEX",
    };
    let Checksum {
        bytes,
        at,
        from,
        to,
        ..
    } = checksum;
    let Crc {
        width,
        polynomial,
        initial,
        reflected_in,
        reflected_out,
        xor_out,
        ..
    } = crc;
    format!(
        "{{FRAMELOCK_{algorithm}, FRAMELOCK_{written}, {bytes}, {at}, {from}, {to},\n\
         {{{width}, {reflected_in}, {reflected_out}, {polynomial:#X}, {initial:#X}, {xor_out:#X}}}}}"
    )
}
