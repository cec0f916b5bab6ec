//! A fast search for the next byte that can start a frame.

#[cfg(kani)]
mod verification;

/// Number of bytes that are examined together.
pub(crate) const BLOCK: usize = 16;

/// Counts the bytes of the leading blocks in which no byte can start a frame.
#[inline]
pub(crate) fn blocks_without_start(bytes: &[u8], starts: impl Fn(u8) -> bool) -> usize {
    let any_starts = |any, &byte: &u8| any | starts(byte);
    let starts_none = |block: &&[u8]| !block.iter().fold(false, any_starts);
    let blocks = bytes.chunks_exact(BLOCK).take_while(starts_none);
    blocks.count().wrapping_mul(BLOCK)
}

/// Counts the leading bytes that cannot start a frame.
#[inline]
pub(crate) fn run_without_start(bytes: &[u8], starts: impl Fn(u8) -> bool) -> usize {
    // Usually the first byte starts the next frame, so the search examines only this byte.
    if bytes.first().is_some_and(|&byte| starts(byte)) {
        return 0;
    }
    let run = blocks_without_start(bytes, &starts);
    let rest = bytes.get(run..).unwrap_or_default().iter();
    run.wrapping_add(rest.take_while(|&&byte| !starts(byte)).count())
}
