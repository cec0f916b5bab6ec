//! The hardware as the reception sees it: a dozen reads and writes of registers, and the reader of
//! the bytes.

use framelock::LineEvent;

/// One of the two halves of the buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Half {
    /// The lower.
    First,
    /// The upper.
    Second,
}

impl Half {
    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// What the hardware says once, until it is asked.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// RXSTARTED: it has begun with the half that was named.
    Started,
    /// ENDRX: a half is full, or the UARTE has stopped writing, or the flush is over.
    Ended,
    /// RXTO: the receiver is off.
    TimedOut,
    /// ERROR.
    Error,
    /// The line has been silent for three byte times.
    Silent,
    /// The line has been silent for so long that no frame goes on (L1).
    Gap,
}

/// When TIMER1's count is asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Moment {
    /// Now.
    Now,
    /// At the last ENDRX.
    End,
    /// At the last ERROR, without the byte that it spoilt.
    Error,
    /// When the line had last been silent for three byte times.
    Silent,
}

/// ERRORSRC.
#[expect(clippy::struct_excessive_bools, reason = "a register's bits")]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Causes {
    /// A byte was lost since the FIFO was full.
    pub overrun: bool,
    /// A byte with a wrong parity bit. It is stored.
    pub parity: bool,
    /// A byte without a stop bit. It is not stored.
    pub framing: bool,
    /// The line was low for longer than a byte.
    pub line_break: bool,
}

/// The hardware, and the reader of the bytes.
pub trait Registers {
    /// Whether that happened since it was last asked: reads the event, and clears it if it is set.
    fn happened(&mut self, event: Event) -> bool;
    /// Clears it, whether it happened or not.
    fn clear(&mut self, event: Event) {
        self.happened(event);
    }
    /// Bytes received by then. Counts wrap.
    fn count(&mut self, moment: Moment) -> u32;
    /// Errors until now: TIMER3. Wraps.
    fn errors(&mut self) -> u32;
    /// ERRORSRC, and clears what was read.
    fn causes(&mut self) -> Causes;
    /// RXD.AMOUNT.
    fn amount(&mut self) -> u32;
    /// Interrupts at errors, or none: they are counted and kept all the same.
    fn listen_to_errors(&mut self, listen: bool);
    /// RXD.PTR: where the UARTE goes on when the half that it has begun is full.
    fn name(&mut self, half: Half);
    /// Starts with the first half; a full half starts the next.
    fn start(&mut self);
    /// A full half starts no other from here on.
    fn last_half(&mut self);
    /// STOPRX.
    fn stop(&mut self);
    /// FLUSHRX: what the UARTE still holds goes to a place of its own.
    fn flush(&mut self);
    /// Switches the UARTE off and on, which ends whatever it does.
    fn switch_off_and_on(&mut self);
    /// Hands on the bytes from `from` to before `to` of a half.
    fn feed(&mut self, half: Half, from: u32, to: u32);
    /// Hands on that many bytes of the flush.
    fn feed_flushed(&mut self, count: u32);
    /// Reports an event behind the bytes handed on.
    fn report(&mut self, event: LineEvent);
}
