//! Harnesses whose expected outcomes apply to the offline prover, but not to Kani.

#[repr(u8)]
#[allow(dead_code, reason = "its values are made from numbers")]
enum Phase {
    Live,
    Hold,
    Ramp,
    Parked,
}

// expected: failed: code that the compiler considers unreachable
#[kani::proof]
fn value_that_the_enum_does_not_have() {
    let byte: u8 = kani::any_where(|&byte| byte <= 4);
    // This conversion is undefined behaviour, because no variant has the value 4. The prover must find it.
    let phase: Phase = unsafe { core::mem::transmute(byte) };
    let ticks: u8 = match phase {
        Phase::Live => kani::any_where(|&ticks| ticks > 10),
        Phase::Hold => kani::any_where(|&ticks| ticks > 20),
        Phase::Ramp => kani::any(),
        Phase::Parked => 0,
    };
    kani::cover!(ticks == 0);
}

// expected: error: uitofp is not modelled
#[kani::proof]
fn floating_point() {
    let byte: u8 = kani::any();
    assert!(f32::from(byte) * 0.1 < 26.0);
    kani::cover!();
}

/// The assertion holds because the number is prime, but proving the assertion would take too long.
#[kani::proof]
fn proof_that_takes_too_long() {
    let (a, b): (u32, u32) = (kani::any(), kani::any());
    kani::assume(a > 1 && b > 1);
    assert!(u64::from(a) * u64::from(b) != 4_611_686_018_427_387_847);
    kani::cover!();
}
