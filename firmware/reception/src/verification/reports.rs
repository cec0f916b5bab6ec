//! S3: every reported event has happened. In these harnesses the registers return arbitrary values, which covers
//! every chip.

use framelock::LineEvent;

use super::Reception;
use super::invariant::any_reception;
use crate::{NO_BYTE, OVERRUN, Registers, State};

/// Registers that return the values in `says`, and record the reports.
struct Uarte {
    says: Values,
    /// Whether a byte lay in memory at the last tick and no transfer was started since.
    lay_there: bool,
    stopping: bool,
    reported: Reported,
}

#[derive(Clone, Copy, kani::Arbitrary)]
struct Values {
    open_for: u32,
    ended: bool,
    ended_later: bool,
    stopped: bool,
    causes: u32,
    byte: u8,
}

#[derive(Clone, Copy, PartialEq, Eq, Default)]
struct Reported {
    overruns: u8,
    parity_errors: u8,
    framing_errors: u8,
    breaks: u8,
    gaps: u8,
    restarts: u8,
}

impl Uarte {
    fn any(reception: &Reception) -> Self {
        Self {
            says: kani::any(),
            lay_there: kani::any(),
            stopping: reception.state == State::Stopping,
            reported: Reported::default(),
        }
    }
}

impl Registers for Uarte {
    fn open_for(&mut self) -> u32 {
        self.says.open_for
    }

    fn ended(&mut self) -> bool {
        core::mem::replace(&mut self.says.ended, self.says.ended_later)
    }

    fn take_causes(&mut self) -> u32 {
        self.says.causes
    }

    fn byte(&mut self) -> u8 {
        self.says.byte
    }

    fn start(&mut self) {
        self.lay_there = false;
    }

    fn stop(&mut self) {
        self.stopping = true;
        self.reported.restarts += 1;
    }

    fn stopped(&mut self) -> bool {
        self.says.stopped
    }

    fn start_anew(&mut self) {
        self.stopping = false;
        self.lay_there = false;
    }

    fn report(&mut self, event: LineEvent) {
        *match event {
            LineEvent::Overrun => &mut self.reported.overruns,
            LineEvent::Parity => &mut self.reported.parity_errors,
            LineEvent::Framing => &mut self.reported.framing_errors,
            LineEvent::Break => &mut self.reported.breaks,
            _ => &mut self.reported.gaps,
        } += 1;
    }

    fn restart_timer(&mut self) {}
    fn listen(&mut self, _: bool, _: bool) {}
    fn push(&mut self, _: u8) {}
}

/// Checks that a round reports a gap once, and each cause in ERRORSRC once. The round stops the UARTE only if there was
/// an overrun but no ENDRX, although a transfer had been open for `NONE_WAITS`.
#[kani::proof]
#[kani::unwind(6)]
fn a_round_reports_what_has_happened() {
    let mut reception = any_reception();
    let mut uarte = Uarte::any(&reception);
    let says = uarte.says;
    let takes_bytes = !uarte.stopping;
    let is_gap = says.open_for >= 2 && !reception.since_byte.in_gap;
    let overran = says.open_for >= 1 && says.causes & OVERRUN != 0;
    let lost_end = overran && !says.ended && !says.ended_later;
    reception.service(&mut uarte);
    let is_cause = |bit: u32| u8::from(takes_bytes && says.causes & 1 << bit != 0);
    let expected = Reported {
        overruns: is_cause(0),
        parity_errors: is_cause(1),
        framing_errors: is_cause(2),
        breaks: is_cause(3),
        gaps: u8::from(takes_bytes && is_gap),
        restarts: u8::from(takes_bytes && lost_end),
    };
    assert!(uarte.reported == expected);
    kani::cover!(expected.breaks == 1 && expected.overruns == 0);
    kani::cover!(expected.restarts == 1);
}

/// Checks that a tick reports a lost ENDRX only if an ENDRX is lost.
///
/// A byte that lies in memory at one tick may have just been stored. Suppose that it still lies there at the second
/// tick, and that no ENDRX came and no transfer was started between the ticks. Then its ENDRX was lost. Rounds between
/// the ticks matter only if they start a transfer, so two arbitrary rounds stand for any number of rounds.
#[kani::proof]
#[kani::unwind(6)]
fn a_tick_reports_no_byte_that_has_just_come() {
    let mut reception = any_reception();
    let mut uarte = Uarte::any(&reception);
    reception.tick(&mut uarte);
    uarte.lay_there = uarte.says.byte != NO_BYTE;
    for _ in 0..2 {
        uarte.says = kani::any();
        reception.service(&mut uarte);
    }
    uarte.says = kani::any();
    let lies_there = uarte.says.byte != NO_BYTE && !uarte.says.ended;
    let lost_end = uarte.lay_there && lies_there && !uarte.stopping;
    uarte.reported = Reported::default();
    reception.tick(&mut uarte);
    let expected = Reported {
        overruns: lost_end.into(),
        restarts: lost_end.into(),
        ..Reported::default()
    };
    assert!(uarte.reported == expected);
    kani::cover!(lost_end);
    kani::cover!(!lost_end && lies_there && !uarte.stopping);
}
