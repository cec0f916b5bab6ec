//! Keeps the debug port open, and makes the reset button work.
//!
//! On chips of build code F and later, every reset closes the debug port. If UICR.APPROTECT contained 0x5A at the
//! reset, the firmware can open the port: it writes 0x5A to APPROTECT.DISABLE. The reset button only works if
//! UICR.PSELRESET contains its pin's number.
//!
//! UICR is flash. A word that is written to UICR takes effect at the next reset. Only erasing the whole chip erases
//! UICR. On a board that uses P0.18 for something else, PSELRESET could hold the chip in reset until the
//! chip is erased. So the firmware writes to UICR only with the feature `write-uicr`. APPROTECT.DISABLE is a register,
//! and loses its value at each reset.

use cortex_m::peripheral::SCB;
use nrf52840_hal::pac::{FICR, NVMC, UICR};

use crate::settings::{RESET_PIN, WRITE_UICR};

/// The first build code of chips that close the debug port by themselves.
const CLOSES_BY_ITSELF: u8 = b'F';
/// The register APPROTECT.DISABLE, which the PAC does not have.
const APPROTECT_DISABLE: *mut u32 = 0x4000_0558 as *mut u32;
/// The value that keeps the port open, in UICR.APPROTECT and in APPROTECT.DISABLE.
const OPEN: u32 = 0x5A;
const ERASED: u32 = u32::MAX;

/// Opens the debug port until the next reset, if UICR allows that. With [`WRITE_UICR`], writes the words of UICR that
/// are still erased, and resets the chip if a word was written, so that the word takes effect.
pub(crate) fn keep_open(ficr: &FICR, uicr: &UICR, nvmc: &NVMC) {
    // The register contains, for example, "AAF0", with "0" in the lowest byte. The F is the letter of the build code.
    let [_, build_code, ..] = ficr.info.variant.read().bits().to_le_bytes();
    let closes_by_itself = build_code >= CLOSES_BY_ITSELF;
    if closes_by_itself {
        // SAFETY: these chips have this register, and writing it only opens the debug port.
        unsafe { APPROTECT_DISABLE.write_volatile(OPEN) };
    }
    if WRITE_UICR && write(uicr, nvmc, closes_by_itself) {
        SCB::sys_reset();
    }
}

/// Writes PSELRESET, and APPROTECT if `closes_by_itself`, where still erased. Returns whether a word was written.
fn write(uicr: &UICR, nvmc: &NVMC, closes_by_itself: bool) -> bool {
    let mut is_new = closes_by_itself && write_once(nvmc, uicr.approtect.as_ptr(), OPEN);
    // The chip uses the reset pin only if both words contain the same number.
    for word in &uicr.pselreset {
        is_new |= write_once(nvmc, word.as_ptr(), RESET_PIN);
    }
    is_new
}

/// Writes a word of UICR if it is erased. Returns true only if the word was erased and now reads as `value`. So a word
/// that cannot be written does not cause a reset at every start.
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
