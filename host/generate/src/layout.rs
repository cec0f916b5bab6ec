//! A kind's layout as plain data, from which the templates make code.

use framelock::{Codes, Stuffing};
use framelock_formats::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Crc, Encoding, LengthField, Messages, Number,
    Patterns,
};
use framelock_formats::layout::{Length, Trailer};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use minijinja::{Value, context};

/// Returns the template values for a layout. Numbers are not converted to text, because each template writes them
/// in its own language.
pub(crate) fn value(layout: &CheckedLayout) -> Value {
    let header = layout.header();
    let fixed = layout.fixed.iter().map(|bits| {
        let is_in_header = usize::try_from(bits.at).is_ok_and(|at| at < header);
        context! { at => bits.at, mask => bits.mask, value => bits.value, is_in_header }
    });
    let field = match layout.length {
        Length::Field(field) => Some(length_field(&field)),
        _ => None,
    };
    context! {
        header,
        shortest => layout.shortest,
        longest => layout.longest,
        most_bytes => layout.most_bytes(),
        is_fixed => layout.length == Length::Fixed,
        is_delimited => layout.length == Length::Delimiter,
        is_silent => layout.length == Length::Silence,
        field,
        sync => patterns(&layout.sync),
        terminator => patterns(&layout.terminator),
        behind => layout.behind,
        other_terminators => layout.other_terminators.each_ref().map(patterns),
        terminators => layout.terminators().collect::<Vec<_>>(),
        fixed => fixed.collect::<Vec<_>>(),
        content => layout.content,
        messages => layout.messages.as_ref().map(messages),
        checksum => layout.checksum.as_ref().map(checksum),
        trailer => layout.trailer.as_ref().map(|it| trailer(it, layout)),
    }
}

/// Returns the template values for the stuffing of packets.
pub(crate) fn packets(stuffing: Stuffing) -> Value {
    match stuffing {
        Stuffing::Escape {
            delimiter,
            escape,
            codes,
        } => {
            let (xor, codes) = match codes {
                Codes::Xor(xor) => (Some(xor), None),
                Codes::Pair { delimiter, escape } => (None, Some((delimiter, escape))),
            };
            context! { kind => "escape", delimiter, escape, xor, codes }
        }
        Stuffing::Cobs => context! { kind => "cobs", delimiter => 0 },
        Stuffing::Doubled { escape, start, end } => {
            context! { kind => "doubled", escape, start, end }
        }
        Stuffing::Break => context! { kind => "break" },
    }
}

/// Returns the order of a number's bytes, as in the names of the functions that read and write numbers.
pub(crate) fn order(order: ByteOrder) -> &'static str {
    match order {
        ByteOrder::Little => "le",
        ByteOrder::Big => "be",
    }
}

fn number(number: &Number) -> Value {
    context! { at => number.at, bytes => number.bytes, order => order(number.order) }
}

fn patterns(patterns: &Patterns) -> Value {
    context! {
        bytes => patterns.bytes,
        length => patterns.length,
        each => patterns.each().collect::<Vec<_>>(),
    }
}

/// Returns the greatest value of a length field.
pub(crate) fn greatest(field: &LengthField) -> u32 {
    field.value(u32::MAX >> (32 - 8 * field.number.bytes))
}

fn length_field(field: &LengthField) -> Value {
    context! {
        number => number(&field.number),
        mask => field.mask,
        shift => field.mask.trailing_zeros(),
        greatest => greatest(field),
        factor => field.factor,
        plus => field.plus,
    }
}

fn messages(messages: &Messages) -> Value {
    let known = messages.known.iter().map(|message| {
        context! {
            number => message.number,
            longest => message.longest_payload,
            extra => message.extra,
        }
    });
    let constant = match messages.known {
        COMMON => Some("COMMON"),
        ARDUPILOTMEGA => Some("ARDUPILOTMEGA"),
        _ => None,
    };
    context! { number => number(&messages.number), known => known.collect::<Vec<_>>(), constant }
}

fn checksum(checksum: &Checksum) -> Value {
    let (algorithm, crc) = match &checksum.algorithm {
        Algorithm::Crc(parameters) => ("Crc".to_owned(), Some(crc(parameters))),
        other => (format!("{other:?}"), None),
    };
    let all = u32::MAX >> (32 - 8 * checksum.bytes);
    context! {
        algorithm,
        crc,
        initial => checksum.initial & all,
        xor_out => checksum.xor_out & all,
        over_hex_digits => checksum.over_hex_digits,
        bytes => checksum.bytes,
        encoding => format!("{:?}", checksum.encoding),
        order => if checksum.encoding == Encoding::Big { "be" } else { "le" },
        at => checksum.at,
        from => checksum.from,
        to => checksum.to,
    }
}

fn crc(crc: &Crc) -> Value {
    context! {
        width => crc.width,
        polynomial => crc.polynomial,
        initial => crc.initial,
        xor_out => crc.xor_out,
        reflected_in => crc.reflected_in,
        reflected_out => crc.reflected_out,
    }
}

fn trailer(trailer: &Trailer, layout: &CheckedLayout) -> Value {
    context! {
        at => trailer.at,
        mask => trailer.mask,
        bytes => trailer.bytes,
        lowest_bit => trailer.mask & trailer.mask.wrapping_neg(),
        may_be_too_long => layout.longest_without_trailer() + trailer.bytes > layout.longest,
    }
}
