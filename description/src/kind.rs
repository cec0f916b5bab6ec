//! From what is written to a layout and its fields, with all that contradicts itself.

use std::ops::Range;

use framelock_formats::layout::{Checksum, FixedBits, Layout, Length, Message, Messages, Patterns};
use toml::Spanned;

use crate::checksum::{bytes_of, tabled};
use crate::field::{Class, Field, Known, Type, index};
use crate::value::Value;
use crate::written::{
    Alternatives, ChecksumEntry, FieldEntry, Problem, Values, Written, missing, sorted, wrong,
};

/// Bytes in the longest frame that may be described: what a length of 16 bits can tell, and 256 more.
pub const LONGEST: usize = 0x1_00FF;

/// Names that rows have besides the fields.
const TAKEN: [&str; 3] = ["offset", "length", "time"];

/// One kind of frames: what they look like, and what stands in them.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Its name among several.
    pub name: String,
    /// What a frame looks like.
    pub layout: Layout<'static>,
    /// What stands in it, in the order of the description; those that are always the same too.
    pub fields: Vec<Field>,
    /// Bytes that must be there before the length is known.
    pub(crate) header: usize,
    /// Bytes at the end that are counted from the end.
    pub(crate) trailer: usize,
}

impl Kind {
    /// A frame without what is appended to it, and that.
    #[inline]
    fn parts<'a>(&self, frame: &'a [u8]) -> (&'a [u8], &'a [u8]) {
        let Some(appendix) = &self.layout.appendix else {
            return (frame, &[]);
        };
        let appended = match frame.get(appendix.at) {
            Some(byte) if byte & appendix.mask != 0 => appendix.bytes,
            _ => 0,
        };
        frame
            .split_at_checked(frame.len().saturating_sub(appended))
            .unwrap_or_default()
    }

    /// What one of its fields is in a frame; nothing if that is too short to have it.
    #[inline]
    #[must_use]
    pub fn content<'f>(&self, field: &'f Field, frame: &'f [u8]) -> Option<Content<'f>> {
        let (frame, appended) = self.parts(frame);
        let bytes = field.bytes(if field.is_appended { appended } else { frame })?;
        Some(Content { field, bytes })
    }

    /// The fields that frames differ in, and what they are in a frame that is long enough to have them.
    pub fn shown<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let fields = self.fields.iter().filter(|field| field.constant.is_none());
        fields.filter_map(move |field| Some((field, self.content(field, frame)?)))
    }

    /// Whether a frame may be too short for a field.
    pub(crate) fn is_optional(&self, field: &Field) -> bool {
        let distance = usize::from(field.at.unsigned_abs());
        let end = distance + field.length().unwrap_or(0);
        field.is_appended || field.at >= 0 && end + field.margin > self.layout.shortest
    }
}

/// What a field is in a frame.
#[derive(Clone, Copy)]
pub struct Content<'f> {
    field: &'f Field,
    bytes: &'f [u8],
}

impl<'f> Content<'f> {
    /// The value, or each of an array.
    #[inline]
    pub fn values(self) -> impl Iterator<Item = Value<'f>> {
        self.field.read(self.bytes)
    }
}

/// The kind that is written.
pub(crate) fn kind(name: &str, written: &Written) -> Result<Kind, Problem> {
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

    // What is there before the length is known, what is counted from the end, and both at least.
    let mut header = sync.length;
    if !matches!(length, Length::Delimiter) {
        header = header.max(1);
    }
    let mut least = 0;
    if let Length::Field(field) = &length {
        header = header.max(field.number.end());
        least = usize::try_from(field.plus).unwrap_or_default();
    }
    if let Some(messages) = &messages {
        header = header.max(messages.number.end());
    }
    let appendix = written
        .appendix
        .as_ref()
        .map(|entry| (entry, entry.get_ref().appendix()));
    if let Some((entry, appendix)) = &appendix {
        header = header.max(appendix.at + 1);
        if !matches!(length, Length::Field(_)) || !(1..=LONGEST).contains(&appendix.bytes) {
            return wrong(
                entry,
                "an appendix has bytes, and its frames have a length_field",
            );
        }
        fields.push(appended(entry.get_ref(), appendix.bytes)?);
    }
    let places = fields
        .iter()
        .filter(|field| !field.is_appended)
        .map(|field| field.at);
    let places = places.chain(written.checksum.as_ref().map(|check| check.get_ref().at));
    let from_end = places
        .filter(|at| *at < 0)
        .map(|at| usize::from(at.unsigned_abs()));
    let trailer = from_end.fold(terminator.length, usize::max);
    for (field, entry) in fields.iter_mut().zip(&written.fields) {
        // What takes the rest of a frame of one length has one length as well.
        if let (Some(length), None) = (&written.length, field.length()) {
            let distance = usize::from(field.at.unsigned_abs());
            field.count = length.get_ref().checked_sub(distance + trailer);
            if field.count.is_none_or(|left| left == 0) {
                return wrong(entry, "nothing of the frame is left for this field");
            }
        }
        let is_placed = field.at < 0 || field.constant.is_some();
        if !is_placed && !matches!(length, Length::Fixed) {
            field.margin = trailer;
        }
    }
    // In frames of one length what is counted from the end has a place like any other.
    let end = match length {
        Length::Fixed => terminator.length,
        _ => trailer,
    };
    fields.iter_mut().for_each(Field::learn);
    let (shortest, longest) = bounds(written, &length, least.max(header + end))?;
    let mut kind = Kind {
        name: name.to_owned(),
        layout: Layout {
            length,
            shortest,
            longest,
            appendix: appendix.map(|(_, appendix)| appendix),
            ..Layout::NONE
        },
        fields,
        header,
        trailer,
    };
    let most = written
        .length_field
        .as_ref()
        .map(|field| field.get_ref().most());
    let alone = most
        .and_then(|most| usize::try_from(most).ok())
        .map_or(longest, |most| longest.min(most));
    for length in [shortest, alone] {
        check_places(written, &kind, length, alone)?;
    }
    let checksum = written.checksum.as_ref().map(checksum).transpose()?;
    kind.layout = Layout {
        sync: leaked(sync),
        fixed: fixed_bits(&kind.fields).leak(),
        messages,
        checksum: checksum.map(|checksum| Checksum {
            algorithm: tabled(checksum.algorithm),
            ..checksum
        }),
        terminator: leaked(terminator),
        ..kind.layout
    };
    Ok(kind)
}

fn leaked(alternatives: &Alternatives) -> Patterns<'static> {
    Patterns {
        bytes: alternatives.bytes.clone().leak(),
        length: alternatives.length,
    }
}

fn length(written: &Written) -> Result<Length, Problem> {
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

/// Bytes in the shortest frame and in the longest; `least` are the parts that each has.
fn bounds(written: &Written, length: &Length, least: usize) -> Result<(usize, usize), Problem> {
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
    let mut most = LONGEST as u64;
    if let (Length::Field(_), Some(field)) = (length, &written.length_field) {
        let appended = written
            .appendix
            .as_ref()
            .map_or(0, |it| it.get_ref().appendix().bytes);
        most = most.min(field.get_ref().most().saturating_add(appended as u64));
    }
    if least <= shortest && shortest <= longest && longest as u64 <= most {
        return Ok((shortest, longest));
    }
    let what = format!(
        "frames of {shortest} to {longest} bytes: the parts that each has are {least}, and {most} \
         is the most that a length field of this type can say, or there is room for"
    );
    wrong(place, what)
}

/// The messages that there are: those that are listed, or the values that a field may have.
fn messages(written: &Written) -> Result<Option<Messages<'static>>, Problem> {
    let mut messages = None;
    if let Some(entry) = &written.messages {
        let known = entry.get_ref().known();
        let number = entry.get_ref().number();
        let known = known.map_err(|why| Problem(entry.span(), why.into()))?;
        messages = Some(Messages { number, known });
    }
    for entry in &written.fields {
        let entry = entry.get_ref();
        let Some((place, Values::OneOf(values))) =
            entry.value.as_ref().map(|it| (it, it.get_ref()))
        else {
            continue;
        };
        let known = sorted(values.iter().map(|value| (*value, None, u16::MAX)));
        let known = known.map_err(|why| Problem(place.span(), why.into()))?;
        match (
            entry.kind.map(|kind| kind.0),
            usize::try_from(*entry.at.get_ref()),
        ) {
            (Some(Type::Number(number)), Ok(at))
                if number.class == Class::Unsigned
                    && number.bytes <= 4
                    && entry.mask.is_none()
                    && entry.count.is_none()
                    && messages.is_none() =>
            {
                let layout = framelock_formats::layout::Number {
                    at,
                    bytes: number.bytes,
                    order: number.order,
                };
                if known.is_empty()
                    || known
                        .iter()
                        .any(|it: &Message| u64::from(it.number) > number.all())
                {
                    return wrong(place, "these values do not fit the field");
                }
                messages = Some(Messages {
                    number: layout,
                    known,
                });
            }
            _ => {
                return wrong(
                    place,
                    "a list of values is for one number without sign, mask and count, counted from the front, of one \
                     field, and where there are no messages besides",
                );
            }
        }
    }
    Ok(messages)
}

fn checksum(entry: &Spanned<ChecksumEntry>) -> Result<Checksum<'static>, Problem> {
    let check = entry.get_ref();
    let algorithm = check
        .algorithm()
        .map_err(|why| Problem(entry.span(), why.into()))?;
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

/// The bits of all that is always the same.
fn fixed_bits(fields: &[Field]) -> Vec<FixedBits> {
    let mut fixed: Vec<FixedBits> = Vec::new();
    for field in fields {
        let Some(constant) = field.constant else {
            continue;
        };
        let mut bytes = std::collections::BTreeMap::<usize, (u8, u8)>::new();
        field.each_bit(0, |place, _, of_value| {
            let (mask, value) = bytes.entry(place / 8).or_default();
            *mask |= 1 << (place % 8);
            *value |= u8::from(constant >> of_value & 1 == 1) << (place % 8);
        });
        for (byte, (mask, value)) in bytes {
            let at = field
                .at
                .saturating_add_unsigned(u16::try_from(byte).unwrap_or(u16::MAX));
            fixed.push(FixedBits { at, mask, value });
        }
    }
    fixed
}

/// A part of a frame: where in the text it is said, what it is called, its first byte, and which bits from there on.
struct Part<'a> {
    span: Range<usize>,
    name: &'a str,
    from: usize,
    bits: Vec<usize>,
}

/// That in a frame of this length, of `longest` at most, all is in its place, and nothing in that of another.
fn check_places(
    written: &Written,
    kind: &Kind,
    length: usize,
    longest: usize,
) -> Result<(), Problem> {
    let whole = |bytes: usize| (0..8 * bytes).collect();
    let mut parts = Vec::new();
    // Where there are several a field may say which.
    let terminator = written
        .terminator
        .as_ref()
        .filter(|it| it.get_ref().is_one());
    if let Some(terminator) = terminator {
        let bytes = terminator.get_ref().length;
        parts.push(Part {
            span: terminator.span(),
            name: "the terminator",
            from: length.saturating_sub(bytes),
            bits: whole(bytes),
        });
    }
    if let Some(entry) = &written.checksum {
        let check = checksum(entry)?;
        let bytes = entry.get_ref().stored.length();
        let place = |at| index(at, length).unwrap_or(length);
        let (at, from, to) = (place(check.at), place(check.from), place(check.to));
        if from > to + 1 || to >= length || (from < at + bytes && at <= to) {
            let what = format!(
                "in a frame of {length} bytes the checksum is at {at} and covers {from} to {to}: \
                 give from and to, the first and the last byte; it does not cover itself"
            );
            return wrong(entry, what);
        }
        parts.push(Part {
            span: entry.span(),
            name: "the checksum",
            from: at,
            bits: whole(bytes),
        });
    }
    for (field, entry) in kind.fields.iter().zip(&written.fields) {
        let entry = entry.get_ref();
        if kind.is_optional(field) && length < longest {
            match &entry.value {
                Some(value) => {
                    return wrong(value, "a frame may be too short for this: give shortest");
                }
                None => continue,
            }
        }
        let from = index(field.at, length).unwrap_or(length);
        let left = length.saturating_sub(from + field.margin);
        let is_in = field.length().is_none_or(|bytes| bytes <= left);
        let mut bits = Vec::new();
        if is_in {
            field.each_bit(left, |place, _, _| bits.push(place));
        }
        parts.push(Part {
            span: entry.at.span(),
            name: &field.name,
            // Beyond the end, if it does not end in front of what is counted from there.
            from: if is_in { from } else { length },
            bits: if is_in { bits } else { vec![0] },
        });
    }
    let mut taken = vec![0_usize; 8 * length];
    for (number, part) in (1..).zip(&parts) {
        for bit in &part.bits {
            let Some(owner) = taken.get_mut(8 * part.from + bit) else {
                let what = format!("{} is not in a frame of {length} bytes", part.name);
                return Err(Problem(part.span.clone(), what));
            };
            let before = std::mem::replace(owner, number);
            if let Some(other) = parts.get(before.wrapping_sub(1)) {
                let what = format!("{} is in the place of {}", part.name, other.name);
                return Err(Problem(part.span.clone(), what));
            }
        }
    }
    Ok(())
}

/// A name that a column may have.
fn column_name(name: &Spanned<String>) -> Result<String, Problem> {
    let text = name.get_ref();
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if !text.starts_with(|c: char| c.is_ascii_lowercase()) || !text.chars().all(plain) {
        return wrong(
            name,
            "a name has small letters, digits and _, and begins with a letter",
        );
    }
    if TAKEN.contains(&text.as_str()) {
        let what = format!(
            "{} are other columns' names: take another",
            TAKEN.join(", ")
        );
        return wrong(name, what);
    }
    Ok(text.clone())
}

/// What is appended.
fn appended(entry: &crate::written::AppendixEntry, bytes: usize) -> Result<Field, Problem> {
    Ok(Field {
        name: column_name(&entry.name)?,
        at: 0,
        kind: Type::Bytes,
        count: Some(bytes),
        mask: None,
        scale: None,
        unit: None,
        constant: None,
        margin: 0,
        is_appended: true,
        known: Known::default(),
    })
}

fn field(spanned: &Spanned<FieldEntry>) -> Result<Field, Problem> {
    let entry = spanned.get_ref();
    let name = column_name(&entry.name)?;
    let kind = match (entry.kind, entry.bits) {
        (Some(kind), None) => kind.0,
        (None, Some(width @ 1..=64)) => Type::Bits {
            first: entry.bit.into(),
            width,
        },
        _ => {
            return wrong(
                spanned,
                "a field has a type, or else bits, which are 1 to 64",
            );
        }
    };
    if entry
        .count
        .is_some_and(|count| !(1..=LONGEST).contains(&count))
    {
        return wrong(spanned, format!("a count is from 1 to {LONGEST}"));
    }
    let number = match kind {
        Type::Number(number) if number.class != Class::Float => Some(number),
        _ => None,
    };
    if let Some(mask) = &entry.mask
        && number.is_none_or(|number| *mask.get_ref() == 0 || *mask.get_ref() > number.all())
    {
        return wrong(
            mask,
            "a mask is for whole numbers, and has bits that they have",
        );
    }
    let is_short = match kind {
        Type::Bits { width, .. } => width <= 32,
        _ => number.is_some_and(|number| number.bytes <= 4),
    };
    if let Some(scale) = entry.scale.as_ref().filter(|_| !is_short) {
        return wrong(scale, "a scale is for whole numbers of up to 32 bits");
    }
    if let Some(unit) = &entry.unit
        && unit
            .get_ref()
            .chars()
            .any(|c| c.is_control() || c.is_whitespace())
    {
        return wrong(unit, "a unit is a word, such as deg or m/s");
    }
    let mut field = Field {
        name,
        at: *entry.at.get_ref(),
        kind,
        count: entry.count,
        mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
        scale: entry.scale.as_ref().map(|scale| scale.get_ref().0.clone()),
        unit: entry.unit.as_ref().map(|unit| unit.get_ref().clone()),
        constant: None,
        margin: 0,
        is_appended: false,
        known: Known::default(),
    };
    if let Some(value) = &entry.value
        && let Values::One(number) = *value.get_ref()
    {
        match field.to_bits(&number.into()) {
            Ok(bits) if !field.is_array() && !field.is_text() => field.constant = Some(bits),
            _ => {
                return wrong(
                    value,
                    "this value does not fit the field, or the field is an array",
                );
            }
        }
    }
    if field.at < 0 && field.length().is_none() {
        let what = "what takes all that is left is counted from the front; or give a count";
        return wrong(&entry.at, what);
    }
    Ok(field)
}
