//! Completes frames according to their layout.

use framelock::Classification;

use crate::checksum::fill;
use crate::layout::{
    ByteOrder, CheckedLayout, Layout, Length, LengthField, Number, Patterns, index,
};

impl CheckedLayout<'_> {
    /// Turns bytes into a frame: writes the sync, fixed bits, length, terminator and checksum, and leaves the other
    /// bytes as they are. If silence ends the frame, the sender must be silent after these bytes. If the layout has
    /// several syncs or several terminators, writes the first sync and the first terminator, unless the bytes already
    /// have a valid one. If the frame has a trailer, the bytes include the trailer. Set the bits that announce the
    /// trailer before you call this function, and write the content of the trailer before or after the call.
    ///
    /// Returns true if the bytes are now a frame. Returns false if no frame has this length, if the message is unknown,
    /// if there is a terminator before the end, or if a byte is not allowed as content or should be a hex digit.
    pub fn seal(&self, frame: &mut [u8]) -> bool {
        self.0.seal(frame)
    }
}

impl Layout<'_> {
    pub(crate) fn seal(&self, frame: &mut [u8]) -> bool {
        self.write(frame);
        self.classify_at(frame, 0, true) == Classification::Frame(frame.len())
    }

    pub(crate) fn write(&self, frame: &mut [u8]) {
        self.sync.write(frame, 0);
        let trailer = self.trailer.map_or(0, |it| it.bytes_after(frame));
        let end = frame.len().checked_sub(trailer);
        let Some(frame) = end.and_then(|end| frame.get_mut(..end)) else {
            return;
        };
        if let Length::Field(field) = &self.length {
            field.write(frame);
        }
        self.write_counted(frame, self.counted_length(frame));
    }

    /// Writes the fixed bits, the terminator and the checksum. Negative offsets count back from `length`.
    pub(crate) fn write_counted(&self, frame: &mut [u8], length: usize) {
        for bits in self.fixed {
            let place = index(bits.at, length);
            if let Some(byte) = place.and_then(|at| frame.get_mut(at)) {
                *byte = *byte & !bits.mask | bits.value & bits.mask;
            }
        }
        // If the lengths differ, the frame already ends with one of the other terminators.
        if length == frame.len() {
            self.terminator.write(frame, self.terminator_at(length));
        }
        let Some(checksum) = &self.checksum else {
            return;
        };
        if let Ok(header) = self.parse(frame) {
            checksum.write(frame, length, header.extra);
        }
    }
}

impl Patterns<'_> {
    /// Writes the first pattern at index `at`, unless one of the patterns is already there.
    fn write(&self, frame: &mut [u8], at: usize) {
        let place = frame
            .get_mut(at..)
            .and_then(|rest| rest.get_mut(..self.length));
        let (Some(place), Some(first)) = (place, self.each().next()) else {
            return;
        };
        if !self.are(place) {
            // In proofs about arbitrary layouts, `first` and `place` may have different lengths, so `copy_from_slice`
            // would panic.
            fill(place, first.iter().copied());
        }
    }
}

impl LengthField {
    /// Writes the number that encodes the frame's length, and leaves the bits outside the mask unchanged.
    fn write(&self, frame: &mut [u8]) {
        let counted = i64::try_from(frame.len()).unwrap_or(i64::MAX);
        let counted = counted.wrapping_sub(self.plus.into());
        let counted = u32::try_from(counted).unwrap_or_default();
        let number = counted.checked_div(self.factor).unwrap_or_default();
        let others = self.number.read(frame) & !self.mask;
        let bits = number.wrapping_shl(self.mask.trailing_zeros()) & self.mask;
        self.number.write(frame, bits | others);
    }
}

impl Number {
    /// Writes `number` at its place in the header, or nothing if the header is too short.
    pub(crate) fn write(&self, header: &mut [u8], number: u32) {
        let place = header.get_mut(self.at..self.end()).unwrap_or_default();
        let lowest_first = number.to_le_bytes().into_iter().take(self.bytes);
        match self.order {
            ByteOrder::Little => fill(place, lowest_first),
            ByteOrder::Big => fill(place, lowest_first.rev()),
        }
    }
}
