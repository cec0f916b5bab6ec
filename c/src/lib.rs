//! framelock for firmware in C: `docs/c.md`. `include/framelock.h` is made from the public items here.
//!
//! A pointer of C is a reference here, or `None` if it is null, so only `memory.rs` has blocks of `unsafe`
//! code. What C must keep to stands at the head of the header, which is in `cbindgen.toml`.
#![cfg_attr(target_os = "none", no_std)]
#![allow(non_camel_case_types, reason = "the names are for C")]
#![allow(
    clippy::doc_markdown,
    reason = "protocols are written as their makers do"
)]

use framelock::motion::Setpoint;

mod memory;

// In the order in which the header has them.
pub mod receiver;

pub mod layout;

pub mod layout_receiver;

pub mod shipped_layouts;

pub mod failsafe;

/// Linking needs one. Nothing calls it: `cargo xtask verify --only core` looks.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

/// One demand for each actuator, each 0 to 255 over the actuator's full travel.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct framelock_setpoint {
    /// Demand of actuator 1.
    pub pitch: u8,
    /// Demand of actuator 2.
    pub roll: u8,
    /// Demand of actuator 3.
    pub yaw: u8,
}

impl From<Setpoint> for framelock_setpoint {
    fn from(Setpoint { pitch, roll, yaw }: Setpoint) -> Self {
        Self { pitch, roll, yaw }
    }
}

impl From<framelock_setpoint> for Setpoint {
    fn from(framelock_setpoint { pitch, roll, yaw }: framelock_setpoint) -> Self {
        Self { pitch, roll, yaw }
    }
}
