//! Tests of each single assumption about the chip.

use crate::board::ticking;
use crate::boards::*;
use nrf52840_emulator::{Assumptions, Board, LineSymbol, MICROSECOND, MILLISECOND, RAM_START};

/// The cycles of a byte at 1 Mbaud.
const BYTE: u64 = 10 * MICROSECOND;

fn assuming(size: u32, change: impl FnOnce(&mut Assumptions)) -> Board {
    let mut board = receiving(size);
    board.assume(Assumptions::default().with(change));
    board
}

/// Receives one byte. Six more wait in the FIFO, the next one finds no room, and the last one has no stop bit.
#[test]
fn events_may_be_lost_or_doubled_and_an_overrun_may_drop_another_byte() {
    type Change = fn(&mut Assumptions);
    // Whether ENDRX and RXTO come, and the waiting bytes.
    let cases: [(Change, bool, bool, &[u8; 6]); 6] = [
        (|_| {}, true, false, b"abcdef"),
        (|a| a.lost_end = 1, false, false, b"abcdef"),
        (|a| a.causeless_timeout = true, true, true, b"abcdef"),
        (|a| a.fifo = 5, true, false, b"abcde\0"),
        (|a| a.overrun_drops_oldest = true, true, false, b"bcdefg"),
        (|a| a.overrun_at_start_bit = true, true, false, b"abcde\0"),
    ];
    for (n, (change, ends, times_out, waiting)) in cases.into_iter().enumerate() {
        let mut board = assuming(1, change);
        board.send(b"0abcdefg");
        board.send_symbols(&[LineSymbol::BadStop(b'h')]);
        board.wait(11 * BYTE);
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
    for (at_start, waiting) in [(false, b"bcdefg"), (true, b"bcdefh")] {
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
        assert_eq!(board.bytes(BUFFER, 6), waiting);
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
fn a_second_start_may_be_ignored() {
    let mut board = assuming(1, |a| a.start_twice_is_ignored = true);
    board.set(STARTRX, 1);
    board.send(b"ab");
    board.wait(3 * BYTE);
    assert!(board.take_event(ENDRX));
    assert_eq!(board.bytes(BUFFER, 1), b"a");
}

#[test]
fn endrx_may_come_again_but_not_for_the_next_transfer() {
    for starts in [false, true] {
        let mut board = assuming(1, |a| (a.doubled_end, a.double_lag) = (1, 2 * BYTE));
        board.send(b"a");
        board.wait(2 * BYTE);
        assert!(board.take_event(ENDRX));
        if starts {
            board.set(STARTRX, 1);
        }
        board.wait(2 * BYTE);
        assert_eq!(board.take_event(ENDRX), !starts);
    }
}

/// The firmware starts the cycle counter and copies it to RAM forever.
#[test]
fn a_slow_core_does_less_in_the_same_time_and_its_cycle_counter_knows() {
    let mut main = [store(0xE000_EDFC, 1 << 24), store(0xE000_1000, 1)].concat();
    main.extend(load(0, 0xE000_1004));
    main.extend(load(1, RAM_START));
    main.extend([0x6802, 0x600A, 0xE7FC]); // ldr r2, [r0]; str r2, [r1]; b .-4
    let run = |slowness| {
        let mut board = booted(board_of(&main, &[RETURN]));
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

/// A mix of assumptions is the same each time, and each deviation occurs in some mixes, but not in all.
#[test]
fn assumptions_come_one_by_one_and_mixed() {
    // Lines such as `fifo: 5,`. The first and the last line are no fields.
    let fields = |assumptions: &Assumptions| {
        let text = format!("{assumptions:#?}");
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let usual = fields(&Assumptions::default());
    let deviations = Assumptions::each();
    let single = deviations.iter().map(|(_, one)| fields(one));
    let mixes = (0..200).map(|seed| {
        assert_eq!(Assumptions::mixed(seed), Assumptions::mixed(seed));
        fields(&Assumptions::mixed(seed))
    });
    let changed = |fields: &[Vec<String>], line: usize| {
        let changed = fields.iter().filter(|fields| fields[line] != usual[line]);
        changed.count()
    };
    let (single, mixes): (Vec<_>, Vec<_>) = (single.collect(), mixes.collect());
    for (line, field) in usual.iter().enumerate() {
        let is_deviation = field.contains(": ");
        let is_single = is_deviation && !field.contains("lost_timeout");
        assert_eq!(changed(&single, line), usize::from(is_single), "{field}");
        let in_mixes = changed(&mixes, line);
        assert_eq!((20..180).contains(&in_mixes), is_deviation, "{field}");
    }
}
