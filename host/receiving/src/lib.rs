//! Receivers for programs on a computer: the command line, the simulation and the page. The user chooses the frames and
//! the receiver at run time.
//!
//! ```text
//!  name or description ─► Protocol ─┐
//!                          Policy ──┴─► AnyLine ─► TrackedLine ─► outcome of each byte
//! ```
//!
//! # Examples
//! ```
//! use framelock_receiving::{AnyLine, Policy, Protocol, TrackedLine};
//!
//! let protocol = Protocol::named("bin")?;
//! let mut line = TrackedLine::new(AnyLine::new(&protocol, Policy::Framelock)?);
//! let mut frames = Vec::new();
//! for byte in *b"?AB\0xyz\rAB" {
//!     let outcomes = line.push(byte);
//!     frames.extend(outcomes.into_iter().filter(|piece| piece.discarded.is_none()));
//! }
//! assert_eq!((frames.len(), frames[0].from), (1, 1));
//! assert_eq!(line.pending(), b"AB");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod any_line;
mod protocol;
mod standstill;
mod tracked_line;

pub use any_line::{AnyLine, LineError, Policy};
pub use protocol::{Protocol, ProtocolError};
pub use standstill::Standstill;
pub use tracked_line::{Piece, TrackedLine};
