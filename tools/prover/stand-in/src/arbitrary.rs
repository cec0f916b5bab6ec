//! The types for which [`any`](crate::any) can return every value.

use crate::assume;

/// A type for which [`any`](crate::any) can return every value.
pub trait Arbitrary: Sized {
    /// Returns any value of the type.
    fn any() -> Self;
}

macro_rules! integers {
    ($($any:ident: $unsigned:ident $signed:ident,)*) => { $(
        unsafe extern "Rust" {
            safe fn $any() -> $unsigned;
        }

        impl Arbitrary for $unsigned {
            #[inline]
            fn any() -> Self {
                $any()
            }
        }

        impl Arbitrary for $signed {
            #[inline]
            fn any() -> Self {
                $any().cast_signed()
            }
        }
    )* };
}
integers! {
    any_u8: u8 i8,
    any_u16: u16 i16,
    any_u32: u32 i32,
    any_u64: u64 i64,
    any_u128: u128 i128,
    any_usize: usize isize,
}

impl Arbitrary for bool {
    #[inline]
    fn any() -> Self {
        let bit = u8::any();
        assume(bit < 2);
        bit == 1
    }
}

impl<T: Arbitrary> Arbitrary for Option<T> {
    #[inline]
    fn any() -> Self {
        // Always draw both values, so that every input consists of the same number of values.
        let (is_some, value) = (bool::any(), T::any());
        is_some.then_some(value)
    }
}

impl<T: Arbitrary, const LENGTH: usize> Arbitrary for [T; LENGTH] {
    #[inline]
    fn any() -> Self {
        core::array::from_fn(|_| T::any())
    }
}

macro_rules! tuples {
    ($(($($part:ident)*))*) => { $(
        impl<$($part: Arbitrary),*> Arbitrary for ($($part,)*) {
            #[inline]
            fn any() -> Self {
                ($($part::any(),)*)
            }
        }
    )* };
}
tuples! { (A) (A B) (A B C) (A B C D) (A B C D E) (A B C D E F) }
