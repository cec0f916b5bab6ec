//! Any value is every value of its type, and no other.

use core::num::NonZeroU32;

/// Expected: proved
#[kani::proof]
#[kani::unwind(2)]
fn an_integer_may_be_any() {
    let (byte, word): (u8, u32) = (kani::any(), kani::any());
    kani::cover!(byte == 0xA5 && word == 0xDEAD_BEEF, "one of each");
    let (long, size): (u64, usize) = (kani::any(), kani::any());
    kani::cover!(long == u64::MAX && size == 0, "the ends");
    let wide: u128 = kani::any();
    kani::cover!(
        wide == 0xFEDC_BA98_7654_3210_0123_4567_89AB_CDEF,
        "halves that differ"
    );
}

/// Expected: proved
#[kani::proof]
#[kani::unwind(4)]
fn what_is_made_of_integers_may_be_any() {
    let truth: bool = kani::any();
    kani::cover!(truth, "true");
    kani::cover!(!truth, "false");
    let byte: Option<u8> = kani::any();
    kani::cover!(byte.is_none(), "none");
    kani::cover!(byte == Some(0xA5), "some");
    let bytes: [u8; 3] = kani::any();
    kani::cover!(bytes == [1, 2, 3], "bytes that differ");
}

/// Expected: proved
#[kani::proof]
#[kani::unwind(2)]
fn what_is_left_out_never_is() {
    let rate: NonZeroU32 = kani::any();
    kani::cover!(rate == NonZeroU32::MIN, "the least");
    kani::cover!(rate == NonZeroU32::MAX, "the greatest");
    assert!(rate.get() != 0);
    let byte: u8 = kani::any_where(|&byte| byte > 3);
    kani::cover!(byte == 4, "the least that may be");
    assert!(byte > 3);
}
