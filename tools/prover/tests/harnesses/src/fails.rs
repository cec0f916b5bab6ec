//! Harnesses with one fault each.

fn sum(bytes: [u8; 16]) -> u32 {
    let (mut sum, mut i) = (0, 0);
    while i < 16 {
        sum += u32::from(bytes[i]);
        i += 1;
    }
    sum
}

// expected: unwinding_too_small: unwinding assertion
#[kani::proof]
#[kani::unwind(4)]
fn bound_that_is_too_small() {
    assert!(sum(kani::any()) <= 16 * 255);
    kani::cover!();
}

// expected: failed: assertion failed: sum(kani::any()) < 16 * 255
#[kani::proof]
#[kani::unwind(17)]
fn only_the_last_round_is_wrong() {
    assert!(sum(kani::any()) < 16 * 255);
    kani::cover!();
}

// expected: cover_unsatisfied: in line
#[kani::proof]
fn end_that_nothing_reaches() {
    let byte: u8 = kani::any();
    kani::assume(byte > 3);
    kani::assume(byte < 2);
    assert!(byte == 0x41);
    kani::cover!();
}

// expected: vacuous: no input reaches the end
#[kani::proof]
fn end_without_cover() {
    let byte: u8 = kani::any();
    kani::assume(byte > 3);
    kani::assume(byte < 2);
}

// expected: cover_unsatisfied: fails::cover_that_nothing_hits
#[kani::proof]
fn cover_that_nothing_hits() {
    let byte: u8 = kani::any();
    kani::cover!(u16::from(byte) == 0x141, "no byte");
    kani::cover!();
}

// expected: cover_unsatisfied: fails::cover_in_code
#[kani::proof]
fn cover_in_code_that_nothing_reaches() {
    let byte: u8 = kani::any();
    if u16::from(byte) > 0xFF {
        kani::cover!(true, "not here");
    }
    kani::cover!();
}

/// This function has two instances, and in one of them the cover cannot be satisfied.
fn covers_in<const LIMIT: u16>(byte: u8) {
    kani::cover!(u16::from(byte) > LIMIT);
}

// expected: cover_unsatisfied: covers_in<255>
#[kani::proof]
fn cover_in_one_of_two_instances() {
    let byte: u8 = kani::any();
    covers_in::<0xFF>(byte);
    covers_in::<0xFE>(byte);
}

// expected: failed: src/fails.rs:
#[kani::proof]
fn false_assertion() {
    let bytes: [u8; 2] = kani::any();
    assert!(bytes != [0x41, 0x0D]);
    kani::cover!();
}

// expected: failed: assertion failed: byte > 1
#[kani::proof]
fn assumption_that_is_too_weak() {
    let byte: u8 = kani::any_where(|&byte| byte > 0);
    assert!(byte > 1);
    kani::cover!();
}

// expected: failed: text: cover: the byte is an A at
#[kani::proof]
fn assertion_with_a_text() {
    let byte: u8 = kani::any();
    assert!(byte != 0x41, "cover: the byte is an A");
    kani::cover!();
}

// expected: failed: panic_const_add_overflow at tools/prover/tests/harnesses/src/fails.rs:105:13: assert!(count + 1 > 0);
#[kani::proof]
fn overflow() {
    let count: u8 = kani::any();
    assert!(count + 1 > 0);
    kani::cover!();
}

// expected: failed: panic_const_shl_overflow
#[kani::proof]
fn shift_too_far() {
    let by: u32 = kani::any();
    assert!(1_u64 << by != 0);
    kani::cover!();
}

// expected: failed: panic_const_div_by_zero
#[kani::proof]
fn division_by_zero() {
    let divisor: u8 = kani::any();
    assert!(100 / divisor <= 100);
    kani::cover!();
}

// expected: failed: panic_bounds_check
#[kani::proof]
fn index_out_of_bounds() {
    let bytes: [u8; 7] = kani::any();
    let index: usize = kani::any_where(|&index| index <= 7);
    assert!(u16::from(bytes[index]) < 256);
    kani::cover!();
}

// expected: failed: dereference failure
#[kani::proof]
fn read_out_of_bounds() {
    let bytes: [u8; 7] = kani::any();
    let index: usize = kani::any_where(|&index| index <= 7);
    // For the index 7, this read is out of bounds. The prover must find it.
    let byte = unsafe { bytes.as_ptr().add(index).read() };
    kani::cover!(byte == 0x41);
}

// expected: failed: slice_index
#[kani::proof]
fn slice_out_of_bounds() {
    let bytes: [u8; 7] = kani::any();
    let start: usize = kani::any();
    assert!(bytes[start..].len() <= 7);
    kani::cover!();
}

// expected: failed: unwrap
#[kani::proof]
fn unwrap_of_nothing() {
    let byte: Option<u8> = kani::any();
    assert!(u16::from(byte.unwrap()) < 256);
    kani::cover!();
}

// expected: failed: assertion failed: to[3] == before[3]
#[kani::proof]
#[kani::unwind(5)]
fn last_copied_byte_differs() {
    let (from, mut to): ([u8; 4], [u8; 4]) = kani::any();
    let (count, before) = (kani::any_where(|&count: &usize| count <= 4), to);
    to[..count].copy_from_slice(&from[..count]);
    assert!(to[3] == before[3]);
    kani::cover!();
}

// expected: unwinding_too_small: unwinding assertion
#[kani::proof]
#[kani::unwind(4)]
fn more_bytes_are_copied_than_the_bound_allows() {
    let (from, mut to): ([u8; 4], [u8; 4]) = kani::any();
    let count = kani::any_where(|&count: &usize| count <= 4);
    to[..count].copy_from_slice(&from[..count]);
    kani::cover!();
}
