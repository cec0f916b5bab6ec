//! Tests of the assumption `slowness`, and of [`Assumptions::each`] and [`Assumptions::mixed`]. The scripts test all
//! other assumptions except `dma_lag`.

use crate::board::ticking;
use crate::boards::*;
use nrf52840_emulator::{Assumptions, Board, MILLISECOND, RAM_START};

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

/// The same seed gives the same mix of assumptions. Each field deviates in some mixes, but not in all.
#[test]
fn assumptions_come_one_by_one_and_mixed() {
    let fields = |assumptions: &Assumptions| {
        let text = format!("{assumptions:?}");
        text.split(", ").map(str::to_owned).collect::<Vec<_>>()
    };
    let usual = fields(&Assumptions::default());
    let deviations = Assumptions::each();
    let single = deviations.iter().map(|(_, one)| fields(one)).collect();
    let mixes = (0..200).map(|seed| {
        assert_eq!(Assumptions::mixed(seed), Assumptions::mixed(seed));
        fields(&Assumptions::mixed(seed))
    });
    let mixes = mixes.collect();
    let changed = |all: &Vec<Vec<String>>, place: usize| {
        let changed = all.iter().filter(|one| one[place] != usual[place]);
        changed.count()
    };
    for (place, field) in usual.iter().enumerate() {
        assert!(changed(&single, place) > 0, "{field}");
        assert!((20..180).contains(&changed(&mixes, place)), "{field}");
    }
    assert!(single.iter().all(|one| *one != usual));
}
