//! What would pass a checker that does not ask whether anything was looked at.

/// Expected: vacuous
#[kani::proof]
#[kani::unwind(2)]
fn assumption_that_nothing_fulfils() {
    let byte: u8 = kani::any();
    kani::assume(byte > 3 && byte < 2);
    assert!(byte == 0x41);
}

/// Expected: is never hit
#[kani::proof]
#[kani::unwind(2)]
fn cover_that_nothing_hits() {
    let byte: u8 = kani::any();
    kani::cover!(u16::from(byte) == 0x141, "no byte");
}

/// Expected: is never hit
#[kani::proof]
#[kani::unwind(2)]
fn cover_in_code_that_nothing_reaches() {
    let byte: u8 = kani::any();
    if u16::from(byte) > 0xFF {
        kani::cover!(true, "not here");
    }
}

/// Expected: proved
#[kani::proof]
#[kani::unwind(2)]
fn two_covers_in_one_function_are_two() {
    let byte: u8 = kani::any();
    kani::assume(byte != 0);
    kani::cover!(byte == 1, "the least");
    kani::cover!(byte == 255, "the greatest");
    assert!(byte.checked_sub(1).is_some());
}

/// Expected: assertion failed: byte > 1
#[kani::proof]
#[kani::unwind(2)]
fn assumption_that_is_too_weak() {
    let byte: u8 = kani::any_where(|&byte| byte > 0);
    assert!(byte > 1);
}
