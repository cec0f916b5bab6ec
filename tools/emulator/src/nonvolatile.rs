//! FICR, UICR, NVMC and TEMP: nRF52840 Product Specification, the sections with these names.
//!
//! Writing words of UICR is modelled, but takes no time. Erasing UICR and writing flash are not modelled. The model of
//! TEMP contains only the calibration, which firmware copies from FICR (erratum 66). No temperature is measured, so
//! writing the calibration has no effect.

use std::collections::BTreeMap;

use crate::peripheral::{ANY, Common, Plain, READ_ONLY};

/// UICR's address.
pub(crate) const UICR: u32 = 0x1000_1000;

/// The offsets of TEMP's calibration in FICR, A0 to T4. The values differ from chip to chip, and have no
/// effect here.
const FICR_TEMP: std::ops::RangeInclusive<u32> = 0x404..=0x444;
/// The offsets of the calibration in TEMP: A0 to A5, B0 to B5, T0 to T4, with a gap after each group.
const CALIBRATION: [std::ops::RangeInclusive<u32>; 3] =
    [0x520..=0x534, 0x540..=0x554, 0x560..=0x570];

/// NVMC.CONFIG. The value 1 enables writing.
pub(crate) const CONFIG: u32 = 0x504;

/// The value of UICR.APPROTECT and of APPROTECT.DISABLE that opens the debug port.
pub(crate) const UNPROTECTED: u32 = 0x5A;
const UICR_APPROTECT: u32 = 0x208;
const UICR_LAST: u32 = 0x304;

pub(crate) fn ficr() -> Common {
    // "AAF0": build code F. From this build code on, the debug port is closed unless the firmware opens it.
    let mut plain = vec![
        (0x100, 0x0005_2840, READ_ONLY),
        (0x104, 0x4141_4630, READ_ONLY),
        // The package QI, and KiB of RAM and of flash.
        (0x108, 0x2004, READ_ONLY),
        (0x10C, 256, READ_ONLY),
        (0x110, 1024, READ_ONLY),
    ];
    plain.extend(FICR_TEMP.step_by(4).map(|offset| (offset, 0, READ_ONLY)));
    Common::new("FICR", 0x1000_0000, &[], &[], &plain)
}

pub(crate) fn temp() -> Common {
    let calibration = CALIBRATION.into_iter().flat_map(|group| group.step_by(4));
    let plain: Vec<Plain> = calibration.map(|offset| (offset, 0, ANY)).collect();
    Common::new("TEMP", 0x4000_C000, &[], &[], &plain)
}

pub(crate) fn nvmc() -> Common {
    // READY, READYNEXT, and ICACHECNF. The cache's profiling is not modelled.
    let [ready, next, cache] = [
        (0x400, 1, READ_ONLY),
        (0x408, 1, READ_ONLY),
        (0x540, 0, 0..=1),
    ];
    let plain = [ready, next, cache, (CONFIG, 0, 0..=1)];
    Common::new("NVMC", 0x4001_E000, &[], &[], &plain)
}

/// UICR, which survives every reset.
#[derive(Debug, Default)]
pub(crate) struct Uicr {
    /// The words that have been written since they were erased.
    words: BTreeMap<u32, u32>,
    /// The bits of words that can no longer be written.
    pub(crate) broken: BTreeMap<u32, u32>,
    /// APPROTECT at the last reset. Later changes take effect at the next reset.
    protection: u32,
}

impl Uicr {
    /// Reads APPROTECT again.
    pub(crate) fn reset(&mut self) {
        self.protection = self.words.get(&UICR_APPROTECT).copied().unwrap_or(u32::MAX);
    }

    pub(crate) fn opens_debug_port(&self) -> bool {
        self.protection == UNPROTECTED
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        (offset <= UICR_LAST).then(|| self.words.get(&offset).copied().unwrap_or(u32::MAX))
    }

    /// Writes a word. In flash, writing changes bits only from 1 to 0.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let broken = self.broken.get(&offset).copied().unwrap_or(0);
        let written = self.read(offset)? & (value | broken);
        self.words.insert(offset, written);
        Some(())
    }
}
