//! A serial-frame receiver for microcontrollers: `no_std`, no panics, no allocation, never deaf.
//!
//! A motion-simulator PC sends seven bytes a frame, `'A' 'B' reserved pitch roll yaw CR`. Push
//! the bytes in as they come; the setpoint comes out in the step that takes the CR, and at no
//! other time:
//!
//! ```
//! use framelock::{Bin, Receiver, Setpoint};
//!
//! let mut receiver = Receiver::<Bin>::new();
//! let mut current = None;
//! for byte in [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D] {
//!     if let Some(setpoint) = receiver.push(byte) {
//!         current = Some(setpoint);
//!     }
//! }
//! assert_eq!(current, Some(Setpoint { pitch: 0x7F, roll: 0xC8, yaw: 0x4A }));
//! ```
//!
//! # What is here
//!
//! | type | what it is | bytes of state |
//! |---|---|---|
//! | [`Receiver`] | the receiver: any [`Format`] of fixed length | 8 (16 for frames above 8 bytes) |
//! | [`BufferedReceiver`] | the receiver of frames of any other length: a [`Framing`] | buffer + 12 |
//! | [`Lecture`] | the lecture's machine, literally: seven states | 4 |
//! | [`Accounting`] | either of them, and where each byte went; takes line events | + 14 words |
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
//! still become a frame*. `push` returns a message exactly when the last bytes are a frame that shares
//! no byte with an earlier committed frame, and it returns that frame's. So it cannot go deaf. The
//! lecture's machine can: see [`Lecture`].
//!
//! A substituted byte in the payload of a [`Bin`] frame goes unnoticed by every receiver: 4 of
//! the 7 bytes may be anything. [`BinCrc8`] notices, where both ends can be changed. A frame
//! repeated without pause whose payload is `(0D 41 42 x)` or `(x 0D 41 42)` is ambiguous: report
//! [`LineEvent::Idle`] when the line pauses.
//!
//! # Panics
//!
//! Nothing here panics, whatever it is given. What could go wrong at run time does not compile:
//! see [`Format`].
//!
//! # Features
//!
//! None is needed. `defmt` and `serde` derive their traits for the types one would log or store;
//! `embedded-io` and `embedded-io-async` give a `Reader` from any `Read` of theirs.
#![no_std]
#![forbid(unsafe_code)]
#![deny(clippy::arithmetic_side_effects, clippy::panic)]
#![cfg_attr(
    kani,
    allow(
        clippy::arithmetic_side_effects,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::unwrap_used,
        reason = "what goes wrong is what a harness would find"
    )
)]

#[cfg(test)]
extern crate std;

/// The README's examples are tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

#[cfg(kani)]
extern crate kani;

mod accounting;
mod buffered;
mod failsafe;
mod format;
mod framing;
mod lecture;
mod parser;
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
mod reader;
mod receiver;
mod setpoint;
mod window;

pub use accounting::{Accounting, Counters, Discarded, LineEvent, LineEvents};
pub use buffered::{BufferedReceiver, Found};
pub use failsafe::{Failsafe, FailsafeError, FailsafeParameters, Output, Phase};
pub use format::{Bin, BinCrc8, Format, Frame, Shape, crc8};
pub use framing::{BrokenLaw, Either, EitherMessage, Framing, Headed, Verdict, check_laws};
pub use lecture::{Lecture, State};
pub use parser::{Event, Mismatch, Parser};
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
pub use reader::Reader;
pub use receiver::Receiver;
pub use setpoint::Setpoint;
