//! Runs of bytes that start no frame, for slices: fast through noise.

#[cfg(kani)]
mod verification;

/// Bytes that are looked at together.
pub(crate) const BLOCK: usize = 16;

/// How many bytes, from the first on, start no frame, as far as whole blocks of them tell.
#[inline]
pub(crate) fn blocks_without_start(bytes: &[u8], starts: impl Fn(u8) -> bool) -> usize {
    let any_starts = |any, &byte: &u8| any | starts(byte);
    let starts_none = |block: &&[u8]| !block.iter().fold(false, any_starts);
    let blocks = bytes.chunks_exact(BLOCK).take_while(starts_none);
    blocks.count().wrapping_mul(BLOCK)
}

/// How many bytes, from the first on, start no frame.
#[inline]
pub(crate) fn run_without_start(bytes: &[u8], starts: impl Fn(u8) -> bool) -> usize {
    // The usual case, a frame behind a frame, costs one byte.
    if bytes.first().is_some_and(|&byte| starts(byte)) {
        return 0;
    }
    let run = blocks_without_start(bytes, &starts);
    let rest = bytes.get(run..).unwrap_or_default().iter();
    run.wrapping_add(rest.take_while(|&&byte| !starts(byte)).count())
}
