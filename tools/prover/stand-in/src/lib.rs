//! Stands in for Kani's library where Kani is not set up.
//!
//! The crate contains the part of Kani's interface that harnesses use, with Kani's meaning. Only the offline prover
//! gives it to the compiler, as the crate `kani`. `cargo kani` never uses it.
//!
//! These functions are only declared here. The offline prover interprets them:
//!
//! | function | meaning |
//! |---|---|
//! | `any_u8` … | returns any value of that type |
//! | `input` | the following values are of this type, and were requested at this source position |
//! | `assume` | executions in which the condition is false are ignored |
//! | `cover` | the condition must be true in some execution |
//!
//! A harness is a function named `harness:PATH`. A static named `unwind:PATH` contains the bound of the harness's
//! loops. The prover's `harness.rs` reads these two names, and its `calls.rs` reads the names in the table.
#![no_std]

mod arbitrary;

pub use arbitrary::Arbitrary;
pub use kani_macros::{Arbitrary, proof, unwind};

mod undecided {
    use core::panic::Location;

    unsafe extern "Rust" {
        pub(crate) safe fn input(type_name: &'static str, place: &'static Location<'static>);
        pub(crate) safe fn assume(condition: bool);
        pub(crate) safe fn cover(condition: bool);
    }
}

/// Returns any value of the type. The rest of the harness is checked for all values.
#[must_use]
#[track_caller]
#[inline]
pub fn any<T: Arbitrary>() -> T {
    undecided::input(core::any::type_name::<T>(), core::panic::Location::caller());
    T::any()
}

/// Returns any value of the type for which `condition` holds.
#[must_use]
#[track_caller]
#[inline]
pub fn any_where<T: Arbitrary, F: FnOnce(&T) -> bool>(condition: F) -> T {
    let value = any();
    assume(condition(&value));
    value
}

/// From here on, ignores executions in which the condition is false.
#[inline]
pub fn assume(condition: bool) {
    undecided::assume(condition);
}

/// Requires that some execution reaches this macro. If a condition is given, the condition must be true in this
/// execution. This shows that a proof is not vacuous. The message is only for readers of the source.
#[macro_export]
macro_rules! cover {
    () => {
        $crate::cover!(true)
    };
    ($condition:expr $(, $message:literal)? $(,)?) => {
        $crate::cover_in_line::<{ line!() }, _>($condition, || ())
    };
}

/// The function that [`cover!`] calls. Each use of the macro, in each instance of a generic function, has its own type
/// of `_place`. So each use has its own instance of this function, and the prover checks every instance.
#[doc(hidden)]
#[inline(never)]
pub fn cover_in_line<const LINE: u32, Place: FnOnce()>(condition: bool, _place: Place) {
    undecided::cover(condition);
}
