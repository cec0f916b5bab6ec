//! A receiver on a line: every byte in exactly one place, and every line event counted.

use core::fmt;

use crate::{DiscardReason, Found, Parser};

/// Something the UART or a timer noticed that makes the frame under way worthless.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
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

impl fmt::Display for LineEvent {
    /// Writes the event in a word or two, as in `line errors: parity error`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Framing => "framing error",
            Self::Parity => "parity error",
            Self::Overrun => "overrun",
            Self::Break => "break",
            Self::Idle => "idle line",
        })
    }
}

/// A counter for each variant of an enum.
macro_rules! counters {
    ($(#[$documentation:meta])* $name:ident of $of:ident: $($counter:ident $variant:ident)*) => {
        $(#[$documentation])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub struct $name {
            $(
                #[doc = concat!("[`", stringify!($of), "::", stringify!($variant), "`].")]
                pub $counter: usize,
            )*
        }

        impl $name {
            const ZERO: Self = Self { $($counter: 0),* };

            /// All of them together.
            #[must_use]
            pub const fn total(&self) -> usize {
                0_usize$(.wrapping_add(self.$counter))*
            }

            fn count(&mut self, which: $of, more: usize) {
                let counter = match which {
                    $($of::$variant => &mut self.$counter,)*
                };
                *counter = counter.wrapping_add(more);
            }
        }
    };
}

counters! {
    /// Bytes that were received and are part of no frame, by reason.
    Discarded of DiscardReason:
    no_sync NoSync
    broken_sync BrokenSync
    bad_header BadHeader
    too_long TooLong
    unknown_message UnknownMessage
    checksum_mismatch ChecksumMismatch
    wrong_terminator WrongTerminator
    line_event LineEvent
}

counters! {
    /// How often each [`LineEvent`] came.
    LineEvents of LineEvent:
    framing Framing
    parity Parity
    overrun Overrun
    line_break Break
    idle Idle
}

/// What has happened on the line. The counters are as wide as the processor's words, and wrap: with
/// 32 bits a line of 1 Mbaud makes `bytes` do so after twelve hours.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
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
        discarded: Discarded::ZERO,
        resynchronisations: 0,
        events: LineEvents::ZERO,
    };
}

/// A receiver at the end of a line: it counts where each byte goes, and takes the line's events.
///
/// At any time, modulo the width of the counters (theorem 9):
///
/// ```text
/// bytes = frame_bytes + discarded + pending
/// ```
///
/// # Examples
/// ```
/// use framelock::motion::Bin;
/// use framelock::{Line, LineEvent, Receiver};
/// let mut line = Line::new(Receiver::<Bin>::new());
/// for byte in *b"noise AB\0xyz\rAB\0x" {
///     line.push(byte);
/// }
/// assert_eq!((line.counters().frames, line.pending()), (1, 4));
/// line.line_event(LineEvent::Framing, |_| ());
/// assert_eq!((line.counters().discarded.no_sync, line.counters().discarded.line_event), (6, 4));
/// assert_eq!((line.counters().bytes, line.counters().frame_bytes), (7 + (6 + 4) + 0, 7));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Line<P> {
    parser: P,
    ledger: Ledger,
}

impl<P> Line<P> {
    /// Nothing counted yet. Give it a receiver in which nothing is pending: bytes that it took before are not counted.
    #[must_use]
    pub const fn new(parser: P) -> Self {
        Self::resumed(parser, Counters::ZERO)
    }

    /// Goes on with counters kept from before.
    #[must_use]
    pub const fn resumed(parser: P, counters: Counters) -> Self {
        let lost = false;
        let ledger = Ledger { counters, lost };
        Self { parser, ledger }
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.ledger.counters
    }

    /// The receiver, to look at.
    #[must_use]
    pub const fn parser(&self) -> &P {
        &self.parser
    }
}

impl<P: Parser> Line<P> {
    /// Takes the next byte; gives the message of the frame that it finds.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<P::Message<'_>> {
        let Self { parser, ledger } = self;
        ledger.received(1);
        let (length, message) =
            parser.push_with(byte, |count, why| ledger.discarded(count, why))?;
        ledger.frame(length);
        Some(message)
    }

    /// Goes on with what is pending, without another byte: see [`BufferedReceiver::push`].
    ///
    /// [`BufferedReceiver::push`]: crate::BufferedReceiver::push
    #[inline]
    pub fn poll(&mut self) -> Option<P::Message<'_>> {
        let Self { parser, ledger } = self;
        let (length, message) = parser.poll_with(|count, why| ledger.discarded(count, why))?;
        ledger.frame(length);
        Some(message)
    }

    /// Takes a slice, and says what becomes of each byte but those pending: [`Parser::feed`].
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<P::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.received(bytes.len());
        parser.feed(bytes, |one| {
            ledger.found(&one);
            found(one);
        });
    }

    /// Decides about what is pending, and says what becomes of it: a frame that lies whole in it is
    /// committed, the rest is discarded. So no later frame has a byte from before the event (theorems
    /// 8 and 13f). Only a [`BufferedReceiver`](crate::BufferedReceiver) can have a whole frame pending.
    ///
    /// Do not push a byte that is known to be bad: report the event in its place.
    pub fn line_event(&mut self, event: LineEvent, mut found: impl FnMut(Found<P::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.counters.events.count(event, 1);
        parser.line_event(|one| {
            ledger.found(&one);
            found(one);
        });
    }

    /// How many of the last bytes are pending: a frame may yet include them.
    #[must_use]
    pub fn pending(&self) -> usize {
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
    fn discarded(&mut self, count: usize, why: DiscardReason) {
        self.lost = true;
        self.counters.discarded.count(why, count);
    }

    #[inline]
    fn found<M>(&mut self, found: &Found<M>) {
        match *found {
            Found::Frame { length, .. } => self.frame(length),
            Found::Discarded { count, why } => self.discarded(count, why),
        }
    }
}
