/// Reads a little-endian integer of `count` bytes.
fn le(frame: &[u8], at: usize, count: usize) -> u64 {
    let bytes = frame.iter().skip(at).take(count).rev();
    bytes.fold(0, |number, &byte| number << 8 | u64::from(byte))
}

/// Reads a big-endian integer of `count` bytes. Missing bytes at the end count as zero.
fn be(frame: &[u8], at: usize, count: usize) -> u64 {
    let bytes = (at..at + count).map(|at| frame.get(at).copied().unwrap_or_default());
    bytes.fold(0, |number, byte| number << 8 | u64::from(byte))
}

/// Sign-extends a number of `width` bits.
fn signed(number: u64, width: usize) -> i64 {
    (number << (64 - width)) as i64 >> (64 - width)
}

/// Reads `width` bits, from bit `first` on. Bit 0 is the lowest bit of the first byte.
fn bits(frame: &[u8], first: usize, width: usize) -> u64 {
    let mut bytes = frame.iter().skip(first / 8).map(|&byte| u64::from(byte));
    let mut bits = bytes.next().unwrap_or_default() >> (first % 8);
    for (byte, place) in bytes.zip((8 - first % 8..width).step_by(8)) {
        bits |= byte << place;
    }
    bits & u64::MAX >> (64 - width)
}

/// Returns the `N` bytes from index `at` on, or `N` zeros if the frame has fewer bytes there.
fn bytes<const N: usize>(frame: &[u8], at: usize) -> [u8; N] {
    let bytes = frame.get(at..).and_then(<[u8]>::first_chunk);
    bytes.copied().unwrap_or([0; N])
}

/// Returns the frame's bytes from index `at` on, without its last `others` bytes.
fn rest(frame: &[u8], at: usize, others: usize) -> Option<&[u8]> {
    frame.get(at..frame.len().checked_sub(others)?)
}

/// Writes a little-endian integer of `count` bytes. Bits that are already 1 stay 1.
fn put_le(frame: &mut [u8], at: usize, count: usize, number: u64) {
    let place = frame.iter_mut().skip(at).take(count);
    for (byte, it) in place.zip(number.to_le_bytes()) {
        *byte |= it;
    }
}

/// Writes a big-endian integer of `count` bytes. Bits that are already 1 stay 1.
fn put_be(frame: &mut [u8], at: usize, count: usize, number: u64) {
    let place = frame.iter_mut().skip(at).take(count).rev();
    for (byte, it) in place.zip(number.to_le_bytes()) {
        *byte |= it;
    }
}

/// Writes the lowest `width` bits of a number, from bit `first` on. Bits that are already 1 stay 1.
fn put_bits(frame: &mut [u8], first: usize, width: usize, bits: u64) {
    for number in (0..width).filter(|number| bits >> number & 1 == 1) {
        if let Some(byte) = frame.get_mut((first + number) / 8) {
            *byte |= 1 << ((first + number) % 8);
        }
    }
}

/// Writes bytes, from index `at` on. Bits that are already 1 stay 1.
fn put(frame: &mut [u8], at: usize, bytes: &[u8]) {
    for (byte, it) in frame.iter_mut().skip(at).zip(bytes) {
        *byte |= it;
    }
}
