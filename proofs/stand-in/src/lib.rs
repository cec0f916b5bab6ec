//! Stands in for Kani's library where the proofs are checked without Kani.
//!
//! It offers the part of Kani's interface that the harnesses use, with Kani's meaning, and nothing
//! more. `cargo kani` never sees it: it brings its own crate named `kani`, and this one is a
//! dependency only under `--cfg kani_stand_in`, which `cargo xtask prove --engine cbmc` sets.
//!
//! Whatever the checker must decide on is a function that is declared and nowhere defined:
//!
//! | function | meaning |
//! |---|---|
//! | `any_u8` … `any_u64`, `any_usize` | any value of that width |
//! | `input` | the values from here on are for that type, asked for at that place |
//! | `assume` | only executions in which it holds are looked at |
//! | `cover:FILE:LINE:COLUMN` | some execution must come here with a value that is not 0 |
//!
//! and a harness is a function named `harness:PATH`. What the checker makes of them stands in
//! `xtask/src/prove/llvm/intrinsics.rs`.
#![no_std]

mod arbitrary;

pub use arbitrary::Arbitrary;
pub use kani_macros::{proof, unwind};

mod undecided {
    unsafe extern "C" {
        pub(crate) safe fn any_u8() -> u8;
        pub(crate) safe fn any_u32() -> u32;
        pub(crate) safe fn any_u64() -> u64;
        pub(crate) safe fn any_usize() -> usize;
        pub(crate) safe fn input(
            type_name: *const u8,
            type_name_length: usize,
            file: *const u8,
            file_length: usize,
            line: u32,
        );
        pub(crate) safe fn assume(condition: bool);
    }
}

/// Any value of the type: what follows is checked for all of them.
#[must_use]
#[track_caller]
pub fn any<T: Arbitrary>() -> T {
    let type_name = core::any::type_name::<T>();
    let place = core::panic::Location::caller();
    undecided::input(
        type_name.as_ptr(),
        type_name.len(),
        place.file().as_ptr(),
        place.file().len(),
        place.line(),
    );
    T::any()
}

/// Any value of the type for which `condition` holds.
#[must_use]
#[track_caller]
pub fn any_where<T: Arbitrary, F: FnOnce(&T) -> bool>(condition: F) -> T {
    let value = any();
    assume(condition(&value));
    value
}

/// From here on, only executions in which the condition holds are looked at.
pub fn assume(condition: bool) {
    undecided::assume(condition);
}

/// Demands that some execution comes here, and with the condition true if one is given: what
/// shows that a proof is not about nothing. The message is for the reader.
#[macro_export]
macro_rules! cover {
    () => {
        $crate::cover!(true)
    };
    ($condition:expr $(,)?) => {{
        // Each place is a function of its own, so that each has a result of its own.
        unsafe extern "C" {
            #[link_name = concat!("cover:", file!(), ":", line!(), ":", column!())]
            safe fn cover(condition: bool);
        }
        cover($condition);
    }};
    ($condition:expr, $message:literal $(,)?) => {
        $crate::cover!($condition)
    };
}
