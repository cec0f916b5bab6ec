//! The layouts of a description. A layout borrows its parts; here they are owned together.

use std::borrow::Cow;
use std::sync::Arc;

use framelock::{Classification, Format, LineEvent};
use framelock_formats::AnyOf;
use framelock_formats::layout::{
    Algorithm, CheckedLayout, Checksum, Contradiction, Crc, FixedBits, KnownMessage, Layout,
    Length, Messages, Number, Patterns, Table, Trailer,
};
use self_cell::self_cell;

use crate::hex;
use crate::problem::Mistake;

/// The number that identifies a message, and the known messages.
pub(crate) type OwnMessages = (Number, Cow<'static, [KnownMessage]>);

/// The parts of a layout, as in [`Layout`].
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    pub(crate) sync: Alternatives,
    pub(crate) length: Length,
    pub(crate) shortest: usize,
    pub(crate) longest: usize,
    pub(crate) fixed: Vec<FixedBits>,
    pub(crate) messages: Option<OwnMessages>,
    pub(crate) checksum: Option<Checksum<'static>>,
    pub(crate) terminator: Alternatives,
    pub(crate) other_terminators: [Alternatives; 2],
    pub(crate) content: Vec<(u8, u8)>,
    pub(crate) trailer: Option<Trailer>,
    /// The table of the checksum's CRC.
    pub(crate) table: Option<Box<[u32; 256]>>,
}

impl Parts {
    /// Returns the layout with these parts.
    pub(crate) fn layout(&self) -> Layout<'_> {
        let with_table = |checksum: Checksum<'static>| -> Checksum<'_> {
            match (checksum.algorithm, &self.table) {
                (Algorithm::Crc(crc), Some(table)) => Checksum {
                    algorithm: Algorithm::Crc(Crc {
                        table: Table::Words(table),
                        ..crc
                    }),
                    ..checksum
                },
                _ => checksum,
            }
        };
        Layout {
            sync: self.sync.patterns(),
            length: self.length,
            shortest: self.shortest,
            longest: self.longest,
            fixed: &self.fixed,
            messages: self.messages.as_ref().map(|(number, known)| Messages {
                number: *number,
                known,
            }),
            checksum: self.checksum.map(with_table),
            terminator: self.terminator.patterns(),
            content: &self.content,
            other_terminators: self
                .other_terminators
                .each_ref()
                .map(Alternatives::patterns),
            trailer: self.trailer,
        }
    }
}

type Checked<'p> = Vec<CheckedLayout<'p>>;

self_cell!(
    struct OwnedLayouts {
        owner: Vec<Arc<Parts>>,
        #[covariant]
        dependent: Checked,
    }
    impl {Debug}
);

/// The format of the frames of a description. Its message consists of the index of the frame's kind, and the frame.
#[derive(Clone, Debug)]
pub struct Layouts(Arc<OwnedLayouts>);

impl Layouts {
    /// Checks the layouts with these parts.
    pub(crate) fn new(parts: Vec<Arc<Parts>>) -> Result<Self, Contradiction> {
        let layouts = OwnedLayouts::try_new(parts, |parts| {
            parts.iter().map(|parts| parts.layout().check()).collect()
        })?;
        Ok(Self(Arc::new(layouts)))
    }

    /// Returns the layouts of all these lists, in their order.
    pub(crate) fn concat<'l>(all: impl Iterator<Item = &'l Self>) -> Self {
        let parts = all.flat_map(|layouts| layouts.0.borrow_owner().iter().cloned());
        Self::new(parts.collect()).expect("each layout has been checked")
    }

    /// Returns the layouts in the order in which they are tried.
    #[must_use]
    #[inline]
    pub fn all(&self) -> &[CheckedLayout<'_>] {
        self.0.borrow_dependent()
    }
}

impl Format for Layouts {
    const LONGEST: usize = usize::MAX;
    type Message<'a> = (usize, &'a [u8]);

    #[inline]
    fn longest(&self) -> usize {
        AnyOf(self.all()).longest()
    }

    #[inline]
    fn classify(&self, bytes: &[u8]) -> Classification {
        AnyOf(self.all()).classify(bytes)
    }

    #[inline]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        AnyOf(self.all()).classify_after(bytes, seen)
    }

    #[inline]
    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        AnyOf(self.all()).classify_before(bytes, event)
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        AnyOf(self.all()).starts(byte)
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> (usize, &'a [u8]) {
        AnyOf(self.all()).decode(frame)
    }
}

/// Alternatives of the same length.
#[derive(Clone, Default, Debug)]
pub(crate) struct Alternatives {
    /// All alternatives, concatenated.
    pub(crate) bytes: Vec<u8>,
    /// The number of bytes in each alternative.
    pub(crate) length: usize,
}

impl Alternatives {
    /// Parses bytes in hex, with a bar between alternatives of the same length.
    pub(crate) fn parse(text: &str) -> Result<Self, Mistake> {
        let each = sequences(text)?;
        let (bytes, length) = (each.concat(), each[0].len());
        if each.iter().any(|bytes| bytes.len() != length) {
            return Err(Mistake::DifferentLengths);
        }
        Ok(Self { bytes, length })
    }

    fn patterns(&self) -> Patterns<'_> {
        Patterns::any_of(&self.bytes, self.length)
    }
}

/// Parses bytes in hex, with a bar between alternatives. Returns at least one.
fn sequences(text: &str) -> Result<Vec<Vec<u8>>, Mistake> {
    let each = text.split('|').map(|text| hex::parse(&[text]));
    let each = each.collect::<Result<Vec<_>, _>>()?;
    if each.iter().any(Vec::is_empty) {
        return Err(Mistake::NoBytes);
    }
    Ok(each)
}

/// Parses the terminators. The first group has the length of the first terminator.
pub(crate) fn terminators(text: &str) -> Result<[Alternatives; 3], Mistake> {
    let mut groups: [Alternatives; 3] = Default::default();
    for end in sequences(text)? {
        let is_own = |group: &&mut Alternatives| group.length == end.len() || group.length == 0;
        let group = groups
            .iter_mut()
            .find(is_own)
            .ok_or(Mistake::ManyTerminators)?;
        group.length = end.len();
        group.bytes.extend(end);
    }
    Ok(groups)
}

/// Parses the bytes that a frame may contain, in hex: single bytes and ranges, then the forbidden bytes after `except`.
/// An example is `20-7E except 21 24`.
pub(crate) fn content(text: &str) -> Result<Vec<(u8, u8)>, Mistake> {
    let (all, except) = text.split_once("except").unwrap_or((text, ""));
    let (all, except) = (ranges(all)?, ranges(except)?);
    let has = |ranges: &[(u8, u8)], byte| ranges.iter().any(|&(a, b)| (a..=b).contains(&byte));
    let mut content: Vec<(u8, u8)> = Vec::new();
    for byte in (0..=u8::MAX).filter(|&byte| has(&all, byte) && !has(&except, byte)) {
        match content.last_mut() {
            Some((_, last)) if *last + 1 == byte => *last = byte,
            _ => content.push((byte, byte)),
        }
    }
    if content.is_empty() {
        return Err(Mistake::NoContent);
    }
    // Put the widest range first, because most bytes are in that range.
    content.sort_by_key(|(first, last)| first.abs_diff(*last));
    content.reverse();
    Ok(content)
}

/// Parses single bytes and ranges of bytes, in hex.
fn ranges(text: &str) -> Result<Vec<(u8, u8)>, Mistake> {
    let words = text.split_whitespace().map(|word| {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        match (&*hex::parse(&[first])?, &*hex::parse(&[last])?) {
            (&[first], &[last]) if first <= last => Ok((first, last)),
            _ => Err(Mistake::Range(word.to_owned())),
        }
    });
    words.collect()
}
