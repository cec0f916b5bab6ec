//! Values of Rust in the memory of C, and values of C.

use core::mem::{self, MaybeUninit};
use core::{ptr, slice};

use crate::layout::framelock_layout;

/// What is in such a memory. All zeros, as static variables of C begin, is `Nothing`: with this `repr` the
/// discriminant comes first.
#[repr(C, u8)]
pub(crate) enum Content<T> {
    /// It is not initialised.
    Nothing = 0,
    Something(T),
}

/// A struct of the header, whose size C knows, for a value that only Rust knows.
pub(crate) trait Memory: Sized {
    type Value;

    /// So that a struct of the wrong size does not compile.
    const FITS: () = assert!(
        size_of::<Content<Self::Value>>() <= size_of::<Self>()
            && align_of::<Content<Self::Value>>() <= align_of::<Self>()
            && !mem::needs_drop::<Self::Value>(),
        "the struct has too few bytes for its value, or is not aligned as it must be; or C would have to drop it"
    );

    fn value(&self) -> Option<&Self::Value> {
        const { Self::FITS };
        // SAFETY: it has room here, and is aligned: FITS. It is here: the header allows its functions only
        // memory that `write` below has written or that is all zeros, and both are a `Content`. Others of
        // these functions may not run meanwhile, says the header: it is not changed while it is borrowed.
        match unsafe { &*ptr::from_ref(self).cast() } {
            Content::Something(value) => Some(value),
            Content::Nothing => None,
        }
    }

    fn value_mut(&mut self) -> Option<&mut Self::Value> {
        const { Self::FITS };
        // SAFETY: as in `value`; and `self` is borrowed mutably for as long as the value is.
        match unsafe { &mut *ptr::from_mut(self).cast() } {
            Content::Something(value) => Some(value),
            Content::Nothing => None,
        }
    }

    /// The struct has nothing but `MaybeUninit`s, so C need not have written to it before.
    fn write(&mut self, content: Content<Self::Value>) {
        const { Self::FITS };
        // SAFETY: it has room here, and is aligned: FITS. What was here need not be dropped: FITS.
        unsafe { ptr::from_mut(self).cast::<Content<_>>().write(content) }
    }
}

impl framelock_layout {
    /// As C has it that writes nothing down.
    // SAFETY: it has integers, bools, pointers, and a reference that may be none: zeros are each of them.
    pub(crate) const NONE: Self = unsafe { MaybeUninit::zeroed().assume_init() };
}

// SAFETY: its pointers are to constants, or to what the header tells C to leave alone while it is in use.
unsafe impl Sync for framelock_layout {}

/// So many values of C's, one behind the other; nothing if they are at NULL.
pub(crate) fn values<T>(first: *const T, count: usize) -> Option<&'static [T]> {
    match count {
        0 => Some(&[]),
        // SAFETY: the header asks for so many values there, and that they stay as they are while a receiver
        // uses them. `T` is what the header has there: integers, bools of C and pointers.
        _ => (!first.is_null()).then(|| unsafe { slice::from_raw_parts(first, count) }),
    }
}

/// So many bytes of C's, or structs of `MaybeUninit`s, to write to; nothing if they are at NULL.
pub(crate) fn values_mut<T>(first: *mut T, count: usize) -> Option<&'static mut [T]> {
    // SAFETY: the header asks for so many there, and that nobody else touches them while this function runs, or a
    // receiver uses them.
    (!first.is_null()).then(|| unsafe { slice::from_raw_parts_mut(first, count) })
}

/// A struct of the header that is, byte for byte, a struct of Rust.
///
/// # Safety
/// Both have the same fields at the same places: [`same`] compares them.
pub(crate) unsafe trait Same {
    type Rust: 'static;
}

/// The same values for Rust.
pub(crate) fn as_rust<T: Same>(values: &'static [T]) -> &'static [T::Rust] {
    // SAFETY: the types are the same: `Same`.
    unsafe { slice::from_raw_parts(values.as_ptr().cast(), values.len()) }
}

/// Compares the sizes, alignments and fields of a struct of the header and one of Rust when it is compiled.
macro_rules! same {
    ($c:ident as $rust:ident: $($field:ident = $of_rust:ident),*) => {
        // SAFETY: what follows does not compile otherwise. The fields have the same types: `same_types` is compiled.
        unsafe impl $crate::memory::Same for $c {
            type Rust = $rust;
        }

        const _: () = {
            use core::mem::offset_of;
            const fn same_types(c: &mut $c, rust: &$rust) {
                $(c.$field = rust.$of_rust;)*
            }
            let _ = same_types;
            assert!(size_of::<$c>() == size_of::<$rust>() && align_of::<$c>() == align_of::<$rust>());
            $(assert!(offset_of!($c, $field) == offset_of!($rust, $of_rust));)*
        };
    };
}
pub(crate) use same;
