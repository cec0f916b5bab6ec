//! Serial protocols for the receivers of [`framelock`]: `no_std`, no panics, no allocation.
//!
//! Describe the frames of your protocol as a [`Layout`], and turn the layout into a format with [`classify_by!`]. `feed`
//! takes the received bytes, and delivers every complete frame. In this example, a frame has two sync bytes, the length
//! of the payload, the payload, and a sum of all preceding bytes:
//!
//! ```
//! use framelock::{BufferedReceiver, Format};
//! use framelock_formats::layout::*;
//!
//! const LAYOUT: CheckedLayout = Layout {
//!     sync: Patterns::one(b"AB"),
//!     length: Length::Field(LengthField { plus: 4, ..LengthField::byte(2) }),
//!     longest: 20,
//!     checksum: Some(Checksum::at_the_end(1)),
//!     ..Layout::NONE
//! }
//! .checked();
//!
//! #[derive(Clone, Copy)]
//! struct Own;
//!
//! impl Format for Own {
//!     framelock_formats::classify_by!(LAYOUT);
//!     type Message<'a> = &'a [u8];
//!     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[3..frame.len() - 1] }
//! }
//!
//! let (mut receiver, mut received) = (BufferedReceiver::<_, [u8; 40]>::new(Own), Vec::new());
//! receiver.feed(b"noise AB\x02hi\x56, noise", |found| {
//!     received.extend(found.decoded().map(<[u8]>::to_vec));
//! });
//! assert_eq!(received, [b"hi"]);
//! ```
//!
//! The crate also has the formats of common protocols, for example the [channels of a radio over SBUS](sbus).
//!
//! # In an interrupt
//!
//! The UART also reports errors and pauses. Pass these to the receiver as line events. Then no delivered frame contains
//! both bytes from before an event and bytes from after it. After a false start, complete frames may be pending. They
//! are delivered as soon as more bytes or a line event reveal the false start. A [`Line`](framelock::Line) counts every
//! byte that it takes.
//!
//! ```
//! use framelock::{Line, LineEvent};
//! use framelock_formats::crsf::{self, Crsf};
//!
//! # enum Uart { Byte(u8), Idle }
//! fn on_interrupt(
//!     line: &mut Line<crsf::Receiver>,
//!     uart: Uart,
//!     mut receive: impl FnMut(crsf::Message),
//! ) {
//!     let found = |found: framelock::Found<framelock::Frame<'_, Crsf>>| {
//!         if let Some(message) = found.decoded() {
//!             receive(message);
//!         }
//!     };
//!     match uart {
//!         Uart::Byte(byte) => line.feed(&[byte], found),
//!         Uart::Idle => line.line_event(LineEvent::Idle, found),
//!     }
//! }
//!
//! let (mut line, mut received) = (Line::new(crsf::Receiver::new(Crsf)), 0);
//! for byte in *b"noise\xC8\x04\x0B\x00\xEC\xB7" {
//!     let receive = |message: crsf::Message| received += usize::from(message.kind == 0x0B);
//!     on_interrupt(&mut line, Uart::Byte(byte), receive);
//! }
//! on_interrupt(&mut line, Uart::Idle, |_| ());
//! assert_eq!((received, line.counters().discarded.total()), (1, 5));
//! ```
//!
//! If an interrupt has no time for several frames, call `push`, then `poll_step` in later interrupts.
//!
//! # Protocols
//!
//! | protocol | module | longest frame | what is checked | source |
//! |---|---|---:|---|---|
//! | SBUS | [`sbus`] | 25 | twelve zero bits at the end, no checksum | PX4, Betaflight |
//! | iBUS | [`ibus`] | 32 | 16-bit sum | Betaflight |
//! | CRSF | [`crsf`] | 64 | CRC-8 | TBS's specification |
//! | UBX | [`ubx`] | chosen by you | 8-bit Fletcher checksum | u-blox's interface descriptions |
//! | MAVLink 1 | [`Mavlink1`](mavlink::Mavlink1) | 263 | CRC-16, which includes the message's definition | mavlink.io |
//! | MAVLink 2 | [`Mavlink2`](mavlink::Mavlink2) | 280 | as for MAVLink 1 | mavlink.io |
//! | NMEA 0183 | [`nmea`] | 515 | exclusive or of 8 bits | u-blox's interface descriptions |
//! | RTCM 3 | [`rtcm`] | 1029 | CRC-24 | RTKLIB |
//! | UBX, NMEA and RTCM on one line | [`gnss`] | chosen by you | the check of each protocol | |
//! | Modbus RTU | [`modbus`] | 256 | CRC-16, and the pause after the frame | MODBUS over Serial Line V1.02 |
//! | SLIP and KISS, COBS, HDLC | [`packet`] | chosen by you | nothing; HDLC: CRC-16 | RFC 1055, RFC 1662 |
//! | six axes | [`motion`] | 16 | its two sync and two terminator bytes | motion platforms |
//!
//! The formats of [`packet`] are for a [`PacketReceiver`](framelock::PacketReceiver). All other formats in the table
//! except `SixAxes` are [`Format`](framelock::Format)s for a [`BufferedReceiver`](framelock::BufferedReceiver). The
//! documentation of `BufferedReceiver` says when a frame is delivered, and which frames can be lost. `SixAxes` is a
//! [`FixedFormat`](framelock::FixedFormat) for the small [`Receiver`](framelock::Receiver).
//!
//! The formats find and check each message, and decode the fields that every message of the protocol has. Your program
//! interprets the sentences of NMEA, the payloads of UBX, MAVLink and RTCM, and those of CRSF except the channels.
//!
//! [`AnyOf`] receives several layouts on one line. In tests, [`check_laws`] and [`check_encoding`]
//! check a format that you write by hand.
//!
//! The repository's `docs/rivals.md` compares the cost per byte of these formats and of other crates, for clean streams
//! and for the most expensive known streams.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![deny(
    clippy::arithmetic_side_effects,
    clippy::panic,
    clippy::indexing_slicing
)]
#![allow(
    clippy::doc_markdown,
    reason = "the names of protocols are spelled as their authors spell them"
)]
#![allow(
    clippy::inline_always,
    reason = "inlining specialises the classification for each constant layout; code that works for any layout takes at least twice as long"
)]
#![cfg_attr(
    kani,
    allow(
        clippy::arithmetic_side_effects,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::unwrap_used,
        reason = "a harness reports every panic"
    )
)]

/// Runs the Rust examples of `docs/own-frame.md` and of the README as doctests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/own-frame.md")]
#[doc = include_str!("../README.md")]
struct OwnFrame;

#[cfg(kani)]
extern crate kani;

mod any_of;
mod checksum;
mod classify;
mod crc;
pub mod crsf;
mod dialects;
mod example;
mod format_laws;
pub mod gnss;
pub mod ibus;
pub mod layout;
pub mod mavlink;
pub mod modbus;
pub mod motion;
pub mod nmea;
pub mod packet;
pub mod rtcm;
pub mod sbus;
mod seal;
pub mod ubx;
#[cfg(kani)]
mod verification;

pub use any_of::AnyOf;
pub use format_laws::{BrokenEncoding, BrokenLaw, check_encoding, check_laws};
// Used by `classify_by!` through `$crate`, so that the macro also works in packages that rename this crate.
#[doc(hidden)]
pub use framelock::{Classification, LineEvent};
pub use layout::{CheckedLayout, Layout};

use framelock::EncodeError;

/// Implements the items of [`Format`](framelock::Format) that find frames: `LONGEST`, `classify`, `classify_after`,
/// `classify_before` and `starts`. Use it inside an `impl` of `Format`.
///
/// `classify_by!(LAYOUT)` takes a constant layout. Use `classify_by!(LONGEST, |format| ..)` if the layout depends on
/// the value of the format. The closure returns the layout for this value. `LONGEST` is a constant layout. No frame of
/// the returned layout may be longer than the longest frame of `LONGEST`.
#[macro_export]
macro_rules! classify_by {
    ($layout:expr) => {
        // The `const` block builds the layout once, at compile time. Otherwise a layout that the caller writes as a
        // block would be built again for each byte.
        $crate::classify_by!($layout, |_format| const { $layout });
    };
    ($longest:expr, |$format:ident| $layout:expr) => {
        const LONGEST: usize = $longest.layout().most_bytes();

        #[inline]
        fn classify(&self, bytes: &[u8]) -> $crate::Classification {
            self.classify_after(bytes, 0)
        }

        #[inline]
        fn classify_after(&self, bytes: &[u8], seen: usize) -> $crate::Classification {
            let $format = self;
            $layout.classify_after(bytes, seen)
        }

        #[inline]
        fn classify_before(
            &self,
            bytes: &[u8],
            event: $crate::LineEvent,
        ) -> $crate::Classification {
            let $format = self;
            $layout.classify_before(bytes, event)
        }

        #[inline]
        fn starts(&self, byte: u8) -> bool {
            let $format = self;
            $layout.starts(byte)
        }
    };
}

/// Writes `parts` one after another to the front of `into`, and [seals](CheckedLayout::seal) them. Returns the frame.
fn write<'b>(
    layout: &Layout,
    into: &'b mut [u8],
    parts: &[&[u8]],
) -> Result<&'b [u8], EncodeError> {
    let mut length = 0_usize;
    for part in parts {
        let end = length.wrapping_add(part.len());
        let place = into.get_mut(length..end);
        place
            .ok_or(EncodeError::BufferTooShort)?
            .copy_from_slice(part);
        length = end;
    }
    let frame = into.get_mut(..length).ok_or(EncodeError::BufferTooShort)?;
    if layout.seal(frame) {
        Ok(frame)
    } else {
        Err(EncodeError::InvalidMessage)
    }
}
