//! Sixteen channels of 11 bits, the lowest bits first: SBUS and CRSF send them so.

pub(crate) const BYTES: usize = 22;

#[inline]
pub(crate) fn unpack(bytes: &[u8; BYTES]) -> [u16; 16] {
    let mut channels = [0; 16];
    let mut bit = 0_u32;
    for channel in &mut channels {
        // Four bytes have it; the last four, from 18 on, have the last two channels.
        let at = (bit / 8).min(18);
        let shift = bit.wrapping_sub(at.wrapping_mul(8));
        let four = bytes.get(at as usize..).and_then(<[u8]>::first_chunk);
        let bits = u32::from_le_bytes(four.copied().unwrap_or_default());
        *channel = (bits.wrapping_shr(shift) & 0x7FF) as u16;
        bit = bit.wrapping_add(11);
    }
    channels
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
