//! Checks a layout's checksum.

use super::{get, reject_if};
use crate::layout::{Algorithm, Checksum, Contradiction, Crc, Layout, Part, Table, index};

const OUTSIDE: &str = "checksum: it is outside of the shortest or the longest frame: change at, or count it from the other end";
const NOT_COVERED: &str = "checksum: the bytes that it covers are outside of the shortest or the longest frame, or from is after to";

/// Checks the checksum in a frame of `length` bytes.
pub(super) const fn check_checksum(layout: &Layout, length: usize) -> Result<(), Contradiction> {
    let Some(checksum) = &layout.checksum else {
        return Ok(());
    };
    if let Err(contradiction) = check_algorithm(checksum) {
        return Err(contradiction);
    }
    let Some(at) = index(checksum.at, length) else {
        return Err(Contradiction::new(Part::Checksum, OUTSIDE));
    };
    let end = at.saturating_add(checksum.encoded_bytes());
    reject_if!(end > length, Part::Checksum, OUTSIDE);
    let (from, to) = match (index(checksum.from, length), index(checksum.to, length)) {
        // In a frame without payload, the range that the checksum covers may be empty.
        (Some(from), Some(to)) if from <= to.saturating_add(1) && to < length => (from, to),
        _ => return Err(Contradiction::new(Part::Checksum, NOT_COVERED)),
    };
    reject_if!(
        from < end && at <= to,
        Part::Checksum,
        "checksum: it covers itself: give from and to, the first and the last byte that it covers"
    );
    let is_behind = at >= length.saturating_sub(layout.behind);
    reject_if!(
        at < layout.sync.length || !is_behind && layout.terminator_at(length) < end,
        Part::Checksum,
        "checksum: it overlaps the sync or the terminator"
    );
    Ok(())
}

const fn check_algorithm(checksum: &Checksum) -> Result<(), Contradiction> {
    let bytes = match &checksum.algorithm {
        Algorithm::Crc(crc) => {
            if let Err(contradiction) = check_crc(crc) {
                return Err(contradiction);
            }
            crc.width.div_ceil(8) as usize
        }
        Algorithm::Xor => 1,
        Algorithm::XorWords | Algorithm::Fletcher => 2,
        Algorithm::Sum | Algorithm::CarrySum | Algorithm::SumWords => checksum.bytes,
    };
    reject_if!(
        checksum.bytes < 1 || checksum.bytes > 4,
        Part::Checksum,
        "checksum: it must have 1 to 4 bytes"
    );
    let has_start = checksum.initial != 0 || checksum.over_hex_digits;
    reject_if!(
        has_start && matches!(checksum.algorithm, Algorithm::Crc(_) | Algorithm::Fletcher),
        Part::Checksum,
        "checksum: initial and hex digits are for sums and XORs: a CRC has its own initial value"
    );
    reject_if!(
        checksum.bytes != bytes,
        Part::Checksum,
        "checksum: the algorithm needs another number of bytes: xor 1, xor of words and Fletcher 2, a CRC its width / 8, rounded \
         up"
    );
    Ok(())
}

const fn check_crc(crc: &Crc) -> Result<(), Contradiction> {
    reject_if!(
        crc.width < 8 || crc.width > 32,
        Part::Checksum,
        "checksum: the width of a CRC must be 8 to 32 bits"
    );
    let bits = u32::MAX.wrapping_shr(32_u32.wrapping_sub(crc.width));
    reject_if!(
        (crc.polynomial | crc.initial | crc.xor_out) & !bits != 0,
        Part::Checksum,
        "checksum: the polynomial, the initial or the xored value has more bits than width: leave out the highest power"
    );
    reject_if!(
        crc.polynomial == 0,
        Part::Checksum,
        "checksum: the polynomial is 0, which detects no wrong byte"
    );
    reject_if!(
        matches!(crc.table, Table::Bytes(_)) && crc.width != 8,
        Part::Checksum,
        "checksum: a table of bytes is only for a CRC of 8 bits: give a table of words"
    );
    // In a correct table, the entry of this byte is the polynomial, so the table of another polynomial has another
    // entry here.
    let byte = if crc.reflected_in { 0x80_u8 } else { 1 };
    let is_its_own = match crc.table {
        Table::None => true,
        Table::Bytes(table) => {
            matches!(get(table, byte as usize), Some(entry) if entry == crc.narrow(byte))
        }
        Table::Words(table) => {
            matches!(get(table, byte as usize), Some(entry) if entry == crc.remainder(byte))
        }
    };
    reject_if!(
        !is_its_own,
        Part::Checksum,
        "checksum: the table belongs to another CRC: compute it from the same parameters"
    );
    Ok(())
}
