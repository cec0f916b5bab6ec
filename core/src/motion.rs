//! The motion platform: setpoints for its axes, the frames that carry them, and the failsafe between them and
//! the actuators.
//!
//! A [`Receiver`](crate::Receiver) finds [`Bin`] and [`BinCrc8`] frames; both mean a [`Setpoint`]. The
//! [`Failsafe`] says what the actuators do when frames stop coming, for any number of axes.

mod bin;
mod failsafe;
mod setpoint;

pub use bin::{Bin, BinCrc8, crc8};
pub use failsafe::{Demand, Failsafe, FailsafeError, FailsafeParameters, Output, Phase};
pub use setpoint::Setpoint;
