//! How often a loop runs.

fn sum<const N: usize>() -> u32 {
    let bytes: [u8; N] = kani::any();
    let mut sum = 0_u32;
    let mut i = 0;
    while i < N {
        sum += u32::from(bytes[i]);
        i += 1;
    }
    sum
}

/// Expected: unwinding assertion
#[kani::proof]
#[kani::unwind(4)]
fn bound_that_is_too_small() {
    assert!(sum::<16>() <= 16 * 255);
}

/// Expected: proved
#[kani::proof]
#[kani::unwind(17)]
fn bound_that_is_enough() {
    assert!(sum::<16>() <= 16 * 255);
}

/// Expected: assertion failed: sum::<16>() < 16 * 255
#[kani::proof]
#[kani::unwind(17)]
fn only_the_last_round_is_wrong() {
    assert!(sum::<16>() < 16 * 255);
}
