//! From LLVM's intermediate representation, which every Rust compiler writes, to C for CBMC.
//!
//! CBMC reads C; Kani's own translation from Rust is only to be had with Kani. This one takes what
//! the compiler makes of the harnesses after its optimisations: whole numbers in single
//! assignment, and arrays of bytes for what has an address. It writes that down as C, a statement
//! for each instruction. It knows no more than that needs: what it does not know is an error.
#![expect(
    clippy::indexing_slicing,
    reason = "places of blocks and tokens that were just counted; a wrong one is a bug here, and ends the program"
)]

mod cursor;
mod emit;
mod function;
mod instruction;
mod intrinsics;
mod ir;
mod lexer;
mod order;
mod panics;
mod parse;
mod statement;

pub(crate) use emit::{END_OF_HARNESS, program};
pub(crate) use intrinsics::INPUT;
pub(crate) use ir::Module;
