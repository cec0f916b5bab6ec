//! Tests that a line full of errors leaves processor time for other code.

use nrf52840_emulator::{LineSymbol, MILLISECOND};

use crate::firmware::{Firmware, RATES, RESTART, sample};
use crate::outputs::{pulse, pulses};

#[test]
fn a_second_of_framing_errors_starves_nobody() {
    starves_nobody(LineSymbol::BadStop(0x55), 11);
}

#[test]
#[ignore = "takes a quarter of a minute"]
fn a_second_of_breaks_starves_nobody() {
    starves_nobody(LineSymbol::Break(10), 11);
    starves_nobody(LineSymbol::Break(12), 13);
}

/// Repeats this symbol of `bits` bits for one second, on a core that is half as fast as the model. Tests the slowest, a
/// middle and the fastest rate, or all offered rates (see [`sample`]). Asserts that there is no reset, the failsafe
/// moves the outputs at the usual times, and a fifth of the processor's time is left. Afterwards, a frame must be
/// received.
fn starves_nobody(symbol: LineSymbol, bits: u64) {
    for rate in sample(RATES, 4) {
        let (baud, _) = rate;
        let what = format!("{symbol:?}, {baud} baud");
        let mut firmware = Firmware::booted_at(rate, 200);
        // The outputs reach the demand within half a second.
        firmware.drive(700, 10, |_| [255; 3]);
        let began = firmware.board.now();
        let handled = handlers(&mut firmware);
        let symbols = vec![symbol; usize::try_from(baud / bits).unwrap()];
        let end = firmware.board.send_symbols(&symbols);
        // The failsafe holds for half a second, and then moves to park in another half a second.
        firmware.board.run_until(began + 450 * MILLISECOND).unwrap();
        assert_eq!(pitch(&mut firmware), pulse(255), "{what}");
        firmware.board.run_until(end).unwrap();
        assert!(pitch(&mut firmware) < pulse(140), "{what}");
        assert_eq!(firmware.board.trace().resets, [], "{what}");
        let span = firmware.board.now() - began;
        let share = (handlers(&mut firmware) - handled) * 100 / span;
        assert!(share <= 80, "{what}: handlers take {share} %");
        assert!(firmware.counter("framing") > 100, "{what}");

        firmware.commits();
        firmware.run_for(RESTART);
        // A frame 30 bits after the next error must also be received.
        firmware.board.send_symbols(&[LineSymbol::BadStop(0xFF)]);
        firmware.board.send_symbols(&[LineSymbol::Idle(30)]);
        firmware.takes_a_frame(MILLISECOND, &what);
    }
}

/// Returns the cycles that handlers have taken.
fn handlers(firmware: &mut Firmware) -> u64 {
    let runs = firmware.board.trace().activations.iter();
    runs.map(|run| run.cycles).sum()
}

/// Returns the width of the newest pitch pulse, in microseconds.
fn pitch(firmware: &mut Firmware) -> u64 {
    let since = firmware.board.now() - 40 * MILLISECOND;
    pulses(firmware, since).last().unwrap()[0]
}
