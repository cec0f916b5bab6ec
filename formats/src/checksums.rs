//! The checks: together they have one table, CRSF's. Each goes on from what it is given, so that several pieces
//! can be checked one behind the other. None is inlined: a frame takes one call or two.

/// CRC-8/DVB-S2: polynomial 0xD5, initial value 0, not reflected.
#[inline(never)]
pub(crate) fn crc8_dvb_s2(crc: u8, bytes: &[u8]) -> u8 {
    bytes.iter().fold(crc, |crc, byte| {
        let remainder = REMAINDERS.get(usize::from(crc ^ byte));
        remainder.copied().unwrap_or_default()
    })
}

/// What each byte makes of the CRC. Tables for half bytes would be 224 bytes smaller, but take half as long again.
const REMAINDERS: [u8; 256] = {
    let mut remainders = [0; 256];
    let mut rest: &mut [u8] = &mut remainders;
    let mut byte = 0_u8;
    while let Some((remainder, behind)) = rest.split_first_mut() {
        let mut register = byte;
        let mut bit = 0_u8;
        while bit < 8 {
            let divisor = if register & 0x80 == 0 { 0 } else { 0xD5 };
            register = register << 1 ^ divisor;
            bit = bit.wrapping_add(1);
        }
        *remainder = register;
        byte = byte.wrapping_add(1);
        rest = behind;
    }
    remainders
};

/// CRC-16/MCRF4XX, which MAVLink calls X.25: polynomial 0x1021, initial value 0xFFFF, reflected.
///
/// Four bytes at once, without a table. With `y` for `1/x`, the quotient of 32 bits by `x^16 + x^12 + x^5 + 1` is
/// the bits times `1 / (1 + y^4 + y^11 + y^16)`. Up to `y^31` that is
/// `(1 + y^8 + y^22)(1 + (y^4 + y^11)(1 + y^16))`. The remainder is the last 16 bits of the quotient times
/// `1 + x^5 + x^12`.
#[inline(never)]
pub(crate) fn crc16_mcrf4xx(crc: u16, bytes: &[u8]) -> u16 {
    let (mut wide, mut rest) = (u32::from(crc), bytes);
    while let Some((four, behind)) = rest.split_first_chunk() {
        let bits = u32::from_le_bytes(*four) ^ wide;
        let bits = bits ^ bits << 8 ^ bits << 22;
        let both = bits << 4 ^ bits << 11;
        let quotient = bits ^ both ^ both << 16;
        wide = (quotient ^ quotient >> 5 ^ quotient >> 12) >> 16;
        rest = behind;
    }
    let [low, high, ..] = wide.to_le_bytes();
    let crc = u16::from_le_bytes([low, high]);
    rest.iter().fold(crc, |crc, byte| {
        let [low, _] = crc.to_le_bytes();
        let low = low ^ byte;
        let low = u16::from(low ^ low << 4);
        crc >> 8 ^ low << 8 ^ low << 3 ^ low >> 4
    })
}

/// Fletcher's checksum with sums of 8 bits, as RFC 1145 has it: the sum of the bytes, and the sum of those sums.
#[inline(never)]
pub(crate) fn fletcher8(sums: [u8; 2], bytes: &[u8]) -> [u8; 2] {
    // As wide as registers, which the sums' lower bytes do not notice.
    let [mut a, mut b] = sums.map(u32::from);
    for &byte in bytes {
        a = a.wrapping_add(byte.into());
        b = b.wrapping_add(a);
    }
    [a.to_le_bytes()[0], b.to_le_bytes()[0]]
}
