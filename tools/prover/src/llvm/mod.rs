//! Reads LLVM's assembly language, as `rustc --emit=llvm-ir` writes it.

mod cursor;
mod module;
mod token;
mod types;

pub(crate) use cursor::Cursor;
pub(crate) use module::{Block, Constant, Module};
pub(crate) use token::Token;
pub(crate) use types::Type;
