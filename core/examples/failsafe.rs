//! Shows how the failsafe moves the outputs when setpoints stop coming, and when they come again. The failsafe is no
//! safety function: actuators need a switch that cuts their power.
//!
//! `cargo run -p framelock --example failsafe`

use framelock::motion::{Failsafe, FailsafeError, FailsafeParameters, Setpoint};

pub(crate) fn main() -> Result<(), FailsafeError> {
    // The clock counts milliseconds, and the program polls every 20 ms, once per servo period. Hold the output after a
    // tenth of a second without frames. Move it to park after half a second without frames.
    let parameters = FailsafeParameters::for_clock(1_000, 20, [128_u8; 3]);
    let mut failsafe = Failsafe::new(parameters, 0)?;

    // Frames come until 1400 ms, then silence until 2400 ms, then frames again.
    for now in (0..3_000).step_by(20) {
        if !(1_400..2_400).contains(&now) {
            failsafe.frame(Setpoint::from([140, 128, 110]));
        }
        let output = failsafe.poll(now);
        let setpoint = Setpoint::from(output.axes);
        if now % 100 == 60 {
            println!("{now:4} ms  {:?}: {setpoint}", output.phase);
        }
    }
    Ok(())
}

// It prints:
//   60 ms  Approach: pitch 138, roll 128, yaw 117
//  160 ms  Approach: pitch 140, roll 128, yaw 110
//  260 ms  Approach: pitch 140, roll 128, yaw 110
//  360 ms  Approach: pitch 140, roll 128, yaw 110
//  460 ms  Approach: pitch 140, roll 128, yaw 110
//  560 ms  Approach: pitch 140, roll 128, yaw 110
//  660 ms  Approach: pitch 140, roll 128, yaw 110
//  760 ms  Approach: pitch 140, roll 128, yaw 110
//  860 ms  Approach: pitch 140, roll 128, yaw 110
//  960 ms  Approach: pitch 140, roll 128, yaw 110
// 1060 ms  Live: pitch 140, roll 128, yaw 110
// 1160 ms  Live: pitch 140, roll 128, yaw 110
// 1260 ms  Live: pitch 140, roll 128, yaw 110
// 1360 ms  Live: pitch 140, roll 128, yaw 110
// 1460 ms  Live: pitch 140, roll 128, yaw 110
// 1560 ms  Hold: pitch 140, roll 128, yaw 110
// 1660 ms  Hold: pitch 140, roll 128, yaw 110
// 1760 ms  Hold: pitch 140, roll 128, yaw 110
// 1860 ms  Hold: pitch 140, roll 128, yaw 110
// 1960 ms  Parked: pitch 128, roll 128, yaw 128
// 2060 ms  Parked: pitch 128, roll 128, yaw 128
// 2160 ms  Parked: pitch 128, roll 128, yaw 128
// 2260 ms  Parked: pitch 128, roll 128, yaw 128
// 2360 ms  Parked: pitch 128, roll 128, yaw 128
// 2460 ms  Approach: pitch 138, roll 128, yaw 117
// 2560 ms  Approach: pitch 140, roll 128, yaw 110
// 2660 ms  Approach: pitch 140, roll 128, yaw 110
// 2760 ms  Approach: pitch 140, roll 128, yaw 110
// 2860 ms  Approach: pitch 140, roll 128, yaw 110
// 2960 ms  Approach: pitch 140, roll 128, yaw 110
