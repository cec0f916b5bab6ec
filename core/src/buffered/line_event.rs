//! Line events, which end the wait for the rest of a frame. [`LineEvent`] states the rule.
//!
//! The rule begins at the first byte about which the format answers `Incomplete`. From this byte on, until nothing is
//! pending, each dropped byte has the reason [`DiscardReason::LineEvent`], or the reason that
//! [`Format::classify_before`] gives. Between two steps, `ask_at == 1` means that the rule has begun. At all other
//! times `ask_at` is 0 or greater than 1, because a format that needs more bytes asks for at least two.

use super::BufferedReceiver;
use crate::{Classification, DiscardReason, Format, Found, Frame, LineEvent};

impl<F: Format, B: AsRef<[u8]> + AsMut<[u8]>> BufferedReceiver<F, B> {
    /// Takes a line event, after which an incomplete frame cannot be continued. Delivers each frame that lies whole in
    /// the pending bytes, unless an earlier delivered frame shares bytes with it. Drops the other bytes. After the call
    /// nothing is pending. [`LineEvent`] explains the reasons of the dropped bytes.
    ///
    /// For each pending byte, calls [`Format::classify_after`] and [`Format::classify_before`] at most once each. To
    /// spread this work over several calls, use [`line_event_step`](Self::line_event_step).
    pub fn line_event(&mut self, event: LineEvent, mut found: impl FnMut(Found<Frame<'_, F>>)) {
        while self.line_event_step(event, &mut found) {}
    }

    /// Does one step of [`line_event`](Self::line_event): delivers or drops the first pending bytes. Returns whether
    /// bytes are still pending.
    ///
    /// After a line event, call this function until it returns false. Then it has delivered and dropped exactly what
    /// one call of `line_event` would have. Keep the bytes that arrive in the meantime, and push them afterwards. If
    /// you push a byte earlier, the receiver may deliver a frame that contains bytes from before and after the event.
    ///
    /// **A step examines fewer than [`LONGEST`](Format::LONGEST) bytes, at most twice.** It calls
    /// [`Format::classify_after`] and [`Format::classify_before`] at most once each. A line event takes at most
    /// `LONGEST` steps. So an interrupt handler can do one step at each interrupt.
    ///
    /// # Examples
    /// `Text` is the format of the [first example](BufferedReceiver).
    /// ```
    /// # use framelock::{BufferedReceiver, DiscardReason, Format, LineEvent, Classification};
    /// # include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/buffered/text.txt"));
    /// # fn main() {
    /// let mut receiver = BufferedReceiver::<_, [u8; 48]>::new(Text);
    /// receiver.feed(b"#\x10#\x09#\x03two", |_| unreachable!());
    ///
    /// // The handler of a timer does one step at a time.
    /// let (mut steps, mut received) = (1, Vec::new());
    /// while receiver.line_event_step(LineEvent::Idle, |found| {
    ///     received.extend(found.message().map(|frame| frame.message().to_vec()));
    /// }) {
    ///     steps += 1;
    /// }
    /// assert_eq!((steps, received), (3, vec![b"two".to_vec()]));
    /// # }
    /// ```
    pub fn line_event_step(
        &mut self,
        event: LineEvent,
        mut found: impl FnMut(Found<Frame<'_, F>>),
    ) -> bool {
        let mut has_begun = self.has_rule_begun();
        let is_decided = self.poll_step(|one| {
            found(match one {
                Found::Discarded { count, .. } if has_begun => {
                    Found::discarded(count, DiscardReason::LineEvent)
                }
                one => one,
            });
        });
        has_begun |= !is_decided;
        if has_begun {
            self.ask_at = 1;
        }
        if !is_decided && self.pending() > 0 {
            self.end_first(event, found);
        }
        if self.pending() == 0 {
            self.reset();
            return false;
        }
        true
    }

    /// Returns whether the rule has begun at an earlier step.
    #[inline]
    pub(super) const fn has_rule_begun(&self) -> bool {
        self.ask_at == 1
    }

    /// Delivers the frame that `classify_before` finds at the start of the pending bytes. If it finds none, drops the
    /// first byte. At least one byte must be pending, and the format must have found the pending bytes incomplete.
    fn end_first(&mut self, event: LineEvent, mut found: impl FnMut(Found<Frame<'_, F>>)) {
        let pending = self.buffer.as_ref().get(self.from..self.to);
        let pending = pending.unwrap_or_default();
        let why = match self.format.classify_before(pending, event) {
            Classification::Frame(length) if (1..=pending.len()).contains(&length) => {
                self.from = self.from.wrapping_add(length);
                found(Found::frame(length, self.frame(length)));
                return;
            }
            Classification::Rejected(why) => why,
            _ => DiscardReason::LineEvent,
        };
        self.from = self.from.wrapping_add(1);
        found(Found::discarded(1, why));
    }
}
