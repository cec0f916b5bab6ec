//! The debug port and the reset button, which an erased chip is without.
//!
//! Chips of build code F and later close the debug port at every reset, unless UICR.APPROTECT says 0x5A
//! by then and the firmware writes the same to APPROTECT.DISABLE. UICR is flash: a word of it is
//! written once, counts from the next reset on, and only erasing the whole chip brings it back.

use cortex_m::peripheral::SCB;
use nrf52840_hal::pac::{FICR, NVMC, UICR};

use crate::settings::{KEEP_DEBUGGABLE, RESET_PIN};

/// The first build code that closes the debug port by itself.
const CLOSES_BY_ITSELF: u8 = b'F';
/// POWER's register APPROTECT.DISABLE, which the PAC does not have.
const APPROTECT_DISABLE: *mut u32 = 0x4000_0558 as *mut u32;
/// What keeps the port open, in both places.
const OPEN: u32 = 0x5A;
const ERASED: u32 = u32::MAX;

/// Opens the debug port until the next reset, and writes those words of UICR that are erased. If it
/// wrote any it resets the chip, so that they count.
pub(crate) fn keep_open(ficr: &FICR, uicr: &UICR, nvmc: &NVMC) {
    if !KEEP_DEBUGGABLE {
        return;
    }
    let mut is_new = false;
    // Four letters, the build code in the last two: "AAF0".
    let [_, build_code, ..] = ficr.info.variant.read().bits().to_le_bytes();
    if build_code >= CLOSES_BY_ITSELF {
        // SAFETY: a register of its own on these chips; all that it does is open the debug port.
        unsafe { APPROTECT_DISABLE.write_volatile(OPEN) };
        is_new |= write_once(nvmc, uicr.approtect.as_ptr(), OPEN);
    }
    // The pin counts if both say the same.
    for word in &uicr.pselreset {
        is_new |= write_once(nvmc, word.as_ptr(), RESET_PIN);
    }
    if is_new {
        SCB::sys_reset();
    }
}

/// Writes a word of UICR if it is erased. Returns whether it did, and the word is there: one that
/// could not be written must not lead to a reset at every start.
#[inline(never)]
fn write_once(nvmc: &NVMC, word: *mut u32, value: u32) -> bool {
    // SAFETY: a register's address, from the PAC.
    if unsafe { word.read_volatile() } != ERASED {
        return false;
    }
    nvmc.config.write(|w| w.wen().wen());
    // SAFETY: the word is UICR's, erased, and writing is enabled; nothing else uses the NVMC.
    unsafe { word.write_volatile(value) };
    cortex_m::asm::dsb();
    while nvmc.ready.read().ready().is_busy() {}
    nvmc.config.reset();
    // SAFETY: as above.
    unsafe { word.read_volatile() == value }
}
