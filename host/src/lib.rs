//! The subcommands of the framelock command line, as a library so that tests and fuzz targets can
//! drive them without a process.

pub mod decode;
pub mod demo;
pub mod encode;
pub mod input;
pub mod names;
pub mod standard;
pub mod stream;
pub mod trace;
