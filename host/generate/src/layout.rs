//! Converts a layout into a value for templates. The value's parts have the same names as in
//! [`Layout`].

use framelock_formats::layout::{
    Algorithm, Checksum, Crc, Layout, Length, Messages, Number, Patterns, Trailer,
};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use minijinja::{Value, context};

pub(crate) fn value(layout: &Layout) -> Value {
    let fixed = layout.fixed.iter();
    let fixed = fixed.map(|it| context! { at => it.at, mask => it.mask, value => it.value });
    let content = layout.content.iter();
    let content = content.map(|(first, last)| format!("({first:#04X}, {last:#04X})"));
    let has_others = layout.other_terminators.iter().any(|it| it.length > 0);
    let others = layout.other_terminators.each_ref().map(patterns);
    let (length_kind, length) = match layout.length {
        Length::Field(it) => {
            let number = number(&it.number);
            let field = context! { number, mask => it.mask, factor => it.factor, plus => it.plus };
            ("Field", Some(field))
        }
        Length::Delimiter => ("Delimiter", None),
        _ => ("Fixed", None),
    };
    context! {
        sync => patterns(&layout.sync),
        length_kind,
        length,
        shortest => layout.shortest,
        longest => layout.longest,
        fixed => fixed.collect::<Vec<_>>(),
        messages => layout.messages.as_ref().map(messages),
        checksum => layout.checksum.as_ref().map(checksum),
        terminator => patterns(&layout.terminator),
        content => content.collect::<Vec<_>>(),
        other_terminators => has_others.then_some(others),
        trailer => layout.trailer.as_ref().map(trailer),
    }
}

fn patterns(patterns: &Patterns) -> Value {
    context! { bytes => hex(patterns.bytes), length => patterns.length }
}

fn hex(bytes: &[u8]) -> Vec<String> {
    bytes.iter().map(|byte| format!("{byte:#04X}")).collect()
}

fn number(number: &Number) -> Value {
    let order = format!("{:?}", number.order);
    context! { at => number.at, bytes => number.bytes, order }
}

fn messages(messages: &Messages) -> Value {
    let known = messages.known.iter().map(|it| {
        context! { number => it.number, longest_payload => it.longest_payload, extra => it.extra }
    });
    // A large table is a constant of `framelock-formats`. The generated module uses the constant's
    // name instead of the table's content.
    let table = match messages.known {
        COMMON => Some("COMMON"),
        ARDUPILOTMEGA => Some("ARDUPILOTMEGA"),
        _ => None,
    };
    context! { number => number(&messages.number), known => known.collect::<Vec<_>>(), table }
}

fn checksum(it: &Checksum) -> Value {
    let (algorithm, crc) = match it.algorithm {
        Algorithm::Crc(crc) => ("Crc".to_owned(), crc),
        sum => (format!("{sum:?}"), Crc::new(0, 0)),
    };
    let crc = context! {
        width => crc.width,
        polynomial => crc.polynomial,
        initial => crc.initial,
        reflected_in => crc.reflected_in.to_string(),
        reflected_out => crc.reflected_out.to_string(),
        xor_out => crc.xor_out,
    };
    context! {
        algorithm,
        crc,
        bytes => it.bytes,
        encoding => format!("{:?}", it.encoding),
        at => it.at,
        from => it.from,
        to => it.to,
    }
}

fn trailer(it: &Trailer) -> Value {
    let lowest_bit = it.mask & it.mask.wrapping_neg();
    context! { at => it.at, mask => it.mask, lowest_bit, bytes => it.bytes }
}
