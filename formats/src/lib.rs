//! Formats that people have, for [`framelock`]'s receivers: `no_std`, no panics, no allocation.
//!
//! | protocol | type | longest frame | what is checked | source |
//! |---|---|---:|---|---|
//! | SBUS | [`Sbus`] | 25 | twelve zero bits at the end, no checksum | PX4, Betaflight |
//! | iBUS | [`Ibus`] | 32 | 16-bit sum | Betaflight |
//! | CRSF | [`Crsf`] | 64 | CRC-8 | TBS's specification |
//! | UBX | [`Ubx`] | chosen by you | 8-bit Fletcher checksum | u-blox's interface descriptions |
//! | MAVLink 2 | [`Mavlink2`] | 280 | CRC-16, which includes the message's definition | mavlink.io |
//! | six axes | [`SixAxes`] | 16 | its two sync and two terminator bytes | motion platforms |
//!
//! All are [`Format`](framelock::Format)s for a [`BufferedReceiver`](framelock::BufferedReceiver),
//! whose documentation says when a frame is delivered and what may be lost. `SixAxes` is a
//! [`FixedFormat`](framelock::FixedFormat) for the small [`Receiver`](framelock::Receiver) as well: prefer that.
//!
//! They frame: they find the bytes of each message, check them, and take apart what all messages have in
//! common. What the payload of a CRSF, UBX or MAVLink message means is left to you.
//!
//! For a format of your own there are [`Headed`], the usual shape, and [`Either`], two formats on one line. The tests
//! [`check_laws`] and [`check_encoding`] try it.
//!
//! What a byte costs, in clean streams and in the worst, stands in the repository's `docs/costs.md`, other crates'
//! figures beside it.
//!
//! # Examples
//! CRSF, and where each byte went.
//! ```
//! use framelock::{Line, BufferedReceiver, LineEvent};
//! use framelock_formats::{Crsf, CrsfMessage};
//!
//! let mut line = Line::new(BufferedReceiver::<_, 128>::new(Crsf::default()));
//! let mut frame = [0; 64];
//! let sent = CrsfMessage { address: 0xC8, kind: 0x0B, payload: &[0, 0xEC] };
//! let length = sent.encode(&mut frame).expect("its payload is short");
//! let mut received = 0;
//! for byte in [b"noise", &frame[..length]].concat() {
//!     if let Some(message) = line.push(byte) {
//!         assert_eq!(message, sent);
//!         received += 1;
//!     }
//! }
//! // No byte for a while: what is pending can become a frame no more.
//! line.line_event(LineEvent::Idle, |found| {
//!     received += usize::from(found.message().is_some());
//! });
//! assert_eq!((received, line.counters().discarded.total()), (1, 5));
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(
    clippy::arithmetic_side_effects,
    clippy::panic,
    clippy::indexing_slicing
)]
#![allow(
    clippy::doc_markdown,
    reason = "protocols are written as their makers do"
)]
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

#[cfg(kani)]
extern crate kani;

mod channels;
mod check;
mod checksums;
mod crsf;
mod either;
mod headed;
mod ibus;
mod mavlink2;
mod sbus;
mod six_axes;
mod ubx;
#[cfg(kani)]
mod verification;

pub use check::{BrokenEncoding, BrokenLaw, check_encoding, check_laws};
pub use crsf::{Crsf, CrsfMessage, address as crsf_address};
pub use either::{Either, EitherMessage};
pub use headed::Headed;
pub use ibus::Ibus;
pub use mavlink2::{Mavlink2, Mavlink2Entry, Mavlink2Message, Mavlink2Signature};
pub use sbus::{Sbus, SbusMessage};
pub use six_axes::SixAxes;
pub use ubx::{Ubx, UbxMessage};

/// Writes `parts` one behind the other to the front of `into`; how many bytes they are, or nothing if there
/// is no room.
fn write(into: &mut [u8], parts: &[&[u8]]) -> Option<usize> {
    let room = into.len();
    let mut rest = into;
    for part in parts {
        let (place, behind) = rest.split_at_mut_checked(part.len())?;
        place.copy_from_slice(part);
        rest = behind;
    }
    room.checked_sub(rest.len())
}
