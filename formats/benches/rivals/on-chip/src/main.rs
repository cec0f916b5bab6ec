//! Passes a stream to one receiver byte by byte, and counts the frames.
//!
//! A feature selects the receiver. The benchmark `rivals` builds this program once for each receiver, runs the program
//! in the emulator, and writes a stream into the program's memory. The benchmark finds the symbols below by their
//! names.
#![no_std]
#![no_main]
#![allow(dead_code, reason = "each program uses one of the receivers")]

use core::hint::black_box;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use framelock::{BufferedReceiver, FixedFormat, Format, Frame, Line, PacketFormat, PacketReceiver};
use framelock_rivals_adapters as adapters;

/// The stream. The benchmark writes the stream into this array when the program calls `begin`.
#[unsafe(no_mangle)]
static STREAM: [AtomicU8; 1 << 14] = [const { AtomicU8::new(0) }; _];

/// The number of bytes in the stream.
#[unsafe(no_mangle)]
static LENGTH: AtomicU32 = AtomicU32::new(0);

/// The number of frames that were found.
#[unsafe(no_mangle)]
static FRAMES: AtomicU32 = AtomicU32::new(0);

/// The size of the receiver in bytes.
#[unsafe(no_mangle)]
static STATE: AtomicU32 = AtomicU32::new(0);

/// A receiver.
pub(crate) trait Receiver {
    /// Takes a byte. Returns the number of frames that the byte completes.
    fn take(&mut self, byte: u8) -> u32;
}

/// Implements [`Receiver`] for framelock's receivers, with an expression that reads and counts the outcome of `push`.
macro_rules! receivers {
    ($([$($bound:tt)*] $receiver:ty, |$outcome:ident| $count:expr;)*) => {$(
        impl<$($bound)*> Receiver for $receiver {
            #[inline(never)]
            fn take(&mut self, byte: u8) -> u32 {
                let $outcome = self.push(byte);
                $count
            }
        }
    )*};
}

receivers! {
    [F: Format, const N: usize] BufferedReceiver<F, [u8; N]>, |frame| frame.map_or(0, decoded);
    [F: Format, const N: usize] Line<BufferedReceiver<F, [u8; N]>>, |frame| frame.map_or(0, decoded);
    [F: PacketFormat, const N: usize] PacketReceiver<F, [u8; N]>, |frame| frame.map_or(0, decoded);
    [F: PacketFormat, const N: usize] Line<PacketReceiver<F, [u8; N]>>, |frame| frame.map_or(0, decoded);
    [F: FixedFormat] framelock::Receiver<F>, |message| found(message.as_ref());
    [F: FixedFormat] Line<framelock::Receiver<F>>, |message| found(message.as_ref());
}

/// The receiver of another crate.
struct Rival<C>(C);

impl<C: adapters::Contender> Receiver for Rival<C> {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        let mut frames = 0;
        self.0.push(byte, |message| frames += found(Some(&message)));
        frames
    }
}

/// A receiver that does nothing. The benchmark subtracts its sizes, and its cycles per frame, from those of the others.
struct Nothing;

impl Receiver for Nothing {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        black_box(byte);
        0
    }
}

/// Decodes a frame. This is a separate function, as in a program that calls a handler for each frame.
#[inline(never)]
fn decoded<F: Format>(frame: Frame<'_, F>) -> u32 {
    found(Some(&frame.message()))
}

#[inline]
fn found<M>(message: Option<&M>) -> u32 {
    message.map_or(0, |message| {
        black_box(message);
        1
    })
}

/// Passes the stream to the receiver, byte by byte.
#[inline]
fn receive<R: Receiver>(mut receiver: R) -> ! {
    STATE.store(
        u32::try_from(size_of::<R>()).unwrap_or(u32::MAX),
        Ordering::Relaxed,
    );
    begin();
    let mut frames = 0;
    let length = LENGTH.load(Ordering::Relaxed) as usize;
    for byte in STREAM.get(..length).unwrap_or_default() {
        frames += receiver.take(byte.load(Ordering::Relaxed));
    }
    FRAMES.store(frames, Ordering::Relaxed);
    // Keep the compiler from removing the counters.
    black_box(&receiver);
    end()
}

/// Marks the point at which the benchmark writes the stream.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn begin() {
    STATE.fetch_add(0, Ordering::Relaxed);
}

/// Marks the point at which the receiver has taken the whole stream.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn end() -> ! {
    loop {
        FRAMES.fetch_add(0, Ordering::Relaxed);
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    end()
}

/// Defines the entry point for a feature that selects one of framelock's receivers. With the feature `line`, the
/// receiver is in a `Line`.
macro_rules! framelock {
    ($($feature:literal: $receiver:expr;)*) => {$(
        #[cfg(feature = $feature)]
        #[cortex_m_rt::entry]
        fn main() -> ! {
            #[cfg(feature = "line")]
            receive(Line::new($receiver));
            #[cfg(not(feature = "line"))]
            receive($receiver)
        }
    )*};
}

framelock! {
    "bin": framelock::Receiver::<framelock::motion::Bin>::new();
    "bin-crc8": framelock::Receiver::<framelock::motion::BinCrc8>::new();
    "six-axes": framelock::Receiver::<framelock_formats::motion::SixAxes>::new();
    "sbus": BufferedReceiver::<_, [u8; 50]>::new(framelock_formats::sbus::Sbus);
    "ibus": BufferedReceiver::<_, [u8; 64]>::new(framelock_formats::ibus::Ibus);
    "crsf": BufferedReceiver::<_, [u8; 128]>::new(framelock_formats::crsf::Crsf);
    "ubx": BufferedReceiver::<_, [u8; 2 * adapters::UBX_LONGEST]>::new(framelock_formats::ubx::Ubx::<{ adapters::UBX_LONGEST }>);
    "slip": PacketReceiver::<_, [u8; adapters::PACKET_LONGEST + 1]>::new(framelock_formats::packet::Slip::<{ adapters::PACKET_LONGEST }>);
    "cobs": PacketReceiver::<_, [u8; adapters::PACKET_LONGEST + 1]>::new(framelock_formats::packet::Cobs::<{ adapters::PACKET_LONGEST }>);
    "mavlink2": BufferedReceiver::<_, [u8; 560]>::new(framelock_formats::mavlink::Mavlink2(adapters::mavlink2::MESSAGES));
}

/// Defines the entry point for a feature that selects a receiver of another crate.
macro_rules! rivals {
    ($($feature:literal: $adapter:ty;)*) => {$(
        #[cfg(feature = $feature)]
        #[cortex_m_rt::entry]
        fn main() -> ! {
            receive(Rival(<$adapter>::default()))
        }
    )*};
}

rivals! {
    "sbus-sbus": adapters::Sbus;
    "sbus-sbus-rs": adapters::SbusRs;
    "sbus-uf-sbus": adapters::UfSbus;
    "ibus-parse_rc_ibus": adapters::Textbook;
    "cobs-cobs": adapters::Cobs;
    "slip-serial-line-ip": adapters::SerialLineIp;
    "crsf-crsf": adapters::Crsf;
    "crsf-uf-crsf": adapters::UfCrsf;
    "ubx-ublox": adapters::Ublox;
    "mavlink2-mavlink-core": adapters::mavlink2::MavlinkCore<1>;
}

#[cfg(feature = "nothing")]
#[cortex_m_rt::entry]
fn main() -> ! {
    receive(Nothing)
}
