//! Counts the bytes that follow rejected headers. If there are many such bytes, the description probably does not fit
//! the frames on the line.

use framelock::DiscardReason;
use framelock_receiving::Protocol;

/// No hint is given before this number of bytes has been received.
const SOME: u64 = 200;

/// For each reason, the number of bytes that followed a header rejected for this reason.
#[derive(Default)]
pub(super) struct RejectedHeaders {
    /// The reason why the last header was rejected; `None` if a frame was delivered after it.
    last: Option<DiscardReason>,
    bad_header: usize,
    too_long: usize,
    unknown_message: usize,
}

impl RejectedHeaders {
    pub(super) fn frame(&mut self) {
        self.last = None;
    }

    pub(super) fn discarded(&mut self, count: usize, why: DiscardReason) {
        match why {
            DiscardReason::NoSync | DiscardReason::BrokenSync => {}
            why => self.last = Some(why),
        }
        match self.last {
            Some(DiscardReason::BadHeader) => self.bad_header += count,
            Some(DiscardReason::TooLong) => self.too_long += count,
            Some(DiscardReason::UnknownMessage) => self.unknown_message += count,
            _ => {}
        }
    }

    /// If more than a tenth of all bytes followed rejected headers, returns a hint that names the key to change.
    pub(super) fn cause(&self, frame: &Protocol, bytes: u64) -> Option<String> {
        let longest = frame.longest();
        let causes = [
            (
                self.too_long,
                format!("state a length above longest, {longest}: raise longest"),
            ),
            (
                self.unknown_message,
                "name messages that are not in the list: add them to messages, or to the field's value".to_owned(),
            ),
            (
                self.bad_header,
                "no frame can have: check shortest, and the fields with a value".to_owned(),
            ),
        ];
        let (count, why) = causes.into_iter().max_by_key(|(count, _)| *count)?;
        let is_much = bytes >= SOME && count as u64 * 10 > bytes;
        is_much.then(|| {
            format!(
                "{count} bytes followed headers that {why} in the description, if these bytes are frames \
                 (framelock decode --frame {frame} --describe shows the description)"
            )
        })
    }
}
