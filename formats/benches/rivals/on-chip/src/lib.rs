//! What each program here does: it hands a stream to a receiver byte by byte, and counts frames.
//!
//! The benchmark `rivals` writes the streams, builds the programs, and runs them in the emulator. It reads the
//! symbols below.
#![no_std]

use core::hint::black_box;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use framelock::{BufferedReceiver, Framing};
// Start-up code, and the vector table.
use cortex_m_rt as _;

/// How many frames were found.
#[unsafe(no_mangle)]
static FRAMES: AtomicU32 = AtomicU32::new(0);

/// Bytes of the receiver's state.
#[unsafe(no_mangle)]
static STATE: AtomicU32 = AtomicU32::new(0);

/// A receiver.
pub trait Receiver {
    /// Takes a byte, and says how many frames it completes.
    fn take(&mut self, byte: u8) -> u32;
}

impl<F: Framing, const N: usize> Receiver for BufferedReceiver<F, N> {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        match self.push(byte) {
            Some(message) => {
                black_box(&message);
                1
            }
            None => 0,
        }
    }
}

/// Hands the stream over. Programs call it once, so it is a part of them.
#[inline]
pub fn receive<R: Receiver>(mut receiver: R, stream: &[u8]) -> ! {
    STATE.store(
        u32::try_from(size_of::<R>()).unwrap_or(u32::MAX),
        Ordering::Relaxed,
    );
    begin();
    let mut frames = 0;
    for &byte in stream {
        frames += receiver.take(byte);
    }
    FRAMES.store(frames, Ordering::Relaxed);
    end()
}

/// Cycles are counted from here.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn begin() {
    STATE.fetch_add(0, Ordering::Relaxed);
}

/// To here.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn end() -> ! {
    loop {
        FRAMES.fetch_add(0, Ordering::Relaxed);
    }
}

/// CRC extra and most bytes of payload of the `MAVLink` messages that are sent.
#[must_use]
#[inline(never)]
pub fn message(id: u32) -> Option<(u8, u8)> {
    match id {
        0 => Some((50, 9)),
        1 => Some((124, 43)),
        24 => Some((24, 52)),
        30 => Some((39, 28)),
        33 => Some((104, 28)),
        65 => Some((118, 42)),
        74 => Some((20, 20)),
        253 => Some((83, 54)),
        _ => None,
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    end()
}

/// A program: `receiver!(stream, new receiver)`.
#[macro_export]
macro_rules! receiver {
    ($stream:literal, $new:expr) => {
        const BYTES: &[u8] = include_bytes!(concat!(env!("FRAMELOCK_STREAMS"), "/", $stream));

        /// A symbol, so that its size can be taken from the image's.
        #[unsafe(no_mangle)]
        static STREAM: [u8; BYTES.len()] = *BYTES.first_chunk().expect("its own length");

        #[cortex_m_rt::entry]
        fn main() -> ! {
            $crate::receive($new, core::hint::black_box(&STREAM))
        }
    };
}
