//! Reads LLVM's assembly language as `rustc --emit=llvm-ir` writes it.

mod module;
mod parser;
mod token;

pub(crate) use module::{Block, Constant, Module};
pub(crate) use parser::{Cursor, Type};
pub(crate) use token::Token;
