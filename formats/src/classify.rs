//! Classifies bytes by a layout. Every format that has a layout uses this module.
//!
//! ```text
//!             sync wrong               header wrong           frame wrong
//!          ┌──> Rejected            ┌──> Rejected          ┌──> Rejected
//!  sync ───┼──────────────> header ─┼───────────> frame ───┼──> Frame
//!          └──> Incomplete          └──> Incomplete        └──> Incomplete
//! ```

use framelock::{Classification, DiscardReason, LineEvent};

use crate::layout::{
    ByteOrder, CheckedLayout, FixedBits, KnownMessage, Layout, Length, Messages, Number, Patterns,
    Trailer, index, is_within,
};

/// A parsed header.
#[derive(Clone, Copy)]
pub(crate) struct Header {
    /// The number of bytes in the frame, including its trailer; `None` if a delimiter or silence ends the frame.
    pub(crate) length: Option<usize>,
    /// The number of bytes in the trailer.
    pub(crate) trailer: usize,
    /// The byte that the checksum covers although it is not sent.
    pub(crate) extra: Option<u8>,
}

impl CheckedLayout<'_> {
    /// Classifies the beginning of `bytes`, which must contain at least one byte.
    #[inline(always)]
    #[must_use]
    pub fn classify(&self, bytes: &[u8]) -> Classification {
        self.0.classify_after(bytes, 0)
    }

    /// Does the same as [`classify`](Self::classify). The first `seen` bytes must have been classified as incomplete.
    /// So the search for a delimiter need not begin at the first byte.
    #[inline(always)]
    #[must_use]
    pub fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.0.classify_after(bytes, seen)
    }

    /// Classifies incomplete bytes that a line event follows. They can be a frame only if the event is a pause or a
    /// break, and [silence](Length::Silence) ends the frames. If they are no frame, the function rejects them.
    #[inline(always)]
    #[must_use]
    pub fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        self.0.classify_before(bytes, event)
    }

    /// Returns true if a frame can begin with this byte.
    #[inline(always)]
    #[must_use]
    pub fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte)
    }
}

impl Layout<'_> {
    #[inline(always)]
    pub(crate) fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.classify_known(self.known(), bytes, seen)
    }

    /// Does the same as [`classify_after`](Self::classify_after), but the known messages are those of `known`. So the
    /// compiler can specialise the code for a constant layout, even if the messages are not constant.
    #[inline(always)]
    pub(crate) fn classify_known(
        &self,
        known: &[KnownMessage],
        bytes: &[u8],
        seen: usize,
    ) -> Classification {
        self.try_classify(known, bytes, seen, false)
            .unwrap_or_else(|classification| classification)
    }

    #[inline(always)]
    pub(crate) fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        if matches!(self.length, Length::Silence) && is_silence(event) {
            let classification = self.classify_at(bytes, 0, true);
            if !matches!(classification, Classification::Incomplete { .. }) {
                return classification;
            }
        }
        Classification::Rejected(DiscardReason::LineEvent)
    }

    /// Does the same as [`classify_after`](Self::classify_after). If `is_over`, silence follows the bytes.
    #[inline(always)]
    pub(crate) fn classify_at(&self, bytes: &[u8], seen: usize, is_over: bool) -> Classification {
        self.try_classify(self.known(), bytes, seen, is_over)
            .unwrap_or_else(|classification| classification)
    }

    #[inline(always)]
    pub(crate) fn starts(&self, byte: u8) -> bool {
        let Patterns { bytes, length } = self.sync;
        let is = |sync: usize| bytes.get(sync.wrapping_mul(length)) == Some(&byte);
        // The first five syncs are tested without a loop. For a constant layout, these tests compile to at most five
        // comparisons. A loop over the syncs would run for each byte of noise.
        let is_other = || is(1) | is(2) | is(3) | is(4) || (5..bytes.len()).any(is);
        length == 0 || is(0) || bytes.len() > length && is_other()
    }

    /// Does the same as [`classify_at`](Self::classify_at). If the header alone decides the classification, returns the
    /// classification as an error, for use with `?`.
    #[inline(always)]
    fn try_classify(
        &self,
        known: &[KnownMessage],
        bytes: &[u8],
        seen: usize,
        is_over: bool,
    ) -> Result<Classification, Classification> {
        let header = self.header_bytes(bytes)?;
        let header = self
            .parse_header(known, header)
            .map_err(Classification::Rejected)?;
        Ok(match self.frame_of(&header, bytes, seen, is_over) {
            Ok(frame) => match self.mismatch(&header, frame) {
                Some(why) => Classification::Rejected(why),
                None => Classification::Frame(frame.len()),
            },
            Err(classification) => classification,
        })
    }

    #[inline(always)]
    pub(crate) fn known(&self) -> &[KnownMessage] {
        self.messages
            .as_ref()
            .map_or(&[], |messages| messages.known)
    }

    /// Parses the header at the beginning of the bytes.
    #[inline(always)]
    pub(crate) fn parse(&self, bytes: &[u8]) -> Result<Header, Classification> {
        self.parse_header(self.known(), self.header_bytes(bytes)?)
            .map_err(Classification::Rejected)
    }

    /// Returns the bytes of the header, if the header is complete and begins with a sync.
    #[inline(always)]
    pub(crate) fn header_bytes<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], Classification> {
        let header = self.header();
        if header > self.longest {
            return Err(Classification::Rejected(DiscardReason::NoSync));
        }
        if let Some(why) = self.sync.refuses(bytes) {
            return Err(Classification::Rejected(why));
        }
        // Ask only for the next byte of the sync, so that a wrong byte is rejected as soon as it arrives.
        let at_least = if bytes.len() < self.sync.length {
            bytes.len().wrapping_add(1)
        } else {
            header
        };
        bytes
            .get(..header)
            .ok_or(Classification::Incomplete { at_least })
    }

    /// Parses a complete header.
    #[inline(always)]
    pub(crate) fn parse_header(
        &self,
        known: &[KnownMessage],
        head: &[u8],
    ) -> Result<Header, DiscardReason> {
        let in_head = |at: &i16| usize::try_from(*at).is_ok_and(|at| at < head.len());
        let mut fixed = self.fixed.iter();
        if !fixed.all(|bits| !in_head(&bits.at) || bits.are_right(head, head.len())) {
            return Err(DiscardReason::BadHeader);
        }
        let message = match &self.messages {
            Some(messages) => Some(
                messages
                    .message(known, head)
                    .ok_or(DiscardReason::UnknownMessage)?,
            ),
            None => None,
        };
        let extra = message.and_then(|message| message.extra);
        let trailer = self.trailer.map_or(0, |trailer| trailer.bytes_after(head));
        let frame = match &self.length {
            Length::Delimiter | Length::Silence => {
                return Ok(Header {
                    length: None,
                    trailer: 0,
                    extra,
                });
            }
            Length::Fixed => self.longest,
            Length::Field(field) => {
                let number = field.value(field.number.read(head));
                if message.is_some_and(|message| number > message.longest_payload.into()) {
                    return Err(DiscardReason::TooLong);
                }
                let counted = u64::from(number).wrapping_mul(field.factor.into());
                // The sum is less than 2 to the power of 64, so the addition fails only if the sum is negative.
                let length = counted.checked_add_signed(field.plus.into());
                let length = length.ok_or(DiscardReason::BadHeader)?;
                usize::try_from(length).map_err(|_| DiscardReason::TooLong)?
            }
        };
        let whole = frame.saturating_add(trailer);
        if frame < self.shortest || whole < head.len() {
            return Err(DiscardReason::BadHeader);
        }
        if whole > self.longest {
            return Err(DiscardReason::TooLong);
        }
        Ok(Header {
            length: Some(whole),
            trailer,
            extra,
        })
    }

    /// Returns the bytes of the frame with this header if the frame is complete. If `is_over`, silence follows the bytes.
    /// Does not check the rest of the frame.
    #[inline(always)]
    pub(crate) fn frame_of<'a>(
        &self,
        header: &Header,
        bytes: &'a [u8],
        seen: usize,
        is_over: bool,
    ) -> Result<&'a [u8], Classification> {
        let length = match header.length {
            Some(length) => length,
            None if matches!(self.length, Length::Silence) => {
                if bytes.len() > self.longest {
                    return Err(Classification::Rejected(DiscardReason::TooLong));
                }
                if is_over && bytes.len() >= self.shortest {
                    bytes.len()
                } else {
                    self.most_bytes()
                }
            }
            None => self.end(bytes, seen)?,
        };
        let at_least = length;
        bytes
            .get(..length)
            .ok_or(Classification::Incomplete { at_least })
    }

    /// Returns the reason to reject a complete frame, or `None` if the frame is valid. `frame` includes the trailer.
    #[inline(always)]
    fn mismatch(&self, header: &Header, frame: &[u8]) -> Option<DiscardReason> {
        let end = frame.len().saturating_sub(header.trailer);
        let frame = frame.get(..end).unwrap_or_default();
        let length = self.counted_length(frame);
        let mut fixed = self.fixed.iter();
        // If a delimiter ends the frame, `end` has already found the terminator.
        let ends = matches!(self.length, Length::Delimiter) || self.terminator.ends(frame);
        if !ends || !fixed.all(|bits| bits.are_right(frame, length)) {
            return Some(DiscardReason::WrongTerminator);
        }
        match &self.checksum {
            Some(checksum) if !checksum.is_right(frame, length, header.extra) => {
                Some(DiscardReason::ChecksumMismatch)
            }
            _ => None,
        }
    }

    /// Returns the length of a frame that a delimiter ends, with the terminator and the bytes `behind` it. The first
    /// `seen` bytes have been classified as incomplete, so they do not contain the whole frame.
    #[inline(always)]
    fn end(&self, bytes: &[u8], seen: usize) -> Result<usize, Classification> {
        let [other, another] = &self.other_terminators;
        let others = other.length.max(another.length);
        let width = self.terminator.length.max(others).max(1);
        let bytes = bytes.get(..self.longest).unwrap_or(bytes);
        // If the first `seen` bytes do not contain the whole header, no terminator has been searched for in them.
        let seen = if seen >= self.header() { seen } else { 0 };
        let from = seen.saturating_sub(width.wrapping_sub(1).wrapping_add(self.behind));
        let from = from.max(self.sync.length);
        let rest = bytes.get(from..).unwrap_or_default();
        let found = if self.content.is_empty() {
            let mut places = rest.windows(width);
            let place = places.position(|place| self.terminator.are(place));
            place.map(|place| (place, width))
        } else {
            self.end_of_content(rest)?
        };
        match found {
            Some((place, width)) => {
                let content = from.wrapping_add(place);
                let least = self.terminator.length.wrapping_add(self.behind);
                if content.wrapping_add(least) < self.shortest {
                    return Err(Classification::Rejected(DiscardReason::BadHeader));
                }
                let length = content.wrapping_add(width).wrapping_add(self.behind);
                if self.behind > 0 && length > self.longest {
                    return Err(Classification::Rejected(DiscardReason::TooLong));
                }
                Ok(length)
            }
            None if bytes.len() >= self.longest => {
                Err(Classification::Rejected(DiscardReason::WrongTerminator))
            }
            None => Err(Classification::Incomplete {
                at_least: bytes.len().wrapping_add(1),
            }),
        }
    }

    /// Returns the index and the length of the terminator that follows the content, or `None` if more bytes are needed.
    #[inline(always)]
    fn end_of_content(&self, bytes: &[u8]) -> Result<Option<(usize, usize)>, Classification> {
        let is_content = |byte: &u8| is_within(self.content, *byte);
        let Some(place) = bytes.iter().position(|byte| !is_content(byte)) else {
            return Ok(None);
        };
        let end = bytes.get(place..).unwrap_or_default();
        let mut may_follow = false;
        for terminator in self.terminators() {
            let mut pattern = terminator.iter().enumerate();
            if pattern.all(|(at, wanted)| end.get(at).is_none_or(|byte| byte == wanted)) {
                if terminator.len() <= end.len() {
                    return Ok(Some((place, terminator.len())));
                }
                may_follow = true;
            }
        }
        if may_follow {
            return Ok(None);
        }
        Err(Classification::Rejected(DiscardReason::WrongTerminator))
    }
}

/// Returns true if the event is a pause or a break. Both end a frame of [`Length::Silence`].
pub(crate) const fn is_silence(event: LineEvent) -> bool {
    matches!(event, LineEvent::Idle | LineEvent::Break)
}

impl Patterns<'_> {
    /// Returns the reason why no sync agrees with these bytes, or `None` if a sync agrees. There must be at least one
    /// byte.
    #[inline(always)]
    fn refuses(&self, bytes: &[u8]) -> Option<DiscardReason> {
        if self.length == 0 {
            return None;
        }
        let mut why = DiscardReason::NoSync;
        for pattern in self.each() {
            let both = || pattern.iter().zip(bytes);
            if both().all(|(wanted, byte)| wanted == byte) {
                return None;
            }
            if both().next().is_some_and(|(wanted, byte)| wanted == byte) {
                why = DiscardReason::BrokenSync;
            }
        }
        Some(why)
    }

    /// Returns true if one of the patterns equals these bytes.
    #[inline(always)]
    pub(crate) fn are(&self, bytes: &[u8]) -> bool {
        self.each().any(|pattern| pattern.iter().eq(bytes))
    }

    #[inline(always)]
    fn ends(&self, frame: &[u8]) -> bool {
        let place = frame.len().checked_sub(self.length);
        let end = place.and_then(|place| frame.get(place..));
        self.length == 0 || end.is_some_and(|end| self.are(end))
    }
}

impl Number {
    /// Reads the number from a header that contains it.
    #[inline(always)]
    pub(crate) fn read(&self, header: &[u8]) -> u32 {
        let bytes = header.get(self.at..self.end()).unwrap_or_default();
        let add = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        match self.order {
            ByteOrder::Little => bytes.iter().rev().fold(0, add),
            ByteOrder::Big => bytes.iter().fold(0, add),
        }
    }
}

impl Messages<'_> {
    #[inline(always)]
    fn message(&self, known: &[KnownMessage], header: &[u8]) -> Option<KnownMessage> {
        let number = self.number.read(header);
        let place = known.binary_search_by_key(&number, |it| it.number);
        known.get(place.ok()?).copied()
    }
}

impl Trailer {
    /// Returns the number of bytes in the trailer of a frame with this header.
    #[inline(always)]
    #[must_use]
    pub fn bytes_after(&self, header: &[u8]) -> usize {
        match header.get(self.at) {
            Some(byte) if byte & self.mask != 0 => self.bytes,
            _ => 0,
        }
    }
}

impl FixedBits {
    /// Returns true if the frame has these bits. Negative offsets count back from `length`.
    #[inline(always)]
    fn are_right(self, frame: &[u8], length: usize) -> bool {
        let byte = index(self.at, length).and_then(|at| frame.get(at));
        byte.is_some_and(|byte| byte & self.mask == self.value)
    }
}
