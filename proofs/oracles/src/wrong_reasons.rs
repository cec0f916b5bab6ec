//! A receiver that the oracles must reject.

use framelock::motion::{Bin, Setpoint};
use framelock::{DiscardReason, Found, LineEvent, Parser, Receiver};

/// A receiver with a deliberate mistake: `next_with` finds every frame, but reports another reason for discarded
/// bytes.
#[derive(Clone, Copy, Default, PartialEq, Debug)]
pub(crate) struct WrongReasons(Receiver<Bin>);

impl Parser for WrongReasons {
    type Message<'a> = Setpoint;

    fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<Setpoint> {
        self.0.push_with(byte, account)
    }

    fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<Setpoint>)) {
        self.0.feed(bytes, found);
    }

    fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<Setpoint>)) {
        self.0.line_event(event, found);
    }

    fn pending(&self) -> usize {
        self.0.pending()
    }

    fn reset(&mut self) {
        self.0.reset();
    }

    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        mut account: impl FnMut(Found<()>),
    ) -> Option<Setpoint> {
        self.0.next_with(bytes, |found| {
            account(match found {
                Found::Discarded { count, .. } => {
                    Found::discarded(count, DiscardReason::ChecksumMismatch)
                }
                Found::Frame { .. } => found,
            });
        })
    }
}
