//! Checks that the entries of a description agree with each other, and makes a [`Kind`] of them.

mod fields;

use framelock_formats::layout::{Checksum, FixedBits, Layout, Length, Message, Messages, Patterns};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use toml::Spanned;

use crate::checksum::{bytes_of, tabled};
use crate::entries::{
    Alternatives, ChecksumEntry, Dialect, FrameEntry, KnownMessages, Problem, Row, Unsigned,
    Values, at, missing, wrong,
};
use crate::field::Type;
use crate::kind::{Kind, LONGEST};
use fields::{appended, check_positions, field, fixed_bits, take_what_is_left};

/// The kind of frames that an entry describes. If it is one of many, its header must tell which it is.
pub(crate) fn kind(
    name: &str,
    written: &FrameEntry,
    is_one_of_many: bool,
) -> Result<Kind, Problem> {
    let none = Alternatives::default();
    let sync = written.sync.as_ref().unwrap_or(&none);
    let terminator = written.terminator.as_ref().map_or(&none, Spanned::get_ref);
    if sync.length + terminator.length == 0 && written.checksum.is_none() {
        return missing("nothing tells a frame from noise: give sync, checksum or terminator");
    }
    let length = length(written)?;
    let fields = written.fields.iter().map(field);
    let mut fields = fields.collect::<Result<Vec<_>, _>>()?;
    let messages = messages(written)?;

    let appendix = written.appendix.as_ref();
    if let Some(entry) = appendix {
        let bytes = entry.get_ref().appendix().bytes;
        if !matches!(length, Length::Field(_)) || !(1..=LONGEST).contains(&bytes) {
            return wrong(
                entry,
                "an appendix has bytes, and its frames have a length_field",
            );
        }
        fields.push(appended(entry.get_ref(), bytes)?);
    }
    // What is there before the length is known, what is counted from the end, and both at least.
    let layout = Layout {
        sync: leaked(sync),
        length,
        messages,
        terminator: leaked(terminator),
        appendix: appendix.map(|entry| entry.get_ref().appendix()),
        ..Layout::NONE
    };
    // A delimiter alone may be a frame.
    let header = match length {
        Length::Delimiter if sync.length == 0 && messages.is_none() => 0,
        _ => layout.header(),
    };
    let least = match length {
        Length::Field(field) => usize::try_from(field.plus).unwrap_or_default(),
        _ => 0,
    };
    let places = fields.iter().map(|field| field.at);
    let places = places.chain(written.checksum.as_ref().map(|check| check.get_ref().at));
    let from_end = places.map(|at| usize::from(at.min(0).unsigned_abs()));
    let trailer = from_end.fold(terminator.length, usize::max);
    take_what_is_left(&mut fields, written, trailer)?;
    // In frames of one length what is counted from the end has a place like any other.
    let end = match length {
        Length::Fixed => terminator.length,
        _ => trailer,
    };
    let (shortest, longest, alone) = bounds(written, least.max(header + end))?;
    let mut kind = Kind {
        name: name.to_owned(),
        layout: Layout {
            shortest,
            longest,
            ..layout
        },
        fields,
        header,
        trailer,
    };
    kind.layout.checksum = written.checksum.as_ref().map(checksum).transpose()?;
    for length in [shortest, alone] {
        check_positions(written, &kind, length, alone)?;
    }
    let fixed = fixed_bits(&kind.fields);
    if is_one_of_many && messages.is_none() {
        kind.layout.messages = telling(&fixed, kind.header);
    }
    kind.layout.fixed = fixed.leak();
    // Only a description without mistakes gets a table.
    if let Some(checksum) = &mut kind.layout.checksum {
        checksum.algorithm = tabled(checksum.algorithm);
    }
    Ok(kind)
}

fn leaked(alternatives: &Alternatives) -> Patterns<'static> {
    Patterns {
        bytes: alternatives.bytes.clone().leak(),
        length: alternatives.length,
    }
}

fn length(written: &FrameEntry) -> Result<Length, Problem> {
    match (&written.length, &written.length_field, &written.terminator) {
        (Some(length), Some(_), _) => wrong(
            length,
            "length is for frames that all have it, length_field for frames that say theirs: \
             leave one out",
        ),
        (Some(_), None, _) => Ok(Length::Fixed),
        (None, Some(entry), _) => {
            let field = entry.get_ref().field();
            let mask = u32::try_from(entry.get_ref().number_mask()).unwrap_or(u32::MAX);
            if field.factor == 0 || mask == 0 {
                return wrong(entry, "with this factor or mask it tells no length");
            }
            Ok(Length::Field(field))
        }
        (None, None, Some(_)) => Ok(Length::Delimiter),
        (None, None, None) => {
            missing("nothing ends a frame: give length, length_field or terminator")
        }
    }
}

/// Bytes in the shortest frame, in the longest, and in the longest without its appendix; `least` are the parts that each
/// has.
fn bounds(written: &FrameEntry, least: usize) -> Result<(usize, usize, usize), Problem> {
    let has_bounds = written.shortest.is_some() || written.longest.is_some();
    let (place, shortest, longest) = match (&written.length, &written.longest) {
        (Some(place), _) if has_bounds => {
            return wrong(place, "length says it all: leave shortest and longest out");
        }
        (Some(length), _) => (length, *length.get_ref(), *length.get_ref()),
        (None, Some(longest)) => (
            longest,
            written.shortest.unwrap_or(least),
            *longest.get_ref(),
        ),
        (None, None) => {
            return missing(
                "give longest, the bytes in the longest frame: as few as there may be, since \
                 after a false beginning a frame may come as late as that",
            );
        }
    };
    let field = written.length_field.as_ref();
    let told = field.map_or(LONGEST, |field| field.get_ref().most());
    let appendix = written.appendix.as_ref();
    let appended = appendix.map_or(0, |it| it.get_ref().appendix().bytes);
    let most = told.saturating_add(appended).min(LONGEST);
    if least <= shortest && shortest <= longest && longest <= most {
        return Ok((shortest, longest, longest.min(told)));
    }
    let what = format!(
        "frames of {shortest} to {longest} bytes: the parts that each has are {least}, and {most} \
         is the most that a length field of this type can say, or there is room for"
    );
    wrong(place, what)
}

/// The messages that there are: those that are listed, or the values that a field may have.
fn messages(written: &FrameEntry) -> Result<Option<Messages<'static>>, Problem> {
    let mut messages = None;
    if let Some(entry) = &written.messages {
        let known = known(&entry.get_ref().known);
        let number = entry.get_ref().number();
        let known = known.map_err(at(entry))?;
        messages = Some(Messages { number, known });
    }
    for entry in written.fields.iter().map(Spanned::get_ref) {
        let Some(place) = &entry.value else { continue };
        let Values::OneOf(values) = place.get_ref() else {
            continue;
        };
        let known = sorted(values.iter().map(|value| (*value, None, u16::MAX)));
        let known = known.map_err(at(place))?;
        let is_plain = entry.mask.is_none() && entry.count.is_none() && messages.is_none();
        let number = match entry.kind {
            Some(Type::Number(number)) if is_plain => Unsigned::of(number),
            _ => None,
        };
        let Some((number, at)) = number.zip(usize::try_from(*entry.at.get_ref()).ok()) else {
            return wrong(
                place,
                "a list of values is for one number without sign, mask and count, counted from the front, of one \
                 field, and where there are no messages besides",
            );
        };
        let is_too_large = |it: &Message| u64::from(it.number) > number.0.all();
        if known.is_empty() || known.iter().any(is_too_large) {
            return wrong(place, "these values do not fit the field");
        }
        let number = number.at(at);
        messages = Some(Messages { number, known });
    }
    Ok(messages)
}

/// The messages that a description knows, by ascending numbers.
fn known(messages: &KnownMessages) -> Result<&'static [Message], &'static str> {
    match messages {
        KnownMessages::Dialect(Dialect::Common) => Ok(COMMON),
        KnownMessages::Dialect(Dialect::Ardupilotmega) => Ok(ARDUPILOTMEGA),
        KnownMessages::Rows(rows) => sorted(rows.iter().map(|row| match *row {
            Row::Number([number]) => (number, None, u16::MAX),
            Row::Extra(number, extra) => (number, Some(extra), u16::MAX),
            Row::Most(number, extra, most) => (number, Some(extra), most),
        })),
    }
}

/// Messages by ascending numbers.
fn sorted(
    rows: impl Iterator<Item = (u32, Option<u8>, u16)>,
) -> Result<&'static [Message], &'static str> {
    let mut messages: Vec<Message> = rows
        .map(|(number, extra, most)| Message {
            number,
            most,
            extra: extra.unwrap_or_default(),
            has_extra: extra.is_some(),
        })
        .collect();
    messages.sort_by_key(|message| message.number);
    if !messages.is_sorted_by(|a, b| a.number < b.number) {
        return Err("a number stands there twice");
    }
    Ok(messages.leak())
}

fn checksum(entry: &Spanned<ChecksumEntry>) -> Result<Checksum<'static>, Problem> {
    let check = entry.get_ref();
    let algorithm = check.algorithm().map_err(at(entry))?;
    if let Some(wanted) = bytes_of(&algorithm).filter(|&wanted| wanted != check.stored.bytes) {
        let what = format!(
            "this checksum has {wanted} bytes, and its type {}",
            check.stored.bytes
        );
        return wrong(entry, what);
    }
    Ok(Checksum {
        algorithm,
        bytes: check.stored.bytes,
        written: check.stored.written,
        at: check.at,
        from: check.from,
        to: check.to.unwrap_or(check.at.saturating_sub(1)),
    })
}

/// The last byte behind the header that has fixed bits, as the number of a message: so it is looked at before another
/// kind is ruled out.
fn telling(fixed: &[FixedBits], header: usize) -> Option<Messages<'static>> {
    let behind = |bits: &&FixedBits| usize::try_from(bits.at).is_ok_and(|at| at >= header);
    let FixedBits { at, mask, value } = *fixed.iter().filter(behind).max_by_key(|bits| bits.at)?;
    let bytes = (0..=u8::MAX).filter(|byte| byte & mask == value);
    let known = sorted(bytes.map(|byte| (byte.into(), None, u16::MAX))).ok()?;
    let number = framelock_formats::layout::Number::byte(usize::try_from(at).ok()?);
    Some(Messages { number, known })
}
