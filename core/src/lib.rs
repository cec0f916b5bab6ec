//! A serial-frame receiver for microcontrollers: `no_std`, no panics, no allocation, never deaf.
//!
//! A motion-simulator PC sends seven bytes a frame, `'A' 'B' reserved pitch roll yaw CR`. Push
//! the bytes in as they come; the setpoint comes out in the step that takes the CR, and at no
//! other time:
//!
//! ```
//! use framelock::{Bin, Parser, Receiver, Setpoint};
//!
//! let mut receiver = Receiver::<Bin>::new();
//! let mut in_force = None;
//! for byte in [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D] {
//!     if let Some(setpoint) = receiver.push(byte) {
//!         in_force = Some(setpoint);
//!     }
//! }
//! assert_eq!(in_force, Some(Setpoint { pitch: 0x7F, roll: 0xC8, yaw: 0x4A }));
//! ```
//!
//! # What is here
//!
//! | type | what it is | bytes of state |
//! |---|---|---|
//! | [`Receiver`] | the receiver: any [`Format`] of fixed length, policy [`Rescan`] | 8 (16 above 8-byte frames) |
//! | [`Lecture`] | the lecture's machine, literally: seven states, policy Discard | 4 |
//! | [`Accounting`] | either of them, and where each byte went; takes line events | + 112 |
//! | [`Failsafe`] | between setpoints and actuators: hold, ramp to park, come back slowly | 60 |
//! | `Reader` | setpoints from an `embedded-io` source | + the buffer |
//!
//! Everything around a parser is written once, against the trait [`Parser`]:
//! [`push`](Parser::push) for a byte, [`feed`](Parser::feed) for a slice.
//!
//! In an interrupt handler, with the line's events and a failsafe:
//!
//! ```
//! use core::num::NonZeroU32;
//! use framelock::{Accounting, Bin, Failsafe, FailsafeParameters, LineEvent, Receiver, Setpoint};
//!
//! # enum Uart { Byte(u8), FramingError }
//! # fn uart() -> Uart { Uart::Byte(0) }
//! # fn milliseconds() -> u32 { 0 }
//! # fn actuate(_: Setpoint) {}
//! # fn main() -> Result<(), framelock::FailsafeError> {
//! let level = Setpoint { pitch: 128, roll: 128, yaw: 128 };
//! let mut line = Accounting::new(Receiver::<Bin>::new());
//! let mut failsafe = Failsafe::new(
//!     FailsafeParameters {
//!         hold_after: 100,
//!         ramp_after: 500,
//!         park: level,
//!         ticks_per_unit: [NonZeroU32::MIN; 3],
//!     },
//!     milliseconds(),
//! )?;
//! // For each interrupt:
//! match uart() {
//!     Uart::Byte(byte) => {
//!         if let Some(setpoint) = line.push(byte) {
//!             failsafe.frame(milliseconds(), setpoint);
//!         }
//!     }
//!     Uart::FramingError => line.line_event(LineEvent::Framing),
//! }
//! // For each period of the actuators:
//! actuate(failsafe.poll(milliseconds()).setpoint);
//! # Ok(())
//! # }
//! ```
//!
//! # The rule
//!
//! The receiver keeps *the longest suffix of what it has seen since the last commit that can
//! still become a frame*. Whatever came before, every frame that the line delivers whole, and
//! that overlaps none committed before it, is committed in the step that takes its last byte; and
//! nothing else is. It cannot go deaf. The lecture's machine can: see [`lecture`].
//!
//! A substituted byte in the payload of a [`Bin`] frame goes unnoticed by every receiver: 4 of
//! the 7 bytes may be anything. [`BinCrc8`] notices, where both ends can be changed. A frame
//! repeated without pause whose payload is `(0D 41 42 x)` or `(x 0D 41 42)` is ambiguous: report
//! [`LineEvent::Idle`] when the line pauses.
//!
//! # Panics
//!
//! Nothing here panics, whatever it is given. What could go wrong at run time does not compile:
//! a format too long for its word, or a [`Shape`] that differs from its frame.
//!
//! # Features
//!
//! None is needed. `defmt` and `serde` derive their traits for the types one would log or store;
//! `embedded-io` and `embedded-io-async` give a `Reader` from any `Read` of theirs.
#![no_std]
#![forbid(unsafe_code)]

mod accounting;
mod failsafe;
mod format;
pub mod lecture;
mod parser;
mod policy;
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
mod reader;
pub mod receiver;
mod scan;
mod setpoint;
mod slice;
pub mod window;

pub use accounting::{Accounting, Counters, Discarded, LineEvent, LineEvents};
pub use failsafe::{Failsafe, FailsafeError, FailsafeParameters, Output, Phase};
pub use format::{Bin, BinCrc8, Format, Frame, crc8};
pub use lecture::{Lecture, State};
pub use parser::{Mismatch, Parser, Sink};
pub use policy::{Discard, Policy, Rescan};
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
pub use reader::Reader;
pub use receiver::Receiver;
pub use setpoint::Setpoint;
pub use window::{Shape, Window, Word};
