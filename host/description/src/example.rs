//! Makes frames without values of fields: to show that a kind has a frame, and as examples.

use framelock_formats::layout::{ByteOrder, Length, index};

use crate::kind::Kind;

impl Kind {
    /// Returns the bytes that a frame may contain between its sync and its terminator.
    #[must_use]
    pub fn content_bytes(&self) -> Vec<u8> {
        let ranges = self.layout().content;
        let is_content = |byte: &u8| {
            ranges
                .iter()
                .any(|(first, last)| (first..=last).contains(&byte))
        };
        (0..=u8::MAX)
            .filter(|byte| ranges.is_empty() || is_content(byte))
            .collect()
    }

    /// Makes a frame of `length` bytes with this number of a message. `fill` returns the byte at an index, which the
    /// layout's own parts then replace. Returns `None` if there is no such frame.
    #[must_use]
    pub fn frame(
        &self,
        length: usize,
        message: Option<u32>,
        fill: impl FnMut(usize) -> u8,
    ) -> Option<Vec<u8>> {
        let mut frame: Vec<u8> = (0..length).map(fill).collect();
        if let (Some(messages), Some(message)) = (self.layout().messages, message) {
            let (number, mut bytes) = (messages.number, message.to_le_bytes());
            let bytes = &mut bytes[..number.bytes];
            if number.order == ByteOrder::Big {
                bytes.reverse();
            }
            frame
                .get_mut(number.at..number.end())?
                .copy_from_slice(bytes);
        }
        self.layout().seal(&mut frame).then_some(frame)
    }

    /// Returns a frame of this kind; `None` if no frame has all parts of the layout. Tries each message, and bytes that
    /// agree with the fixed bits.
    pub(crate) fn example(&self) -> Option<Vec<u8>> {
        /// The number of frames that are tried at most.
        const ATTEMPTS: usize = 100_000;
        let layout = self.layout();
        let content = self.content_bytes();
        let mut ends = layout.terminators();
        let is_free = |byte: &&u8| !ends.any(|end| end.contains(byte));
        // Prefer bytes that cannot begin a terminator.
        let mut fills: Vec<u8> = content.iter().filter(is_free).copied().collect();
        if fills.is_empty() {
            fills = content;
        }
        let fill = |length: usize, attempt: usize| {
            let fills = &fills;
            move |at: usize| {
                let fixed = layout
                    .fixed
                    .iter()
                    .filter(|bits| index(bits.at, length) == Some(at));
                let agrees = |byte: &&u8| fixed.clone().all(|bits| *byte & bits.mask == bits.value);
                let agreeing = fills.iter().filter(agrees);
                let count = agreeing.clone().count().max(1);
                agreeing.copied().nth(attempt * 37 % count).unwrap_or(0)
            }
        };
        let messages = layout.messages.map_or(&[][..], |messages| messages.known);
        let numbers: Vec<Option<u32>> = match messages {
            [] => vec![None],
            known => known.iter().map(|message| Some(message.number)).collect(),
        };
        let lengths = (layout.shortest..=layout.longest_without_trailer())
            .filter(|length| self.may_have_length(*length));
        let each = lengths.flat_map(|length| {
            let attempts =
                (0..4).flat_map(|attempt| numbers.iter().map(move |number| (attempt, *number)));
            attempts.map(move |(attempt, number)| (length, attempt, number))
        });
        let mut each = each.take(ATTEMPTS);
        each.find_map(|(length, attempt, number)| self.frame(length, number, fill(length, attempt)))
    }

    /// Returns true if the length field can express this length.
    fn may_have_length(&self, length: usize) -> bool {
        let Length::Field(field) = self.layout().length else {
            return true;
        };
        let (factor, mask) = (i64::from(field.factor), i64::from(field.mask));
        let counted = i64::try_from(length).map_or(-1, |length| length - i64::from(field.plus));
        counted >= 0 && counted % factor == 0 && (counted / factor) & !mask == 0
    }
}
