//! The types of which there can be any value.

use core::num::NonZero;

use crate::{assume, undecided};

/// A type of which [`any`](crate::any) can make every value.
pub trait Arbitrary: Sized {
    /// Any value of it.
    fn any() -> Self;
}

macro_rules! integer {
    ($($unsigned:ident $signed:ident $function:ident;)*) => { $(
        impl Arbitrary for $unsigned {
            fn any() -> Self {
                undecided::$function()
            }
        }

        impl Arbitrary for $signed {
            fn any() -> Self {
                $unsigned::any().cast_signed()
            }
        }
    )* };
}
integer! {
    u8 i8 any_u8;
    u16 i16 any_u16;
    u32 i32 any_u32;
    u64 i64 any_u64;
    usize isize any_usize;
}

impl Arbitrary for u128 {
    fn any() -> Self {
        Self::from(u64::any()) << 64 | Self::from(u64::any())
    }
}

impl Arbitrary for i128 {
    fn any() -> Self {
        u128::any().cast_signed()
    }
}

impl Arbitrary for bool {
    fn any() -> Self {
        let bit = u8::any();
        assume(bit < 2);
        bit == 1
    }
}

impl Arbitrary for char {
    fn any() -> Self {
        let value = Self::from_u32(u32::any());
        assume(value.is_some());
        value.unwrap_or_default()
    }
}

impl<T: Arbitrary> Arbitrary for Option<T> {
    fn any() -> Self {
        // Both are drawn whatever the first is, so that an input always has the same values.
        let (is_some, value) = <(bool, T)>::any();
        is_some.then_some(value)
    }
}

impl<T: Arbitrary, const LENGTH: usize> Arbitrary for [T; LENGTH] {
    fn any() -> Self {
        core::array::from_fn(|_| T::any())
    }
}

macro_rules! tuple {
    ($($part:ident)*) => {
        impl<$($part: Arbitrary),*> Arbitrary for ($($part,)*) {
            fn any() -> Self {
                ($($part::any(),)*)
            }
        }
    };
}
tuple!(A);
tuple!(A B);
tuple!(A B C);
tuple!(A B C D);

macro_rules! non_zero {
    ($($integer:ident)*) => { $(
        impl Arbitrary for NonZero<$integer> {
            fn any() -> Self {
                let value = $integer::any();
                assume(value != 0);
                Self::new(value).unwrap_or(Self::MIN)
            }
        }
    )* };
}
non_zero!(u8 u16 u32 u64 u128 usize);
