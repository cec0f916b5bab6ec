//! Stands in for Kani's library where Kani is not set up.
//!
//! It has the part of Kani's interface that harnesses use, with Kani's meaning. `cargo kani` never
//! sees it: the offline prover hands it to the compiler as the crate `kani`.
//!
//! What the checker decides is a function that is declared and nowhere defined:
//!
//! | function | meaning |
//! |---|---|
//! | `any_u8` … | any value of that type |
//! | `input` | the values that follow are for that type, asked for at that place |
//! | `assume` | only executions in which it holds are looked at |
//! | `cover` | some execution comes here with a value that is not 0 |
//!
//! A harness is a function named `harness:PATH`; a number named `unwind:PATH` is the bound of its
//! loops. The prover's `calls.rs` and `compile.rs` read these names.
#![no_std]

mod arbitrary;

pub use arbitrary::Arbitrary;
pub use kani_macros::{Arbitrary, proof, solver, unwind};

mod undecided {
    use core::panic::Location;

    unsafe extern "Rust" {
        pub(crate) safe fn input(type_name: &'static str, place: &'static Location<'static>);
        pub(crate) safe fn assume(condition: bool);
        pub(crate) safe fn cover(condition: bool);
    }
}

/// Any value of the type: what follows is checked for all of them.
#[must_use]
#[track_caller]
#[inline]
pub fn any<T: Arbitrary>() -> T {
    undecided::input(core::any::type_name::<T>(), core::panic::Location::caller());
    T::any()
}

/// Any value of the type for which `condition` holds.
#[must_use]
#[track_caller]
#[inline]
pub fn any_where<T: Arbitrary, F: FnOnce(&T) -> bool>(condition: F) -> T {
    let value = any();
    assume(condition(&value));
    value
}

/// From here on, only executions in which the condition holds are looked at.
#[inline]
pub fn assume(condition: bool) {
    undecided::assume(condition);
}

/// Demands that some execution comes here, with the condition true if one is given. It shows that a
/// proof is about something. The message is for the reader.
#[macro_export]
macro_rules! cover {
    () => {
        $crate::cover!(true)
    };
    ($condition:expr $(, $message:literal)? $(,)?) => {
        $crate::cover_in_line::<{ line!() }, _>($condition, || ())
    };
}

/// What [`cover!`] calls. Each place, in each instance of a generic function, has a type of `_place`
/// of its own, so that this is a function of its own, and the prover asks for each.
#[doc(hidden)]
#[inline(never)]
pub fn cover_in_line<const LINE: u32, Place: FnOnce()>(condition: bool, _place: Place) {
    undecided::cover(condition);
}
