//! Every byte in exactly one place, and every line event counted.

use crate::{Mismatch, Parser, Sink};

/// Something the UART or a timer noticed that makes the frame under way worthless.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LineEvent {
    /// A framing error: no stop bit where one was due. Noise, or a wrong baud rate.
    Framing,
    /// A parity error.
    Parity,
    /// An overrun: bytes were lost because nobody fetched them in time.
    Overrun,
    /// A break: the line was held low for longer than a byte.
    Break,
    /// An idle gap: no byte for longer than a sender leaves between the bytes of a frame.
    Idle,
}

/// Bytes that were received and are part of no frame, by reason.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Discarded {
    /// [`Mismatch::NoSync`].
    pub no_sync: u64,
    /// [`Mismatch::BrokenSync`].
    pub broken_sync: u64,
    /// [`Mismatch::Check`].
    pub check: u64,
    /// [`Mismatch::Terminator`].
    pub terminator: u64,
    /// Held when a line event came.
    pub line_event: u64,
}

impl Discarded {
    /// All of them, whatever the reason.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.no_sync
            .wrapping_add(self.broken_sync)
            .wrapping_add(self.check)
            .wrapping_add(self.terminator)
            .wrapping_add(self.line_event)
    }

    fn count(&mut self, why: Mismatch) -> &mut u64 {
        match why {
            Mismatch::NoSync => &mut self.no_sync,
            Mismatch::BrokenSync => &mut self.broken_sync,
            Mismatch::Check => &mut self.check,
            Mismatch::Terminator => &mut self.terminator,
        }
    }
}

/// How often each [`LineEvent`] came.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineEvents {
    /// [`LineEvent::Framing`].
    pub framing: u64,
    /// [`LineEvent::Parity`].
    pub parity: u64,
    /// [`LineEvent::Overrun`].
    pub overrun: u64,
    /// [`LineEvent::Break`]; `break` is a word of Rust's.
    pub line_break: u64,
    /// [`LineEvent::Idle`].
    pub idle: u64,
}

impl LineEvents {
    fn count(&mut self, event: LineEvent) -> &mut u64 {
        match event {
            LineEvent::Framing => &mut self.framing,
            LineEvent::Parity => &mut self.parity,
            LineEvent::Overrun => &mut self.overrun,
            LineEvent::Break => &mut self.line_break,
            LineEvent::Idle => &mut self.idle,
        }
    }
}

/// What has happened on the line. Counters of 64 bits, which wrap: a line of 1 Mbaud would take
/// five million years to make one do so.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counters {
    /// Bytes received.
    pub bytes: u64,
    /// Frames committed.
    pub frames: u64,
    /// Bytes that are part of no frame.
    pub discarded: Discarded,
    /// Commits that ended a loss: the first one after bytes were discarded.
    pub resynchronisations: u64,
    /// Line events.
    pub events: LineEvents,
}

impl Counters {
    /// Nothing has happened yet: [`Default`], but for constants and statics.
    pub const ZERO: Self = Self {
        bytes: 0,
        frames: 0,
        discarded: Discarded {
            no_sync: 0,
            broken_sync: 0,
            check: 0,
            terminator: 0,
            line_event: 0,
        },
        resynchronisations: 0,
        events: LineEvents {
            framing: 0,
            parity: 0,
            overrun: 0,
            line_break: 0,
            idle: 0,
        },
    };
}

/// A parser, and where each byte that it took has gone.
///
/// At any time, modulo 2^64:
///
/// ```text
/// bytes = frame length * frames + discarded + pending
/// ```
///
/// # Examples
/// ```
/// use framelock::{Accounting, Bin, LineEvent, Parser, Receiver};
/// let mut line = Accounting::new(Receiver::<Bin>::new());
/// line.feed(b"noise AB\0xyz\rAB\0x", |_, _setpoint| ());
/// assert_eq!((line.counters().frames, line.pending()), (1, 4));
/// line.line_event(LineEvent::Framing);
/// assert_eq!((line.counters().discarded.no_sync, line.counters().discarded.line_event), (6, 4));
/// assert_eq!(line.counters().bytes, 7 * 1 + (6 + 4) + 0);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Accounting<P> {
    parser: P,
    counters: Counters,
    lost: bool,
}

impl<P: Parser> Accounting<P> {
    /// Nothing counted yet. Whatever `parser` holds already counts as received.
    #[must_use]
    pub fn new(parser: P) -> Self {
        let bytes = parser.pending() as u64;
        Self::resumed(
            parser,
            Counters {
                bytes,
                ..Counters::ZERO
            },
        )
    }

    /// Goes on with counters kept from before.
    #[must_use]
    pub const fn resumed(parser: P, counters: Counters) -> Self {
        Self {
            parser,
            counters,
            lost: false,
        }
    }

    /// Takes the next byte; gives the message if it completes a frame.
    ///
    /// Costs what [`feed`](Self::feed) of one byte does; feed slices where there are any.
    pub fn push(&mut self, byte: u8) -> Option<P::Message> {
        let mut completed = None;
        self.feed(&[byte], |_, message| completed = Some(message));
        completed
    }

    /// Takes a slice: calls `frame` with each message, and the index in `bytes` of its last byte.
    pub fn feed(&mut self, bytes: &[u8], frame: impl FnMut(usize, P::Message)) {
        self.counters.bytes = self.counters.bytes.wrapping_add(bytes.len() as u64);
        let mut ledger = Ledger {
            counters: &mut self.counters,
            frames: 0,
            lost: self.lost,
            frame,
        };
        self.parser.feed(bytes, &mut ledger);
        self.lost = ledger.lost;
        let frames = ledger.frames as u64;
        self.counters.frames = self.counters.frames.wrapping_add(frames);
    }

    /// Drops the frame under way: no frame that holds a byte from before the event is committed.
    ///
    /// A byte that is known to be bad is not to be pushed: report the event in its place.
    pub fn line_event(&mut self, event: LineEvent) {
        let count = self.counters.events.count(event);
        *count = count.wrapping_add(1);
        let pending = self.parser.pending();
        if pending > 0 {
            self.lost = true;
            let discarded = &mut self.counters.discarded.line_event;
            *discarded = discarded.wrapping_add(pending as u64);
        }
        self.parser.reset();
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Bytes held because a frame may yet include them.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.parser.pending()
    }

    /// The parser, to look at.
    #[must_use]
    pub const fn parser(&self) -> &P {
        &self.parser
    }
}

/// Writes down what the parser reports.
struct Ledger<'a, F> {
    counters: &'a mut Counters,
    /// Frames of this slice: a word is counted in faster than 64 bits are on a microcontroller.
    frames: usize,
    lost: bool,
    frame: F,
}

impl<F> Ledger<'_, F> {
    #[cold]
    fn resynchronised(&mut self) {
        self.lost = false;
        self.counters.resynchronisations = self.counters.resynchronisations.wrapping_add(1);
    }
}

impl<Message, F: FnMut(usize, Message)> Sink<Message> for Ledger<'_, F> {
    #[inline]
    fn frame(&mut self, index: usize, message: Message) {
        self.frames += 1;
        if self.lost {
            self.resynchronised();
        }
        (self.frame)(index, message);
    }

    fn dropped(&mut self, count: usize, why: Mismatch) {
        self.lost = true;
        let discarded = self.counters.discarded.count(why);
        *discarded = discarded.wrapping_add(count as u64);
    }
}
