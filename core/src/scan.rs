//! Looking at a block of bytes at once. Safe code, in a shape that compilers turn into vector
//! instructions where there are any.

/// Bytes looked at together: a bit for each fills a `u64`.
pub(crate) const BLOCK: usize = u64::BITS as usize;

/// How many bytes at the head of `bytes` are not `wanted`: its index, or the whole length.
pub(crate) fn run_without(wanted: u8, bytes: &[u8]) -> usize {
    let mut skipped = 0;
    let mut rest = bytes;
    while let Some((block, behind)) = rest.split_first_chunk() {
        let mut places = Places::ALL;
        places.keep(wanted, block);
        if places.any() {
            break;
        }
        skipped += BLOCK;
        rest = behind;
    }
    skipped
        + rest
            .iter()
            .position(|&byte| byte == wanted)
            .unwrap_or(rest.len())
}

/// Some of the places in a block: 1 for each that is meant, 0 for the others.
pub(crate) struct Places([u8; BLOCK]);

impl Places {
    pub(crate) const ALL: Self = Self([1; BLOCK]);

    /// Keeps those where the block holds `wanted`.
    #[inline]
    pub(crate) fn keep(&mut self, wanted: u8, block: &[u8; BLOCK]) {
        for (kept, &byte) in self.0.iter_mut().zip(block) {
            *kept &= u8::from(byte == wanted);
        }
    }

    /// Whether there is any.
    #[inline]
    fn any(&self) -> bool {
        self.0.iter().fold(0, |any, &kept| any | kept) != 0
    }

    /// A bit for each place, the first place's lowest.
    #[inline]
    pub(crate) fn bits(&self) -> u64 {
        if !self.any() {
            return 0;
        }
        // Eight at a time: the product's highest byte is the sum of the eight bytes, each shifted
        // to its own bit, and no other sum reaches it.
        self.0.chunks_exact(8).rev().fold(0, |bits, eight| {
            let eight = eight
                .first_chunk()
                .map_or(0, |eight| u64::from_le_bytes(*eight));
            let [.., gathered] = eight.wrapping_mul(0x0102_0408_1020_4080).to_le_bytes();
            bits << 8 | u64::from(gathered)
        })
    }
}
