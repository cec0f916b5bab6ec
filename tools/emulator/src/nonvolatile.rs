//! FICR, UICR and NVMC: nRF52840 Product Specification, the sections of these names.
//!
//! Writing words of UICR is modelled, without the time it takes; erasing, and writing flash, are not.

use std::collections::BTreeMap;

pub(crate) const FICR: u32 = 0x1000_0000;
pub(crate) const UICR: u32 = 0x1000_1000;
pub(crate) const NVMC: u32 = 0x4001_E000;

const FICR_PART: u32 = 0x100;
const FICR_VARIANT: u32 = 0x104;
/// "AAF0": build code F, the first whose debug port is closed unless the firmware opens it.
const VARIANT: u32 = 0x4141_4630;

/// TEMP's calibration, A0 to T4. It differs from chip to chip, and has no effect here.
const FICR_TEMP: std::ops::RangeInclusive<u32> = 0x404..=0x444;

const UICR_APPROTECT: u32 = 0x208;
const UICR_LAST: u32 = 0x304;

const READY: u32 = 0x400;
const READYNEXT: u32 = 0x408;
const CONFIG: u32 = 0x504;
const ICACHECNF: u32 = 0x540;
const WRITE_ENABLED: u32 = 1;

/// Opens the debug port: the same value in UICR.APPROTECT and APPROTECT.DISABLE.
pub(crate) const UNPROTECTED: u32 = 0x5A;

/// What survives every reset, and the cache of the instructions in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nonvolatile {
    /// Words of UICR that are not as erased.
    uicr: BTreeMap<u32, u32>,
    configuration: u32,
    cache: u32,
    /// UICR.APPROTECT at the last reset, which is when it counts.
    pub(crate) protection: u32,
}

impl Nonvolatile {
    /// NVMC's registers are reset, UICR is read anew.
    pub(crate) fn reset(&mut self) {
        self.protection = self.word(UICR_APPROTECT);
        self.configuration = 0;
        self.cache = 0;
    }

    fn word(&self, offset: u32) -> u32 {
        self.uicr.get(&offset).copied().unwrap_or(u32::MAX)
    }

    /// Whether CONFIG lets UICR be written.
    pub(crate) fn is_writable(&self) -> bool {
        self.configuration == WRITE_ENABLED
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

    pub(crate) fn write(&mut self, base: u32, offset: u32, value: u32) -> Option<()> {
        match (base, offset) {
            // As in all flash, bits go from 1 to 0 only.
            (UICR, ..=UICR_LAST) if self.is_writable() => {
                self.uicr.insert(offset, self.word(offset) & value);
            }
            (NVMC, CONFIG) if value <= WRITE_ENABLED => self.configuration = value,
            // Without its profiling.
            (NVMC, ICACHECNF) if value <= 1 => self.cache = value,
            _ => return None,
        }
        Some(())
    }
}
