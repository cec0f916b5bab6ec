//! The motion platform: setpoints for its axes, the frames that carry the setpoints, and the failsafe between
//! the frames and the actuators.
//!
//! A [`Receiver`](crate::Receiver) finds frames of the format [`Bin`] or [`BinCrc8`]. Each frame carries a
//! [`Setpoint`]. The [`Failsafe`] limits the actuators' speed, and parks the actuators when frames stop coming, for any
//! number of axes.

mod bin;
mod failsafe;
mod pace;
mod setpoint;

pub use bin::{Bin, BinCrc8, crc8};
pub use failsafe::{Demand, Failsafe, FailsafeError, FailsafeParameters, Output, Phase};
pub use pace::Pace;
pub use setpoint::Setpoint;
