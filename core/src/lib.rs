//! A serial-frame receiver for microcontrollers: `no_std`, no panics, no allocation, never deaf.
//!
//! A motion-simulator PC sends frames of seven bytes: `'A' 'B' reserved pitch roll yaw CR`. Push the received bytes one
//! by one. `push` returns the setpoint in the step that takes the CR, and at no other time:
//!
//! ```
//! use framelock::Receiver;
//! use framelock::motion::{Bin, Setpoint};
//!
//! let (mut receiver, mut current) = (Receiver::<Bin>::new(), None);
//! for byte in *b"noise AB\0\x7F\xC8\x4A\r, noise" {
//!     if let Some(setpoint) = receiver.push(byte) {
//!         current = Some(setpoint);
//!     }
//! }
//! assert_eq!(current, Some(Setpoint { pitch: 0x7F, roll: 0xC8, yaw: 0x4A }));
//! ```
//!
//! [`motion::Failsafe`] moves the actuators to the setpoint, and parks them when frames stop.
//!
//! # In an interrupt
//!
//! The UART also reports errors and pauses. Pass them on as line events, so that no frame contains bytes from both sides
//! of one. A [`Line`] takes both, and counts every byte:
//!
//! ```
//! use framelock::motion::{Bin, Setpoint};
//! use framelock::{Line, LineEvent, Receiver};
//!
//! # enum Uart { Byte(u8), FramingError }
//! fn on_interrupt(line: &mut Line<Receiver<Bin>>, uart: Uart) -> Option<Setpoint> {
//!     match uart {
//!         Uart::Byte(byte) => return line.push(byte),
//!         Uart::FramingError => line.line_event(LineEvent::Framing, |_| ()),
//!     }
//!     None
//! }
//!
//! let mut line = Line::new(Receiver::new());
//! assert_eq!(on_interrupt(&mut line, Uart::Byte(b'A')), None);
//! assert_eq!(on_interrupt(&mut line, Uart::FramingError), None);
//! assert_eq!(line.counters().discarded.line_event, 1);
//! ```
//!
//! A DMA buffer or a slice of bytes goes into `feed`, or into `next`, which stops after each frame.
//!
//! # Types
//!
//! | type | what it is | bytes of state |
//! |---|---|---|
//! | [`Receiver`] | the receiver: any [`FixedFormat`] of up to 16 bytes | 8 (16 for frames above 8 bytes) |
//! | [`BufferedReceiver`] | the receiver of frames of any other length: a [`Format`] | buffer + 3 words |
//! | [`Line`] | a receiver at the end of a line: counts where each byte went, takes line events | + 18 words |
//! | `Reader` | messages from an `embedded-io` source | + the buffer |
//! | [`motion`] | a motion platform's frames, setpoint and failsafe | 60 for three axes |
//! | [`lecture`] | the lecture's machine, literally: seven states | 4 |
//!
//! All three machines have the same functions, those of the trait [`Parser`]. Nothing here panics, whatever it is
//! given: what could go wrong at run time does not compile (see [`FixedFormat`]).
//!
//! Frames of SBUS, iBUS, CRSF, UBX, `MAVLink`, NMEA and RTCM are in
//! [`framelock-formats`](https://docs.rs/framelock-formats).
//!
//! # The rule
//!
//! The receiver keeps *the longest suffix of what it has seen since the last commit that can still become a frame*.
//! `push` returns a message exactly when the last bytes are a frame that shares no byte with an earlier committed
//! frame, and it returns that frame's. So it cannot go deaf. The lecture's machine can: see [`lecture`].
//!
//! # Features
//!
//! None is needed. `defmt` and `serde` derive their traits for the types one would log or store;
//! `embedded-io-v0.7` and `embedded-io-async-v0.7` give a `Reader` from any `Read` of these versions.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![deny(clippy::arithmetic_side_effects, clippy::panic)]
// What goes wrong is what a harness would find.
#![cfg_attr(kani, allow(clippy::restriction, clippy::must_use_candidate))]

#[cfg(test)]
extern crate std;

/// The examples of the project's README and of this crate's are tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(kani)]
extern crate kani;

mod buffered;
mod fixed_format;
mod format;
pub mod lecture;
mod line;
pub mod motion;
mod noise;
mod parser;
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
mod reader;
mod receiver;
mod window;

pub use buffered::BufferedReceiver;
pub use fixed_format::{Encode, FixedFormat, FrameBytes, Shape};
#[cfg(kani)]
#[doc(hidden)]
pub use format::verification as any_format;
pub use format::{Classification, EncodeError, EncodeInto, Format, Frame};
pub use line::{Counters, Discarded, Line, LineEvent, LineEvents};
pub use parser::{DiscardReason, Found, Parser};
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
pub use reader::Reader;
pub use receiver::Receiver;
