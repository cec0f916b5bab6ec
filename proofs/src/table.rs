//! Theorem 2: bounded state. From each of the seven states of the lecture's machine, each byte leads to the next state
//! that the table gives (M1). The module `no_panic` proves the rest: after any stream, fewer bytes are pending in a
//! receiver than a frame has.

use framelock::lecture::State;

use crate::states::any_lecture;

#[kani::proof]
#[kani::unwind(8)]
fn states_are_numbered() {
    let index: usize = kani::any_where(|&index| index < 7);
    assert!(State::ALL[index] as usize == index);
    kani::cover!(index == 6, "the last state");
}

#[kani::proof]
#[kani::unwind(8)]
fn lecture_steps_by_it() {
    let before = any_lecture();
    let byte: u8 = kani::any();
    let mut after = before;
    let committed = after.push(byte);
    let taken = before.pending();
    let next = match (taken, byte) {
        (0, b'A') => 1,
        (1, b'B') => 2,
        (2..=5, _) => taken + 1,
        _ => 0,
    };
    assert!(after.pending() == next);
    let stored = |place, otherwise| if taken == place { byte } else { otherwise };
    assert!(after.temp.pitch == stored(3, before.temp.pitch));
    assert!(after.temp.roll == stored(4, before.temp.roll));
    assert!(after.temp.yaw == stored(5, before.temp.yaw));
    let complete = before.state == State::Terminator && byte == b'\r';
    assert!(committed == complete.then_some(before.temp));
    kani::cover!(
        before.state == State::SyncB && byte == b'A',
        "the row that framelock changes"
    );
    kani::cover!(complete, "a commit");
}
