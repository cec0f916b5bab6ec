//! What stands between the setpoints and the actuators.

use core::mem::MaybeUninit;
use core::num::NonZeroU32;

use framelock::motion::{Failsafe, FailsafeParameters, Phase, Setpoint};

use crate::framelock_setpoint;
use crate::memory::{Content, Memory};

/// How a failsafe behaves. Times are in ticks of your clock, whatever that is.
#[repr(C)]
pub struct framelock_failsafe_parameters {
    /// Silence after which the output is held. At least 1.
    pub hold_after: u32,
    /// Silence after which the output moves to `park`. At least `hold_after`.
    pub ramp_after: u32,
    /// Where each axis goes when no setpoint comes.
    pub park: framelock_setpoint,
    /// How many ticks one unit of demand takes, for pitch, roll and yaw. At least 1.
    pub ticks_per_unit: [u32; 3],
}

/// A failsafe: what is between the setpoints and the actuators.
#[repr(C)]
pub struct framelock_failsafe {
    opaque: [MaybeUninit<u32>; 16],
}

impl Memory for framelock_failsafe {
    type Value = Failsafe<u8, 3>;
}

/// What a failsafe is doing: one of the constants below.
pub type framelock_phase = u8;
/// Nothing: it is not initialised, and there is no output.
pub const FRAMELOCK_NO_OUTPUT: framelock_phase = 0;
/// The output is the last frame's setpoint.
pub const FRAMELOCK_LIVE: framelock_phase = 1;
/// Frames come again; the output moves to the setpoint at the bounded rate.
pub const FRAMELOCK_APPROACH: framelock_phase = 2;
/// Silence: the output stays where it is.
pub const FRAMELOCK_HOLD: framelock_phase = 3;
/// Longer silence: the output moves to park at the bounded rate.
pub const FRAMELOCK_RAMP: framelock_phase = 4;
/// Every axis is at park.
pub const FRAMELOCK_PARKED: framelock_phase = 5;

/// Begins parked, at the time `now`. If the parameters break one of their rules it returns false, and the
/// failsafe is not initialised.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_failsafe_init(
    failsafe: Option<&mut framelock_failsafe>,
    parameters: Option<&framelock_failsafe_parameters>,
    now: u32,
) -> bool {
    let Some(failsafe) = failsafe else {
        return false;
    };
    let built = parameters.and_then(|parameters| {
        let [Some(pitch), Some(roll), Some(yaw)] = parameters.ticks_per_unit.map(NonZeroU32::new)
        else {
            return None;
        };
        let parameters = FailsafeParameters {
            hold_after: parameters.hold_after,
            ramp_after: parameters.ramp_after,
            park: Setpoint::from(parameters.park).into(),
            ticks_per_unit: [pitch, roll, yaw],
        };
        Failsafe::new(parameters, now).ok()
    });
    let is_built = built.is_some();
    failsafe.write(built.map_or(Content::Nothing, Content::Something));
    is_built
}

/// Say that a frame was received, at the time `now`, with this setpoint.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_failsafe_frame(
    failsafe: Option<&mut framelock_failsafe>,
    now: u32,
    setpoint: framelock_setpoint,
) {
    if let Some(failsafe) = failsafe.and_then(framelock_failsafe::value_mut) {
        failsafe.frame(now, Setpoint::from(setpoint));
    }
}

/// Writes where each axis is to be at the time `now`, and returns why. The time is a counter that may wrap:
/// call this more often than it does. `FRAMELOCK_NO_OUTPUT` leaves `output` as it is.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_failsafe_poll(
    failsafe: Option<&mut framelock_failsafe>,
    now: u32,
    output: Option<&mut MaybeUninit<framelock_setpoint>>,
) -> framelock_phase {
    let Some(failsafe) = failsafe.and_then(framelock_failsafe::value_mut) else {
        return FRAMELOCK_NO_OUTPUT;
    };
    let now = failsafe.poll(now);
    let phase = match now.phase {
        Phase::Live => FRAMELOCK_LIVE,
        Phase::Approach => FRAMELOCK_APPROACH,
        Phase::Hold => FRAMELOCK_HOLD,
        Phase::Ramp => FRAMELOCK_RAMP,
        Phase::Parked => FRAMELOCK_PARKED,
        // The header has no word for one that the core does not have yet.
        _ => return FRAMELOCK_NO_OUTPUT,
    };
    if let Some(output) = output {
        output.write(Setpoint::from(now.axes).into());
    }
    phase
}
