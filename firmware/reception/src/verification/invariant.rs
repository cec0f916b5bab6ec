//! What always holds of the chip and the reception together.

use super::chip::{Byte, Chip, Dma, FIFO, HALF, narrow};
use crate::{Half, PATIENCE, Reception, State};

pub(super) type Handler = Reception<{ HALF as u32 }>;

/// What always holds.
pub(super) fn holds(chip: &Chip, reception: &Handler) -> bool {
    View::of(chip, reception).is_some_and(|view| view.is_sound() && view.state())
}

/// The part of it that is about the chip alone: it holds too when the handler is late.
pub(super) fn is_sound(chip: &Chip, reception: &Handler) -> bool {
    View::of(chip, reception).is_some_and(|view| view.is_sound())
}

/// The chip and the handler's state.
struct View<'a> {
    chip: &'a Chip,
    reception: &'a Handler,
    taken: u8,
    begun_at: u8,
    doubt: u8,
    /// Errors that the handler has not read.
    unread: u8,
}

impl<'a> View<'a> {
    /// None if their counts do not fit.
    fn of(chip: &'a Chip, reception: &'a Handler) -> Option<Self> {
        let errors_seen = narrow(reception.errors_seen)?;
        Some(Self {
            chip,
            reception,
            taken: reception.taken.min(100) as u8,
            begun_at: narrow(reception.begun_at)?,
            doubt: reception.doubt.min(100) as u8,
            unread: chip.errors.checked_sub(errors_seen)?,
        })
    }

    fn is_sound(&self) -> bool {
        let chip = self.chip;
        let counts = chip.at_error <= chip.count
            && chip.at_end <= chip.count
            && chip.at_silence <= chip.count;
        let events = (self.unread == 0 || chip.error) && chip.ended == (chip.ends > 0);
        let fifo = chip.held <= FIFO
            && chip.held <= chip.number
            && chip.expected <= chip.number
            && (0..FIFO).all(|at| {
                let number = self.oldest().wrapping_add(at);
                at >= chip.held || chip.fifo[usize::from(at)].number == number
            });
        let dma = match chip.dma {
            Dma::Closed => true,
            Dma::Open => chip.done < HALF && chip.held <= 1,
            Dma::Full | Dma::Restarting => chip.done == HALF && chip.held == 0,
        };
        counts && events && fifo && dma && !(chip.short && chip.stopping)
    }

    fn state(&self) -> bool {
        match self.reception.state {
            State::Receiving => self.receiving(),
            State::Stopping { exact } => {
                self.restarting() && self.stopping() && (!exact || self.exact())
            }
            State::Flushing => self.restarting() && self.flushing(),
        }
    }

    /// The number of the oldest byte in the FIFO, or of the next.
    fn oldest(&self) -> u8 {
        self.chip.number.wrapping_sub(self.chip.held)
    }

    /// The open half, and the other.
    fn memory(&self) -> [[Byte; HALF as usize]; 2] {
        let [first, second] = self.chip.memory;
        match self.reception.open {
            Half::First => [first, second],
            Half::Second => [second, first],
        }
    }

    fn receiving(&self) -> bool {
        let Self {
            chip, reception, ..
        } = *self;
        let Reception { open, named, .. } = *reception;
        let is_on = chip.runs && chip.short && !chip.stopping && !chip.flushing;
        let is_restarting = chip.dma == Dma::Restarting;
        let has_restarted = chip.ends > u8::from(is_restarting);
        // The handler has seen the end of the half before, and the open one has not started.
        let is_to_start = is_restarting && chip.ends == 0;
        let pointers = if named {
            let writing = if has_restarted { open.other() } else { open };
            !is_to_start
                && chip.named == open.other()
                && chip.writing == writing
                && chip.started == has_restarted
        } else {
            chip.named == open
                && chip.started != is_to_start
                && (is_to_start || chip.writing == open)
        };
        is_on
            && chip.dma != Dma::Closed
            && pointers
            && self.taken <= HALF
            && chip.listening == (reception.errors_left > 0)
            && self.counts()
            && self.silences()
            && (!named && chip.ends > 0 || self.bytes())
    }

    /// Bytes stored since the open half was begun.
    fn place(&self) -> u8 {
        let chip = self.chip;
        let done = if chip.dma == Dma::Restarting {
            0
        } else {
            chip.done
        };
        chip.ends.wrapping_mul(HALF).wrapping_add(done)
    }

    fn counts(&self) -> bool {
        let Self {
            chip,
            begun_at,
            doubt,
            unread,
            ..
        } = *self;
        let accepted = self.place().wrapping_add(chip.held);
        let last = chip.count.wrapping_add(chip.ready_due.into());
        let total = last.wrapping_sub(begun_at);
        // Counted, and not stored.
        let phantoms = total.wrapping_sub(accepted);
        let end = if chip.ends == 0 {
            chip.at_end <= begun_at
        } else {
            let end = chip.at_end.wrapping_sub(begun_at);
            let since = accepted.wrapping_sub(HALF);
            let counted = last.wrapping_sub(chip.at_end);
            let most = since.saturating_add(1).saturating_add(unread);
            chip.at_end >= begun_at
                && end >= chip.ends.wrapping_mul(HALF).wrapping_sub(1)
                && (chip.ends > 1 || since <= counted && counted <= most)
        };
        begun_at <= last
            && end
            && accepted <= total
            && (chip.ends > 1
                || phantoms <= doubt.saturating_add(unread)
                    && (unread != 1 || self.error_is_within(self.place())))
    }

    /// The last error's place.
    fn at_error(&self) -> u8 {
        self.chip.at_error.saturating_sub(self.begun_at)
    }

    /// Whether the only unread error came no later than just before the byte at this place.
    fn error_is_within(&self, place: u8) -> bool {
        let chip = self.chip;
        // If it came after the end of the open half: that half's last byte may be counted later.
        let is_behind = chip.ends == 1 && chip.at_error > chip.at_end;
        let since = chip.at_error.wrapping_sub(chip.at_end);
        self.at_error() <= place.saturating_add(self.doubt)
            && (!is_behind || place >= HALF && since <= place.wrapping_sub(HALF).saturating_add(1))
    }

    /// What was received when the line was silent is stored, but for what is in doubt.
    fn silences(&self) -> bool {
        let chip = self.chip;
        let in_doubt = self.doubt.saturating_add(self.unread);
        let stored = self.begun_at.saturating_add(self.place());
        // Since the end of the open half, whose last byte may be counted later.
        let since = self.place().saturating_sub(HALF).saturating_add(1);
        let behind = chip.at_end.saturating_add(since);
        let is_stored = |count: u8| {
            chip.ends > 1
                || count <= stored.saturating_add(in_doubt)
                    && (chip.ends == 0 || count <= behind.saturating_add(self.unread))
        };
        let now = !chip.silent || is_stored(chip.at_silence);
        let before = self.reception.silent_at.is_none_or(|count| {
            narrow(count).is_some_and(|count| count <= chip.count && is_stored(count))
        });
        now && before
    }

    /// Whether the byte at this place may be broken: an error that is not read yet tells, or an event
    /// was reported just before it.
    fn may_be_broken(&self, place: u8) -> bool {
        let chip = self.chip;
        let is_unread = self.unread > 0
            && place <= self.at_error()
            && (self.unread > 1 || self.error_is_within(place));
        place < self.taken || is_unread || place == self.taken && chip.reported
    }

    /// The bytes that were not taken are there. (If the open half may be overwritten, they need not
    /// be: the handler will be late.)
    fn bytes(&self) -> bool {
        let Self { chip, taken, .. } = *self;
        let place = self.place();
        // The number of the open half's first.
        let first = self.oldest().wrapping_sub(place);
        let is_right = |byte: Byte, place: u8| {
            byte.number == first.wrapping_add(place) && (!byte.broken || self.may_be_broken(place))
        };
        let [open, other] = self.memory();
        let memory = (0..HALF).all(|at| {
            let behind = HALF.wrapping_add(at);
            let is_other = chip.ends == 1 && behind < place;
            (at < taken || at >= place || is_right(open[usize::from(at)], at))
                && (!is_other || is_right(other[usize::from(at)], behind))
        });
        let to_come = chip.ends > 1
            || (chip.held == 0 || is_right(chip.fifo[0], place) && !chip.broken)
                && (!chip.broken || self.may_be_broken(place));
        place <= self.oldest() && memory && to_come && self.next(first, place)
    }

    /// What was handed on last.
    fn next(&self, first: u8, place: u8) -> bool {
        let Self { chip, taken, .. } = *self;
        chip.expected <= first.wrapping_add(taken.min(place))
            && (chip.reported || chip.expected == first.wrapping_add(taken) && taken <= place)
    }

    /// Stopping or flushing.
    fn restarting(&self) -> bool {
        let reception = self.reception;
        !self.chip.short && reception.waited < PATIENCE && (!reception.follows || self.follows())
    }

    /// What is in the FIFO follows what was handed on.
    fn follows(&self) -> bool {
        let Self {
            chip, reception, ..
        } = *self;
        let is_flushed = reception.state == State::Flushing && chip.ended;
        let is_as_before = u32::from(chip.amount) == reception.amount;
        let amount = if is_flushed {
            chip.amount == chip.held || chip.held == 0 && is_as_before
        } else {
            is_as_before
        };
        chip.dma == Dma::Closed
            && chip.ended == is_flushed
            && amount
            && chip.expected <= self.oldest()
            && (chip.reported || chip.expected == self.oldest())
            && self.fifo_is_sound(true)
    }

    /// No byte in the FIFO is broken: an error that is not read yet tells, or an event was reported
    /// just before the first.
    fn fifo_is_sound(&self, is_next: bool) -> bool {
        let chip = self.chip;
        let is_reported = is_next && chip.reported;
        let are_sound = (0..FIFO).all(|at| {
            at >= chip.held || !chip.fifo[usize::from(at)].broken || at == 0 && is_reported
        });
        let to_come = !chip.broken || !chip.runs || chip.held == 0 && is_reported;
        self.unread > 0 || are_sound && to_come
    }

    fn stopping(&self) -> bool {
        let chip = self.chip;
        let is_on = chip.runs && chip.stopping && !chip.timed_out;
        !chip.flushing && (is_on || self.is_off() && chip.timed_out)
    }

    fn flushing(&self) -> bool {
        let chip = self.chip;
        self.is_off() && !chip.timed_out && chip.flushing != chip.ended
    }

    fn is_off(&self) -> bool {
        let chip = self.chip;
        !chip.runs && !chip.stopping && !chip.ready_due && chip.dma == Dma::Closed
    }

    /// While the open half is stopped and has not been taken.
    fn exact(&self) -> bool {
        let Self {
            chip,
            reception,
            taken,
            ..
        } = *self;
        let done = chip.done;
        let first = self.oldest().wrapping_sub(done);
        let [open, _] = self.memory();
        let are_right = (0..HALF).all(|at| {
            let byte = open[usize::from(at)];
            let is_sound = !byte.broken || self.unread > 0 || at == taken && chip.reported;
            at < taken || at >= done || byte.number == first.wrapping_add(at) && is_sound
        });
        let is_as_before = u32::from(chip.amount) == reception.amount;
        let last = chip.count.wrapping_add(chip.ready_due.into());
        let ended = match chip.dma {
            Dma::Open | Dma::Full => {
                let total = last.wrapping_sub(self.begun_at);
                let stored = done
                    .wrapping_add(chip.held)
                    .saturating_add(self.doubt)
                    .saturating_add(self.unread);
                !chip.ended && is_as_before && self.begun_at <= last && total <= stored
            }
            Dma::Closed => {
                let total = chip.at_end.saturating_sub(self.begun_at);
                let most = self.doubt.saturating_add(1);
                chip.ends == 1
                    && (chip.amount == done || done == 0 && is_as_before)
                    && (done > 0 || self.unread > 0 || total <= most)
            }
            Dma::Restarting => false,
        };
        reception.named
            && !reception.follows
            && taken <= HALF
            && done <= HALF
            && done <= self.oldest()
            && chip.writing == reception.open
            && chip.named == reception.open.other()
            && are_right
            && self.fifo_is_sound(taken >= done)
            && ended
            && self.next(first, done)
    }
}
