//! Receives in an interrupt, and moves the outputs in a task of another priority.
//!
//! `cargo run -p framelock --example mailbox`
//!
//! Only the task calls the failsafe. If the interrupt called `Failsafe::frame` during `Failsafe::poll`, `poll` could
//! take the pitch of one frame and the roll of the next, and could miss that a frame has come. So the interrupt puts
//! the setpoint into a mailbox. `critical_section` disables the interrupts for the few instructions that access the
//! mailbox. This also works on a Cortex-M0, which has no atomic exchange. On a chip with two cores, use the
//! implementation of `critical_section` for that chip.
//!
//! This program is no safety function: a platform needs a switch that cuts the power of its actuators.

use std::cell::Cell;

use critical_section::Mutex;
use framelock::motion::{Bin, Failsafe, FailsafeError, FailsafeParameters, Output, Setpoint};
use framelock::{Line, LineEvent, Receiver};

/// The newest setpoint that the task has not taken.
static MAILBOX: Mutex<Cell<Option<Setpoint>>> = Mutex::new(Cell::new(None));

/// The interrupt handler of the UART or the DMA. It takes new bytes, an error, or a pause.
fn interrupt(line: &mut Line<Receiver<Bin>>, found: Result<&[u8], LineEvent>) {
    match found {
        Ok(bytes) => line.messages(bytes).for_each(|setpoint| {
            critical_section::with(|section| MAILBOX.borrow(section).set(Some(setpoint)));
        }),
        Err(event) => line.event(event),
    }
}

/// The task, which runs every 20 ms.
fn task(failsafe: &mut Failsafe<u8, 3>, now: u32) -> Output<u8, 3> {
    if let Some(setpoint) = critical_section::with(|section| MAILBOX.borrow(section).take()) {
        failsafe.frame(setpoint);
    }
    failsafe.poll(now)
}

pub(crate) fn main() -> Result<(), FailsafeError> {
    let mut line = Line::new(Receiver::new());
    let parameters = FailsafeParameters::for_clock(1_000, 20, [128; 3]);
    let mut failsafe = Failsafe::new(parameters, 0)?;
    let mut phase = None;
    for now in (0..3_000).step_by(20) {
        // The line has lost the first byte of the first frame. Each frame contains a CR, followed by `AB`. So if the
        // pauses were not reported, the receiver would find frames at the wrong place.
        if now < 2_000 {
            let frame = b"AB\0\rAB\r";
            interrupt(&mut line, Ok(if now == 0 { &frame[1..] } else { frame }));
            interrupt(&mut line, Err(LineEvent::Idle));
        }
        let output = task(&mut failsafe, now);
        if phase.replace(output.phase) != Some(output.phase) {
            println!("{:?}: {}", output.phase, Setpoint::from(output.axes));
        }
    }
    Ok(())
}

// It prints:
// Parked: pitch 128, roll 128, yaw 128
// Approach: pitch 122, roll 122, yaw 122
// Live: pitch 13, roll 65, yaw 66
// Hold: pitch 13, roll 65, yaw 66
// Ramp: pitch 18, roll 70, yaw 71
// Parked: pitch 128, roll 128, yaw 128
