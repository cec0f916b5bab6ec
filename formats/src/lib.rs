//! Formats that people have, for [`framelock`]'s receivers: `no_std`, no panics, no allocation.
//!
//! | protocol | type | longest frame | what is checked | source |
//! |---|---|---:|---|---|
//! | SBUS | [`Sbus`] | 25 | twelve zero bits at the end, no checksum | PX4, Betaflight |
//! | iBUS | [`Ibus`] | 32 | 16-bit sum | Betaflight |
//! | CRSF | [`Crsf`] | 64 | CRC-8 | TBS's specification |
//! | UBX | [`Ubx`] | chosen by you | 8-bit Fletcher checksum | u-blox's interface descriptions |
//! | MAVLink 1 | [`Mavlink1`] | 263 | CRC-16, which includes the message's definition | mavlink.io |
//! | MAVLink 2 | [`Mavlink2`] | 280 | the same | mavlink.io |
//! | NMEA 0183 | [`Nmea`] | 128 | exclusive or of 8 bits | u-blox's interface descriptions |
//! | RTCM 3 | [`Rtcm`] | 1029 | CRC-24 | RTKLIB |
//! | UBX, NMEA and RTCM on one line | [`Gnss`] | chosen by you | as they have it | |
//! | six axes | [`SixAxes`] | 16 | its two sync and two terminator bytes | motion platforms |
//!
//! All but one are [`Format`](framelock::Format)s for a [`BufferedReceiver`](framelock::BufferedReceiver),
//! whose documentation says when a frame is delivered and what may be lost. `SixAxes` is a
//! [`FixedFormat`](framelock::FixedFormat), for the small [`Receiver`](framelock::Receiver).
//!
//! They frame: they find the bytes of each message, check them, and take apart what all messages have in
//! common. What the payload of a CRSF, UBX or MAVLink message means is left to you.
//!
//! For a format of your own write down its [`Layout`], and [`judged_by!`] makes it a format. Several on one line are
//! [`AnyOf`] them. The tests [`check_laws`] and [`check_encoding`] try what is written by hand.
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
//! let mut line = Line::new(BufferedReceiver::<_, 128>::new(Crsf));
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
#![allow(
    clippy::inline_always,
    reason = "a layout that is a constant is to be judged by constants: compiled once, for any layout, the judge takes twice as long and more"
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

/// The Rust of the guide to a frame of one's own is tested.
#[cfg(doctest)]
#[doc = include_str!("../../docs/own-frame.md")]
struct OwnFrame;

#[cfg(kani)]
extern crate kani;

mod any_of;
mod checksum;
mod crc;
mod crsf;
mod dialects;
mod format_laws;
mod gnss;
mod ibus;
mod judge;
pub mod layout;
mod mavlink;
mod motion;
mod nmea;
mod rtcm;
mod sbus;
mod seal;
mod ubx;
#[cfg(kani)]
mod verification;

pub use any_of::AnyOf;
pub use crsf::{CRSF, Crsf, CrsfMessage, address as crsf_address};
pub use dialects::{ARDUPILOTMEGA, COMMON};
// For `judged_by!`, whatever the crate is called where it is used.
pub use format_laws::{BrokenEncoding, BrokenLaw, check_encoding, check_laws};
#[doc(hidden)]
pub use framelock::Verdict;
pub use gnss::{Gnss, GnssMessage};
pub use ibus::{IBUS, Ibus};
pub use layout::Layout;
pub use mavlink::{Mavlink1, Mavlink2, MavlinkMessage, MavlinkSignature, mavlink1, mavlink2};
pub use motion::{BIN, BIN_CRC8, SIX_AXES, SixAxes, SixAxesBigEndian};
pub use nmea::{NMEA, Nmea};
pub use rtcm::{RTCM, Rtcm, RtcmMessage};
pub use sbus::{SBUS, Sbus, SbusMessage};
pub use ubx::{UBX, Ubx, UbxMessage};

/// In an `impl` of [`Format`](framelock::Format): the longest frame and all questions answered by a layout, a constant; or
/// by one that the format's value makes, as `judged_by!(LONGEST, |format| ..)`, whose frames are no longer than those
/// of the first.
#[macro_export]
macro_rules! judged_by {
    ($layout:expr) => {
        $crate::judged_by!($layout, |_format| $layout);
    };
    ($longest:expr, |$format:ident| $layout:expr) => {
        const LONGEST: usize = $longest.longest;

        #[inline]
        fn judge(&self, bytes: &[u8]) -> $crate::Verdict {
            self.judge_on(bytes, 0)
        }

        #[inline]
        fn judge_on(&self, bytes: &[u8], seen: usize) -> $crate::Verdict {
            let $format = self;
            $layout.judge_on(bytes, seen)
        }

        #[inline]
        fn starts(&self, byte: u8) -> bool {
            let $format = self;
            $layout.starts(byte)
        }
    };
}

/// Writes `parts` one behind the other to the front of `into` and [seals](Layout::seal) them; how many bytes they
/// are, or nothing if there is no room or no such frame.
fn write(layout: &Layout, into: &mut [u8], parts: &[&[u8]]) -> Option<usize> {
    let mut length = 0_usize;
    for part in parts {
        let place = into.get_mut(length..)?.get_mut(..part.len())?;
        place.copy_from_slice(part);
        length = length.wrapping_add(part.len());
    }
    layout.seal(into.get_mut(..length)?).then_some(length)
}
