//! A serial line simulated bit by bit, with faults and with framelock's receivers at its end.
//!
//! The crate never waits, opens no files and displays nothing. Time is simulated, randomness comes from a seed,
//! and the same parameters give the same numbers on every computer. The simulation therefore runs in a command line, in
//! a test and, compiled for `wasm32-unknown-unknown`, in a browser.
//!
//! ```text
//!  sender ─► line ─► uart ─► byte faults ─► station: receiver ─► tally
//!   motion    ▲                      │          ▲
//!           noise                    └────► the bytes that really arrived
//! ```
//!
//! # Example
//!
//! Measures how many intact frames the lecture's machine and framelock's receiver lose if one byte
//! in a hundred is lost:
//!
//! ```
//! use framelock_simulation::{Parameters, Protocol, run_all};
//!
//! # fn main() -> anyhow::Result<()> {
//! let bin = Protocol::named("bin").map_err(anyhow::Error::msg)?;
//! let tally = run_all(&bin, &Parameters { lose: 0.01, trials: 4, ..Parameters::DEFAULT })?;
//! let [lecture, .., framelock] = &tally.receivers[..] else { panic!("four receivers") };
//! assert!(lecture.lost_intact > 100);
//! assert_eq!(framelock.lost_intact, 0);
//! # Ok(())
//! # }
//! ```
//!
//! With the feature `clap`, a [`Shape`], an [`Axis`] or a [`Policy`] can be the value of a command-line option.

#![forbid(unsafe_code)]
#![allow(
    clippy::indexing_slicing,
    reason = "an index out of range is a bug of this program"
)]

mod frames;
mod line;
mod motion;
mod parameters;
mod station;
mod trial;
mod uart;

pub use framelock_oracles::Seed;
pub use framelock_receiving::{Policy, Protocol};
pub use frames::{Payload, Transmission, examples, transmissions};
pub use line::check_rate;
pub use motion::{Axis, LEVEL, Motion, Shape, between};
pub use parameters::Parameters;
pub use station::ReceiverTally;
pub use trial::{LineTally, Tally, run_all};
