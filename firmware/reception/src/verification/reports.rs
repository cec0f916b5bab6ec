//! S3: what is reported has happened. Here the registers say anything, for no chip could make more of it.

use framelock::LineEvent;

use super::invariant::any_reception;
use crate::{NO_BYTE, OVERRUN, Registers};

/// Registers that say these values, and what was reported.
struct Uarte {
    open_for: u32,
    ended: bool,
    causes: u32,
    byte: u8,
    overruns: u8,
    parity_errors: u8,
    framing_errors: u8,
    breaks: u8,
    gaps: u8,
    restarts: u8,
}

impl Uarte {
    fn any() -> Self {
        Self {
            open_for: kani::any(),
            ended: kani::any(),
            causes: kani::any(),
            byte: kani::any(),
            overruns: 0,
            parity_errors: 0,
            framing_errors: 0,
            breaks: 0,
            gaps: 0,
            restarts: 0,
        }
    }
}

impl Registers for Uarte {
    fn open_for(&mut self) -> u32 {
        self.open_for
    }

    fn ended(&mut self) -> bool {
        self.ended
    }

    fn take_causes(&mut self) -> u32 {
        self.causes
    }

    fn byte(&mut self) -> u8 {
        self.byte
    }

    fn start_anew(&mut self) {
        self.restarts += 1;
    }

    fn report(&mut self, event: LineEvent) {
        *match event {
            LineEvent::Overrun => &mut self.overruns,
            LineEvent::Parity => &mut self.parity_errors,
            LineEvent::Framing => &mut self.framing_errors,
            LineEvent::Break => &mut self.breaks,
            _ => &mut self.gaps,
        } += 1;
    }

    fn restart_timer(&mut self) {}
    fn start(&mut self) {}
    fn listen(&mut self, _: bool, _: bool) {}
    fn push(&mut self, _: u8) {}
}

/// By ERRORSRC's bits, each once, and the gap; and only behind an ENDRX that was lost is the UARTE started anew.
#[kani::proof]
#[kani::unwind(6)]
fn a_round_reports_what_has_happened() {
    let mut reception = any_reception();
    let mut uarte = Uarte::any();
    let is_gap = uarte.open_for >= 2 && !reception.since_byte.in_gap;
    let lost_end = !uarte.ended && uarte.causes & OVERRUN != 0;
    reception.service(&mut uarte);
    let is_cause = |bit: u32| u8::from(uarte.causes & 1 << bit != 0);
    assert!(uarte.overruns == is_cause(0) && uarte.parity_errors == is_cause(1));
    assert!(uarte.framing_errors == is_cause(2) && uarte.breaks == is_cause(3));
    assert!(uarte.gaps == u8::from(is_gap));
    assert!(uarte.restarts == u8::from(lost_end));
    kani::cover!(uarte.breaks == 1 && uarte.overruns == 0);
}

/// A byte that lies there at one tick may have come just now; at the second its ENDRX was lost.
#[kani::proof]
#[kani::unwind(6)]
fn a_tick_reports_no_byte_that_has_just_come() {
    let mut reception = any_reception();
    let mut uarte = Uarte::any();
    let lost_end = uarte.byte != NO_BYTE && reception.since_byte.signs > 0;
    reception.tick(&mut uarte);
    assert!(uarte.overruns == u8::from(lost_end) && uarte.restarts == u8::from(lost_end));
    assert!(uarte.parity_errors + uarte.framing_errors + uarte.breaks + uarte.gaps == 0);
    kani::cover!(lost_end);
}
