//! The memory that the UARTE writes received bytes to: two halves by turns.

use core::cell::UnsafeCell;
use core::ptr::addr_of;
use core::slice;
use core::sync::atomic::{Ordering, compiler_fence};

use framelock_reception::{FIFO, Half};

use crate::settings::HALF;

/// The UARTE's memory. In RAM, where EasyDMA can reach it.
#[repr(C, align(4))]
pub(crate) struct ReceiveBuffer(UnsafeCell<Memory>);

#[repr(C)]
struct Memory {
    halves: [[u8; HALF as usize]; 2],
    /// What the UARTE still held when it was stopped.
    flushed: [u8; FIFO as usize],
}

// SAFETY: the program never writes to it, and reads it through `received` and `flushed` only, whose
// callers promise that the UARTE does not write there meanwhile.
unsafe impl Sync for ReceiveBuffer {}

impl ReceiveBuffer {
    pub(crate) const fn new() -> Self {
        Self(UnsafeCell::new(Memory {
            halves: [[0; HALF as usize]; 2],
            flushed: [0; FIFO as usize],
        }))
    }

    /// Where the UARTE is to write a half.
    pub(crate) fn address(&self, half: Half) -> u32 {
        let first = self.0.get() as u32;
        match half {
            Half::First => first,
            Half::Second => first + HALF,
        }
    }

    /// Where the UARTE is to write what it still holds.
    pub(crate) fn flushed_address(&self) -> u32 {
        self.0.get() as u32 + 2 * HALF
    }

    /// The bytes from `from` to before `to` of a half; none if there are no such.
    ///
    /// # Safety
    /// The UARTE has written them, and does not write to them while the slice lives.
    #[inline]
    pub(crate) unsafe fn received(&self, half: Half, from: u32, to: u32) -> &[u8] {
        // What was read of them before is out of date from here on.
        compiler_fence(Ordering::SeqCst);
        let first = self.0.get().cast::<u8>();
        let (from, to) = (from.min(HALF) as usize, to.min(HALF) as usize);
        let start = match half {
            Half::First => from,
            Half::Second => from + HALF as usize,
        };
        // SAFETY: inside the half, whose bytes are initialised since the start; not written meanwhile, as
        // the caller promises. The slice covers these bytes only, so the others may be written.
        unsafe { slice::from_raw_parts(first.add(start), to.saturating_sub(from)) }
    }

    /// The first `count` bytes of what the UARTE still held.
    ///
    /// # Safety
    /// As [`Self::received`].
    pub(crate) unsafe fn flushed(&self, count: u32) -> &[u8] {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: as there.
        let flushed = unsafe { &*addr_of!((*self.0.get()).flushed) };
        flushed.get(..count as usize).unwrap_or_default()
    }
}
