//! A receiver on a line: counts the outcome of every byte, and every line event.

use core::fmt;

use crate::lecture::Lecture;
use crate::{DiscardReason, FixedFormat, Found, Parser, Receiver};

/// An event on the line that ends the incomplete frame. The UART or a timer notices the event.
///
/// # The rule for pending bytes
/// A line event ends the wait for the rest of a frame. Frames that lie whole among the pending bytes are delivered.
/// Every other pending byte is discarded as [`DiscardReason::LineEvent`]. All receivers follow this rule, so a
/// [`Receiver`] and a [`BufferedReceiver`](crate::BufferedReceiver) of BIN frames have equal counters.
/// [`PacketReceiver::line_event`](crate::PacketReceiver::line_event) states two exceptions for packets.
///
/// Two kinds of bytes have other reasons:
///
/// * If the format itself gives another reason ([`Format::classify_before`](crate::Format::classify_before)), the byte
///   counts with this reason. For example, a frame that ends with a pause may have a wrong checksum.
/// * [`BufferedReceiver::push`](crate::BufferedReceiver::push) may leave bytes undecided. The receiver first classifies
///   these bytes, as `feed` would have. So the counters do not depend on whether bytes are pushed or fed.
///
/// # From a driver's error
/// A pause or a break may end a packet, or a frame that ends with silence. Otherwise, the kind of an event only decides
/// which counter counts the event. So a simple conversion is enough:
///
/// | error of | line event |
/// |---|---|
/// | `embedded-io` | `if error.kind() == ErrorKind::TimedOut { Idle } else { Overrun }` |
/// | `embedded-hal-nb` | `match error.kind() { ErrorKind::Overrun => Overrun, ErrorKind::Parity => Parity, _ => Framing }` |
/// | nRF, register `ERRORSRC` | `match errorsrc { 8.. => Break, 4.. => Framing, 2.. => Parity, _ => Overrun }` |
/// | RP2040, `embassy-rp` | `match error { Error::Overrun => Overrun, Error::Break => Break, _ => Framing }` |
/// | RP2040, `rp2040-hal` | the same, of `ReadErrorType` |
/// | STM32, `embassy-stm32` | `match error { Error::Overrun => Overrun, Error::Parity => Parity, _ => Framing }` |
/// | STM32, `stm32f4xx-hal` | the same |
///
/// ```
/// use embedded_io::{Error, ErrorKind};
/// use framelock::LineEvent;
///
/// fn line_event(error: impl Error) -> LineEvent {
///     if error.kind() == ErrorKind::TimedOut { LineEvent::Idle } else { LineEvent::Overrun }
/// }
/// assert_eq!(line_event(ErrorKind::TimedOut), LineEvent::Idle);
/// ```
/// ```
/// use embedded_hal_nb::serial::{Error, ErrorKind};
/// use framelock::LineEvent;
///
/// fn line_event(error: impl Error) -> LineEvent {
///     match error.kind() {
///         ErrorKind::Overrun => LineEvent::Overrun,
///         ErrorKind::Parity => LineEvent::Parity,
///         _ => LineEvent::Framing,
///     }
/// }
/// assert_eq!(line_event(ErrorKind::FrameFormat), LineEvent::Framing);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum LineEvent {
    /// A framing error: the stop bit is missing, because of noise or a wrong baud rate.
    Framing,
    /// A parity error.
    Parity,
    /// An overrun: bytes were lost because the program did not read them in time.
    Overrun,
    /// A break: the line was held low for longer than a byte takes.
    Break,
    /// An idle gap: a pause that is longer than any pause inside a frame.
    Idle,
}

impl fmt::Display for LineEvent {
    /// Writes the event in a word or two, as in `line events: parity error 1`.
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

/// Defines a struct with a counter for each variant of an enum.
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
                pub $counter: u32,
            )*
        }

        impl $name {
            const ZERO: Self = Self { $($counter: 0),* };

            /// Returns the sum of all counters, modulo 2³².
            #[must_use]
            pub const fn total(&self) -> u32 {
                0_u32$(.wrapping_add(self.$counter))*
            }

            fn count(&mut self, which: $of, more: u32) {
                let counter = match which {
                    $($of::$variant => &mut self.$counter,)*
                };
                *counter = counter.wrapping_add(more);
            }
        }

        impl fmt::Display for $name {
            /// Writes the counters that are not zero, or `none`.
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let mut separator = "";
                $(
                    if self.$counter != 0 {
                        write!(f, "{separator}{} {}", $of::$variant, self.$counter)?;
                        separator = ", ";
                    }
                )*
                if separator.is_empty() { f.write_str("none") } else { Ok(()) }
            }
        }
    };
}

counters! {
    /// The number of discarded bytes for each reason.
    Discarded of DiscardReason:
    no_sync NoSync
    broken_sync BrokenSync
    bad_header BadHeader
    too_long TooLong
    unknown_message UnknownMessage
    checksum_mismatch ChecksumMismatch
    wrong_terminator WrongTerminator
    broken_stuffing BrokenStuffing
    line_event LineEvent
}

counters! {
    /// The number of [`LineEvent`]s of each kind.
    LineEvents of LineEvent:
    framing Framing
    parity Parity
    overrun Overrun
    line_break Break
    idle Idle
}

/// The counters of a [`Line`].
///
/// Each counter has 32 bits on every target and wraps. At 1 Mbaud, `bytes` wraps after twelve hours.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Counters {
    /// The number of received bytes.
    pub bytes: u32,
    /// The number of delivered frames.
    pub frames: u32,
    /// The number of bytes in delivered frames.
    pub frame_bytes: u32,
    /// The number of discarded bytes, by reason.
    pub discarded: Discarded,
    /// The number of resynchronisations: delivered frames that follow discarded bytes.
    pub resynchronisations: u32,
    /// The number of line events, by kind.
    pub events: LineEvents,
}

impl Counters {
    /// All counters zero: the same value as [`Default`], for constants and statics.
    pub const ZERO: Self = Self {
        bytes: 0,
        frames: 0,
        frame_bytes: 0,
        discarded: Discarded::ZERO,
        resynchronisations: 0,
        events: LineEvents::ZERO,
    };
}

impl fmt::Display for Counters {
    /// Writes one line: bytes, frames, discarded bytes by reason, resynchronisations, line events.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} bytes, frames: {} ({} bytes), ",
            self.bytes, self.frames, self.frame_bytes
        )?;
        write!(
            f,
            "discarded: {}, resynchronisations: {}, ",
            self.discarded, self.resynchronisations
        )?;
        write!(f, "line events: {}", self.events)
    }
}

/// A receiver that also takes line events, and counts the outcome of each byte.
///
/// The counters always satisfy this equation modulo 2³²:
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
/// line.event(LineEvent::Framing);
/// assert_eq!((line.counters().discarded.no_sync, line.counters().discarded.line_event), (6, 4));
/// assert_eq!((line.counters().bytes, line.counters().frame_bytes), (7 + (6 + 4) + 0, 7));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Line<P> {
    parser: P,
    ledger: Ledger,
}

impl<P> Line<P> {
    /// Creates a line whose counters are zero. The receiver must have no pending bytes, because the line has not
    /// counted the bytes that the receiver took earlier.
    #[must_use]
    pub const fn new(parser: P) -> Self {
        Self::resumed(parser, Counters::ZERO)
    }

    /// Creates a line that continues with the counters of an earlier line, whose pending bytes `parser` must hold.
    #[must_use]
    pub const fn resumed(parser: P, counters: Counters) -> Self {
        let lost = 0;
        let ledger = Ledger { lost, counters };
        Self { parser, ledger }
    }

    /// Returns the counters.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.ledger.counters
    }

    /// Returns the receiver, for reading only.
    #[must_use]
    pub const fn parser(&self) -> &P {
        &self.parser
    }
}

#[cfg(kani)]
impl<P> Line<P> {
    /// Returns this line in the state after discarded bytes, so that the line's next frame counts as a
    /// resynchronisation.
    #[must_use]
    pub const fn after_loss(mut self) -> Self {
        self.ledger.lost = 1;
        self
    }

    /// Returns whether bytes have been discarded since the last frame.
    pub const fn is_after_loss(&self) -> bool {
        self.ledger.lost != 0
    }
}

/// Defines [`Line::event`] for a receiver that delivers nothing at a line event, because its frames are delivered with
/// their last byte.
macro_rules! event_delivers_nothing {
    ($([$($bound:tt)*] $receiver:ty)*) => { $(
        impl<$($bound)*> Line<$receiver> {
            /// Takes a line event, after which an incomplete frame cannot be continued. Discards and counts the pending
            /// bytes. Does the same as [`line_event`](Line::line_event), which would report no frame.
            ///
            /// ```
            /// use framelock::{Line, LineEvent, Receiver, motion::Bin};
            /// let mut line = Line::new(Receiver::<Bin>::new());
            /// line.push(b'A');
            /// line.event(LineEvent::Idle);
            /// assert_eq!((line.pending(), line.counters().discarded.line_event), (0, 1));
            /// ```
            #[inline]
            pub fn event(&mut self, event: LineEvent) {
                self.line_event(event, |_| ());
            }
        }
    )* };
}
event_delivers_nothing! {
    [F: FixedFormat] Receiver<F>
    [] Lecture
}

impl<P: Parser> Line<P> {
    /// Takes the next byte. Returns the message if this call delivers a frame.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<P::Message<'_>> {
        let Self { parser, ledger } = self;
        ledger.received(1);
        parser.push_with(byte, |one| ledger.found(&one))
    }

    /// Returns the message of the next frame among the pending bytes. [`BufferedReceiver::push`] explains when there is
    /// such a frame.
    ///
    /// [`BufferedReceiver::push`]: crate::BufferedReceiver::push
    #[inline]
    pub fn poll(&mut self) -> Option<P::Message<'_>> {
        self.next(&mut [].as_slice())
    }

    /// Does one step of [`poll`](Self::poll). Returns false if the next decision needs more bytes. A program that has
    /// no time for the whole work in one call does one step at a time until the step returns false.
    ///
    /// [`BufferedReceiver::poll_step`](crate::BufferedReceiver::poll_step) says how many bytes a step examines. Other
    /// receivers leave no bytes undecided.
    ///
    /// # Examples
    /// ```
    /// use framelock::motion::Bin;
    /// use framelock::{Line, Receiver};
    /// let mut line = Line::new(Receiver::<Bin>::new());
    /// assert!(b"AB\0".iter().all(|&byte| line.push(byte).is_none()));
    /// assert!(!line.poll_step(|_| unreachable!()));
    /// ```
    pub fn poll_step(&mut self, mut found: impl FnMut(Found<P::Message<'_>>)) -> bool {
        let Self { parser, ledger } = self;
        parser.poll_step(|one| {
            ledger.found(&one);
            found(one);
        })
    }

    /// Takes bytes from the front of the slice until a frame is delivered, and leaves the rest in the slice. Returns
    /// the frame's message. If no frame is delivered, takes the whole slice and returns `None`.
    ///
    /// A program may stop, return or await between frames. Call this function until it returns `None`. By then it has
    /// delivered the frames that [`feed`](Self::feed) would deliver, in the same order (see [`Parser::next_with`]).
    ///
    /// # Examples
    /// ```
    /// use framelock::motion::{Bin, Setpoint};
    /// use framelock::{Line, Receiver};
    ///
    /// /// Stops after a setpoint that is out of range.
    /// fn follow(line: &mut Line<Receiver<Bin>>, mut bytes: &[u8]) -> Result<(), Setpoint> {
    ///     while let Some(setpoint) = line.next(&mut bytes) {
    ///         if setpoint.pitch > 200 {
    ///             return Err(setpoint);
    ///         }
    ///     }
    ///     Ok(())
    /// }
    ///
    /// let mut line = Line::new(Receiver::<Bin>::new());
    /// let stream = b"AB\0\x10\x20\x30\rAB\0\xFF\x20\x30\rAB\0\x10";
    /// assert_eq!(follow(&mut line, stream), Err(Setpoint::from([0xFF, 0x20, 0x30])));
    /// assert_eq!(line.counters().bytes, 14);
    /// ```
    #[inline]
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<P::Message<'_>> {
        let Self { parser, ledger } = self;
        let before = bytes.len();
        let message = parser.next_with(bytes, |one| ledger.found(&one));
        ledger.received(before.wrapping_sub(bytes.len()));
        message
    }

    /// Returns an iterator over the messages in a slice, for messages that own their data.
    ///
    /// The iterator takes bytes only when its `next` is called. Run the iterator to its end, as a `for` loop does. The
    /// iterator takes the bytes after the last frame only when it returns `None`. To stop between frames and continue
    /// later, use [`Line::next`](Self::next).
    ///
    /// # Examples
    /// ```
    /// use framelock::motion::Bin;
    /// use framelock::{Line, Receiver};
    /// let mut line = Line::new(Receiver::<Bin>::new());
    /// let setpoints = line.messages(b"AB\0abc\r, AB\0xyz\rAB");
    /// assert_eq!(setpoints.map(|setpoint| setpoint.pitch).collect::<Vec<_>>(), b"ax");
    /// assert_eq!((line.counters().bytes, line.pending()), (18, 2));
    /// ```
    pub fn messages<M>(&mut self, mut bytes: &[u8]) -> impl Iterator<Item = M>
    where
        P: for<'a> Parser<Message<'a> = M> + 'static,
    {
        core::iter::from_fn(move || self.next(&mut bytes))
    }

    /// Takes a slice. Reports the outcome of each byte, except the bytes that are pending at the end: see
    /// [`Parser::feed`].
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<P::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.received(bytes.len());
        parser.feed(bytes, |one| {
            ledger.found(&one);
            found(one);
        });
    }

    /// Counts a line event. Delivers the frames that lie whole in the pending bytes, discards the other pending bytes,
    /// and reports the outcome of each pending byte. So no later frame contains a byte from before the event (theorems
    /// 8 and 13f). Only a [`BufferedReceiver`](crate::BufferedReceiver) can have a whole frame pending.
    /// [`PacketReceiver::line_event`](crate::PacketReceiver::line_event) states two exceptions for packets.
    ///
    /// Do not push a byte that arrived with an error. Report the error as a line event instead.
    pub fn line_event(&mut self, event: LineEvent, mut found: impl FnMut(Found<P::Message<'_>>)) {
        let Self { parser, ledger } = self;
        ledger.counters.events.count(event, 1);
        parser.line_event(event, |one| {
            ledger.found(&one);
            found(one);
        });
    }

    /// Does one step of [`line_event`](Self::line_event). Returns whether another step is needed. The last step, which
    /// returns false, counts the event.
    ///
    /// After a line event, call this function until it returns false. Then the line has delivered and counted exactly
    /// what one call of `line_event` would have. Keep the bytes that arrive in the meantime, and push them afterwards.
    ///
    /// [`BufferedReceiver::line_event_step`](crate::BufferedReceiver::line_event_step) says how many bytes a step
    /// examines. Other receivers need only one step.
    ///
    /// # Examples
    /// ```
    /// use framelock::motion::Bin;
    /// use framelock::{Line, LineEvent, Receiver};
    /// let mut line = Line::new(Receiver::<Bin>::new());
    /// line.feed(b"AB\0", |_| unreachable!());
    /// while line.line_event_step(LineEvent::Idle, |_| ()) {}
    /// assert_eq!((line.counters().discarded.line_event, line.counters().events.idle), (3, 1));
    /// ```
    pub fn line_event_step(
        &mut self,
        event: LineEvent,
        mut found: impl FnMut(Found<P::Message<'_>>),
    ) -> bool {
        let Self { parser, ledger } = self;
        let is_pending = parser.line_event_step(event, |one| {
            ledger.found(&one);
            found(one);
        });
        if !is_pending {
            ledger.counters.events.count(event, 1);
        }
        is_pending
    }

    /// Returns the number of pending bytes. These are the bytes at the end of the stream that may still become part of
    /// a frame.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.parser.pending()
    }
}

/// The counters, and a flag for counting resynchronisations.
// On a Cortex-M4, this layout saves up to ten cycles per byte. The flag comes first, because the compiler would
// otherwise keep a pointer to `Counters::bytes`, and save registers in each call of `push`. The flag is a number,
// because the compiler would place a `Ledger` with a `bool` before the receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(C)]
struct Ledger {
    /// 1 if bytes were discarded since the last delivered frame, otherwise 0.
    lost: u32,
    counters: Counters,
}

impl Ledger {
    #[inline]
    fn received(&mut self, count: usize) {
        self.counters.bytes = self.counters.bytes.wrapping_add(wrapped(count));
    }

    #[inline]
    fn frame(&mut self, length: usize) {
        let counters = &mut self.counters;
        counters.frames = counters.frames.wrapping_add(1);
        counters.frame_bytes = counters.frame_bytes.wrapping_add(wrapped(length));
        if self.lost != 0 {
            self.lost = 0;
            counters.resynchronisations = counters.resynchronisations.wrapping_add(1);
        }
    }

    #[inline]
    fn discarded(&mut self, count: usize, why: DiscardReason) {
        self.lost = 1;
        self.counters.discarded.count(why, wrapped(count));
    }

    #[inline]
    fn found<M>(&mut self, found: &Found<M>) {
        match *found {
            Found::Frame { length, .. } => self.frame(length),
            Found::Discarded { count, why } => self.discarded(count, why),
        }
    }
}

/// Returns a number of bytes modulo 2³², because the counters wrap there.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "counters wrap")]
const fn wrapped(count: usize) -> u32 {
    count as u32
}
