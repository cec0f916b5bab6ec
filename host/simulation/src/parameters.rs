//! The parameters of a simulation. Together with the protocol, they determine the simulation's results completely.

use crate::frames::Payload;

/// All parameters of a simulation. Each rate and each length names its unit. Shares are from 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Parameters {
    /// Seed of all random numbers: the same seed gives the same results.
    pub seed: u64,
    /// The number of independent runs, each beginning at reset.
    pub trials: u32,
    /// The number of frames sent in each trial.
    pub frames: u32,
    /// The payload that the sender sends.
    pub payload: Payload,
    /// Bits per second, ten for each byte; at least 1.
    pub baud: u32,
    /// Frames per second, more than 0.
    pub rate: f64,
    /// The share of bytes that are lost without a report.
    pub lose: f64,
    /// The share of bits that are inverted.
    pub bit_flip: f64,
    /// How much faster the sender's clock is than the receiver's, in per cent; from -50 to 50.
    pub baud_error: f64,
    /// Bursts of noise per second.
    pub burst_rate: f64,
    /// The length of a burst in milliseconds.
    pub burst_length: f64,
    /// The silence in byte times after which receivers with an idle-gap rule drop the current frame.
    pub idle_gap: u32,
}

impl Parameters {
    /// A line without faults.
    pub const DEFAULT: Self = Self {
        seed: 1,
        trials: 32,
        frames: 1_000,
        payload: Payload::Motion,
        baud: 115_200,
        rate: 50.0,
        lose: 0.0,
        bit_flip: 0.0,
        baud_error: 0.0,
        burst_rate: 0.0,
        burst_length: 5.0,
        idle_gap: 20,
    };
}
