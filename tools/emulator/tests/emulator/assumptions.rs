//! Tests of each single assumption about the chip.

use crate::board::ticking;
use crate::registers::*;
use nrf52840_emulator::{Assumptions, Board, LineSymbol, MICROSECOND, MILLISECOND, RAM_START};

/// The cycles of a byte at 1 Mbaud.
const BYTE: u64 = 10 * MICROSECOND;
const TIMER1: u32 = 0x4000_9000;
const COUNT: u32 = TIMER1 + 0x008;
const CAPTURE: u32 = TIMER1 + 0x040;
const CC: u32 = TIMER1 + 0x540;
const PPI: u32 = 0x4001_F000;

fn assuming(size: u32, change: impl FnOnce(&mut Assumptions)) -> Board {
    let mut board = receiving(size);
    let mut assumptions = Assumptions::default();
    change(&mut assumptions);
    board.assume(assumptions);
    // TIMER1 counts RXDRDY events. CC[0] holds the current count, CC[1] the count at ENDRX.
    board.set_all(&[(TIMER1 + 0x504, 1), (TIMER1 + 0x508, 3), (TIMER1, 1)]);
    let channels = [(RXDRDY, COUNT), (RXDRDY, CAPTURE), (ENDRX, CAPTURE + 4)];
    for (n, (event, task)) in (0..).zip(channels) {
        board.set(PPI + 0x510 + 8 * n, event);
        board.set(PPI + 0x514 + 8 * n, task);
    }
    board.set(PPI + 0x504, 7);
    board
}

/// Returns the number of RXDRDY events so far.
fn ready(board: &mut Board) -> u32 {
    board.set(CAPTURE, 1);
    board.get(CC)
}

/// Receives one byte. Six more wait in the FIFO, the next one finds no room, and the last one has no stop bit.
#[test]
fn events_may_be_lost_or_doubled_and_an_overrun_may_drop_another_byte() {
    type Change = fn(&mut Assumptions);
    // The number of RXDRDY, whether ENDRX and RXTO come, and the waiting bytes.
    let cases: [(Change, u32, bool, bool, &[u8; 6]); 12] = [
        (|_| {}, 2, true, false, b"abcdef"),
        (|a| a.ready_at_store = true, 7, true, false, b"abcdef"),
        (
            |a| a.ready_on_framing_error = true,
            3,
            true,
            false,
            b"abcdef",
        ),
        (|a| a.ready_on_overrun = true, 3, true, false, b"abcdef"),
        (|a| a.lost_ready = 1, 1, true, false, b"abcdef"),
        (|a| a.lost_ready = u32::MAX, 0, true, false, b"abcdef"),
        (|a| a.doubled_ready = 1, 3, true, false, b"abcdef"),
        (|a| a.lost_end = 1, 2, false, false, b"abcdef"),
        (|a| a.causeless_timeout = true, 2, true, true, b"abcdef"),
        (|a| a.fifo = 5, 2, true, false, b"abcde\0"),
        (|a| a.overrun_drops_oldest = true, 2, true, false, b"bcdefg"),
        (
            |a| a.overrun_at_start_bit = true,
            2,
            true,
            false,
            b"abcde\0",
        ),
    ];
    for (n, (change, count, ends, times_out, waiting)) in cases.into_iter().enumerate() {
        let mut board = assuming(1, change);
        board.send(b"0abcdefg");
        board.send_symbols(&[LineSymbol::BadStop(b'h')]);
        board.wait(11 * BYTE);
        assert_eq!(ready(&mut board), count, "case {n}");
        assert_eq!(board.take_event(ENDRX), ends, "case {n}");
        assert_eq!(board.take_event(RXTO), times_out, "case {n}");
        assert_eq!(board.get(ERRORSRC), FRAMING | OVERRUN, "case {n}");
        board.set(RXD_MAXCNT, 6);
        board.set(STARTRX, 1);
        board.wait(BYTE);
        assert_eq!(board.bytes(BUFFER, 6), waiting, "case {n}");
        let is_full = waiting[5] != 0;
        assert_eq!(board.take_event(ENDRX), is_full, "only one is lost");
    }
}

#[test]
fn endrx_may_come_before_the_last_rxdrdy() {
    for (end_first, lag) in [(false, 0), (false, 31), (true, 32), (true, 600)] {
        let mut board = assuming(4, |a| a.ready_lag = lag);
        board.send(b"abcd");
        board.wait(6 * BYTE);
        assert!(board.take_event(ENDRX));
        assert_eq!(board.get(CC + 4), if end_first { 3 } else { 4 }, "{lag}");
        assert_eq!(ready(&mut board), 4);
    }
}

#[test]
fn a_late_rxdrdy_comes_before_the_next_byte() {
    let mut board = assuming(8, |a| a.ready_lag = 100 * BYTE);
    let end = board.send(b"abc");
    board.run_until(end).unwrap();
    assert_eq!(ready(&mut board), 2);
    let end = board.send_symbols(&[LineSymbol::BadStop(b'd')]);
    board.run_until(end).unwrap();
    assert_eq!(
        ready(&mut board),
        3,
        "and before a character without a stop bit"
    );
    board.send(b"e");
    board.wait(2 * BYTE);
    board.set(STOPRX, 1);
    board.wait(6 * BYTE);
    assert_eq!(ready(&mut board), 4, "and before RXTO");
}

#[test]
fn rxstarted_may_take_its_time_and_no_byte_is_stored_before() {
    let mut board = assuming(1, |a| a.start_lag = BYTE);
    board.send(b"ab");
    board.wait(3 * BYTE);
    assert!(board.take_event(ENDRX) && board.take_event(RXSTARTED));
    board.set(STARTRX, 1);
    board.wait(BYTE - 1);
    assert!(!board.take_event(RXSTARTED) && !board.take_event(ENDRX));
    board.wait(1);
    assert!(board.take_event(RXSTARTED) && board.take_event(ENDRX));
    assert_eq!(board.bytes(BUFFER, 1), b"b");
}

/// "A start bit is received while the previous data still lies in RXD (previous data is lost)."
#[test]
fn an_overrun_may_come_with_the_start_bit_and_lose_the_byte_before() {
    for (at_start, kept) in [(false, b"bcdefg"), (true, b"bcdefh")] {
        let mut board = assuming(1, |a| a.overrun_at_start_bit = at_start);
        let full = board.send(b"abcdefg");
        board.send(b"h");
        board.run_until(full + BYTE / 2).unwrap();
        assert_eq!(board.get(ERRORSRC), if at_start { OVERRUN } else { 0 });
        board.wait(2 * BYTE);
        assert_eq!(board.get(ERRORSRC), OVERRUN);
        board.set(RXD_MAXCNT, 6);
        board.set(STARTRX, 1);
        board.wait(BYTE);
        assert_eq!(board.bytes(BUFFER, 6), kept);
    }
}

#[test]
fn any_write_to_errorsrc_may_clear_all_causes() {
    for (any, left) in [(false, [FRAMING | BREAK, BREAK]), (true, [0; 2])] {
        let mut board = assuming(8, |a| a.any_write_clears = any);
        board.send_symbols(&[LineSymbol::Break(20)]);
        board.wait(3 * BYTE);
        for (value, left) in [0, FRAMING].into_iter().zip(left) {
            board.set(ERRORSRC, value);
            assert_eq!(board.get(ERRORSRC), left);
        }
    }
}

#[test]
fn rxto_may_not_come() {
    for lost in [0, 1] {
        let mut board = assuming(1, |a| a.lost_timeout = lost);
        board.set(STOPRX, 1);
        board.wait(6 * BYTE);
        assert!(board.take_event(ENDRX));
        assert_eq!(board.take_event(RXTO), lost == 0);
    }
}

#[test]
fn a_start_in_the_middle_of_a_byte_may_drop_it() {
    for drops in [true, false] {
        let mut board = assuming(1, |a| a.start_drops_byte = drops);
        board.set(STOPRX, 1);
        board.wait(6 * BYTE);
        assert!(board.take_event(ENDRX));
        board.send(b"p");
        board.wait(3 * MICROSECOND);
        board.set(STARTRX, 1);
        board.wait(BYTE);
        board.send(b"b");
        board.wait(2 * BYTE);
        assert!(board.take_event(ENDRX));
        assert_eq!(board.bytes(BUFFER, 1) == b"b", drops);
    }
}

#[test]
fn a_second_start_may_be_ignored_and_is_an_error_otherwise() {
    let mut board = receiving(1);
    assert!(board.set_register(STARTRX, 1).is_err());
    let mut board = assuming(1, |a| a.start_twice_is_ignored = true);
    board.set(STARTRX, 1);
    board.send(b"ab");
    board.wait(3 * BYTE);
    assert!(board.take_event(ENDRX));
    assert_eq!(board.bytes(BUFFER, 1), b"a");
}

#[test]
fn endrx_may_come_again_for_the_next_transfer() {
    for when_open in [false, true] {
        let mut board = assuming(1, |a| {
            (a.doubled_end, a.double_lag) = (1, 2 * BYTE);
            a.doubled_when_open = when_open;
        });
        board.send(b"a");
        board.wait(2 * BYTE);
        assert!(board.take_event(ENDRX));
        board.set(STARTRX, 1);
        board.wait(2 * BYTE);
        assert_eq!(board.take_event(ENDRX), when_open);
    }
}

#[test]
fn a_task_that_is_triggered_twice_at_once_may_act_once() {
    for (once, count) in [(false, 2), (true, 1)] {
        let mut board = assuming(8, |a| a.twice_is_once = once);
        // A second channel leads from RXDRDY to the same task.
        board.set(PPI + 0x510 + 8 * 3, RXDRDY);
        board.set(PPI + 0x514 + 8 * 3, COUNT);
        board.set(PPI + 0x504, 1 << 3);
        board.send(b"a");
        board.wait(2 * BYTE);
        assert_eq!(ready(&mut board), count);
    }
}

/// Returns a board whose firmware starts the cycle counter and copies it to RAM forever.
fn copies_the_cycle_counter() -> Board {
    let mut main = [store(0xE000_EDFC, 1 << 24), store(0xE000_1000, 1)].concat();
    main.extend(load(0, 0xE000_1004));
    main.extend(load(1, RAM_START));
    main.extend([0x6802, 0x600A, 0xE7FC]); // ldr r2, [r0]; str r2, [r1]; b .-4
    booted(board_of(&main, &[RETURN]))
}

#[test]
fn a_slow_core_does_less_in_the_same_time_and_its_cycle_counter_knows() {
    let run = |slowness| {
        let mut board = copies_the_cycle_counter();
        board.assume(Assumptions::default().with(|a| a.slowness = slowness));
        let read = |board: &Board| u64::from(board.memory().word(RAM_START).unwrap());
        let (instructions, cycles, began) = (board.instructions(), read(&board), board.now());
        board.wait(30_000);
        let took = board.now() - began;
        assert!(took.abs_diff(read(&board) - cycles) < 30, "{slowness}");
        board.instructions() - instructions
    };
    let full = run(100);
    assert!(run(150).abs_diff(full * 2 / 3) < 3);
    assert!(run(200).abs_diff(full / 2) < 3);
}

#[test]
fn a_slow_core_is_awake_for_longer_and_wakes_as_often() {
    let run = |slowness| {
        let mut board = ticking();
        board.assume(Assumptions::default().with(|a| a.slowness = slowness));
        let (slept, began) = (board.slept(), board.now());
        board.wait(10 * MILLISECOND);
        let awake = (board.now() - began) - (board.slept() - slept);
        (awake, board.trace().activations.len())
    };
    let (awake, ticks) = run(100);
    let (awake_when_slow, ticks_when_slow) = run(300);
    assert_eq!(ticks_when_slow, ticks);
    assert!(awake_when_slow.abs_diff(3 * awake) < 10);
}

#[test]
fn assumptions_come_one_by_one_and_mixed() {
    let each = Assumptions::each();
    for (n, (name, assumptions)) in each.iter().enumerate() {
        assert_ne!(*assumptions, Assumptions::default(), "{name}");
        let others = each.iter().skip(n + 1);
        assert!(others.clone().all(|other| other.0 != *name), "{name}");
        assert!(
            others.clone().all(|other| other.1 != *assumptions),
            "{name}"
        );
    }
    let mut end_first = 0;
    // Lines such as `fifo: 5,`.
    let fields = |assumptions: &Assumptions| {
        let text = format!("{assumptions:#?}");
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let unchanged = fields(&Assumptions::default());
    let mut changed = vec![0; unchanged.len()];
    for seed in 0..200 {
        let mixed = Assumptions::mixed(seed);
        for ((field, unchanged), changed) in fields(&mixed).iter().zip(&unchanged).zip(&mut changed)
        {
            *changed += u32::from(field != unchanged);
        }
        assert_eq!(mixed, Assumptions::mixed(seed));
        assert_ne!(mixed, Assumptions::mixed(seed + 1));
        assert!(mixed.dma_lag < 2 * BYTE, "{mixed:?}");
        assert!(mixed.lost_ready < 4 && mixed.doubled_ready < 4 && mixed.lost_end < 4);
        assert!((100..=150).contains(&mixed.slowness));
        assert!(mixed.fifo == 5 || mixed.fifo == 6);
        end_first += u32::from(mixed.ready_lag >= mixed.dma_lag);
    }
    assert!((40..160).contains(&end_first), "{end_first} of 200");
    for (field, changed) in unchanged.iter().zip(changed) {
        // The first and the last line are no fields. `mixed` never sets `doubled_when_open`.
        let is_changed = field.contains(": ") && !field.contains("doubled_when_open");
        assert_eq!(changed > 20, is_changed, "{field} {changed} of 200");
    }
}
