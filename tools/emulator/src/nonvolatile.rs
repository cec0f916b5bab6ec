//! FICR, UICR, NVMC and TEMP: nRF52840 Product Specification, the sections with these names.
//!
//! Writing words of UICR is modelled, but takes no time. Erasing UICR and writing flash are not modelled. The model of
//! TEMP contains only the calibration, which firmware copies from FICR (erratum 66). No temperature is measured, so
//! writing the calibration has no effect, and reading it is an error.

use std::collections::BTreeMap;

use crate::error::Refusal;
use crate::peripheral::Context;

const FICR: u32 = 0x1000_0000;
const UICR: u32 = 0x1000_1000;
const TEMP: u32 = 0x4000_C000;
const NVMC: u32 = 0x4001_E000;

const FICR_PART: u32 = 0x100;
const FICR_VARIANT: u32 = 0x104;
/// "AAF0": build code F. From this build code on, the debug port is closed unless the firmware opens it.
const VARIANT: u32 = 0x4141_4630;

/// The offsets of TEMP's calibration in FICR, A0 to T4. The values differ from chip to chip, and have no
/// effect here.
const FICR_TEMP: std::ops::RangeInclusive<u32> = 0x404..=0x444;

/// The offsets of the calibration in TEMP: A0 to A5, B0 to B5, T0 to T4, with a gap after each group.
const CALIBRATION: [std::ops::RangeInclusive<u32>; 3] =
    [0x520..=0x534, 0x540..=0x554, 0x560..=0x570];

const UICR_APPROTECT: u32 = 0x208;
const UICR_LAST: u32 = 0x304;

const READY: u32 = 0x400;
const READYNEXT: u32 = 0x408;
const CONFIG: u32 = 0x504;
const ICACHECNF: u32 = 0x540;
const WRITE_ENABLED: u32 = 1;

/// The value of UICR.APPROTECT and of APPROTECT.DISABLE that opens the debug port.
pub(crate) const UNPROTECTED: u32 = 0x5A;

/// UICR, which survives every reset, and NVMC's registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nonvolatile {
    /// The words of UICR that have been written since they were erased.
    uicr: BTreeMap<u32, u32>,
    /// The bits of words of UICR that can no longer be written.
    pub(crate) broken: BTreeMap<u32, u32>,
    configuration: u32,
    cache: u32,
    /// UICR.APPROTECT at the last reset. Later changes take effect at the next reset.
    pub(crate) protection: u32,
}

impl Nonvolatile {
    /// Resets NVMC's registers, and reads UICR.APPROTECT again.
    pub(crate) fn reset(&mut self) {
        self.protection = self.word(UICR_APPROTECT);
        self.configuration = 0;
        self.cache = 0;
    }

    fn word(&self, offset: u32) -> u32 {
        self.uicr.get(&offset).copied().unwrap_or(u32::MAX)
    }

    pub(crate) fn caches(&self) -> bool {
        self.cache == 1
    }

    pub(crate) fn read(&self, base: u32, offset: u32) -> Option<u32> {
        Some(match (base, offset) {
            (FICR, FICR_PART) => 0x0005_2840,
            (FICR, FICR_VARIANT) => VARIANT,
            (FICR, offset) if FICR_TEMP.contains(&offset) => 0,
            (UICR, ..=UICR_LAST) => self.word(offset),
            (NVMC, READY | READYNEXT) => 1,
            (NVMC, CONFIG) => self.configuration,
            (NVMC, ICACHECNF) => self.cache,
            _ => return None,
        })
    }

    pub(crate) fn write(
        &mut self,
        base: u32,
        offset: u32,
        value: u32,
        context: &mut Context,
    ) -> Option<()> {
        match (base, offset) {
            (UICR, _) if self.configuration != WRITE_ENABLED => {
                let address = base + offset;
                context.refuse(Refusal::UicrNotWritable { address });
                return None;
            }
            // In flash, writing changes bits only from 1 to 0.
            (UICR, ..=UICR_LAST) => {
                let broken = self.broken.get(&offset).copied().unwrap_or(0);
                let written = self.word(offset) & (value | broken);
                self.uicr.insert(offset, written);
            }
            (NVMC, CONFIG) if value <= WRITE_ENABLED => self.configuration = value,
            // The cache's profiling is not modelled.
            (NVMC, ICACHECNF) if value <= 1 => self.cache = value,
            (TEMP, _) if CALIBRATION.iter().any(|group| group.contains(&offset)) => {}
            _ => return None,
        }
        Some(())
    }
}

/// Returns the name of the peripheral at `base`, if it is one of these four.
pub(crate) fn name(base: u32) -> Option<&'static str> {
    let names = [
        (FICR, "FICR"),
        (UICR, "UICR"),
        (TEMP, "TEMP"),
        (NVMC, "NVMC"),
    ];
    let found = names.iter().find(|(one, _)| *one == base);
    found.map(|(_, name)| *name)
}
