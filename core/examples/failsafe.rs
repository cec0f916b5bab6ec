//! Shows how the failsafe moves the outputs when setpoints stop coming, and when they come again.
//!
//! `cargo run -p framelock-examples --bin failsafe`

use core::num::NonZeroU32;

use framelock::motion::{Failsafe, FailsafeError, FailsafeParameters, Setpoint};

pub(crate) fn main() -> Result<(), FailsafeError> {
    let parameters = FailsafeParameters {
        // The clock counts milliseconds. Hold the output after a tenth of a second without frames.
        // Move it to park after half a second without frames.
        hold_after: 100,
        ramp_after: 500,
        park: [128_u8; 3],
        ticks_per_unit: [const { NonZeroU32::new(4).unwrap() }; 3],
    };
    let mut failsafe = Failsafe::new(parameters, 0)?;

    // Frames come until 200 ms, then silence until 1000 ms, then frames again.
    for now in (0..1_200).step_by(100) {
        if !(200..1_000).contains(&now) {
            failsafe.frame(now, Setpoint::from([140, 128, 110]));
        }
        // In firmware, poll once per servo period.
        let output = failsafe.poll(now);
        let setpoint = Setpoint::from(output.axes);
        println!("{now:4} ms  {:?}: {setpoint}", output.phase);
    }
    Ok(())
}

// It prints:
//    0 ms  Approach: pitch 128, roll 128, yaw 128
//  100 ms  Live: pitch 140, roll 128, yaw 110
//  200 ms  Hold: pitch 140, roll 128, yaw 110
//  300 ms  Hold: pitch 140, roll 128, yaw 110
//  400 ms  Hold: pitch 140, roll 128, yaw 110
//  500 ms  Hold: pitch 140, roll 128, yaw 110
//  600 ms  Ramp: pitch 140, roll 128, yaw 110
//  700 ms  Parked: pitch 128, roll 128, yaw 128
//  800 ms  Parked: pitch 128, roll 128, yaw 128
//  900 ms  Parked: pitch 128, roll 128, yaw 128
// 1000 ms  Approach: pitch 128, roll 128, yaw 128
// 1100 ms  Live: pitch 140, roll 128, yaw 110
