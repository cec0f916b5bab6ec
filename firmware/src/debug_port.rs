//! The debug port and the reset button, neither of which works on an erased chip.
//!
//! On chips of build code F and later, every reset closes the debug port. If UICR.APPROTECT contained 0x5A at the
//! reset, the firmware can open the port: it writes 0x5A to APPROTECT.DISABLE. UICR is flash. Each word of UICR can be
//! written once, and takes effect at the next reset. Only erasing the whole chip erases UICR.

use cortex_m::peripheral::SCB;
use nrf52840_hal::pac::{FICR, NVMC, UICR};

use crate::settings::{KEEP_DEBUGGABLE, RESET_PIN};

/// The first build code of chips that close the debug port by themselves.
const CLOSES_BY_ITSELF: u8 = b'F';
/// POWER's register APPROTECT.DISABLE, which the PAC does not have.
const APPROTECT_DISABLE: *mut u32 = 0x4000_0558 as *mut u32;
/// The value that keeps the port open, in both registers.
const OPEN: u32 = 0x5A;
const ERASED: u32 = u32::MAX;

/// Opens the debug port until the next reset, and writes the words of UICR that are still erased. Resets the chip
/// if a word was written, so that the word takes effect.
pub(crate) fn keep_open(ficr: &FICR, uicr: &UICR, nvmc: &NVMC) {
    if !KEEP_DEBUGGABLE {
        return;
    }
    let mut is_new = false;
    // The variant has four characters, for example "AAF0". The last two are the build code.
    let [_, build_code, ..] = ficr.info.variant.read().bits().to_le_bytes();
    if build_code >= CLOSES_BY_ITSELF {
        // SAFETY: these chips have this register, and writing it only opens the debug port.
        unsafe { APPROTECT_DISABLE.write_volatile(OPEN) };
        is_new |= write_once(nvmc, uicr.approtect.as_ptr(), OPEN);
    }
    // The chip uses the reset pin only if both words contain the same number.
    for word in &uicr.pselreset {
        is_new |= write_once(nvmc, word.as_ptr(), RESET_PIN);
    }
    if is_new {
        SCB::sys_reset();
    }
}

/// Writes a word of UICR if it is erased. Returns true only if the word was erased and now reads as `value`. Otherwise
/// a word that cannot be written would cause a reset at every start.
#[inline(never)]
fn write_once(nvmc: &NVMC, word: *mut u32, value: u32) -> bool {
    // SAFETY: the address is from the PAC and belongs to a register.
    if unsafe { word.read_volatile() } != ERASED {
        return false;
    }
    nvmc.config.write(|w| w.wen().wen());
    // SAFETY: the word belongs to UICR and is erased, writing is enabled, and nothing else uses the NVMC.
    unsafe { word.write_volatile(value) };
    cortex_m::asm::dsb();
    while nvmc.ready.read().ready().is_busy() {}
    nvmc.config.reset();
    // SAFETY: as above.
    unsafe { word.read_volatile() == value }
}
