//! Checks that the entries of a description agree with each other, and makes a [`Kind`] from them.

mod fields;

use std::collections::HashSet;
use std::ops::Range;

use framelock::DiscardReason;
use framelock_formats::layout::{
    Contradiction, FixedBits, KnownMessage, Layout, Length, Messages, Part, Patterns,
};
use toml::Spanned;

use crate::checksum::tabled;
use crate::entries::{
    Alternatives, Dialect, FieldEntry, FrameEntry, KnownEntry, KnownMessages, Problem, Unsigned,
    Values, at, missing, wrong,
};
use crate::field::Type;
use crate::kept::kept;
use crate::kind::{Kind, LONGEST};
use fields::{appended, check_positions, field, fixed_bits, take_what_is_left};

/// Returns the kind of frames that an entry describes. If the kind is one of many and has no list of messages, its
/// layout gets the list that [`telling`] returns.
pub(crate) fn kind(
    name: &str,
    written: &FrameEntry,
    is_one_of_many: bool,
) -> Result<Kind, Problem> {
    let (mut kind, owners) = untabled(name, written, is_one_of_many)?;
    // Compute the table last, when the description is known to be valid.
    let mut layout = kind.layout.layout();
    if let Some(checksum) = &mut layout.checksum {
        checksum.algorithm = tabled(checksum.algorithm);
        let checked = layout.check();
        kind.layout = checked.map_err(|contradiction| placed(written, contradiction, &owners))?;
    }
    if let Some(messages) = &written.messages {
        kind.message_names = message_names(&messages.get_ref().known);
    }
    for entry in written.views.iter().map(Spanned::get_ref) {
        let mut all = written.clone();
        // If a view has items, the view's fields are added to the field that takes the rest of the frame. Otherwise the
        // view's fields replace that field.
        let is_item = |field: &Spanned<FieldEntry>| field.get_ref().item.is_some();
        if !entry.fields.iter().any(is_item) {
            all.fields.retain(|field| !field.get_ref().takes_rest());
        }
        all.fields.extend(entry.fields.clone());
        let (view, _) = untabled(entry.name.get_ref(), &all, is_one_of_many)?;
        kind.views.push(Kind {
            layout: kind.layout,
            sign: (entry.at.0, entry.bytes.bytes.clone()),
            ..view
        });
    }
    Ok(kind)
}

/// Returns the kind without a table for its checksum and without views, and the indexes of the fields with fixed bits.
fn untabled(
    name: &str,
    written: &FrameEntry,
    is_one_of_many: bool,
) -> Result<(Kind, Vec<usize>), Problem> {
    let none = Alternatives::default();
    let sync = written.sync.as_ref().map_or(&none, Spanned::get_ref);
    let ends = written.terminator.as_ref().map(Spanned::get_ref);
    let terminator = ends.map_or(&none, |ends| &ends.first);
    let length = length(written)?;
    let fields = written.fields.iter().map(field);
    let mut fields = fields.collect::<Result<Vec<_>, _>>()?;
    let mut layout = Layout {
        sync: patterns(sync),
        length,
        messages: messages(written)?,
        terminator: patterns(terminator),
        ..Layout::NONE
    };
    if let Some(ends) = ends {
        layout.other_terminators = ends.others.each_ref().map(patterns);
    }
    if let Some(entry) = &written.content {
        layout.content = kept(entry.get_ref().0.clone());
    }
    if let Some(entry) = &written.trailer {
        let trailer = entry.get_ref().trailer();
        layout.trailer = Some(trailer);
        fields.push(appended(entry.get_ref(), trailer.bytes)?);
    }
    let checksum = written.checksum.as_ref();
    if let Some(entry) = checksum {
        layout.checksum = Some(entry.get_ref().checksum().map_err(at(entry))?);
    }
    // A frame may consist of only the delimiter.
    let header = match length {
        Length::Delimiter if sync.length == 0 && layout.messages.is_none() => 0,
        _ => layout.header(),
    };
    let places = fields.iter().map(|field| field.at);
    let places = places.chain(checksum.map(|entry| entry.get_ref().at));
    let from_end = places.map(|at| usize::from(at.min(0).unsigned_abs()));
    let from_end = from_end.fold(terminator.length, usize::max);
    take_what_is_left(&mut fields, written, from_end)?;
    let (fixed, owners) = fixed_bits(&fields);
    if is_one_of_many && layout.messages.is_none() {
        layout.messages = telling(&fixed, header);
    }
    (layout.shortest, layout.longest) = bounds(written, header + from_end)?;
    layout.fixed = kept(fixed);
    let layout = layout
        .check()
        .map_err(|contradiction| placed(written, contradiction, &owners))?;
    if let Err(why) = layout.example(&mut vec![0; layout.longest]) {
        return Err(placed(written, no_frame(&layout, why), &owners));
    }
    let kind = Kind {
        name: name.to_owned(),
        layout,
        ends: Kind::ends_of(&fields),
        fields,
        header,
        from_end,
        views: Vec::new(),
        sign: (0, Vec::new()),
        has_truncated_zeros: written.truncated_zeros.unwrap_or_default(),
        message_names: Vec::new(),
    };
    let alone = layout.longest_without_trailer();
    for length in [layout.shortest, alone] {
        check_positions(written, &kind, length, alone)?;
    }
    Ok((kind, owners))
}

/// Returns the contradiction of a layout without frames. `why` is the reason to reject the bytes that come closest to a
/// frame.
fn no_frame(layout: &Layout, why: DiscardReason) -> Contradiction {
    let (part, message) = match why {
        DiscardReason::NoSync | DiscardReason::BrokenSync => (
            Part::Sync,
            "sync: no frame can be made, because other parts determine these bytes",
        ),
        DiscardReason::UnknownMessage => (
            Part::Messages,
            "messages: no frame can be made, because other parts determine the number",
        ),
        DiscardReason::WrongTerminator if !layout.fixed.is_empty() => (
            Part::Fixed(layout.fixed.len() - 1),
            "fixed: no frame can be made, because other parts exclude this value",
        ),
        DiscardReason::WrongTerminator => (
            Part::Terminator,
            "terminator: no frame can be made, because other parts exclude this end, or contain it",
        ),
        _ => (
            Part::Length,
            "length: no frame can be made, because no length in its header is in the limits and agrees with the fixed \
             values",
        ),
    };
    Contradiction { part, message }
}

/// Converts a contradiction into a problem at the entry that describes the contradictory part. For each entry of the
/// fixed bits, `owners` has the index of its field.
fn placed(written: &FrameEntry, contradiction: Contradiction, owners: &[usize]) -> Problem {
    fn span<T>(entry: Option<&Spanned<T>>) -> Option<Range<usize>> {
        entry.map(Spanned::span)
    }
    let length = || span(written.length.as_ref());
    let fields = || written.fields.iter().map(Spanned::get_ref);
    let place = match contradiction.part {
        Part::Sync => span(written.sync.as_ref()),
        Part::Length => span(written.length_field.as_ref()).or_else(length),
        Part::Shortest | Part::Longest => span(written.longest.as_ref()).or_else(length),
        Part::Fixed(number) => {
            let field = owners.get(number).and_then(|owner| fields().nth(*owner));
            field.and_then(|field| span(field.value.as_ref()))
        }
        Part::Messages => span(written.messages.as_ref()).or_else(|| {
            let is_list = |value: &&Spanned<Values>| matches!(value.get_ref(), Values::OneOf(_));
            let mut lists = fields().filter_map(|field| field.value.as_ref());
            span(lists.find(is_list))
        }),
        Part::Checksum => span(written.checksum.as_ref()),
        Part::Content => span(written.content.as_ref()),
        Part::Terminator | Part::OtherTerminators => span(written.terminator.as_ref()),
        Part::Trailer => span(written.trailer.as_ref()),
        _ => None,
    };
    Problem(place.unwrap_or_default(), contradiction.message.into())
}

fn patterns(alternatives: &Alternatives) -> Patterns<'static> {
    Patterns::any_of(kept(alternatives.bytes.clone()), alternatives.length)
}

fn length(written: &FrameEntry) -> Result<Length, Problem> {
    match (&written.length, &written.length_field, &written.terminator) {
        (Some(length), Some(_), _) => wrong(
            length,
            "length is for frames of the same length, length_field for frames that contain their length: \
             leave one out",
        ),
        (Some(_), None, _) => Ok(Length::Fixed),
        (None, Some(entry), _) => Ok(Length::Field(entry.get_ref().field())),
        (None, None, Some(_)) => Ok(Length::Delimiter),
        (None, None, None) => {
            missing("nothing ends a frame: give length, length_field or terminator")
        }
    }
}

/// Returns the lengths of the shortest and the longest frame. If frames vary in length, each frame has at least `least`
/// bytes: the header, and the parts that are counted from the end.
fn bounds(written: &FrameEntry, least: usize) -> Result<(usize, usize), Problem> {
    let has_bounds = written.shortest.is_some() || written.longest.is_some();
    let (place, shortest, longest) = match (&written.length, &written.longest) {
        (Some(place), _) if has_bounds => {
            return wrong(
                place,
                "every frame has this length: leave shortest and longest out",
            );
        }
        (Some(length), _) => (length, *length.get_ref(), *length.get_ref()),
        (None, Some(longest)) => {
            let field = written.length_field.as_ref();
            let plus = field.map_or(0, |field| field.get_ref().field().plus);
            let least = least.max(usize::try_from(plus).unwrap_or_default());
            let shortest = written.shortest.unwrap_or(least);
            if shortest < least {
                let what = format!(
                    "frames of {shortest} bytes are too short: the header and the parts that are counted from the end \
                     have {least}"
                );
                return wrong(longest, what);
            }
            (longest, shortest, *longest.get_ref())
        }
        (None, None) => {
            return missing(
                "give longest, the number of bytes in the longest frame: as few as possible, because \
                 after a false start a frame may be delayed by that many bytes",
            );
        }
    };
    if longest > LONGEST {
        return wrong(
            place,
            format!("longest: a frame can have at most {LONGEST} bytes"),
        );
    }
    Ok((shortest, longest))
}

/// Returns the known messages: the listed messages, or the values that a field may have.
fn messages(written: &FrameEntry) -> Result<Option<Messages<'static>>, Problem> {
    let mut messages = None;
    if let Some(entry) = &written.messages {
        let known = known(&entry.get_ref().known);
        let number = entry.get_ref().number();
        messages = Some(Messages { number, known });
    }
    for entry in written.fields.iter().map(Spanned::get_ref) {
        let Some(place) = &entry.value else { continue };
        let Values::OneOf(values) = place.get_ref() else {
            continue;
        };
        let known = sorted(values.iter().map(|value| KnownMessage::new(*value)));
        let is_plain = entry.mask.is_none() && entry.count.is_none() && messages.is_none();
        let number = match entry.kind {
            Some(Type::Number(number)) if is_plain => Unsigned::of(number),
            _ => None,
        };
        let Some((number, at)) = number.zip(usize::try_from(*entry.at.get_ref()).ok()) else {
            return wrong(
                place,
                "only one field can have a list of values, and only without messages: an unsigned number without mask \
                 and count, counted from the front",
            );
        };
        let is_too_large = |it: &KnownMessage| u64::from(it.number) > number.0.all();
        if known.is_empty() || known.iter().any(is_too_large) {
            return wrong(place, "these values do not fit the field");
        }
        messages = Some(Messages {
            number: number.at(at),
            known,
        });
    }
    Ok(messages)
}

/// Returns the known messages in ascending order of their numbers. A row for a message replaces the dialect's entry.
fn known(messages: &KnownMessages) -> &'static [KnownMessage] {
    let list = match messages {
        KnownMessages::Dialect(dialect) => return dialect.messages(),
        KnownMessages::List(list) => list,
    };
    let rows = list.iter().filter_map(|known| match known {
        KnownEntry::Row(row) => Some(row.message()),
        KnownEntry::Dialect(_) => None,
    });
    let mut all: Vec<KnownMessage> = rows.collect();
    for known in list {
        if let KnownEntry::Dialect(dialect) = known {
            let taken: HashSet<u32> = all.iter().map(|message| message.number).collect();
            let others = dialect.messages().iter();
            all.extend(others.filter(|message| !taken.contains(&message.number)));
        }
    }
    sorted(all.into_iter())
}

/// Returns the numbers and names of the messages that a description takes from a dialect. Leaves out a message to which
/// a row gives another definition.
fn message_names(messages: &KnownMessages) -> Vec<(u32, &'static str)> {
    let dialects: Vec<Dialect> = match messages {
        KnownMessages::Dialect(dialect) => vec![*dialect],
        KnownMessages::List(list) => {
            let dialects = list.iter().filter_map(|known| match known {
                KnownEntry::Dialect(dialect) => Some(*dialect),
                KnownEntry::Row(_) => None,
            });
            dialects.collect()
        }
    };
    let known = known(messages);
    let extra = |messages: &[KnownMessage], number| {
        let place = messages.binary_search_by_key(&number, |message| message.number);
        Some(messages.get(place.ok()?)?.extra)
    };
    let is_of_dialect = |number: u32| {
        let own = extra(known, number);
        let mut dialects = dialects.iter().map(|dialect| dialect.messages());
        own.is_some() && dialects.any(|messages| extra(messages, number) == own)
    };
    let lines = include_str!("message_names.txt").lines();
    let names = lines.filter_map(|line| line.split_once(' '));
    let names = names.filter_map(|(number, name)| Some((number.parse().ok()?, name)));
    names.filter(|(number, _)| is_of_dialect(*number)).collect()
}

/// Sorts messages by their numbers.
fn sorted(messages: impl Iterator<Item = KnownMessage>) -> &'static [KnownMessage] {
    let mut messages: Vec<KnownMessage> = messages.collect();
    messages.sort_by_key(|message| message.number);
    kept(messages)
}

/// Returns a list of messages for a kind that has fixed bits after the header. The list makes a receiver check these bits
/// before it decides on the kind. A receiver waits for a message's number before it decides, so the list declares the
/// last byte with fixed bits to be this number. The known numbers are all values of this byte that agree with its fixed
/// bits.
fn telling(fixed: &[FixedBits], header: usize) -> Option<Messages<'static>> {
    let behind = |bits: &&FixedBits| usize::try_from(bits.at).is_ok_and(|at| at >= header);
    let FixedBits {
        at, mask, value, ..
    } = *fixed.iter().filter(behind).max_by_key(|bits| bits.at)?;
    let bytes = (0..=u8::MAX).filter(|byte| byte & mask == value);
    let known = sorted(bytes.map(|byte| KnownMessage::new(byte.into())));
    let number = framelock_formats::layout::Number::byte(usize::try_from(at).ok()?);
    Some(Messages { number, known })
}
