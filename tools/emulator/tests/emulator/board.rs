//! Tests of the board's functions, with programs of a few instructions.

use crate::boards::*;
use nrf52840_emulator::{Board, MICROSECOND, MILLISECOND, RAM_START, ResetCause, Symbol};

const TIMER0: u32 = 0x4000_8000;
const COMPARE0: u32 = TIMER0 + 0x140;
const WDT: u32 = 0x4001_0000;
const NVIC_ISER0: u32 = 0xE000_E100;
/// TIMER0 is interrupt 8.
const TIMER0_EXCEPTION: u16 = 16 + 8;

/// Returns code that enables TIMER0's interrupt and then sleeps forever.
fn sleep_until_timer0() -> Vec<u16> {
    [&store(NVIC_ISER0, 1 << 8)[..], &SLEEP].concat()
}

/// Returns a board whose firmware sleeps between the ticks of TIMER0.
pub(crate) fn ticking() -> Board {
    ticking_in(&sleep_until_timer0())
}

fn variable(name: &str, address: u32, size: u32) -> Symbol {
    Symbol {
        name: name.to_owned(),
        address,
        size,
        function: false,
    }
}

/// Returns a board with TIMER0 ticking every 100 us. The interrupt handler clears COMPARE[0] and counts in RAM.
fn ticking_in(main: &[u16]) -> Board {
    let mut handler = load(0, COMPARE0).to_vec();
    handler.push(0x2100); // movs r1, #0
    handler.push(0x6001); // str r1, [r0]
    handler.extend(load(2, RAM_START));
    handler.extend([0x6813, 0x3301, 0x6013]); // ldr r3, [r2]; adds r3, #1; str r3, [r2]
    handler.push(0x4770); // bx lr
    let handler_at = u32::try_from(0x100 + 2 * main.len()).unwrap();
    let symbols = vec![
        variable("TICKS", RAM_START, 4),
        Symbol {
            function: true,
            ..variable("example::TIMER0", handler_at, 2 * 10)
        },
    ];
    let mut board = booted(board_with(main, &handler, symbols));
    for (register, value) in [
        (0x508, 3),
        (0x510, 4),
        (0x540, 100),
        (0x200, 1),
        (0x304, 1 << 16),
        (0, 1),
    ] {
        board.set(TIMER0 + register, value);
    }
    board
}

#[test]
fn an_interrupt_wakes_the_core_and_its_handler_is_accounted_for() {
    let mut board = ticking();
    board.wait(1_050 * MICROSECOND);
    assert_eq!(board.word("TICKS").unwrap(), 10);
    let activations = &board.trace().activations;
    assert_eq!(activations.len(), 10);
    for activation in activations {
        assert_eq!(activation.exception, TIMER0_EXCEPTION);
        // The handler's ten instructions take a cycle each, and three of them take one more for a data access. The
        // entry takes 12 cycles, and 8 more for stacking eight words. The return takes 10 cycles, and 8 more for
        // unstacking the words.
        assert_eq!(activation.cycles, 10 + 3 + (12 + 8) + (10 + 8));
    }
    assert_eq!(activations[1].at - activations[0].at, 100 * MICROSECOND);
}

/// Instructions that an IT block skips stay skipped if an interrupt comes between them.
#[test]
fn an_interrupt_in_an_it_block_changes_nothing() {
    let mut main = store(NVIC_ISER0, 1 << 8);
    main.extend(load(6, RAM_START + 4));
    main.extend([0x2500, 0x2401]); // movs r5, #0; movs r4, #1: not zero
    main.extend([0xBF01, 0x3501, 0x3501, 0x3501, 0x3501]); // itttt eq; addeq r5, #1 (4 times)
    main.extend([0x6035, 0xE7F8]); // str r5, [r6]; b to the itttt
    let mut board = ticking_in(&main);
    for _ in 0..500 {
        board.wait(101 * MICROSECOND);
    }
    assert!(board.word("TICKS").unwrap() > 500);
    assert_eq!(board.memory().word(RAM_START + 4), Some(0));
}

#[test]
fn an_interrupt_that_is_pending_and_masked_wakes_the_core_from_the_sleep_that_it_goes_into() {
    let mut main = Vec::new();
    main.extend(load(0, NVIC_ISER0));
    main.extend(load(1, 1 << 8));
    main.extend(load(2, RAM_START));
    main.push(0xB672); // cpsid i
    main.extend([0x6001, 0xF8C0, 0x1100]); // str r1, [r0]; str.w r1, [r0, #0x100]: pending
    main.extend([0xBF30, 0x6011, 0xE7FE]); // wfi; str r1, [r2]; b .
    let mut board = board_of(&main, &[]);
    board.wait(MILLISECOND);
    assert_eq!(board.memory().word(RAM_START), Some(1 << 8));
}

#[test]
fn a_core_that_is_held_off_runs_its_handler_late() {
    let mut board = ticking();
    board.watch("TICKS").unwrap();
    let began = board.now();
    board.hold_off(began + 350 * MICROSECOND, 200 * MICROSECOND);
    board.wait(1_050 * MICROSECOND);
    let at: Vec<u64> = board
        .trace()
        .changes
        .iter()
        .map(|c| (c.at - began) / MICROSECOND)
        .collect();
    // The core runs again at 550 us, so it handles the ticks at 400 and 500 us as one.
    assert_eq!(at, [100, 200, 300, 550, 600, 700, 800, 900, 1_000]);
}

#[test]
fn it_runs_to_a_symbol() {
    let mut board = ticking();
    let handler = board.image().symbol("TIMER0").unwrap().address;
    let soon = board.now() + MILLISECOND;
    assert!(board.run(soon, |board| board.pc() == handler).unwrap());
    assert_eq!(board.pc(), handler);
    assert_eq!(board.exception(), TIMER0_EXCEPTION);
    assert_eq!(
        board.image().function_at(handler + 4).unwrap().name,
        "example::TIMER0"
    );
    assert!(!board.run(soon, |board| board.pc() == 0xDEAD_BEEE).unwrap());
}

#[test]
fn a_stuck_main_loop_still_takes_interrupts_and_never_sleeps() {
    let mut board = ticking();
    board.wait(150 * MICROSECOND);
    board.stick_main_loop().unwrap();
    let before = board.word("TICKS").unwrap();
    // The core may sleep once more, until the next interrupt.
    board.wait(100 * MICROSECOND);
    let slept = board.slept();
    board.wait(MILLISECOND);
    assert_eq!(board.slept(), slept);
    assert_eq!(board.word("TICKS").unwrap(), before + 11);
    assert_eq!(board.exception(), 0);
}

/// Returns a board whose TIMER0 handler requests a soft reset.
fn resets_itself() -> Board {
    let mut handler = store(0xE000_ED0C, 0x05FA_0004);
    handler.push(0xE7FE); // b .
    booted(board_of(&sleep_until_timer0(), &handler))
}

#[test]
fn a_soft_reset_stops_the_timers_and_leaves_the_watchdog_running() {
    let mut board = resets_itself();
    // 3277 cycles of 32.768 kHz: 100 ms.
    board.set(WDT + 0x504, 3_276);
    board.set(WDT, 1);
    for (register, value) in [(0x508, 3), (0x540, 100), (0x304, 1 << 16), (0, 1)] {
        board.set(TIMER0 + register, value);
    }
    board.wait(90 * MILLISECOND);
    let causes = |board: &mut Board| {
        let resets = board.trace().resets.iter();
        resets.map(|reset| reset.cause).collect::<Vec<_>>()
    };
    assert_eq!(causes(&mut board), [ResetCause::Soft]);
    assert_eq!(board.get(WDT + 0x400), 1, "the watchdog runs");
    board.wait(20 * MILLISECOND);
    assert_eq!(causes(&mut board), [ResetCause::Soft, ResetCause::Watchdog]);
    assert_eq!(board.get(WDT + 0x400), 0);
    assert_eq!(board.get(0x4000_0400), 0b110, "the causes add up");
}

#[test]
fn what_the_firmware_does_wrong_is_told_with_the_program_counter() {
    // Reads GPIOTE.
    let mut main = load(0, 0x4000_6100).to_vec();
    main.extend([0x6801, 0xE7FE]); // ldr r1, [r0]; b .
    let error = board_of(&main, &[RETURN]).run_for(100).unwrap_err();
    let expected =
        "read of peripheral at 0x40006100, which is not modelled (pc 0x00000108, unknown function)";
    assert_eq!(error.to_string(), expected);
}

/// An undefined instruction and a write to flash cause faults.
#[test]
fn a_fault_ends_the_emulation_with_its_status() {
    let undefined = vec![0xDE00]; // udf
    let writes = [&load(0, 0x104)[..], &[0x6001, 0xE7FE]].concat(); // str r1, [r0]; b .
    for (main, status) in [
        (undefined, "hardfault: CFSR 0x00010000"),
        (writes, "address 0x00000104"),
    ] {
        let error = board_of(&main, &[RETURN]).run_for(100).unwrap_err();
        assert!(error.to_string().contains(status), "{error}");
    }
}

/// Sends every byte value back to back, with the sender's rate off by some per mille. The receiver's rate for 115200
/// baud is 115108 baud.
#[test]
fn the_baud_rates_may_differ_by_four_per_cent_but_not_by_six() {
    for per_mille in [-60_i64, -40, -20, 0, 20, 40, 60] {
        let bytes: Vec<u8> = (0..=255).collect();
        let nominal = 16_000_000_000 / 139;
        let millibaud = u64::try_from(nominal + nominal * per_mille / 1000).unwrap();
        let mut board = receiving_at(BAUD_115200, millibaud, 256);
        let end = board.send(&bytes);
        board.run_until(end + 200 * MICROSECOND).unwrap();
        let arrived = board.bytes(BUFFER, 256);
        let right = arrived.iter().zip(&bytes).filter(|(a, b)| a == b).count();
        if per_mille.abs() > 40 {
            assert!(right < 200, "{right} of 256 at {per_mille} per mille");
        } else {
            assert_eq!(
                (right, board.get(ERRORSRC)),
                (256, 0),
                "{per_mille} per mille"
            );
        }
    }
}
