//! Makes kinds of frames from the entries of a description. If entries contradict each other, the layout's own check or
//! the checks in this module find the contradiction.

use std::ops::Range;

use framelock::DiscardReason;
use framelock_formats::layout::{
    self, Algorithm, FixedBits, KnownMessage, Length, LengthField, Number, Trailer,
};
use toml::Spanned;

use crate::entries::{
    Entries, FieldEntry, Patterns, Text, TrailerEntry, ViewEntry, parsed, parsed_if_any, span,
};
use crate::field::{Field, Type};
use crate::kind::{Kind, LONGEST};
use crate::layouts::{Alternatives, Layouts, OwnMessages, Parts};
use crate::messages::sorted;
use crate::number::NumberType;
use crate::pattern::{Pattern, TextPlace};
use crate::problem::{Located, Mistake, reject_if};
use crate::read_field::{ONE_LIST, column_name};
use crate::{checksum, layouts};

/// A field, with the positions of its entry and of the entry's keys `at` and `value` in the description's text.
#[derive(Clone)]
struct ReadField {
    field: Field,
    entry: Range<usize>,
    at: Range<usize>,
    value: Range<usize>,
}

impl Kind {
    /// Returns the kind with these entries. `is_one_of_many` says whether the kind is in `[[kinds]]`.
    pub(crate) fn read(name: &str, all: &Entries, is_one_of_many: bool) -> Result<Self, Located> {
        let sync = parsed_if_any(all.sync.as_ref(), Alternatives::parse)?.unwrap_or_default();
        let length = length(all)?;
        let counted = match length {
            Length::Field(field) => field.number.end(),
            _ => 0,
        };
        let text_at = counted.max(sync.length);
        let (fields, texts) = read_fields(&all.fields, all.text.as_ref(), text_at)?;
        let (fixed, owners) = fixed_bits(&fields);
        let terminators = parsed_if_any(all.terminator.as_ref(), layouts::terminators)?;
        let (trailer, trailer_field) = all.trailer.as_ref().map(trailer).transpose()?.unzip();
        let mut parts = Parts {
            sync,
            length,
            shortest: 0,
            longest: 0,
            fixed,
            messages: messages(all, &fields)?,
            checksum: all.checksum.as_ref().map(checksum::read).transpose()?,
            terminators: terminators.unwrap_or_default(),
            behind: all.behind.as_ref().map_or(0, |behind| *behind.get_ref()),
            packets: all
                .packets
                .as_ref()
                .map(|packets| {
                    let stuffing = packets.get_ref().stuffing();
                    stuffing.map_err(|mistake| Located::new(packets.span(), mistake))
                })
                .transpose()?,
            content: parsed_if_any(all.content.as_ref(), layouts::content)?.unwrap_or_default(),
            trailer,
            table: None,
        };
        let mut syncs = parts.sync.bytes.chunks(parts.sync.length.max(1));
        let is_dynamixel = |sync: &[u8]| sync.starts_with(&[0xFF, 0xFF, 0xFD]);
        let rule = "frames of Dynamixel 2 contain an inserted FD after each FF FF FD: the values after it would be wrong, so \
                    these frames cannot be described";
        reject_if(syncs.any(is_dynamixel), span(all.sync.as_ref()), rule)?;
        let algorithm = parts.checksum.map(|checksum| checksum.algorithm);
        if let Some(Algorithm::Crc(crc)) = algorithm
            && (8..=32).contains(&crc.width)
        {
            parts.table = Some(Box::new(crc.table_of_words()));
        }
        let checksum = parts.checksum.iter().map(|checksum| checksum.at);
        let places = checksum.chain(fields.iter().map(|read| read.field.at));
        let end = parts.terminators[0].length.saturating_add(parts.behind);
        let from_end = places.fold(end, bytes_from_end);
        let header = layouts::header(&parts.layout());
        if is_one_of_many && parts.messages.is_none() {
            parts.messages = distinguishing(&parts.fixed, header);
        }
        (parts.shortest, parts.longest) = bounds(all, parts.length, header + from_end)?;
        let most = parts.layout().longest_without_trailer();
        let (shortest, longest) = (parts.shortest, parts.longest);
        let layouts = Layouts::new(vec![parts.into()]).map_err(|contradiction| {
            let bytes = match contradiction.part {
                layout::Part::Longest if most < longest => Some(most),
                layout::Part::Longest if longest < shortest => Some(shortest),
                layout::Part::Longest | layout::Part::Shortest => Some(header + from_end),
                _ => None,
            };
            let mistake = Mistake::Layout {
                kind: is_one_of_many.then(|| name.to_owned()),
                message: contradiction.message,
                bytes,
            };
            Located::new(span_of(contradiction.part, all, &owners), mistake)
        })?;
        let known = all.messages.as_ref().map(|it| it.get_ref().known.names());
        let mut kind = Self {
            name: name.to_owned(),
            layouts,
            fields: Vec::new(),
            room: (0, 0),
            from_end,
            views: Vec::new(),
            sign: (0, Vec::new()),
            has_truncated_zeros: all.truncated_zeros.unwrap_or(false),
            message_names: known.unwrap_or_default(),
            texts,
            text_at,
        };
        let views = all.views.iter();
        let views = views.map(|view| kind.view(view, &fields, trailer_field.clone()));
        let views = views.collect::<Result<Vec<_>, _>>();
        kind.place(&fields, trailer_field)?;
        kind.check_example(all, &owners)?;
        kind.views = views?;
        Ok(kind)
    }

    /// Returns the view with these entries. `common` are the fields that the kind will have.
    fn view(
        &self,
        entry: &Spanned<ViewEntry>,
        common: &[ReadField],
        trailer: Option<Field>,
    ) -> Result<Self, Located> {
        let (span, entry) = (entry.span(), entry.get_ref());
        let (own, texts) = read_fields(&entry.fields, entry.text.as_ref(), self.text_at)?;
        // A view with a text keeps the kind's field that takes the rest of the frame; other views leave this field out.
        // Every view leaves out the values of the kind's text, and replaces the kind's fields that have the names of
        // its own fields.
        let is_common = |read: &&ReadField| {
            let field = &read.field;
            let is_replaced = own.iter().any(|own| own.field.name == field.name);
            field.text.is_none() && !is_replaced && (!texts.is_empty() || field.length().is_some())
        };
        let mut fields: Vec<ReadField> = common.iter().filter(is_common).cloned().collect();
        let first_own = fields.len();
        fields.extend(own);
        let sign = match (&entry.at, &entry.bytes) {
            (Some(at), Some(bytes)) if !bytes.get_ref().trim().is_empty() => {
                (front(at)?, parsed(bytes, Alternatives::parse)?.bytes)
            }
            (None, None) if !texts.is_empty() => (self.text_at, Vec::new()),
            _ => {
                let rule = "a view needs what selects its frames: at and bytes, the offset and the bytes in hex, or a text";
                return Err(Located::new(span, rule));
            }
        };
        let places = fields.iter().map(|read| read.field.at);
        let mut view = Self {
            name: entry.name.clone(),
            sign,
            texts,
            from_end: places.fold(self.from_end, bytes_from_end),
            message_names: Vec::new(),
            ..self.clone()
        };
        view.place(&fields, trailer)?;
        let own = view.fields[first_own..fields.len()].iter();
        view.room = (
            own.clone().map(|field| field.needs(1)).min().unwrap_or(0),
            own.map(|field| field.needs(field.values()))
                .max()
                .unwrap_or(0),
        );
        Ok(view)
    }

    /// Gives the kind its fields. Checks that each field is inside the longest frame, and inside the shortest frame if
    /// every frame must have the field. Also checks that no field shares a bit with the sync, the length, the checksum
    /// or the terminator, with the exceptions of [`overlapped`](Self::overlapped). Fields may share bytes with each
    /// other.
    fn place(&mut self, fields: &[ReadField], trailer: Option<Field>) -> Result<(), Located> {
        let longest = self.layout().longest_without_trailer();
        let fixed_length = (self.layout().length == Length::Fixed).then_some(longest);
        for read in fields {
            let mut field = read.field.clone();
            let has_bytes = field.limit(fixed_length, self.from_end);
            let rule = "no bytes of the frame are left for this field";
            reject_if(!has_bytes, read.entry.clone(), rule)?;
            self.fields.push(field);
        }
        self.fields.extend(trailer.map(|mut trailer| {
            trailer.limit(fixed_length, self.from_end);
            trailer
        }));
        for length in [self.layout().shortest, longest] {
            for (field, read) in self.fields.iter().zip(fields) {
                let is_optional = length < longest && self.shortest_with(field).is_some();
                // A value in a text shares the bytes of the text.
                if field.text.is_some() || is_optional {
                    continue;
                }
                let name = || field.name.clone();
                let mistake = match field.position(length) {
                    Some(bytes) => self.overlapped(field, bytes, length).map(|part| {
                        let (field, part) = (name(), part.name());
                        Mistake::Overlap { field, part }
                    }),
                    None => field.length().map(|_| {
                        let field = name();
                        Mistake::Outside { field, length }
                    }),
                };
                if let Some(mistake) = mistake {
                    return Err(Located::new(read.at.clone(), mistake));
                }
            }
        }
        Ok(())
    }

    /// Checks that a frame of this kind exists, by making one.
    fn check_example(&self, all: &Entries, owners: &[Range<usize>]) -> Result<(), Located> {
        let layout = self.layout();
        let Err(why) = layout.example(&mut vec![0; layout.longest]) else {
            return Ok(());
        };
        let (part, rule) = match (why, owners.len().checked_sub(1)) {
            (DiscardReason::NoSync | DiscardReason::BrokenSync, _) => (
                layout::Part::Sync,
                "sync: no frame can be made, because other parts determine these bytes",
            ),
            (DiscardReason::UnknownMessage, _) => (
                layout::Part::Messages,
                "messages: no frame can be made, because other parts determine the number",
            ),
            (DiscardReason::WrongTerminator, Some(last)) => (
                layout::Part::Fixed(last),
                "fixed: no frame can be made, because other parts exclude this value",
            ),
            (DiscardReason::WrongTerminator, None) => (
                layout::Part::Terminator,
                "terminator: no frame can be made, because other parts exclude this end, or contain it",
            ),
            _ => (
                layout::Part::Length,
                "length: no frame can be made, because no length in its header is in the limits and agrees with the \
                 fixed values",
            ),
        };
        Err(Located::new(span_of(part, all, owners), rule))
    }
}

/// Reads the fields and the patterns of the text. Values of the text follow the other fields, in the order of the text.
fn read_fields(
    entries: &[Spanned<FieldEntry>],
    text: Option<&Spanned<Patterns>>,
    text_at: usize,
) -> Result<(Vec<ReadField>, Vec<Pattern>), Located> {
    let at = i16::try_from(text_at).expect("the header is short");
    let text_span = span(text);
    let texts = match text.map(Spanned::get_ref) {
        None => &[][..],
        Some(Patterns::One(text)) => std::slice::from_ref(text),
        Some(Patterns::Several(texts)) => texts,
    };
    let patterns = texts.iter().map(|text| Pattern::parse(text));
    let patterns = patterns.collect::<Result<Vec<_>, _>>();
    let mut patterns = patterns.map_err(|mistake| Located::new(text_span.clone(), mistake))?;
    let mut fields = Vec::new();
    for entry in entries {
        let keys = entry.get_ref();
        let mut places = (0..).zip(&patterns).filter_map(|(pattern, parsed)| {
            let value = parsed.position(keys.name.get_ref())?;
            Some((at, TextPlace { pattern, value }))
        });
        fields.push(ReadField {
            field: Field::read(entry, places.next())?,
            entry: entry.span(),
            at: span(keys.at.as_ref()),
            value: span(keys.value.as_ref()),
        });
    }
    for (pattern, parsed) in patterns.iter().enumerate() {
        for (value, named) in parsed.values.iter().enumerate() {
            let place = TextPlace { pattern, value };
            let is_new = !fields.iter().any(|read| read.field.text == Some(place));
            if let (Some(name), true) = (&named.name, is_new) {
                fields.push(ReadField {
                    field: Field::in_text(name.clone(), at, place),
                    entry: text_span.clone(),
                    at: text_span.clone(),
                    value: 0..0,
                });
            }
        }
    }
    fields.sort_by_key(|read| read.field.text);
    for field in fields.iter().map(|read| &read.field) {
        if let Some(TextPlace { pattern, value }) = field.text {
            patterns[pattern].values[value].notation = field.notation;
        }
    }
    Ok((fields, patterns))
}

/// Reads a position that is counted from the front.
fn front(at: &Spanned<i16>) -> Result<usize, Located> {
    let rule = "this is needed before the frame's end is known: count it from the front, 0 or more";
    usize::try_from(*at.get_ref()).map_err(|_| Located::new(at.span(), rule))
}

/// Returns the greater of two numbers: `bytes`, and the number of bytes from `at` to the end of the frame. For
/// a position that is counted from the front, the second number is 0.
fn bytes_from_end(bytes: usize, at: i16) -> usize {
    bytes.max(at.min(0).unsigned_abs().into())
}

/// Reads the type and the position of a number in the header.
fn number(at: &Spanned<i16>, name: &Text) -> Result<Number, Located> {
    let number = parsed(name, |name| NumberType::parse_unsigned(name, &[]))?;
    Ok(number.at(front(at)?))
}

/// Returns the trailer, and its field.
fn trailer(entry: &Spanned<TrailerEntry>) -> Result<(Trailer, Field), Located> {
    let TrailerEntry {
        name,
        at,
        mask,
        bytes,
    } = entry.get_ref();
    let name = parsed(name, column_name)?;
    let (at, mask, bytes) = (front(at)?, *mask, *bytes);
    Ok((Trailer { at, mask, bytes }, Field::of_trailer(name, bytes)))
}

/// Returns the part that determines the length of a frame.
fn length(all: &Entries) -> Result<Length, Located> {
    if let Some(ends) = &all.ends {
        let is_over = all.length.is_some() || all.length_field.is_some() || all.packets.is_some();
        let rule = "ends = \"silence\" is for frames that nothing else ends: leave it out, or leave length, length_field \
                    and packets out";
        reject_if(is_over, ends.span(), rule)?;
    }
    match (&all.length, &all.length_field) {
        (Some(length), Some(_)) => {
            let rule = "length is for frames of the same length, length_field for frames that contain their length: \
                        leave one out";
            Err(Located::new(length.span(), rule))
        }
        // Without sync and checksum, only the delimiter after the packet shows that the packet has this length.
        (Some(_), None)
            if all.packets.is_some() && all.sync.is_none() && all.checksum.is_none() =>
        {
            Ok(Length::Silence)
        }
        (Some(_), None) => Ok(Length::Fixed),
        (None, Some(field)) => {
            let field = field.get_ref();
            Ok(Length::Field(LengthField {
                number: number(&field.at, &field.r#type)?,
                mask: field.mask.unwrap_or(u32::MAX),
                factor: field.factor.unwrap_or(1),
                plus: field.plus,
            }))
        }
        (None, None) if all.ends.is_some() => Ok(Length::Silence),
        (None, None) if all.terminator.is_some() => Ok(Length::Delimiter),
        (None, None) if all.packets.is_some() => Ok(Length::Silence),
        (None, None) => {
            let rule = "nothing ends a frame: give length, length_field, terminator, packets, or ends = \"silence\"";
            Err(Located::new(0..0, rule))
        }
    }
}

/// Returns the lengths of the shortest and the longest frame. If frames vary in length, each frame has at least `parts`
/// bytes: the header, and the parts that are counted from the end.
fn bounds(all: &Entries, length: Length, parts: usize) -> Result<(usize, usize), Located> {
    let needless = all.shortest.is_some() || all.longest.is_some();
    let rule = "every frame has this length: leave shortest and longest out";
    if let Some(length) = &all.length {
        reject_if(needless, length.span(), rule)?;
    }
    let Some(longest) = all.length.as_ref().or(all.longest.as_ref()) else {
        let rule = "give longest, the number of bytes in the longest frame: as few as possible, because after a false \
                    start a frame may be delayed by that many bytes";
        return Err(Located::new(0..0, rule));
    };
    let (what, most) = ("longest", LONGEST);
    reject_if(
        *longest.get_ref() > most,
        longest.span(),
        Mistake::OutOfRange { what, most },
    )?;
    let least = match length {
        _ if all.length.is_some() => *longest.get_ref(),
        Length::Field(field) => parts.max(usize::try_from(field.plus).unwrap_or(0)),
        _ => parts,
    };
    let shortest = all.shortest.as_ref().map_or(least, |it| *it.get_ref());
    Ok((shortest, *longest.get_ref()))
}

/// Returns the bits that are the same in every frame, and a second list of the same length: where the description's
/// text has the value of these bits.
fn fixed_bits(fields: &[ReadField]) -> (Vec<FixedBits>, Vec<Range<usize>>) {
    let constant = fields.iter().filter(|read| read.field.constant.is_some());
    let bits = constant.flat_map(|ReadField { field, value, .. }| {
        let span = value.clone();
        let masks = field.masks(0).into_iter();
        masks.map(move |(byte, (mask, value))| {
            let byte = i16::try_from(byte).expect("a number has up to nine bytes");
            let at = field.at.saturating_add(byte);
            (FixedBits { at, mask, value }, span.clone())
        })
    });
    bits.unzip()
}

/// Returns the known messages: those of the entry `messages`, or the possible values of a field with a list of values.
fn messages(all: &Entries, fields: &[ReadField]) -> Result<Option<OwnMessages>, Located> {
    let mut messages = match all.messages.as_ref().map(Spanned::get_ref) {
        Some(entry) => Some((number(&entry.at, &entry.r#type)?, entry.known.messages())),
        None => None,
    };
    for ReadField { field, value, .. } in fields {
        if let (Type::Number(number), [_, ..]) = (field.kind, &*field.allowed) {
            reject_if(messages.is_some(), value.clone(), ONE_LIST)?;
            let known = field.allowed.iter().map(|value| KnownMessage::new(*value));
            let at = field.at.unsigned_abs().into();
            messages = Some((number.at(at), sorted(known).into()));
        }
    }
    Ok(messages)
}

/// Returns a list of messages for a kind that has fixed bits after the header. The list treats the last byte with fixed
/// bits as the message's number. A receiver waits for this number before it decides on the kind, so it checks all fixed
/// bits first. The known numbers are all values of this byte that agree with its fixed bits.
fn distinguishing(fixed: &[FixedBits], header: usize) -> Option<OwnMessages> {
    let follows = |bits: &&FixedBits| usize::try_from(bits.at).is_ok_and(|at| at >= header);
    let last = fixed.iter().filter(follows).max_by_key(|bits| bits.at)?;
    let bytes = (0..=u8::MAX).filter(|byte| byte & last.mask == last.value);
    let known: Vec<KnownMessage> = bytes.map(|byte| KnownMessage::new(byte.into())).collect();
    Some((Number::byte(last.at.unsigned_abs().into()), known.into()))
}

/// Returns the position of a part's entry. `owners[i]` is the position, in the description's text, of the value that
/// fixes the bits with index `i`.
fn span_of(part: layout::Part, all: &Entries, owners: &[Range<usize>]) -> Range<usize> {
    let length = || span(all.length.as_ref());
    match part {
        layout::Part::Sync => span(all.sync.as_ref()),
        layout::Part::Length => all.length_field.as_ref().map_or_else(length, Spanned::span),
        layout::Part::Shortest | layout::Part::Longest => {
            all.longest.as_ref().map_or_else(length, Spanned::span)
        }
        layout::Part::Fixed(number) => owners[number].clone(),
        layout::Part::Messages => {
            let mut fields = all.fields.iter().map(Spanned::get_ref);
            let list = fields.find_map(|it| it.value.as_ref().filter(|it| it.get_ref().is_list()));
            list.map_or_else(|| span(all.messages.as_ref()), Spanned::span)
        }
        layout::Part::Behind => span(all.behind.as_ref()),
        layout::Part::Checksum => span(all.checksum.as_ref()),
        layout::Part::Content => span(all.content.as_ref()),
        layout::Part::Trailer => span(all.trailer.as_ref()),
        _ => span(all.terminator.as_ref()),
    }
}
