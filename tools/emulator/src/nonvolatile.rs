//! FICR, UICR, NVMC and TEMP: nRF52840 Product Specification, the sections with these names.
//!
//! Writing words of UICR is modelled, but takes no time. Erasing UICR and writing flash are not modelled. The model of
//! TEMP contains only the calibration, which firmware copies from FICR (erratum 66). No temperature is measured, so
//! writing the calibration has no effect.

use crate::peripheral::{ANY, Access, Common, READ_ONLY};

pub(crate) const UICR: u32 = 0x1000_1000;
pub(crate) const NVMC: u32 = 0x4001_E000;

/// NVMC.CONFIG. The value 1 enables writing.
pub(crate) const CONFIG: u32 = 0x504;

/// The value of UICR.APPROTECT and of APPROTECT.DISABLE that opens the debug port.
pub(crate) const UNPROTECTED: u32 = 0x5A;
pub(crate) const APPROTECT: u32 = 0x208;

pub(crate) fn ficr() -> Common {
    // TEMP's calibration, A0 to T4. The values differ from chip to chip, and have no effect here.
    let calibration = (0x404..=0x444).step_by(4).map(|offset| (offset, 0));
    // "AAF0": build code F. From this build code on, the debug port is closed unless the firmware opens it. The other
    // words are the part number, the package (QI), and the sizes of RAM and of flash in KiB.
    let information = [
        (0x100, 0x0005_2840),
        (0x104, 0x4141_4630),
        (0x108, 0x2004),
        (0x10C, 256),
        (0x110, 1024),
    ];
    let all = calibration
        .chain(information)
        .map(|(offset, value)| (offset, value, READ_ONLY));
    Common::new("FICR", 0x1000_0000, &[], all)
}

/// UICR, erased. It survives every reset.
pub(crate) fn uicr() -> Common {
    let words = (0..=0x304)
        .step_by(4)
        .map(|offset| (offset, u32::MAX, Access::Flash(0)));
    Common::new("UICR", UICR, &[], words)
}

pub(crate) fn temp() -> Common {
    // A0 to A5, B0 to B5, T0 to T4, with a gap after each group.
    let calibration = [0x520..=0x534, 0x540..=0x554, 0x560..=0x570].into_iter();
    let calibration = calibration.flat_map(|group| group.step_by(4));
    Common::new(
        "TEMP",
        0x4000_C000,
        &[],
        calibration.map(|offset| (offset, 0, ANY)),
    )
}

pub(crate) fn nvmc() -> Common {
    let registers = [
        // READY and READYNEXT.
        (0x400, 1, READ_ONLY),
        (0x408, 1, READ_ONLY),
        (CONFIG, 0, Access::Plain(0..=1)),
        // ICACHECNF. The cache's profiling is not modelled.
        (0x540, 0, Access::Plain(0..=1)),
    ];
    Common::new("NVMC", NVMC, &[], registers)
}
