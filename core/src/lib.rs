//! A serial-frame receiver for microcontrollers: `no_std`, no panics, no allocation.
//!
//! Describe your frame as a type. The frame in this example has the byte FE, a throttle of 16 bits, and a line feed.
//! Push the received bytes one by one. `push` returns the message when it takes a frame's last byte, and at no other
//! time:
//!
//! ```
//! use framelock::{FixedFormat, Receiver, Shape};
//!
//! struct Throttle;
//!
//! impl FixedFormat for Throttle {
//!     type Frame = [u8; 4];
//!     type Message = u16;
//!     const SHAPE: Shape<[u8; 4]> = Shape::new([Some(0xFE), None, None, Some(b'\n')]);
//!     fn decode([_, high, low, _]: [u8; 4]) -> u16 { u16::from_be_bytes([high, low]) }
//! }
//!
//! let (mut receiver, mut current) = (Receiver::<Throttle>::new(), None);
//! for byte in *b"noise \xFE\x9C\x40\n, noise" {
//!     if let Some(throttle) = receiver.push(byte) {
//!         current = Some(throttle);
//!     }
//! }
//! assert_eq!(current, Some(40_000));
//! ```
//!
//! [`BufferedReceiver`] receives frames that are longer than 16 bytes, or have several lengths.
//!
//! # In an interrupt
//!
//! The UART also reports errors, and the UART or a timer notices pauses. Pass each error and each pause on as a line
//! event. Then no delivered frame contains bytes from both before and after a line event. A [`Line`] takes bytes and
//! line events, and counts every byte that it takes. [`LineEvent`] lists the errors of common drivers.
//!
//! ```
//! use framelock::{Line, LineEvent, Receiver};
//! # use framelock::{FixedFormat, Shape};
//! # struct Throttle;
//! # impl FixedFormat for Throttle {
//! #     type Frame = [u8; 4];
//! #     type Message = u16;
//! #     const SHAPE: Shape<[u8; 4]> = Shape::new([Some(0xFE), None, None, Some(b'\n')]);
//! #     fn decode([_, high, low, _]: [u8; 4]) -> u16 { u16::from_be_bytes([high, low]) }
//! # }
//! # enum Uart { Byte(u8), FramingError }
//!
//! fn on_interrupt(line: &mut Line<Receiver<Throttle>>, uart: Uart) -> Option<u16> {
//!     match uart {
//!         Uart::Byte(byte) => return line.push(byte),
//!         Uart::FramingError => line.event(LineEvent::Framing),
//!     }
//!     None
//! }
//!
//! let mut line = Line::new(Receiver::new());
//! assert_eq!(on_interrupt(&mut line, Uart::Byte(0xFE)), None);
//! assert_eq!(on_interrupt(&mut line, Uart::FramingError), None);
//! assert_eq!(line.counters().discarded.line_event, 1);
//! ```
//!
//! If bytes arrive in a DMA buffer or a slice, pass the slice to `feed`, or to `next`, which stops after each frame.
//!
//! # Types
//!
//! | type | purpose | bytes of state |
//! |---|---|---|
//! | [`Receiver`] | finds frames of a fixed length, up to 16 bytes; takes a [`FixedFormat`] | 8 (16 for frames of more than 8 bytes) |
//! | [`BufferedReceiver`] | finds frames of any length; takes a [`Format`] | buffer + 3 words |
//! | [`PacketReceiver`] | finds packets between delimiters (SLIP, HDLC, COBS, DLE framing); takes a [`PacketFormat`] | buffer + 4 words |
//! | [`Line`] | wraps a receiver, takes line events, and counts the outcome of each byte | receiver + 80 |
//! | `Reader` | reads messages from an `embedded-io` source | source + line + buffer + 2 words (3 if async) |
//! | [`motion`] | a motion platform's frames, setpoint and failsafe | 104 for the failsafe with three axes |
//! | [`lecture`] | the lecture's state machine, unchanged: seven states | 4 |
//!
//! `Receiver`, `BufferedReceiver`, `PacketReceiver` and the lecture's machine all have the functions of the trait
//! [`Parser`]. No function in this crate panics, whatever its arguments, unless your own format, source or closure
//! does. This is proved for slices and buffers of up to 4096 bytes, except for functions that only write text. Several
//! mistakes in a format are compile errors (see [`FixedFormat`]).
//!
//! The crate [`framelock-formats`](https://docs.rs/framelock-formats) has the formats SBUS, iBUS, CRSF, UBX,
//! `MAVLink`, NMEA, RTCM, Modbus RTU and others.
//!
//! # The rule
//!
//! Take the bytes that have come since the last delivered frame or line event. A [`Receiver`] keeps *the longest suffix
//! of these bytes that can still become a frame*. `push` returns a message exactly when the last of these bytes are a
//! frame. The message is decoded from this frame. So for every whole frame, the receiver delivers this frame, or an
//! earlier delivered frame shares bytes with it. The lecture's machine may deliver nothing for ever (see
//! [`lecture`]).
//!
//! A frame that nobody sent may share bytes with a whole frame. If the receiver delivers the unsent frame first, the
//! whole frame is lost. In BIN, the bytes of a repeated frame may form frames at two offsets. Then only a pause,
//! reported as a line event, or a checksum shows which frames were sent (see [`motion::Bin`]).
//!
//! # A motion platform
//!
//! [`motion`] has the frames of a motion-simulator PC, for example [`motion::Bin`]: `'A' 'B' reserved pitch roll yaw
//! CR`. [`motion::Failsafe`] moves the actuators to the setpoint, and parks the actuators when frames stop coming. It
//! is no safety function: the actuators need a switch that cuts their power.
//!
//! # Features
//!
//! All features are optional. `defmt` and `serde` derive the traits of these crates for the types that a program might
//! log or store. `embedded-io-v0.7` and `embedded-io-async-v0.7` add a `Reader`, which reads from any type that
//! implements the trait `Read` of `embedded-io` 0.7 or `embedded-io-async` 0.7.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![deny(clippy::arithmetic_side_effects, clippy::panic)]
// The proofs find each panic that these lints would warn about.
#![cfg_attr(kani, allow(clippy::restriction, clippy::must_use_candidate))]

#[cfg(test)]
extern crate std;

/// Tests the examples of the project's README and of this crate's README.
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
mod packets;
mod parser;
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
mod reader;
mod receiver;
mod stuffing;
mod window;

pub use buffered::BufferedReceiver;
pub use fixed_format::{Encode, FixedFormat, FrameBytes, Shape};
#[cfg(kani)]
#[doc(hidden)]
pub use format::verification as any_format;
pub use format::{Classification, EncodeError, EncodeInto, Format, Frame};
pub use line::{Counters, Discarded, Line, LineEvent, LineEvents};
pub use packets::PacketReceiver;
pub use parser::{DiscardReason, Found, Parser};
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
pub use reader::Reader;
pub use receiver::Receiver;
pub use stuffing::{Codes, PacketFormat, Stuffing};
