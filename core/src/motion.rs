//! The motion platform: setpoints for its axes, the frames that carry them, and the failsafe between them and
//! the actuators.
//!
//! A motion-simulator PC sends [`Bin`] frames, seven bytes each; [`BinCrc8`] adds a checksum, for those who
//! control both ends. Both mean a [`Setpoint`], and a [`Receiver`](crate::Receiver) finds them. The
//! [`Failsafe`] says what the actuators do when frames stop coming, for any number of axes.

mod bin;
mod failsafe;
mod setpoint;

pub use bin::{Bin, BinCrc8, crc8};
pub use failsafe::{Demand, Failsafe, FailsafeError, FailsafeParameters, Output, Phase};
pub use setpoint::Setpoint;
