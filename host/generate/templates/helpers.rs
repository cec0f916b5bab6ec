/// Reads a number of `count` bytes, little-endian.
fn le(frame: &[u8], at: usize, count: usize) -> u64 {
    let bytes = frame.iter().skip(at).take(count).rev();
    bytes.fold(0, |number, &byte| number << 8 | u64::from(byte))
}

/// Reads a number of `count` bytes, big-endian. Missing bytes at the end are zero.
fn be(frame: &[u8], at: usize, count: usize) -> u64 {
    let bytes = (at..at + count).map(|at| frame.get(at).copied().unwrap_or_default());
    bytes.fold(0, |number, byte| number << 8 | u64::from(byte))
}

/// Extends the sign of a number of `width` bits.
fn signed(number: u64, width: usize) -> i64 {
    (number << (64 - width)) as i64 >> (64 - width)
}

/// Reads `width` bits, from bit `first` on: bit 0 is the lowest bit of the first byte.
fn bits(frame: &[u8], first: usize, width: usize) -> u64 {
    let mut bytes = frame.iter().skip(first / 8).map(|&byte| u64::from(byte));
    let mut bits = bytes.next().unwrap_or_default() >> (first % 8);
    for (byte, place) in bytes.zip((8 - first % 8..width).step_by(8)) {
        bits |= byte << place;
    }
    bits & u64::MAX >> (64 - width)
}

/// Returns `N` bytes from index `at` on, or zeros if there are fewer.
fn bytes<const N: usize>(frame: &[u8], at: usize) -> [u8; N] {
    let bytes = frame.get(at..).and_then(<[u8]>::first_chunk);
    bytes.copied().unwrap_or([0; N])
}

/// Returns the bytes from index `at` on, without the last `others` bytes.
fn rest(frame: &[u8], at: usize, others: usize) -> Option<&[u8]> {
    frame.get(at..frame.len().checked_sub(others)?)
}

/// Writes a number of `count` bytes, little-endian, into bytes that are zero.
fn put_le(frame: &mut [u8], at: usize, count: usize, number: u64) {
    let place = frame.iter_mut().skip(at).take(count);
    for (byte, it) in place.zip(number.to_le_bytes()) {
        *byte |= it;
    }
}

/// Writes a number of `count` bytes, big-endian, into bytes that are zero.
fn put_be(frame: &mut [u8], at: usize, count: usize, number: u64) {
    let place = frame.iter_mut().skip(at).take(count).rev();
    for (byte, it) in place.zip(number.to_le_bytes()) {
        *byte |= it;
    }
}

/// Writes `width` bits, from bit `first` on, into bits that are zero.
fn put_bits(frame: &mut [u8], first: usize, width: usize, bits: u64) {
    for number in (0..width).filter(|number| bits >> number & 1 == 1) {
        if let Some(byte) = frame.get_mut((first + number) / 8) {
            *byte |= 1 << ((first + number) % 8);
        }
    }
}

/// Writes bytes, from index `at` on, into bytes that are zero.
fn put(frame: &mut [u8], at: usize, bytes: &[u8]) {
    for (byte, it) in frame.iter_mut().skip(at).zip(bytes) {
        *byte |= it;
    }
}
