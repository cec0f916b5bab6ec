//! Makes example frames from bytes that the caller chooses, instead of from values of fields.

use framelock_formats::layout::ByteOrder;

use crate::kind::Kind;

impl Kind {
    /// Returns the bytes that a frame may contain between its sync and its terminator.
    #[must_use]
    pub fn content_bytes(&self) -> Vec<u8> {
        (0..=u8::MAX)
            .filter(|byte| self.layout().is_content(*byte))
            .collect()
    }

    /// Makes a frame of `length` bytes with this message number. `fill` returns the byte for each index. The sync, the
    /// checksum and other parts of the layout then replace some of these bytes. Returns `None` if there is no such
    /// frame.
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
}
