//! The model of the chip: its state as the handler sees it, and its steps.

use framelock::LineEvent;

use crate::{NO_BYTE, OVERRUN, Registers};

/// Number of bytes that the UARTE's FIFO can hold.
pub(super) const FIFO: u8 = 3;

/// Number of timer values that the model distinguishes.
pub(super) const TIMES: u8 = 5;

/// A byte in memory.
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) struct Byte {
    pub(super) number: u8,
    /// Whether the byte is sound: it is not corrupted, and no error occurred between its arrival and its storage in
    /// memory.
    pub(super) is_sound: bool,
    /// Whether the byte's value is [`NO_BYTE`].
    pub(super) is_hidden: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Chip {
    /// The number of the next byte on the line. Lost bytes have numbers too.
    pub(super) next: u8,
    /// The FIFO holds `old` bytes followed by `new` bytes. The `old` bytes may be corrupted, or may have come before
    /// the last error. The `new` bytes are sound, and are the latest bytes on the line.
    pub(super) old: u8,
    pub(super) new: u8,
    pub(super) open: bool,
    /// The byte that the last transfer stored, until the next transfer is opened.
    pub(super) memory: Option<Byte>,
    pub(super) ended: bool,
    /// Whether the transfer has ended but ENDRX has not come, because this ENDRX is late or lost.
    pub(super) owes_end: bool,
    /// `failed`: whether a cause is set in ERRORSRC. `error`: whether the event ERROR is set.
    pub(super) failed: bool,
    pub(super) error: bool,
    /// Whether an overrun of the FIFO is among the causes.
    pub(super) overran: bool,
    /// The timer. 0: less than `NONE_WAITS`. 1: at least `NONE_WAITS`, but less than `GAP`. 2 and 3: at least `GAP`,
    /// but less than twice `GAP`. 4: at least twice `GAP`.
    pub(super) time: u8,
    /// `stopping`: whether STOPRX was given and no transfer started since. `timeout`: whether RXTO has come, even if
    /// the receiver has not stopped.
    pub(super) stopping: bool,
    pub(super) timeout: bool,
    /// `may_owe`: whether an ENDRX may be late or lost. `moves`: whether the chip takes steps between two accesses.
    /// `ghost`: whether a duplicate ENDRX has come although the next transfer is open.
    pub(super) may_owe: bool,
    pub(super) moves: bool,
    pub(super) ghost: bool,
    /// `expected`: the number of the last byte handed on, plus one. `reported`: whether an event was reported after
    /// that byte.
    pub(super) expected: u8,
    pub(super) reported: bool,
    /// Whether ENDRX was late or lost when the handler last read this event.
    pub(super) owed: bool,
    /// The byte that the round read last. This field and the next ones record the actions of a round.
    pub(super) looked_at: Option<Byte>,
    pub(super) pushed: u8,
    pub(super) idles: u8,
    pub(super) restarts: u8,
    pub(super) wakes_by_error: bool,
    pub(super) wakes_by_timer: bool,
}

impl Chip {
    /// Returns the number of the first byte in the FIFO that was received after the last error.
    pub(super) fn first_new(&self) -> u8 {
        self.next - self.new
    }

    /// Takes any number of the chip's steps, or none, in any order. The chip stores at most one byte meanwhile, because
    /// only an access can open another transfer.
    pub(super) fn moves(&mut self) {
        if self.stopping {
            // While stopping, the handler reads only the timer and RXTO, and all bytes that arrive are lost.
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
            // An ENDRX that is still due may come now.
            let is_late = self.memory.is_some_and(|byte| !byte.is_hidden) && kani::any();
            self.owes_end = !is_late;
            self.ended = is_late;
        } else if !self.open {
            // ENDRX may come a second time.
            self.ended |= kani::any::<bool>();
        }
    }

    /// Advances the timer by any amount of time, except while a byte waits and a transfer is open. So if a byte waits
    /// when the timer is 0, it is stored before `NONE_WAITS` (A1). A byte that begins to wait later may be stored after
    /// any delay. In the model, such a byte arrives later, and is stored without a delay.
    fn time_passes(&mut self) {
        let waits = self.open && (self.old > 0 || self.new > 0);
        if !waits {
            self.time = kani::any_where(|time| *time >= self.time && *time < TIMES);
        }
    }

    /// Receives up to `FIFO + 1` bytes. Some of them may be lost or corrupted.
    fn receives(&mut self) {
        let more: u8 = kani::any();
        kani::assume(more < FIFO + 2);
        self.next += more;
        let waited = self.old + self.new > 0;
        if kani::any() {
            // All bytes are sound, and the FIFO has room for them.
            self.new += more;
        } else {
            // When the first received byte is stored, ERRORSRC already shows an error (A3). The error may have
            // corrupted this byte. An overrun may lose any bytes that were in the FIFO, but at least one byte stays
            // there (A4).
            self.failed = true;
            self.error |= kani::any::<bool>();
            self.old = kani::any();
            self.new = kani::any();
            kani::assume(self.new < more + 1);
            if kani::any() {
                // A4: from `NONE_WAITS` on, an open transfer takes a byte before the FIFO overruns.
                kani::assume(!self.open || self.time == 0);
                self.overran = true;
            }
        }
        kani::assume(self.old < FIFO + 1 && self.new < FIFO + 1 && self.old + self.new < FIFO + 1);
        kani::assume(self.old + self.new > 0 || !waited && !self.overran);
    }

    /// Stores the first byte of the FIFO in memory, if a transfer is open.
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

    /// Takes the chip's steps before an access. An access need not call this function if it makes no difference whether
    /// the chip's steps come before this access or before the next one.
    fn access(&mut self) {
        if self.moves {
            self.moves();
        }
    }

    fn opens(&mut self) {
        assert!(!self.open || self.ghost, "a transfer is open already");
        assert!(!self.owes_end, "the last transfer's ENDRX is still due");
        if let (true, None, Some(byte)) = (self.ghost, self.looked_at, self.memory) {
            // The case of L4: the spurious byte replaces the byte in memory, which then counts as handed on.
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
        // Another error may come after the causes are read and before they are cleared. Then clearing also removes this
        // error if its cause is among the causes that were read, or if any write clears all causes.
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
        // The bytes in the FIFO are lost, and so are all bytes that arrive until the UARTE is on again.
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
            "S1: not corrupted, S2: not from before an error"
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
