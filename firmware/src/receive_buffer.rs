//! The memory that the UARTE writes received bytes to: two halves by turns.

use core::cell::UnsafeCell;
use core::ptr::addr_of;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::settings::HALF;

/// The UARTE's memory. In RAM, where EasyDMA can reach it.
#[repr(C, align(4))]
pub(crate) struct ReceiveBuffer(UnsafeCell<Memory>);

#[repr(C)]
struct Memory {
    halves: [[u8; HALF as usize]; 2],
    /// What the UARTE still holds when it is stopped: at most five bytes, which are not used.
    leftover: [u8; LEFTOVER as usize],
}

/// Room for [`Memory::leftover`].
pub(crate) const LEFTOVER: u32 = 8;

// SAFETY: the program never writes to it, and reads it through `received` only, whose caller
// promises that the UARTE does not write there meanwhile.
unsafe impl Sync for ReceiveBuffer {}

/// One of the two.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Half {
    First,
    Second,
}

impl Half {
    pub(crate) fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

impl ReceiveBuffer {
    pub(crate) const fn new() -> Self {
        Self(UnsafeCell::new(Memory {
            halves: [[0; HALF as usize]; 2],
            leftover: [0; LEFTOVER as usize],
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

    /// Where the UARTE is to write what is left over.
    pub(crate) fn leftover_address(&self) -> u32 {
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
        // SAFETY: inside the memory; initialised since the start; not written meanwhile, as the
        // caller promises. A pointer to this half only, so the other may be written.
        let half: &[u8; HALF as usize] = unsafe {
            match half {
                Half::First => &*addr_of!((*self.0.get()).halves[0]),
                Half::Second => &*addr_of!((*self.0.get()).halves[1]),
            }
        };
        half.get(from as usize..to as usize).unwrap_or_default()
    }
}
