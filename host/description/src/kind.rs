//! A kind of frames: its layout, its fields, and the values of the fields in a frame.

use std::collections::BTreeMap;
use std::ops::Range;

use framelock::DiscardReason;
use framelock_formats::layout::{
    self, CheckedLayout, FixedBits, KnownMessage, Length, LengthField, Trailer,
};

use crate::field::{Class, Field, NumberType, Type, column_name};
use crate::layouts::{Alternatives, Layouts, Parts};
use crate::messages::Known;
use crate::problem::{Located, Mistake};
use crate::table::Table;
use crate::value::Value;
use crate::{checksum, layouts};

/// The largest length that a description may allow for a frame: the largest 16-bit number plus 256.
pub const LONGEST: usize = 0x1_00FF;

/// One kind of frames: their layout and their fields.
#[derive(Clone, Debug)]
pub struct Kind {
    /// The name of the kind.
    pub name: String,
    /// The layout of the kind alone.
    pub(crate) layouts: Layouts,
    /// The fields in the order of the description, including those that have the same value in every frame.
    pub fields: Vec<Field>,
    /// The exclusive end index of each field, in ascending order; `None` if a field takes the rest of the frame.
    ends: Option<Vec<usize>>,
    /// The number of bytes that must arrive before the length is known.
    header: usize,
    /// How many bytes at the frame's end hold the terminator and all parts whose positions are counted from the end.
    pub from_end: usize,
    /// The views of messages. Each view has fields for the values in one message's payload. A frame is shown by the
    /// first view that fits.
    pub views: Vec<Kind>,
    /// If this is a view: the bytes that identify the view's frames, and the index of the first of these bytes.
    pub sign: (usize, Vec<u8>),
    /// Whether the sender leaves out zero bytes at the end of the payload.
    pub has_truncated_zeros: bool,
    /// The numbers and names of messages, in ascending order of the numbers.
    pub message_names: Vec<(u32, &'static str)>,
}

/// A part of a frame. `Display` writes the part's name: `sync` for example, or the column of a value.
#[derive(Clone, Copy, Debug)]
pub enum Part<'k> {
    /// The bytes that a frame begins with.
    Sync,
    /// The number that determines the frame's length.
    Length,
    /// The checksum, as it is encoded in the frame: in hex, each byte of the checksum takes two bytes of the frame.
    Checksum,
    /// The bytes that a frame ends with.
    Terminator,
    /// A value of a field and its index, from 0. Only arrays have several values.
    Value(&'k Field, usize),
}

impl Part<'_> {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Length => "length",
            Self::Checksum => "checksum",
            Self::Terminator => "terminator",
            Self::Value(..) => "value",
        }
    }
}

/// Reads the table of a length field.
fn length_field(mut table: Table) -> Result<LengthField, Located> {
    let number = number(&mut table)?;
    let (mask, factor, plus) = (table.get("mask")?, table.get("factor")?, table.get("plus")?);
    table.finish()?;
    Ok(LengthField {
        mask: mask.unwrap_or(u32::MAX),
        factor: factor.unwrap_or(1),
        plus: plus.unwrap_or(0),
        ..LengthField::new(number)
    })
}

/// Reads the type and the position of a number in the header.
fn number(table: &mut Table) -> Result<layout::Number, Located> {
    let number = table.need_parsed("type", NumberType::parse_unsigned)?;
    Ok(number.at(front(table)?))
}

/// Reads a position that is counted from the front.
fn front(table: &mut Table) -> Result<usize, Located> {
    let at: i16 = table.need("at")?;
    usize::try_from(at).or_else(|_| table.wrong("at", Mistake::FromEnd))
}

/// Reads the table of a trailer: the trailer and its field.
fn trailer(mut table: Table) -> Result<(Trailer, Field), Located> {
    let name = table.need_parsed("name", column_name)?;
    let at = front(&mut table)?;
    let (mask, bytes) = (table.need("mask")?, table.need("bytes")?);
    table.finish()?;
    Ok((Trailer { at, mask, bytes }, Field::of_trailer(name, bytes)))
}

/// Reads the tables of fields.
fn fields(tables: Vec<Table>) -> Result<Vec<(Field, Table)>, Located> {
    let read = |mut table| Ok((Field::read(&mut table)?, table));
    tables.into_iter().map(read).collect()
}

/// Returns the sum of two lists of tables.
fn both<'t>(
    common: Option<&Table<'t>>,
    own: &mut Table<'t>,
    key: &'static str,
) -> Result<Vec<Table<'t>>, Located> {
    let mut tables = match common {
        Some(common) => common.clone().tables(key)?,
        None => Vec::new(),
    };
    tables.extend(own.tables(key)?);
    Ok(tables)
}

impl Kind {
    /// Reads the table of a kind. If the kind is one of many, `common` is the table that surrounds them.
    pub(crate) fn read<'t>(
        name: &str,
        table: &mut Table<'t>,
        common: Option<&Table<'t>>,
    ) -> Result<Self, Located> {
        if let Some(common) = common {
            table.inherit(common);
        }
        let sync = table
            .parse("sync", Alternatives::parse)?
            .unwrap_or_default();
        let fixed_length = table.get::<usize>("length")?;
        let length_field = table.table("length_field", length_field)?;
        let (shortest, longest) = (table.get("shortest")?, table.get("longest")?);
        let terminators = table.parse("terminator", layouts::terminators)?;
        let content = table
            .parse("content", layouts::content)?
            .unwrap_or_default();
        let checksum = table.table("checksum", checksum::read)?;
        let messages = table.table("messages", |mut table| {
            let messages = (number(&mut table)?, table.need::<Known>("known")?);
            table.finish().map(|()| messages)
        })?;
        let (trailer, trailer_field) = table.table("trailer", trailer)?.unzip();
        let has_truncated_zeros = table.get("truncated_zeros")?.unwrap_or(false);
        let fields = fields(both(common, table, "fields")?)?;
        let views = both(common, table, "views")?;
        table.finish()?;

        let length = length(table, fixed_length, length_field, terminators.is_some())?;
        let [terminator, other, another] = terminators.unwrap_or_default();
        let from_end = checksum.iter().map(|checksum| checksum.at);
        let from_end = from_end.chain(fields.iter().map(|(field, _)| field.at));
        let from_end = from_end.map(|at| usize::from(at.min(0).unsigned_abs()));
        let from_end = from_end.fold(terminator.length, usize::max);
        let (fixed, owners) = fixed_bits(fields.iter().map(|(field, _)| field));
        let mut parts = Parts {
            sync,
            length,
            shortest: 0,
            longest: 0,
            fixed,
            messages: None,
            checksum,
            terminator,
            other_terminators: [other, another],
            content,
            trailer,
            table: None,
        };
        let listed = messages.as_ref();
        parts.messages = listed.map(|(number, known)| (*number, known.messages()));
        for (field, table) in &fields {
            if let (Type::Number(number), [_, ..]) = (field.kind, &*field.allowed) {
                if parts.messages.is_some() {
                    return table.wrong("value", Mistake::ValueList);
                }
                let known = field.allowed.iter().map(|value| KnownMessage::new(*value));
                let at = usize::from(field.at.unsigned_abs());
                parts.messages = Some((number.at(at), crate::messages::sorted(known).into()));
            }
        }
        // A frame may consist of only the delimiter.
        let header = match length {
            Length::Delimiter if parts.sync.length == 0 && parts.messages.is_none() => 0,
            _ => parts.layout().header(),
        };
        if common.is_some() && parts.messages.is_none() {
            parts.messages = distinguishing(&parts.fixed, header);
        }
        (parts.shortest, parts.longest) = bounds(
            table,
            fixed_length,
            &length,
            shortest,
            longest,
            header + from_end,
        )?;
        if let Some(layout::Algorithm::Crc(crc)) = checksum.map(|checksum| checksum.algorithm)
            && (8..=32).contains(&crc.width)
        {
            parts.table = Some(Box::new(crc.table_of_words()));
        }
        let layouts = Layouts::new(vec![parts.into()]).map_err(|contradiction| {
            let span = span_of(contradiction.part, table, &fields, &owners);
            Located::new(span, Mistake::Contradiction(contradiction))
        })?;
        let mut kind = Self {
            name: name.to_owned(),
            layouts,
            fields: Vec::new(),
            ends: None,
            header,
            from_end,
            views: Vec::new(),
            sign: (0, Vec::new()),
            has_truncated_zeros,
            message_names: messages.map_or(Vec::new(), |(_, known)| known.names()),
        };
        let plain = kind.clone();
        kind.place(&fields, trailer_field.clone(), fixed_length)?;
        kind.check_example(table, &fields, &owners)?;
        for mut view in views {
            kind.views
                .push(plain.view(&mut view, &fields, trailer_field.clone(), fixed_length)?);
        }
        Ok(kind)
    }

    /// Reads the table of a view of this kind, which has no fields yet. `common` are the fields of the kind.
    fn view(
        &self,
        table: &mut Table,
        common: &[(Field, Table)],
        trailer: Option<Field>,
        fixed_length: Option<usize>,
    ) -> Result<Self, Located> {
        let name: String = table.need("name")?;
        let at = front(table)?;
        let bytes = table.need_parsed("bytes", Alternatives::parse)?.bytes;
        let own = fields(table.tables("fields")?)?;
        table.finish()?;
        // If a view has items, the view's fields are added to the field that takes the rest of the frame. Otherwise the
        // view's fields replace that field.
        let has_items = own.iter().any(|(field, _)| field.item.is_some());
        let common = common
            .iter()
            .filter(|(field, _)| has_items || field.length().is_some());
        let fields: Vec<(Field, Table)> = common.cloned().chain(own).collect();
        let from_end = fields
            .iter()
            .map(|(field, _)| usize::from(field.at.min(0).unsigned_abs()));
        let mut view = Self {
            name,
            sign: (at, bytes),
            from_end: from_end.fold(self.from_end, usize::max),
            message_names: Vec::new(),
            ..self.clone()
        };
        view.place(&fields, trailer, fixed_length)?;
        Ok(view)
    }

    /// Gives the kind its fields. Checks that each field is in every frame that must have it, and outside the sync, the
    /// length, the checksum and the terminator. Fields may share bytes with each other.
    fn place(
        &mut self,
        fields: &[(Field, Table)],
        trailer: Option<Field>,
        fixed_length: Option<usize>,
    ) -> Result<(), Located> {
        self.fields = fields
            .iter()
            .map(|(field, _)| field.clone())
            .chain(trailer)
            .collect();
        for (number, field) in self.fields.iter_mut().enumerate() {
            if !field.limit(fixed_length, self.from_end) {
                return Err(Located::new(fields[number].1.span.clone(), Mistake::NoRest));
            }
        }
        self.ends = self.ends_of_fields();
        let longest = self.layout().longest_without_trailer();
        for length in [self.layout().shortest, longest] {
            // An item shares the bytes of its text.
            let own = self
                .fields
                .iter()
                .zip(fields)
                .filter(|(field, _)| field.item.is_none());
            for (field, (_, table)) in own {
                if length < longest && self.shortest_with(field).is_some() {
                    continue;
                }
                let mistake = match field.position(length) {
                    None if field.length().is_some() => Some(Mistake::Outside {
                        field: field.name.clone(),
                        length,
                    }),
                    Some(bytes) => {
                        self.overlapped(field, bytes, length)
                            .map(|part| Mistake::Overlap {
                                field: field.name.clone(),
                                part,
                            })
                    }
                    None => None,
                };
                if let Some(mistake) = mistake {
                    return table.wrong("at", mistake);
                }
            }
        }
        Ok(())
    }

    /// Checks that a frame of this kind exists, by making one.
    fn check_example(
        &self,
        table: &Table,
        fields: &[(Field, Table)],
        owners: &[usize],
    ) -> Result<(), Located> {
        let layout = self.layout();
        let Err(why) = layout.example(&mut vec![0; layout.longest]) else {
            return Ok(());
        };
        let part = match why {
            DiscardReason::NoSync | DiscardReason::BrokenSync => layout::Part::Sync,
            DiscardReason::UnknownMessage => layout::Part::Messages,
            DiscardReason::WrongTerminator if !owners.is_empty() => {
                layout::Part::Fixed(owners.len() - 1)
            }
            DiscardReason::WrongTerminator => layout::Part::Terminator,
            _ => layout::Part::Length,
        };
        let span = span_of(part, table, fields, owners);
        Err(Located::new(span, Mistake::NoFrame(part)))
    }

    /// Returns the name of another part that has a bit of this field in a frame of `length` bytes. A field may select
    /// one of several syncs or terminators.
    fn overlapped(
        &self,
        field: &Field,
        bytes: Range<usize>,
        length: usize,
    ) -> Option<&'static str> {
        let (layout, mut overlapped) = (self.layout(), None);
        let is_choice = |part: Part| match part {
            Part::Sync => layout.sync.bytes.len() > layout.sync.length,
            Part::Terminator => {
                layout.terminator.bytes.len() > layout.terminator.length
                    && layout
                        .other_terminators
                        .iter()
                        .all(|other| other.length == 0)
            }
            _ => false,
        };
        let mut parts = self.layout_parts(length, true);
        parts.retain(|(part, _)| !is_choice(*part));
        field.each_bit(bytes.len(), |bit, _, _| {
            let byte = bytes.start + bit / 8;
            let has_bit = |(part, range): &&(Part, Range<usize>)| {
                range.contains(&byte)
                    && match (part, layout.length) {
                        (Part::Length, Length::Field(length)) => {
                            let place = match length.number.order {
                                layout::ByteOrder::Little => byte - range.start,
                                layout::ByteOrder::Big => range.end - 1 - byte,
                            };
                            length.mask >> (8 * place + bit % 8) & 1 == 1
                        }
                        _ => true,
                    }
            };
            overlapped = overlapped.or(parts.iter().find(has_bit).map(|(part, _)| part.name()));
        });
        overlapped
    }

    /// Returns the layout of a frame.
    #[must_use]
    #[inline]
    pub fn layout(&self) -> &CheckedLayout<'_> {
        &self.layouts.all()[0]
    }

    /// Returns the kind and its views.
    pub(crate) fn with_views(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.views)
    }

    /// Returns the parts of a frame of `length` bytes, without its trailer, and their positions. Fields come first, and
    /// may share bytes with other parts. If the frame is incomplete, leaves out parts that are counted from the end, and
    /// extends a field that takes the rest to `length`.
    #[must_use]
    pub fn parts(&self, length: usize, is_whole: bool) -> Vec<(Part<'_>, Range<usize>)> {
        let mut parts = Vec::new();
        let fields = self.fields.iter().filter(|field| !field.is_appended);
        for field in fields.filter(|field| is_whole || field.at >= 0) {
            let Some(all) = field.position(length + if is_whole { 0 } else { field.margin }) else {
                continue;
            };
            for number in 0..field.values() {
                let bytes = field.value_bytes(number, all.len());
                parts.push((
                    Part::Value(field, number),
                    all.start + bytes.start..all.start + bytes.end,
                ));
            }
        }
        parts.extend(self.layout_parts(length, is_whole));
        parts
    }

    /// Returns the positions of the parts that are not fields.
    fn layout_parts(&self, length: usize, is_whole: bool) -> Vec<(Part<'static>, Range<usize>)> {
        let layout = self.layout();
        let mut parts = vec![(Part::Sync, 0..layout.sync.length)];
        if let Length::Field(field) = layout.length {
            parts.push((Part::Length, field.number.at..field.number.end()));
        }
        if let Some(checksum) = layout
            .checksum
            .filter(|checksum| is_whole || checksum.at >= 0)
            && let Some(from) = layout::index(checksum.at, length)
        {
            parts.push((Part::Checksum, from..from + checksum.encoded_bytes()));
        }
        if is_whole {
            parts.push((
                Part::Terminator,
                length.saturating_sub(layout.terminator.length)..length,
            ));
        }
        parts
    }

    /// Returns the length of the shortest frame that contains a field; `None` if every frame contains it.
    #[must_use]
    pub fn shortest_with(&self, field: &Field) -> Option<usize> {
        if field.is_appended {
            return Some(self.layout().shortest);
        }
        let shortest = field.end(0)? + field.margin;
        (shortest > self.layout().shortest).then_some(shortest)
    }

    /// Returns the length of the shortest frame with room for three things: the header, fields with these
    /// [`end`](Field::end)s, and all parts that are counted from the end. The format's shortest frame may be longer. If
    /// all frames have the same length, returns this length.
    pub fn least_length(&self, ends: impl IntoIterator<Item = usize>) -> usize {
        match self.layout().length {
            Length::Fixed => self.layout().longest,
            _ => ends.into_iter().fold(self.header, usize::max) + self.from_end,
        }
    }

    /// Returns a divisor and a remainder: the length of each frame is a multiple of the divisor, plus the remainder.
    /// Returns `None` if any length is possible.
    #[must_use]
    pub fn multiple(&self) -> Option<(usize, usize)> {
        let Length::Field(field) = self.layout().length else {
            return None;
        };
        let factor = field.factor as usize;
        let more = i64::from(field.plus).checked_rem_euclid(field.factor.into())?;
        (factor > 1).then_some((factor, usize::try_from(more).ok()?))
    }

    /// For a sender that leaves out zeros, returns the index of the first byte that may be left out.
    #[must_use]
    pub fn first_zero(&self) -> usize {
        let shortest = self.layout().shortest.saturating_sub(self.from_end);
        self.header.max(shortest) + 1
    }

    /// Returns the name of the message in a frame, or the name of the kind if the message has none.
    #[inline]
    #[must_use]
    pub fn name_of(&self, frame: &[u8]) -> &str {
        self.message_name(frame).unwrap_or(&self.name)
    }

    fn message_name(&self, frame: &[u8]) -> Option<&'static str> {
        if self.message_names.is_empty() {
            return None;
        }
        let number = self.message_number(frame)?;
        let names = &self.message_names;
        let place = names.binary_search_by_key(&number, |(number, _)| u64::from(*number));
        Some(names[place.ok()?].1)
    }

    /// Returns the number of the message in a frame.
    pub(crate) fn message_number(&self, frame: &[u8]) -> Option<u64> {
        let number = self.layout().messages?.number;
        let number_type = NumberType {
            class: Class::Unsigned,
            bytes: number.bytes,
            order: number.order,
        };
        Some(number_type.bits(frame.get(number.at..number.end())?))
    }

    /// Returns true if the condition holds for the name of the kind or of one of its messages.
    #[must_use]
    pub fn has_name(&self, is_wanted: impl Fn(&str) -> bool) -> bool {
        is_wanted(&self.name) || self.message_names.iter().any(|(_, name)| is_wanted(name))
    }

    /// Returns the index of the view that shows a frame; `None` if no view fits the frame's values and length.
    #[inline]
    pub(crate) fn view_of(&self, frame: &[u8]) -> Option<usize> {
        self.views.iter().position(|view| view.shows(frame))
    }

    /// Returns true if the frame has the view's bytes, and some field ends at the end of the frame, or takes the rest of
    /// the frame. Zeros that the sender has left out count as present.
    #[inline]
    fn shows(&self, frame: &[u8]) -> bool {
        let (at, bytes) = &self.sign;
        if frame.get(*at..at + bytes.len()) != Some(bytes) {
            return false;
        }
        let trailer = self
            .layout()
            .trailer
            .map_or(0, |trailer| trailer.bytes_after(frame));
        let end = self
            .layout()
            .counted_length(frame)
            .saturating_sub(trailer + self.from_end);
        match &self.ends {
            None => true,
            Some(ends) if self.has_truncated_zeros => ends.last().is_some_and(|last| end <= *last),
            Some(ends) => ends.binary_search(&end).is_ok(),
        }
    }

    fn ends_of_fields(&self) -> Option<Vec<usize>> {
        let fields = self.fields.iter().filter(|field| !field.is_appended);
        if fields.clone().any(|field| field.length().is_none()) {
            return None;
        }
        let mut ends: Vec<usize> = fields.filter_map(|field| field.end(0)).collect();
        ends.sort_unstable();
        Some(ends)
    }

    /// Returns the fields whose values differ between frames.
    pub fn varying_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| field.constant.is_none())
    }

    /// Returns the fields whose values differ between frames, with their contents. Leaves out fields for which the frame
    /// is too short. All output of frames goes over this list.
    #[inline]
    pub fn values<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let contents = self.contents(frame);
        let fields = self.varying_fields();
        fields.filter_map(move |field| Some((field, contents.of(field)?)))
    }

    /// Returns the parts of a frame, for reading many fields.
    #[inline]
    #[must_use]
    pub fn contents<'f>(&'f self, frame: &'f [u8]) -> Contents<'f> {
        let layout = self.layout();
        let trailer = layout
            .trailer
            .map_or(0, |trailer| trailer.bytes_after(frame));
        let (alone, appended) = frame.split_at(frame.len().saturating_sub(trailer));
        Contents {
            kind: self,
            alone,
            length: layout.counted_length(alone),
            appended,
        }
    }
}

/// Returns the part that determines the length of a frame.
fn length(
    table: &Table,
    fixed_length: Option<usize>,
    length_field: Option<LengthField>,
    has_terminator: bool,
) -> Result<Length, Located> {
    match (fixed_length, length_field) {
        (Some(_), Some(_)) => table.wrong("length", Mistake::TwoLengths),
        (Some(_), None) => Ok(Length::Fixed),
        (None, Some(field)) => Ok(Length::Field(field)),
        (None, None) if has_terminator => Ok(Length::Delimiter),
        (None, None) => Err(Mistake::NoEnd.into()),
    }
}

/// Returns the position of a part: the part's entry. For each entry of the fixed bits, `owners` has the index of its
/// field.
fn span_of(
    part: layout::Part,
    table: &Table,
    fields: &[(Field, Table)],
    owners: &[usize],
) -> Range<usize> {
    let key = match part {
        layout::Part::Sync => "sync",
        layout::Part::Length if table.has("length_field") => "length_field",
        layout::Part::Shortest | layout::Part::Longest if table.has("longest") => "longest",
        layout::Part::Length | layout::Part::Shortest | layout::Part::Longest => "length",
        layout::Part::Messages => "messages",
        layout::Part::Checksum => "checksum",
        layout::Part::Content => "content",
        layout::Part::Trailer => "trailer",
        _ => "terminator",
    };
    let mut lists = fields.iter().filter(|(field, _)| !field.allowed.is_empty());
    let field = match part {
        layout::Part::Fixed(number) => Some(&fields[owners[number]]),
        layout::Part::Messages => lists.next(),
        _ => None,
    };
    field.map_or_else(|| table.span_of(key), |(_, table)| table.span_of("value"))
}

/// Returns the lengths of the shortest and the longest frame. If frames vary in length, each frame has at least `parts`
/// bytes: the header, and the parts that are counted from the end.
fn bounds(
    table: &Table,
    fixed_length: Option<usize>,
    length: &Length,
    shortest: Option<usize>,
    longest: Option<usize>,
    parts: usize,
) -> Result<(usize, usize), Located> {
    let (key, shortest, longest) = match (fixed_length, longest) {
        (Some(_), _) if shortest.is_some() || longest.is_some() => {
            return table.wrong("length", Mistake::NeedlessBounds);
        }
        (Some(length), _) => ("length", length, length),
        (None, Some(longest)) => {
            let least = match length {
                Length::Field(field) => parts.max(usize::try_from(field.plus).unwrap_or(0)),
                _ => parts,
            };
            let shortest = shortest.unwrap_or(least);
            if shortest < least {
                return table.wrong("longest", Mistake::TooShort { shortest, least });
            }
            ("longest", shortest, longest)
        }
        (None, None) => return Err(Mistake::NoLongest.into()),
    };
    if longest > LONGEST {
        return table.wrong(key, Mistake::TooLong);
    }
    Ok((shortest, longest))
}

/// Returns the bits that are the same in every frame, and for each entry of this list the index of its field.
fn fixed_bits<'f>(fields: impl Iterator<Item = &'f Field>) -> (Vec<FixedBits>, Vec<usize>) {
    let mut all = Vec::new();
    for (number, field) in fields.enumerate() {
        let Some(constant) = field.constant else {
            continue;
        };
        let mut bytes = BTreeMap::<i16, (u8, u8)>::new();
        field.each_bit(0, |place, _, of_value| {
            let byte = i16::try_from(place / 8).expect("a number has up to eight bytes");
            let (mask, value) = bytes.entry(field.at.saturating_add(byte)).or_default();
            *mask |= 1 << (place % 8);
            *value |= u8::from(constant >> of_value & 1 == 1) << (place % 8);
        });
        let bits = bytes
            .into_iter()
            .map(|(at, (mask, value))| FixedBits { at, mask, value });
        all.extend(bits.map(|bits| (bits, number)));
    }
    all.into_iter().unzip()
}

/// Returns a list of messages for a kind that has fixed bits after the header. The list makes a receiver check these bits
/// before it decides on the kind: the list treats the last byte with fixed bits as the message's number, for which a
/// receiver always waits. The known numbers are all values of this byte that agree with its fixed bits.
fn distinguishing(fixed: &[FixedBits], header: usize) -> Option<layouts::OwnMessages> {
    let follows = |bits: &&FixedBits| usize::try_from(bits.at).is_ok_and(|at| at >= header);
    let last = fixed.iter().filter(follows).max_by_key(|bits| bits.at)?;
    let bytes = (0..=u8::MAX).filter(|byte| byte & last.mask == last.value);
    let known: Vec<KnownMessage> = bytes.map(|byte| KnownMessage::new(byte.into())).collect();
    Some((
        layout::Number::byte(last.at.unsigned_abs().into()),
        known.into(),
    ))
}

/// The parts of a frame.
#[derive(Clone, Copy)]
pub struct Contents<'f> {
    kind: &'f Kind,
    /// The frame without its trailer.
    alone: &'f [u8],
    /// The length from which positions relative to the end are counted.
    length: usize,
    /// The trailer.
    appended: &'f [u8],
}

impl<'f> Contents<'f> {
    /// Returns the content of a field; `None` if the frame is too short to contain the field. Zeros that the sender has
    /// left out count as present.
    #[inline]
    #[must_use]
    pub fn of(&self, field: &'f Field) -> Option<Content<'f>> {
        match field.bytes(self.alone, self.length) {
            Some(bytes) if field.is_simple() => Some(Content { field, bytes }),
            _ => self.of_rarer(field),
        }
    }

    #[inline(never)]
    fn of_rarer(&self, field: &'f Field) -> Option<Content<'f>> {
        let bytes = if field.is_appended {
            field.bytes(self.appended, self.appended.len())
        } else {
            let cut = || field.first_bytes(self.alone, self.length);
            let bytes = field.bytes(self.alone, self.length);
            bytes.or_else(|| self.kind.has_truncated_zeros.then(cut)?)
        };
        let bytes = field.item(bytes?)?;
        Some(Content { field, bytes })
    }
}

/// The content of a field in a frame.
#[derive(Clone, Copy)]
pub struct Content<'f> {
    field: &'f Field,
    bytes: &'f [u8],
}

impl<'f> Content<'f> {
    /// Returns the value, or the first value of an array.
    #[inline]
    #[must_use]
    pub fn value(self) -> Value<'f> {
        self.field.value(self.bytes, 0)
    }

    /// Returns the value, or each value of an array.
    #[inline]
    pub fn values(self) -> impl Iterator<Item = Value<'f>> {
        self.field.values_in(self.bytes)
    }
}
