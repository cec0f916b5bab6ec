//! The setpoint: the demands that a frame carries for three actuators.

use core::fmt;

/// One demand per actuator, each 0..=255 over the actuator's full travel.
///
/// # Examples
/// ```
/// let level = framelock::motion::Setpoint { pitch: 128, roll: 128, yaw: 128 };
/// assert_eq!(framelock::motion::Setpoint::from([128, 128, 128]), level);
/// assert_eq!(level.to_string(), "pitch 128, roll 128, yaw 128");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Setpoint {
    /// Demand of actuator 1.
    pub pitch: u8,
    /// Demand of actuator 2.
    pub roll: u8,
    /// Demand of actuator 3 (the lecture's frame table calls it heave).
    pub yaw: u8,
}

impl From<[u8; 3]> for Setpoint {
    /// Takes the demands in the order of the frame: pitch, roll, yaw. The conversion to an array
    /// has the same order.
    fn from([pitch, roll, yaw]: [u8; 3]) -> Self {
        Self { pitch, roll, yaw }
    }
}

impl From<Setpoint> for [u8; 3] {
    fn from(setpoint: Setpoint) -> Self {
        [setpoint.pitch, setpoint.roll, setpoint.yaw]
    }
}

impl fmt::Display for Setpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pitch, roll, yaw } = self;
        write!(f, "pitch {pitch}, roll {roll}, yaw {yaw}")
    }
}
