//! The chip as the handler sees it, and what it may do.

use framelock::LineEvent;

use crate::{NO_BYTE, OVERRUN, Registers};

/// Bytes that the UARTE's FIFO holds.
pub(super) const FIFO: u8 = 3;

/// Times of the timer that the model tells apart.
pub(super) const TIMES: u8 = 5;

/// What memory holds.
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) struct Byte {
    pub(super) number: u8,
    /// It was received behind the last error that came before it was stored.
    pub(super) is_sound: bool,
    /// It looks like [`NO_BYTE`].
    pub(super) is_hidden: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Chip {
    /// The number of the next byte on the line. A byte that is lost has a number too.
    pub(super) next: u8,
    /// Bytes in the FIFO that may be from before the last error, or spoilt; and those behind them, which
    /// are sound and the last on the line.
    pub(super) old: u8,
    pub(super) new: u8,
    pub(super) open: bool,
    /// What the last transfer brought, until it is taken out.
    pub(super) memory: Option<Byte>,
    pub(super) ended: bool,
    /// The transfer is over and ENDRX has not come: it is late, or lost.
    pub(super) owes_end: bool,
    /// ERRORSRC says something, and the event ERROR is set.
    pub(super) failed: bool,
    pub(super) error: bool,
    /// One of the causes is that the FIFO has overrun.
    pub(super) overran: bool,
    /// The timer: 0, `NONE_WAITS`, `GAP`, more, twice `GAP`.
    pub(super) time: u8,
    /// STOPRX was given, and nothing started since; RXTO has come, with a cause or without.
    pub(super) stopping: bool,
    pub(super) timeout: bool,
    /// Whether an ENDRX may be late or lost; whether it does anything between two accesses; whether ENDRX has
    /// come again though the next transfer is open.
    pub(super) may_owe: bool,
    pub(super) moves: bool,
    pub(super) ghost: bool,
    /// Of what was handed on: the number that would follow, and whether an event was reported since.
    pub(super) expected: u8,
    pub(super) reported: bool,
    /// When the handler last asked for ENDRX, it was late or lost.
    pub(super) owed: bool,
    /// What a round did: the byte that it looked at last.
    pub(super) looked_at: Option<Byte>,
    pub(super) pushed: u8,
    pub(super) idles: u8,
    pub(super) restarts: u8,
    pub(super) wakes_by_error: bool,
    pub(super) wakes_by_timer: bool,
}

impl Chip {
    /// The number of the first byte in the FIFO that is behind every error.
    pub(super) fn first_new(&self) -> u8 {
        self.next - self.new
    }

    /// The chip does nothing, or any number of steps, in any order. Between two accesses it stores one byte
    /// at most, since nothing opens a transfer.
    pub(super) fn moves(&mut self) {
        if self.stopping {
            // Nothing but the time and RXTO is looked at, and all that comes is lost.
            self.time = kani::any_where(|time| *time >= self.time && *time < TIMES);
            self.timeout |= kani::any::<bool>();
            return;
        }
        self.time_passes();
        self.receives();
        if self.open && kani::any() {
            self.stores();
            self.receives();
            self.time_passes();
        }
        if self.owes_end {
            // It may be late.
            let is_late = self.memory.is_some_and(|byte| !byte.is_hidden) && kani::any();
            self.owes_end = !is_late;
            self.ended = is_late;
        } else if !self.open {
            // It may come again.
            self.ended |= kani::any::<bool>();
        }
    }

    /// A1: no byte waits when the time is over.
    fn time_passes(&mut self) {
        let waits = self.open && (self.old > 0 || self.new > 0);
        if !waits {
            self.time = kani::any_where(|time| *time >= self.time && *time < TIMES);
        }
    }

    /// Any number of bytes, lost or spoilt ones among them, or none.
    fn receives(&mut self) {
        let more: u8 = kani::any();
        kani::assume(more < FIFO + 2);
        self.next += more;
        let waited = self.old + self.new > 0;
        if kani::any() {
            // All are sound, and there is room.
            self.new += more;
        } else {
            // An error comes before the first is stored, or spoils it: A3, A4. What was there may be lost to an
            // overrun, but for the last.
            self.failed = true;
            self.error |= kani::any::<bool>();
            self.old = kani::any();
            self.new = kani::any();
            kani::assume(self.new < more + 1);
            if kani::any() {
                // A1: an open transfer takes a byte before the FIFO is full.
                kani::assume(!self.open || self.time == 0);
                self.overran = true;
            }
        }
        kani::assume(self.old < FIFO + 1 && self.new < FIFO + 1 && self.old + self.new < FIFO + 1);
        kani::assume(self.old + self.new > 0 || !waited && !self.overran);
    }

    /// Stores the first byte of the FIFO, if a transfer is open.
    pub(super) fn stores(&mut self) {
        if !self.open || self.old == 0 && self.new == 0 {
            return;
        }
        let is_sound = self.old == 0;
        let number = if is_sound {
            self.new -= 1;
            self.first_new() - 1
        } else {
            self.old -= 1;
            kani::any_where(|number| *number < self.next)
        };
        self.memory = Some(Byte {
            number,
            is_sound,
            is_hidden: kani::any(),
        });
        self.open = false;
        self.owes_end = self.may_owe && kani::any();
        self.ended = !self.owes_end;
    }

    /// In front of each access that reads or changes what the chip does. What it does in front of the others it
    /// may as well do in front of the next of these: none of its steps depends on them.
    fn access(&mut self) {
        if self.moves {
            self.moves();
        }
    }

    fn opens(&mut self) {
        assert!(!self.open || self.ghost, "a transfer is open already");
        assert!(!self.owes_end, "the last transfer's ENDRX is to come");
        if let (true, None, Some(byte)) = (self.ghost, self.looked_at, self.memory) {
            // L4: overwritten.
            self.expected = if byte.is_sound {
                byte.number + 1
            } else {
                self.expected
            };
        }
        self.ended = false;
        self.memory = None;
        self.open = true;
        self.time = 0;
    }
}

impl Registers for Chip {
    fn open_for(&mut self) -> u32 {
        self.access();
        self.time.into()
    }

    fn restart_timer(&mut self) {
        self.access();
        self.time = 0;
    }

    fn ended(&mut self) -> bool {
        self.access();
        self.owed = self.owes_end;
        self.ended
    }

    fn take_causes(&mut self) -> u32 {
        self.error = false;
        self.access();
        let (failed, overran) = (self.failed, self.overran);
        // One of the same kind that comes before the causes are cleared is cleared with them; one of another kind
        // too, if any write clears all.
        self.access();
        if !failed {
            return 0;
        }
        self.overran &= !overran && kani::any::<bool>();
        self.failed = self.overran || kani::any::<bool>();
        kani::any_where(|causes| *causes > 0 && *causes < 16 && (*causes & OVERRUN != 0) == overran)
    }

    fn byte(&mut self) -> u8 {
        self.access();
        self.looked_at = self.memory;
        match self.memory {
            Some(byte) if byte.is_hidden => NO_BYTE,
            Some(_) => 0,
            None => NO_BYTE,
        }
    }

    fn start(&mut self) {
        self.access();
        self.opens();
    }

    fn stop(&mut self) {
        assert!(self.owed, "S3: an ENDRX is late or lost");
        self.restarts += 1;
        self.stopping = true;
        self.timeout = false;
        self.time = 0;
        self.wakes_by_error = false;
        self.wakes_by_timer = false;
    }

    fn stopped(&mut self) -> bool {
        self.access();
        self.timeout
    }

    fn start_anew(&mut self) {
        self.access();
        assert!(self.stopping, "the receiver is stopped first");
        self.stopping = false;
        // The FIFO's bytes are lost, and so are all that come until it is on again.
        (self.old, self.new) = (0, 0);
        self.next += 1;
        (self.open, self.owes_end) = (false, false);
        (self.failed, self.overran) = (false, false);
        self.opens();
    }

    fn listen(&mut self, to_errors: bool, to_none_waits: bool) {
        self.wakes_by_error = to_errors;
        self.wakes_by_timer = to_none_waits;
    }

    fn push(&mut self, _: u8) {
        self.pushed += 1;
        let Some(byte) = self.looked_at.take() else {
            assert!(core::mem::take(&mut self.ghost), "S1: once");
            return;
        };
        assert!(
            byte.is_sound,
            "S1: not spoilt, S2: not from before an error"
        );
        assert!(byte.number >= self.expected, "S1: in order");
        assert!(
            byte.number == self.expected || self.reported,
            "S2: none is missing"
        );
        self.expected = byte.number + 1;
        self.reported = false;
    }

    fn report(&mut self, event: LineEvent) {
        self.reported = true;
        self.idles += u8::from(event == LineEvent::Idle);
    }
}
