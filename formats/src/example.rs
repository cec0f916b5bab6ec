//! Makes an example frame of a layout.

use framelock::{Classification, DiscardReason};

use crate::any_of::further_on;
use crate::checksum::fill;
use crate::layout::{CheckedLayout, Messages, Trailer, index};

/// The limit on the number of bytes that [`CheckedLayout::example`] writes in search of a frame.
const MOST_BYTES: usize = 1 << 22;

impl CheckedLayout<'_> {
    /// Makes a short frame in the buffer, and returns the frame. The buffer should have as many bytes as the longest
    /// frame, although the frame usually has fewer.
    ///
    /// The check of a layout does not find every contradiction. So a checked layout may have no frames at all, for
    /// example if its fixed bits exclude its sync. Therefore make a frame in a test of your layout.
    ///
    /// # Errors
    /// Returns the reason to reject the bytes that come closest to a frame.
    ///
    /// # Examples
    /// ```
    /// use framelock::DiscardReason;
    /// use framelock_formats::layout::{CheckedLayout, FixedBits, Layout, Patterns};
    /// use framelock_formats::sbus;
    ///
    /// assert_eq!(sbus::LAYOUT.example(&mut [0; 25]).map(|frame| frame.len()), Ok(25));
    ///
    /// const WRONG: CheckedLayout = Layout {
    ///     sync: Patterns::one(b"$"),
    ///     longest: 3,
    ///     fixed: &[FixedBits { at: 0, mask: 0xFF, value: 7 }],
    ///     ..Layout::NONE
    /// }
    /// .checked();
    /// assert_eq!(WRONG.example(&mut [0; 3]), Err(DiscardReason::NoSync));
    /// ```
    pub fn example<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b mut [u8], DiscardReason> {
        let (mut furthest, mut written) = (DiscardReason::NoSync, 0_usize);
        let longest = self.longest_without_trailer().min(buffer.len());
        for length in self.shortest..=longest {
            for number in 0.. {
                let Some(whole) = self.draft(buffer, length, number) else {
                    break;
                };
                let frame = buffer.get_mut(..whole).unwrap_or_default();
                self.write(frame);
                match self.0.classify_at(frame, 0, true) {
                    Classification::Frame(all) if all == whole => {
                        return Ok(buffer.get_mut(..whole).unwrap_or_default());
                    }
                    Classification::Rejected(why) if further_on(why) >= further_on(furthest) => {
                        furthest = why;
                    }
                    _ => {}
                }
                written = written.saturating_add(whole);
                if written > MOST_BYTES {
                    return Err(furthest);
                }
            }
        }
        Err(furthest)
    }

    /// Writes the parts that sealing does not choose, and returns the length of the draft with its trailer. `length` does
    /// not include the trailer. `number` chooses one of the drafts of this length: each known message with each sync, with
    /// each terminator, with and without the trailer, and with four fillers. Returns `None` if there are no more drafts, or
    /// if the buffer is too short.
    fn draft(&self, buffer: &mut [u8], length: usize, number: usize) -> Option<usize> {
        let known = self.messages.map_or(&[][..], |messages| messages.known);
        let mut rest = number;
        let mut choose = |from: usize| {
            let index = rest.checked_rem(from).unwrap_or_default();
            rest = rest.checked_div(from).unwrap_or(rest);
            index
        };
        let filler = choose(4);
        let trailer = self.trailer.filter(|_| choose(2) == 1);
        let terminator = self
            .terminator
            .each()
            .nth(choose(self.terminator.each().count()));
        let sync = self.sync.each().nth(choose(self.sync.each().count()));
        let message = known.get(choose(known.len()));
        if rest > 0 {
            return None;
        }
        let frame = buffer.get_mut(..length)?;
        frame.fill(self.filler(filler));
        for bits in self.fixed {
            let place = index(bits.at, length);
            if let Some(byte) = place.and_then(|at| frame.get_mut(at)) {
                let here = || self.fixed.iter().filter(|it| index(it.at, length) == place);
                let is_right = |byte: &u8| here().all(|bits| byte & bits.mask == bits.value);
                let mut right = (0..=u8::MAX).filter(|byte| self.is_free(*byte) && is_right(byte));
                *byte = right.next().unwrap_or(*byte);
            }
        }
        if let (Some(Messages { number, .. }), Some(message)) = (self.messages, message) {
            number.write(frame, message.number);
        }
        if let Some(Trailer { at, mask, .. }) = self.trailer {
            let bits = if trailer.is_some() { mask } else { 0 };
            let place = frame.get_mut(at..).unwrap_or_default().iter_mut().take(1);
            place.for_each(|byte| *byte = *byte & !mask | bits);
        }
        let end = self.terminator_at(length);
        fill(frame, sync.unwrap_or_default().iter().copied());
        let end = frame.get_mut(end..).unwrap_or_default();
        fill(end, terminator.unwrap_or_default().iter().copied());
        Some(length.saturating_add(trailer.map_or(0, |trailer| trailer.bytes)))
    }

    /// Returns one of four bytes to fill a frame with.
    fn filler(&self, number: usize) -> u8 {
        let free = (0..=u8::MAX).filter(|byte| self.is_free(*byte));
        free.step_by(19).nth(number).unwrap_or_default()
    }

    /// Returns true if the byte is content and does not occur in [`terminator`](crate::Layout::terminator). If the
    /// checksum covers hex digits, the byte must also be a hex digit.
    fn is_free(&self, byte: u8) -> bool {
        let covers_digits = self
            .checksum
            .is_some_and(|checksum| checksum.over_hex_digits);
        let is_possible = !covers_digits || byte.is_ascii_hexdigit();
        is_possible && self.is_content(byte) && !self.terminator.bytes.contains(&byte)
    }
}
