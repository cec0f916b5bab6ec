//! Sixteen channels of 11 bits, the lowest bits first: SBUS and CRSF send them so.

pub(crate) const BYTES: usize = 22;

pub(crate) fn unpack(bytes: &[u8; BYTES]) -> [u16; 16] {
    let mut bytes = bytes.iter();
    let (mut bits, mut count) = (0_u32, 0_u32);
    [(); 16].map(|()| {
        while count < 11 {
            let byte = bytes.next().copied().unwrap_or_default();
            bits |= u32::from(byte).wrapping_shl(count);
            count = count.wrapping_add(8);
        }
        let channel = bits & 0x7FF;
        bits >>= 11;
        count = count.wrapping_sub(11);
        channel as u16
    })
}

/// Of each channel the lower 11 bits.
pub(crate) fn pack(channels: &[u16; 16]) -> [u8; BYTES] {
    let mut channels = channels.iter();
    let (mut bits, mut count) = (0_u32, 0_u32);
    [(); BYTES].map(|()| {
        if count < 8 {
            let channel = channels.next().copied().unwrap_or_default() & 0x7FF;
            bits |= u32::from(channel).wrapping_shl(count);
            count = count.wrapping_add(11);
        }
        let [byte, ..] = bits.to_le_bytes();
        bits >>= 8;
        count = count.wrapping_sub(8);
        byte
    })
}
