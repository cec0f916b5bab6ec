//! The types of which there can be any value.

use core::num::NonZeroU32;

use crate::{assume, undecided};

/// A type of which [`any`](crate::any) can make every value.
pub trait Arbitrary: Sized {
    /// Any value of it.
    fn any() -> Self;
}

macro_rules! integer {
    ($($integer:ident $function:ident;)*) => { $(
        impl Arbitrary for $integer {
            fn any() -> Self {
                undecided::$function()
            }
        }
    )* };
}
integer! {
    u8 any_u8;
    u32 any_u32;
    u64 any_u64;
    usize any_usize;
}

impl Arbitrary for u128 {
    fn any() -> Self {
        Self::from(u64::any()) << 64 | Self::from(u64::any())
    }
}

impl Arbitrary for bool {
    fn any() -> Self {
        let bit = u8::any();
        assume(bit < 2);
        bit == 1
    }
}

impl<T: Arbitrary> Arbitrary for Option<T> {
    fn any() -> Self {
        // Both are drawn whatever the first is, so that an input always has the same values.
        let (is_some, value) = (bool::any(), T::any());
        is_some.then_some(value)
    }
}

impl<T: Arbitrary, const LENGTH: usize> Arbitrary for [T; LENGTH] {
    fn any() -> Self {
        core::array::from_fn(|_| T::any())
    }
}

impl Arbitrary for NonZeroU32 {
    fn any() -> Self {
        let value = u32::any();
        assume(value != 0);
        Self::new(value).unwrap_or(Self::MIN)
    }
}
