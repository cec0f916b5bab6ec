//! The subcommands of the framelock command line, as a library so that tests and fuzz targets can
//! drive them without a process.

pub mod decode;
pub mod demo;
pub mod encode;
mod faulty_line;
pub mod input;
mod interrupt;
mod line_errors;
mod line_rate;
pub mod monitor;
pub mod names;
mod numbers;
pub mod screen;
pub mod send;
mod serial;
pub mod setpoints;
pub mod simulate;
mod smooth_motion;
pub mod standard;
pub mod stream;
pub mod trace;
mod view_parts;
