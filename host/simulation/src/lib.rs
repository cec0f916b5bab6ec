//! A serial line simulated bit by bit, with faults and with framelock's receivers at its end.
//!
//! The crate never waits, draws or opens anything. Time is counted in bits, randomness comes from a
//! seed, and the same parameters give the same numbers on every computer. The simulation therefore
//! runs in a command line, in a test and, compiled for `wasm32-unknown-unknown`, in a browser.
//!
//! ```text
//!  sender ─► line ─► uart ─► byte faults ─► station: receiver ─► failsafe ─► tally
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
//! use framelock_simulation::{Parameters, run_all};
//!
//! # fn main() -> anyhow::Result<()> {
//! let tally = run_all(&Parameters { lose: 0.01, trials: 4, ..Parameters::DEFAULT })?;
//! let [lecture, .., framelock] = &tally.receivers[..] else { panic!("four receivers") };
//! assert!(lecture.lost_intact > 100);
//! assert_eq!(framelock.lost_intact, 0);
//! # Ok(())
//! # }
//! ```
//!
//! [`run_all`] runs all trials, and [`run`] runs one. To watch a trial byte by byte, step through a [`Trial`]. With
//! the feature `clap`, frame formats, motions and axes can be values of command-line options.

#![forbid(unsafe_code)]

mod byte_faults;
mod line;
mod motion;
mod parameters;
mod payload;
mod random;
mod sent_frame;
mod station;
mod tally;
mod trial;
mod uart;

pub use byte_faults::{ByteFaults, FaultCounts, FaultRates};
pub use framelock_receiving::{FrameFormat, Policy};
pub use line::{check_rate, time_on_line};
pub use motion::{Axis, LEVEL, Motion, Shape, SmoothMotion, between};
pub use parameters::Parameters;
pub use payload::{Payload, Transmission};
pub use random::Seed;
pub use sent_frame::Origin;
pub use station::{Fate, Outcome, Station, StationKind};
pub use tally::{LineTally, ReceiverTally, Tally};
pub use trial::{Event, Trial, run, run_all};
