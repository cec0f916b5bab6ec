//! A parser with arbitrary results.

use framelock::any_format::any_mismatch;
use framelock::{Found, LineEvent, Parser};

/// A parser that finds any messages and reports any outcomes, at most two in each call.
#[derive(Default)]
pub(crate) struct AnyParser {
    /// The number of outcomes that were reported.
    pub(crate) outcomes: u8,
    /// The number of messages that were returned.
    pub(crate) messages: u8,
    /// The number of bytes that `next` has taken.
    pub(crate) taken: usize,
}

impl AnyParser {
    fn report<T>(&mut self, message: impl Fn() -> T, mut found: impl FnMut(Found<T>)) {
        if kani::any() {
            found(Found::discarded(kani::any(), any_mismatch()));
            self.outcomes += 1;
        }
        if kani::any() {
            found(Found::frame(kani::any(), message()));
            self.outcomes += 1;
        }
    }

    fn message(&mut self) -> Option<u8> {
        let message: Option<u8> = kani::any();
        self.messages += u8::from(message.is_some());
        message
    }
}

impl Parser for AnyParser {
    type Message<'a> = u8;

    fn push_with(&mut self, _: u8, account: impl FnMut(Found<()>)) -> Option<u8> {
        self.report(|| (), account);
        self.message()
    }

    fn feed(&mut self, _: &[u8], found: impl FnMut(Found<u8>)) {
        self.report(kani::any, found);
    }

    fn line_event(&mut self, _: LineEvent, found: impl FnMut(Found<u8>)) {
        self.report(kani::any, found);
    }

    fn line_event_step(&mut self, _: LineEvent, found: impl FnMut(Found<u8>)) -> bool {
        self.report(kani::any, found);
        kani::any()
    }

    fn poll_step(&mut self, found: impl FnMut(Found<u8>)) -> bool {
        self.report(kani::any, found);
        kani::any()
    }

    fn pending(&self) -> usize {
        kani::any()
    }

    fn reset(&mut self) {}

    /// Takes any number of the bytes, or all bytes if it finds no message.
    fn next_with(&mut self, bytes: &mut &[u8], account: impl FnMut(Found<()>)) -> Option<u8> {
        self.report(|| (), account);
        let message = self.message();
        let count = match message {
            Some(_) => usize::from(kani::any::<u16>()),
            None => bytes.len(),
        };
        kani::assume(count <= bytes.len());
        self.taken += count;
        *bytes = bytes.get(count..).unwrap_or_default();
        message
    }
}
