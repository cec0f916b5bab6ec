//! The checks, small rather than fast: together they have a table of 32 bytes. Each goes on from what it is
//! given, so that several pieces can be checked one behind the other. None is inlined: a frame takes one call or two.

/// CRC-8/DVB-S2: polynomial 0xD5, initial value 0, not reflected.
#[inline(never)]
pub(crate) fn crc8_dvb_s2(crc: u8, bytes: &[u8]) -> u8 {
    bytes.iter().fold(crc, |crc, byte| {
        // It is linear: what the upper half of the byte makes of it, and what the lower does.
        let [upper, lower] = [(crc ^ byte) >> 4, (crc ^ byte) & 0x0F];
        entry(&UPPER, upper) ^ entry(&LOWER, lower)
    })
}

/// The remainders of 0x00, 0x10, .. 0xF0, and of 0x00 to 0x0F.
#[rustfmt::skip]
const UPPER: [u8; 16] = [
    0x00, 0x52, 0xA4, 0xF6, 0x9D, 0xCF, 0x39, 0x6B, 0xEF, 0xBD, 0x4B, 0x19, 0x72, 0x20, 0xD6, 0x84,
];
#[rustfmt::skip]
const LOWER: [u8; 16] = [
    0x00, 0xD5, 0x7F, 0xAA, 0xFE, 0x2B, 0x81, 0x54, 0x29, 0xFC, 0x56, 0x83, 0xD7, 0x02, 0xA8, 0x7D,
];

#[inline]
fn entry(table: &[u8; 16], place: u8) -> u8 {
    table.get(usize::from(place)).copied().unwrap_or_default()
}

/// CRC-16/MCRF4XX, which MAVLink calls X.25: polynomial 0x1021, initial value 0xFFFF, reflected.
#[inline(never)]
pub(crate) fn crc16_mcrf4xx(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, byte| {
        let [low, _] = crc.to_le_bytes();
        let low = low ^ byte;
        let low = u16::from(low ^ low << 4);
        crc >> 8 ^ low << 8 ^ low << 3 ^ low >> 4
    })
}

/// Fletcher's checksum with sums of 8 bits, as RFC 1145 has it: the sum of the bytes, and the sum of those sums.
#[inline(never)]
pub(crate) fn fletcher8(sums: [u8; 2], bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold(sums, |[a, b], &byte| {
        let a = a.wrapping_add(byte);
        [a, b.wrapping_add(a)]
    })
}
