//! Values of Rust in the memory of C.

use core::mem::MaybeUninit;
use core::ptr;

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
    type Value: Copy;

    /// So that a struct of the wrong size does not compile.
    const FITS: () = assert!(
        size_of::<Content<Self::Value>>() <= size_of::<Self>()
            && align_of::<Content<Self::Value>>() <= align_of::<Self>(),
        "the struct has too few bytes for its value, or is not aligned as it must be"
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

    fn write(memory: &mut MaybeUninit<Self>, content: Content<Self::Value>) {
        const { Self::FITS };
        // SAFETY: it has room here, and is aligned: FITS. What was here is `Copy`: it need not be dropped.
        unsafe { memory.as_mut_ptr().cast::<Content<_>>().write(content) }
    }
}
