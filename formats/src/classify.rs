//! What bytes are by a layout: the one place that decides it, for every format.
//!
//! ```text
//!             sync wrong               header wrong           frame wrong
//!          ┌──> Rejected            ┌──> Rejected          ┌──> Rejected
//!  sync ───┼──────────────> header ─┼───────────> frame ───┼──> Frame
//!          └──> Incomplete          └──> Incomplete        └──> Incomplete
//! ```

use framelock::{Classification, DiscardReason};

use crate::layout::{
    Appendix, ByteOrder, FixedBits, Layout, Length, Message, Messages, Number, Patterns, index,
};

/// What a right header says of its frame.
#[derive(Clone, Copy)]
pub(crate) struct Known {
    /// Bytes in it; none if its end is to be looked for.
    pub(crate) length: Option<usize>,
    /// Bytes appended to it, which are counted in its length.
    pub(crate) appended: usize,
    /// The byte that the checksum covers besides.
    pub(crate) extra: Option<u8>,
}

impl Layout<'_> {
    /// What `bytes`, at least one, begin with.
    #[inline(always)]
    #[must_use]
    pub fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    /// [`classify`](Self::classify), knowing that the first `seen` of the bytes were incomplete.
    #[inline(always)]
    #[must_use]
    pub fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.told(bytes, seen)
            .unwrap_or_else(|classification| classification)
    }

    /// The same, as an error if the header says so.
    #[inline(always)]
    pub(crate) fn told(&self, bytes: &[u8], seen: usize) -> Result<Classification, Classification> {
        let known = self.head(bytes)?;
        Ok(match self.frame_of(&known, bytes, seen) {
            Ok(frame) => match self.mismatch(&known, frame) {
                Some(why) => Classification::Rejected(why),
                None => Classification::Frame(frame.len()),
            },
            Err(classification) => classification,
        })
    }

    /// Whether a frame may begin with this byte.
    #[inline(always)]
    #[must_use]
    pub fn starts(&self, byte: u8) -> bool {
        let Patterns { bytes, length } = self.sync;
        let is = |sync: usize| bytes.get(sync.wrapping_mul(length)) == Some(&byte);
        // Of a constant, five are five comparisons: a loop would be one for each byte of noise.
        let is_other = || is(1) | is(2) | is(3) | is(4) || (5..bytes.len()).any(is);
        length == 0 || is(0) || bytes.len() > length && is_other()
    }

    /// What the bytes up to the end of the header say, or why they are none.
    #[inline(always)]
    pub(crate) fn head(&self, bytes: &[u8]) -> Result<Known, Classification> {
        self.known(self.header_of(bytes)?)
            .map_err(Classification::Rejected)
    }

    /// The header, if it is there and behind the right sync.
    #[inline(always)]
    pub(crate) fn header_of<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], Classification> {
        let header = self.header();
        if header > self.longest {
            return Err(Classification::Rejected(DiscardReason::NoSync));
        }
        if let Some(why) = self.sync.refuses(bytes) {
            return Err(Classification::Rejected(why));
        }
        // A wrong sync byte is seen as soon as it is there.
        let at_least = if bytes.len() < self.sync.length {
            bytes.len().wrapping_add(1)
        } else {
            header
        };
        bytes
            .get(..header)
            .ok_or(Classification::Incomplete { at_least })
    }

    /// Bytes that must be there before the length is known: one at least.
    #[inline(always)]
    #[must_use]
    pub fn header(&self) -> usize {
        let mut header = self.sync.length.max(1);
        if let Length::Field(field) = &self.length {
            header = header.max(field.number.end());
        }
        if let Some(messages) = &self.messages {
            header = header.max(messages.number.end());
        }
        if let Some(appendix) = &self.appendix {
            header = header.max(appendix.at.saturating_add(1));
        }
        header
    }

    /// What a header says, if it is one.
    #[inline(always)]
    pub(crate) fn known(&self, head: &[u8]) -> Result<Known, DiscardReason> {
        let in_head = |at: &i16| usize::try_from(*at).is_ok_and(|at| at < head.len());
        let mut fixed = self.fixed.iter();
        if !fixed.all(|bits| !in_head(&bits.at) || bits.are_right(head)) {
            return Err(DiscardReason::BadHeader);
        }
        let message = match &self.messages {
            Some(messages) => Some(
                messages
                    .message(head)
                    .ok_or(DiscardReason::UnknownMessage)?,
            ),
            None => None,
        };
        let extra = message.and_then(|message| message.has_extra.then_some(message.extra));
        let appended = self
            .appendix
            .map_or(0, |appendix| appendix.appended_to(head));
        let frame = match &self.length {
            Length::Delimiter => {
                return Ok(Known {
                    length: None,
                    appended: 0,
                    extra,
                });
            }
            Length::Fixed => self.longest,
            Length::Field(field) => {
                let number = field.number.read(head) & field.mask;
                if message.is_some_and(|message| number > message.most.into()) {
                    return Err(DiscardReason::TooLong);
                }
                let plus = i64::from(number).wrapping_mul(i64::from(field.factor));
                let length = plus.wrapping_add(field.plus.into());
                // Less than nothing is too short.
                if length.is_negative() {
                    return Err(DiscardReason::BadHeader);
                }
                usize::try_from(length).map_err(|_| DiscardReason::TooLong)?
            }
        };
        let whole = frame.saturating_add(appended);
        if frame < self.shortest || whole < head.len() {
            return Err(DiscardReason::BadHeader);
        }
        if whole > self.longest {
            return Err(DiscardReason::TooLong);
        }
        Ok(Known {
            length: Some(whole),
            appended,
            extra,
        })
    }

    /// The frame whose header is known, right or wrong, if it is there in full.
    #[inline(always)]
    pub(crate) fn frame_of<'a>(
        &self,
        known: &Known,
        bytes: &'a [u8],
        seen: usize,
    ) -> Result<&'a [u8], Classification> {
        let length = match known.length {
            Some(length) => length,
            None => self.end(bytes, seen)?,
        };
        let at_least = length;
        bytes
            .get(..length)
            .ok_or(Classification::Incomplete { at_least })
    }

    /// What is wrong with a frame that is there in full, its appendix included.
    #[inline(always)]
    fn mismatch(&self, known: &Known, frame: &[u8]) -> Option<DiscardReason> {
        let end = frame.len().saturating_sub(known.appended);
        let frame = frame.get(..end).unwrap_or_default();
        let mut fixed = self.fixed.iter();
        if !self.terminator.ends(frame) || !fixed.all(|bits| bits.are_right(frame)) {
            return Some(DiscardReason::WrongTerminator);
        }
        match &self.checksum {
            Some(checksum) if !checksum.is_right(frame, known.extra) => {
                Some(DiscardReason::ChecksumMismatch)
            }
            _ => None,
        }
    }

    /// Where the first terminator ends; of the first `seen` bytes that were incomplete there was none.
    #[inline(always)]
    fn end(&self, bytes: &[u8], seen: usize) -> Result<usize, Classification> {
        let width = self.terminator.length.max(1);
        let bytes = bytes.get(..self.longest).unwrap_or(bytes);
        // Fewer bytes than the header has were not looked through.
        let seen = if seen >= self.header() { seen } else { 0 };
        let from = seen.saturating_sub(width.wrapping_sub(1));
        let from = from.max(self.sync.length);
        let mut places = bytes.get(from..).unwrap_or_default().windows(width);
        match places.position(|place| self.terminator.are(place)) {
            Some(place) => {
                let end = from.wrapping_add(place).wrapping_add(width);
                if end < self.shortest {
                    return Err(Classification::Rejected(DiscardReason::BadHeader));
                }
                Ok(end)
            }
            None if bytes.len() >= self.longest => {
                Err(Classification::Rejected(DiscardReason::WrongTerminator))
            }
            None => Err(Classification::Incomplete {
                at_least: bytes.len().wrapping_add(1),
            }),
        }
    }
}

impl Patterns<'_> {
    /// Why no frame begins with these bytes, at least one, if none does by its sync.
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

    /// Whether one of them is these bytes.
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
    /// The number, from a header that has it.
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
    fn message(&self, header: &[u8]) -> Option<Message> {
        let number = self.number.read(header);
        let place = self.known.binary_search_by_key(&number, |it| it.number);
        self.known.get(place.ok()?).copied()
    }
}

impl Appendix {
    /// How many bytes are behind the frame with this header.
    #[inline(always)]
    #[must_use]
    pub fn appended_to(&self, header: &[u8]) -> usize {
        match header.get(self.at) {
            Some(byte) if byte & self.mask != 0 => self.bytes,
            _ => 0,
        }
    }
}

impl FixedBits {
    #[inline(always)]
    fn are_right(self, frame: &[u8]) -> bool {
        let byte = index(self.at, frame.len()).and_then(|at| frame.get(at));
        byte.is_some_and(|byte| byte & self.mask == self.value & self.mask)
    }
}
