//! FICR, UICR and NVMC, as far as start-up code reads them: nRF52840 Product Specification, sections
//! "FICR", "UICR" and "NVMC". Flash is not written by a running firmware here.

/// The device identifier and address of the emulated chip, which no real one has.
const DEVICE: u32 = 0xF4A3_E10C;

/// FICR, from `0x1000_0000`.
pub(crate) fn read_ficr(offset: u32) -> Option<u32> {
    Some(match offset {
        // CODEPAGESIZE in bytes; CODESIZE in pages, and INFO.RAM in KiB.
        0x010 => 4096,
        0x014 | 0x10C => 256,
        // DEVICEID, DEVICEADDRTYPE, DEVICEADDR.
        0x060 | 0x064 | 0x0A4 | 0x0A8 => DEVICE,
        0x0A0 => 1,
        // INFO.PART, VARIANT "AAD0", PACKAGE QI, FLASH in KiB.
        0x100 => 0x52840,
        0x104 => 0x4141_4430,
        0x108 => 0x2004,
        0x110 => 1024,
        _ => return None,
    })
}

/// UICR, from `0x1000_1000`, erased: no pin is the reset pin.
pub(crate) fn read_uicr(offset: u32) -> Option<u32> {
    (offset.is_multiple_of(4) && offset < 0x308).then_some(u32::MAX)
}

/// NVMC, from `0x4001_E000`: READY and CONFIG (read only).
pub(crate) fn read_nvmc(offset: u32) -> Option<u32> {
    match offset {
        0x400 | 0x408 => Some(1),
        0x504 => Some(0),
        _ => None,
    }
}
