//! Every byte in exactly one place, and every line event counted.

use crate::{BufferedReceiver, Event, Found, Framing, Mismatch, Parser};

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
    pub no_sync: usize,
    /// [`Mismatch::BrokenSync`].
    pub broken_sync: usize,
    /// [`Mismatch::Header`].
    pub header: usize,
    /// [`Mismatch::Check`].
    pub check: usize,
    /// [`Mismatch::Terminator`].
    pub terminator: usize,
    /// [`Mismatch::LineEvent`].
    pub line_event: usize,
}

impl Discarded {
    /// All of them, whatever the reason.
    #[must_use]
    pub const fn total(&self) -> usize {
        self.no_sync
            .wrapping_add(self.broken_sync)
            .wrapping_add(self.header)
            .wrapping_add(self.check)
            .wrapping_add(self.terminator)
            .wrapping_add(self.line_event)
    }

    fn count(&mut self, why: Mismatch, bytes: usize) {
        let counter = match why {
            Mismatch::NoSync => &mut self.no_sync,
            Mismatch::BrokenSync => &mut self.broken_sync,
            Mismatch::Header => &mut self.header,
            Mismatch::Check => &mut self.check,
            Mismatch::Terminator => &mut self.terminator,
            Mismatch::LineEvent => &mut self.line_event,
        };
        *counter = counter.wrapping_add(bytes);
    }
}

/// How often each [`LineEvent`] came.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineEvents {
    /// [`LineEvent::Framing`].
    pub framing: usize,
    /// [`LineEvent::Parity`].
    pub parity: usize,
    /// [`LineEvent::Overrun`].
    pub overrun: usize,
    /// [`LineEvent::Break`]; `break` is a word of Rust's.
    pub line_break: usize,
    /// [`LineEvent::Idle`].
    pub idle: usize,
}

impl LineEvents {
    fn count(&mut self, event: LineEvent) {
        let counter = match event {
            LineEvent::Framing => &mut self.framing,
            LineEvent::Parity => &mut self.parity,
            LineEvent::Overrun => &mut self.overrun,
            LineEvent::Break => &mut self.line_break,
            LineEvent::Idle => &mut self.idle,
        };
        *counter = counter.wrapping_add(1);
    }
}

/// What has happened on the line. The counters are as wide as the processor's words, and wrap: with
/// 32 bits a line of 1 Mbaud makes `bytes` do so after twelve hours.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counters {
    /// Bytes received.
    pub bytes: usize,
    /// Frames committed.
    pub frames: usize,
    /// Bytes in them.
    pub frame_bytes: usize,
    /// Bytes that are part of no frame.
    pub discarded: Discarded,
    /// Commits that ended a loss: the first one after bytes were discarded.
    pub resynchronisations: usize,
    /// Line events.
    pub events: LineEvents,
}

impl Counters {
    /// Nothing has happened yet: [`Default`], but for constants and statics.
    pub const ZERO: Self = Self {
        bytes: 0,
        frames: 0,
        frame_bytes: 0,
        discarded: Discarded {
            no_sync: 0,
            broken_sync: 0,
            header: 0,
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
/// At any time, modulo the width of the counters (theorem 9):
///
/// ```text
/// bytes = frame_bytes + discarded + pending
/// ```
///
/// # Examples
/// ```
/// use framelock::{Accounting, Bin, LineEvent, Receiver};
/// let mut line = Accounting::new(Receiver::<Bin>::new());
/// line.feed(b"noise AB\0xyz\rAB\0x", |_, _setpoint| ());
/// assert_eq!((line.counters().frames, line.pending()), (1, 4));
/// line.line_event(LineEvent::Framing);
/// assert_eq!((line.counters().discarded.no_sync, line.counters().discarded.line_event), (6, 4));
/// assert_eq!((line.counters().bytes, line.counters().frame_bytes), (7 + (6 + 4) + 0, 7));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Accounting<P> {
    parser: P,
    ledger: Ledger,
}

impl<P> Accounting<P> {
    /// Nothing counted yet. Give it a parser in which nothing is pending: bytes that it took before
    /// are not counted.
    #[must_use]
    pub const fn new(parser: P) -> Self {
        Self::resumed(parser, Counters::ZERO)
    }

    /// Goes on with counters kept from before.
    #[must_use]
    pub const fn resumed(parser: P, counters: Counters) -> Self {
        Self {
            parser,
            ledger: Ledger {
                counters,
                lost: false,
            },
        }
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.ledger.counters
    }

    /// The parser, to look at.
    #[must_use]
    pub const fn parser(&self) -> &P {
        &self.parser
    }
}

impl<P: Parser> Accounting<P> {
    /// Takes the next byte; gives the message if it completes a frame.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<P::Message> {
        let Self { parser, ledger } = self;
        ledger.received(1);
        let message = parser.push_with(byte, |count, why| ledger.dropped(count, why))?;
        ledger.frame(P::FRAME_LENGTH);
        Some(message)
    }

    /// Takes a slice: calls `frame` with each message, and the index in `bytes` of its last byte.
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], mut frame: impl FnMut(usize, P::Message)) {
        self.feed_events(bytes, |event| {
            if let Event::Frame { index, message } = event {
                frame(index, message);
            }
        });
    }

    /// [`feed`](Self::feed), which also tells of the bytes that are dropped.
    #[inline]
    pub fn feed_events(&mut self, bytes: &[u8], mut event: impl FnMut(Event<P::Message>)) {
        let Self { parser, ledger } = self;
        ledger.received(bytes.len());
        parser.feed_events(bytes, |found| {
            match found {
                Event::Frame { .. } => ledger.frame(P::FRAME_LENGTH),
                Event::Dropped { count, why } => ledger.dropped(count, why),
            }
            event(found);
        });
    }

    /// Drops what is pending: no frame that holds a byte from before the event is committed
    /// (theorem 8).
    ///
    /// Do not push a byte that is known to be bad: report the event in its place.
    pub fn line_event(&mut self, event: LineEvent) {
        self.ledger.counters.events.count(event);
        let pending = self.parser.pending();
        if pending > 0 {
            self.ledger.dropped(pending, Mismatch::LineEvent);
        }
        self.parser.reset();
    }

    /// How many of the last bytes are pending: a frame may yet include them.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.parser.pending()
    }
}

impl<F: Framing, const N: usize> Accounting<BufferedReceiver<F, N>> {
    /// [`BufferedReceiver::push`].
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<F::Message<'_>> {
        let Self { parser, ledger } = self;
        ledger.received(1);
        let (length, message) =
            parser.push_events(byte, |count, why| ledger.dropped(count, why))?;
        ledger.frame(length);
        Some(message)
    }

    /// Takes a slice, and says what becomes of each byte but those pending: [`BufferedReceiver::feed`].
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], mut event: impl FnMut(Found<F::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.received(bytes.len());
        parser.feed(bytes, |found| {
            ledger.found(&found);
            event(found);
        });
    }

    /// Decides about what is pending, and says what becomes of it: frames that lie whole in it are committed, the
    /// rest is dropped. So no frame that holds a byte from before the event is committed later
    /// (theorem 13f).
    ///
    /// Do not push a byte that is known to be bad: report the event in its place.
    pub fn line_event(&mut self, event: LineEvent, mut became: impl FnMut(Found<F::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.counters.events.count(event);
        parser.line_event(|found| {
            ledger.found(&found);
            became(found);
        });
    }

    /// How many of the last bytes are pending: a frame may yet include them.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.parser.pending()
    }
}

/// The counters, and what it takes to count resynchronisations.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Ledger {
    counters: Counters,
    /// Bytes were discarded since the last commit.
    lost: bool,
}

impl Ledger {
    #[inline]
    fn received(&mut self, count: usize) {
        self.counters.bytes = self.counters.bytes.wrapping_add(count);
    }

    #[inline]
    fn frame(&mut self, length: usize) {
        let counters = &mut self.counters;
        counters.frames = counters.frames.wrapping_add(1);
        counters.frame_bytes = counters.frame_bytes.wrapping_add(length);
        if self.lost {
            self.lost = false;
            counters.resynchronisations = counters.resynchronisations.wrapping_add(1);
        }
    }

    #[inline]
    fn dropped(&mut self, count: usize, why: Mismatch) {
        self.lost = true;
        self.counters.discarded.count(why, count);
    }

    #[inline]
    fn found<M>(&mut self, found: &Found<M>) {
        match *found {
            Found::Frame { length, .. } => self.frame(length),
            Found::Dropped { count, why } => self.dropped(count, why),
        }
    }
}
