//! Harnesses without a fault. They check that `any` returns every value of a type and no other value, and that machine
//! operations are modelled correctly.

#[kani::proof]
fn an_integer_may_be_any() {
    let (byte, word): (u8, u32) = (kani::any(), kani::any());
    kani::cover!(byte == 0xA5 && word == 0xDEAD_BEEF, "one of each");
    let (long, size): (i64, usize) = (kani::any(), kani::any());
    kani::cover!(long == i64::MIN && size == usize::MAX, "the ends");
    let wide: u128 = kani::any();
    kani::cover!(
        wide == 0xFEDC_BA98_7654_3210_0123_4567_89AB_CDEF,
        "halves that differ"
    );
    kani::cover!();
}

#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
struct Pair {
    first: u8,
    second: bool,
}

#[kani::proof]
#[kani::unwind(4)]
fn what_is_made_of_integers_may_be_any() {
    let truth: bool = kani::any();
    kani::cover!(truth, "true");
    kani::cover!(!truth, "false");
    let (byte, bytes): (Option<u8>, [u8; 3]) = kani::any();
    kani::cover!(byte.is_none(), "none");
    kani::cover!(byte == Some(0xA5), "some");
    kani::cover!(bytes == [1, 2, 3], "bytes that differ");
    let (pair, expected): (Pair, _) = (
        kani::any(),
        Pair {
            first: 7,
            second: true,
        },
    );
    kani::cover!(pair == expected, "a struct");
}

#[kani::proof]
fn what_is_left_out_never_is() {
    let byte: u8 = kani::any_where(|&byte| byte > 3);
    assert!(byte > 3);
    kani::cover!(byte == 4, "the least that may be");
}

/// Contains the covers of the harness `covers_in_a_function`, which ends with a call of this function.
fn ends(byte: u8) {
    if byte > 1 {
        assert!(byte.checked_sub(1).is_some());
        kani::cover!(byte == 2, "the least");
        kani::cover!(byte == 255, "the greatest");
    }
}

#[kani::proof]
fn covers_in_a_function() {
    ends(kani::any());
}

#[kani::proof]
#[kani::unwind(17)]
fn bound_that_is_enough() {
    let bytes: [u8; 16] = kani::any();
    let (mut sum, mut i) = (0_u32, 0);
    while i < 16 {
        sum += u32::from(bytes[i]);
        i += 1;
    }
    assert!(sum <= 16 * 255);
    kani::cover!(sum == 16 * 255);
}

/// Compares operations on bits, such as counting ones, with calculations bit by bit.
#[kani::proof]
#[kani::unwind(17)]
fn operations_on_bits_are_as_they_are_defined() {
    let word: u16 = kani::any();
    let (mut ones, mut leading, mut trailing, mut i) = (0, 16, 16, 0);
    while i < 16 {
        if word >> i & 1 == 1 {
            ones += 1;
            leading = 15 - i;
        } else if word << (15 - i) == 0 {
            trailing = i + 1;
        }
        i += 1;
    }
    if word & 1 == 1 {
        trailing = 0;
    } else if word != 0 {
        trailing = (word & word.wrapping_neg()).ilog2();
    }
    assert!(word.count_ones() == ones);
    assert!(word.leading_zeros() == leading);
    assert!(word.trailing_zeros() == trailing);
    let [low, high] = word.to_le_bytes();
    assert!(word.swap_bytes() == u16::from(low) << 8 | u16::from(high));
    assert!(u32::from(word).swap_bytes().to_be_bytes() == [low, high, 0, 0]);
    let by: u32 = kani::any_where(|&by| by < 16);
    let twice = u32::from(word) << 16 | u32::from(word);
    assert!(u32::from(word.rotate_left(by)) == twice << by >> 16);
    assert!(u32::from(word.rotate_right(by)) == twice >> by & 0xFFFF);
    kani::cover!(ones == 0);
    kani::cover!(ones == 16);
}

/// Compares arithmetic with calculations in wider numbers, which do not overflow.
#[kani::proof]
fn arithmetic_is_as_it_is_defined() {
    let (a, b): (i8, i8) = (kani::any(), kani::any());
    let (wide_a, wide_b) = (i32::from(a), i32::from(b));
    assert!(a.checked_add(b).map(i32::from) == in_range(wide_a + wide_b));
    assert!(a.checked_sub(b).map(i32::from) == in_range(wide_a - wide_b));
    assert!(a.checked_mul(b).map(i32::from) == in_range(wide_a * wide_b));
    if b != 0 {
        assert!(a.checked_div(b).map(i32::from) == in_range(wide_a / wide_b));
        assert!(i32::from(a.wrapping_rem(b)) == wide_a % wide_b);
    }
    assert!(a.max(b) >= a && a.max(b) >= b && a.min(b) <= a && a.min(b) <= b);
    assert!(i32::from(a.unsigned_abs()) == if wide_a < 0 { -wide_a } else { wide_a });
    let (c, d) = (a.cast_unsigned(), b.cast_unsigned());
    assert!(c.saturating_sub(d) == c.max(d) - d);
    assert!(u32::from(c.saturating_add(d)) == (u32::from(c) + u32::from(d)).min(255));
    assert!(u128::from(c) << 100 >> 100 == u128::from(c));
    assert!(i32::from(a >> 3) == wide_a.div_euclid(8));
    kani::cover!(a == i8::MIN && b == -1, "the quotient is too large");
    kani::cover!();
}

fn in_range(wide: i32) -> Option<i32> {
    (-128..=127).contains(&wide).then_some(wide)
}

/// Copies a number of bytes that the compiler does not know.
#[kani::proof]
#[kani::unwind(5)]
fn any_number_of_bytes_is_copied() {
    let (from, mut to): ([u8; 4], [u8; 4]) = kani::any();
    let (count, before) = (kani::any_where(|&count: &usize| count <= 4), to);
    to[..count].copy_from_slice(&from[..count]);
    let at: usize = kani::any_where(|&at| at < 4);
    assert!(to[at] == if at < count { from[at] } else { before[at] });
    kani::cover!(count == 0, "no byte");
    kani::cover!(count == 4, "all bytes");
}
