//! The layouts of a description. A [`Layout`] borrows its parts. [`Layouts`] owns several layouts together with their
//! parts.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::ops::RangeInclusive;
use std::sync::Arc;

use framelock::{Classification, Format, LineEvent, PacketFormat, Stuffing};
use framelock_formats::AnyOf;
use framelock_formats::layout::{
    Algorithm, CheckedLayout, Checksum, Contradiction, FixedBits, KnownMessage, Layout, Length,
    Messages, Number, Patterns, Table, Trailer,
};
use self_cell::self_cell;

use crate::hex;
use crate::problem::{HexError, HexReason, Mistake};
use crate::text::quoted;

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
    /// The terminator, and the terminators of other lengths.
    pub(crate) terminators: [Alternatives; 3],
    /// The number of bytes after the terminator.
    pub(crate) behind: usize,
    /// The stuffing, if the frames are packets.
    pub(crate) packets: Option<Stuffing>,
    pub(crate) content: Vec<(u8, u8)>,
    pub(crate) trailer: Option<Trailer>,
    /// The table of the checksum's CRC.
    pub(crate) table: Option<Box<[u32; 256]>>,
}

impl Parts {
    /// Returns the layout with these parts.
    pub(crate) fn layout(&self) -> Layout<'_> {
        let mut checksum: Option<Checksum<'_>> = self.checksum;
        if let Some(Checksum { algorithm, .. }) = &mut checksum
            && let (Algorithm::Crc(crc), Some(table)) = (algorithm, &self.table)
        {
            crc.table = Table::Words(table);
        }
        let known = self.messages.as_ref();
        let [terminator, other_terminators @ ..] =
            self.terminators.each_ref().map(Alternatives::patterns);
        Layout {
            sync: self.sync.patterns(),
            length: self.length,
            shortest: self.shortest,
            longest: self.longest,
            fixed: &self.fixed,
            messages: known.map(|(number, known)| Messages {
                number: *number,
                known,
            }),
            checksum,
            terminator,
            behind: self.behind,
            content: &self.content,
            other_terminators,
            trailer: self.trailer,
        }
    }
}

/// Returns the number of bytes in the header. It is 0 if a frame may consist of only the delimiter.
pub(crate) fn header(layout: &Layout) -> usize {
    match layout.length {
        Length::Delimiter if layout.sync.length == 0 && layout.messages.is_none() => 0,
        _ => layout.header(),
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

/// The format of a description's frames. A received message is the index of the frame's kind, and the frame's bytes.
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

    /// Returns the stuffing if the frames are packets. All layouts have the same stuffing.
    #[must_use]
    pub fn packets(&self) -> Option<Stuffing> {
        self.0.borrow_owner().first()?.packets
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

impl PacketFormat for Layouts {
    /// # Panics
    /// Panics if the frames are not packets.
    fn stuffing(&self) -> Stuffing {
        self.packets()
            .expect("only packets have a receiver of packets")
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
        match terminators(text)? {
            [one, other, _] if other.bytes.is_empty() => Ok(one),
            _ => Err("all alternatives for these bytes must have the same length".into()),
        }
    }

    fn patterns(&self) -> Patterns<'_> {
        Patterns::any_of(&self.bytes, self.length)
    }
}

/// Parses bytes in hex, with a bar between alternatives, and groups the alternatives by their lengths. The first group
/// has the length of the first alternative.
pub(crate) fn terminators(text: &str) -> Result<[Alternatives; 3], Mistake> {
    let mut groups: [Alternatives; 3] = Default::default();
    for text in text.split('|') {
        let bytes = hex::parse(&[text])?;
        if bytes.is_empty() {
            return Err("no bytes: leave the key out if there are none".into());
        }
        let fits = |group: &&mut Alternatives| [0, bytes.len()].contains(&group.length);
        let group = groups.iter_mut().find(fits);
        let group = group.ok_or("a frame can have terminators of at most three lengths")?;
        group.length = bytes.len();
        group.bytes.extend(bytes);
    }
    Ok(groups)
}

/// Parses the bytes that a frame may contain, in hex: single bytes and ranges, then the forbidden bytes after `except`.
/// An example is `20-7E except 21 24`.
pub(crate) fn content(text: &str) -> Result<Vec<(u8, u8)>, Mistake> {
    let (all, except) = text.split_once("except").unwrap_or((text, ""));
    let (all, except) = (ranges(all)?, ranges(except)?);
    let is_in =
        |ranges: &[RangeInclusive<u8>], byte: u8| ranges.iter().any(|range| range.contains(&byte));
    let mut content: Vec<(u8, u8)> = Vec::new();
    for byte in (0..=u8::MAX).filter(|&byte| is_in(&all, byte) && !is_in(&except, byte)) {
        match content.last_mut() {
            Some((_, last)) if *last + 1 == byte => *last = byte,
            _ => content.push((byte, byte)),
        }
    }
    if content.is_empty() {
        return Err("no bytes: leave the key out if a frame may contain any".into());
    }
    // Put the widest range first, because most bytes are in that range.
    content.sort_by_key(|(first, last)| Reverse(last - first));
    Ok(content)
}

/// Parses single bytes and ranges of bytes, in hex.
fn ranges(text: &str) -> Result<Vec<RangeInclusive<u8>>, HexError> {
    let words = (1..).zip(text.split_whitespace());
    let range = |(number, word): (usize, &str)| {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        match (&*hex::parse(&[first])?, &*hex::parse(&[last])?) {
            (&[first], &[last]) if first <= last => Ok(first..=last),
            _ => Err(HexError {
                number,
                word: quoted(word),
                reason: HexReason::Range,
            }),
        }
    };
    words.map(range).collect()
}
