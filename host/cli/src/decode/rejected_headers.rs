//! Counts the bytes that follow rejected headers. If they are many, the description does not fit the line.

use framelock::DiscardReason;
use framelock_receiving::Protocol;

use crate::output::note;

/// Bytes of which a tenth is worth a hint while they come, and at the end.
const MANY: usize = 10_000;
const SOME: usize = 200;

/// The bytes that followed rejected headers, by the reason.
#[derive(Default)]
pub(super) struct RejectedHeaders {
    /// Why the last header was rejected, if no frame has come since.
    last: Option<DiscardReason>,
    bad_header: usize,
    too_long: usize,
    unknown_message: usize,
    is_told: bool,
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

    /// Says once which key to change, if more than a tenth of all bytes went by so.
    pub(super) fn hint(&mut self, frame: &Protocol, bytes: usize, is_end: bool) {
        let least = if is_end { SOME } else { MANY };
        if self.is_told || bytes < least {
            return;
        }
        let longest = frame.longest();
        let causes = [
            (
                self.too_long,
                format!("which tell more bytes than longest, {longest}: raise longest"),
            ),
            (
                self.unknown_message,
                "of messages that are not in its list: add them to messages, or to the field's value".to_owned(),
            ),
            (
                self.bad_header,
                "which no frame has: look at shortest, and at the fields with a value".to_owned(),
            ),
        ];
        let most = causes.iter().max_by_key(|(count, _)| *count);
        if let Some((count, why)) = most.filter(|(count, _)| count * 10 > bytes) {
            self.is_told = true;
            note(&format!(
                "{count} of {bytes} bytes went by behind headers {why} in the description, if they are frames \
                 (framelock decode --frame {frame} --describe shows it)"
            ));
        }
    }
}
