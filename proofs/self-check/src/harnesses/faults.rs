//! What panics, or is undefined.

/// Expected: attempt to divide by zero
#[kani::proof]
#[kani::unwind(2)]
fn division_by_zero() {
    let divisor: u8 = kani::any();
    assert!(100 / divisor <= 100);
}

/// Expected: index out of bounds
#[kani::proof]
#[kani::unwind(8)]
fn index_out_of_bounds() {
    let bytes: [u8; 7] = kani::any();
    let index: usize = kani::any_where(|&index| index <= 7);
    assert!(bytes[index] < 255 || bytes[index] == 255);
}

/// Expected: slice index out of range
#[kani::proof]
#[kani::unwind(8)]
fn slice_out_of_bounds() {
    let bytes: [u8; 7] = kani::any();
    let start: usize = kani::any();
    assert!(bytes[start..].len() <= 7);
}

/// Expected: attempt to add with overflow
#[kani::proof]
#[kani::unwind(2)]
fn overflow() {
    let count: u8 = kani::any();
    assert!(count + 1 > 0);
}

/// Expected: attempt to shift left with overflow
#[kani::proof]
#[kani::unwind(2)]
fn shift_too_far() {
    let by: u32 = kani::any();
    assert!(1_u64 << by != 0);
}

/// Expected: assertion failed: byte != 0x41
#[kani::proof]
#[kani::unwind(2)]
fn false_assertion() {
    let byte: u8 = kani::any();
    assert!(byte != 0x41);
}

/// Expected: unwrap
#[kani::proof]
#[kani::unwind(2)]
fn unwrap_of_nothing() {
    let byte: Option<u8> = kani::any();
    assert!(byte.unwrap() < 255 || byte == Some(255));
}

#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Phase {
    Live,
    Hold,
}

/// Expected: what the compiler assumes
#[kani::proof]
#[kani::unwind(2)]
fn value_that_the_enum_does_not_have() {
    let byte: u8 = kani::any_where(|&byte| byte <= 2);
    // It is not sound: 2 is neither. That is what must be found.
    let phase: Phase = unsafe { core::mem::transmute(byte) };
    assert!(phase == Phase::Live || phase == Phase::Hold);
}
