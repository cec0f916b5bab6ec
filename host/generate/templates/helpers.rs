/// Reads a little-endian integer of `count` bytes.
fn le(frame: &[u8], at: usize, count: usize) -> u64 {
    bits(frame, 8 * at, 8 * count)
}

/// Reads a big-endian integer of `count` bytes. Missing bytes at the end count as zero.
fn be(frame: &[u8], at: usize, count: usize) -> u64 {
    le(frame, at, count).swap_bytes() >> (64 - 8 * count)
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

/// Returns the `N` bytes from index `at` on. Missing bytes at the end count as zero.
fn bytes<const N: usize>(frame: &[u8], at: usize) -> [u8; N] {
    core::array::from_fn(|i| frame.get(at + i).copied().unwrap_or_default())
}

/// Returns the frame's bytes from index `at` on, without its last `others` bytes.
fn rest(frame: &[u8], at: usize, others: usize) -> Option<&[u8]> {
    frame.get(at..frame.len().checked_sub(others)?)
}

/// Writes a little-endian integer of `count` bytes. Bits that are already 1 stay 1.
fn put_le(frame: &mut [u8], at: usize, count: usize, number: u64) {
    put_bits(frame, 8 * at, 8 * count, number);
}

/// Writes a big-endian integer of `count` bytes. Bits that are already 1 stay 1.
fn put_be(frame: &mut [u8], at: usize, count: usize, number: u64) {
    put_le(frame, at, count, number.swap_bytes() >> (64 - 8 * count));
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

/// Converts `width` bits to a number: the highest bit is the sign, and the others are the magnitude.
fn magnitude(number: u64, width: usize) -> i64 {
    let sign = 1 << (width - 1);
    (number & !sign) as i64 * if number & sign == 0 { 1 } else { -1 }
}

/// Converts a number to `width` bits: the highest bit is the sign, and the others are the magnitude.
fn with_sign(number: i64, width: usize) -> u64 {
    u64::from(number < 0) << (width - 1) | number.unsigned_abs()
}

/// Reads a number in binary-coded decimal, with four bits for each digit.
fn bcd(digits: u64) -> Option<u64> {
    (0..16).rev().try_fold(0_u64, |number, place| {
        let digit = digits >> (4 * place) & 0xF;
        (digit <= 9).then_some(10 * number + digit)
    })
}

/// Returns the decimal digits of a number, with four bits for each.
fn to_bcd(mut number: u64) -> u64 {
    (0..16).fold(0, |digits, place| {
        let digit = number % 10;
        number /= 10;
        digits | digit << (4 * place)
    })
}

/// Returns the value of a hexadecimal digit.
fn digit(digit: u8) -> Option<u32> {
    char::from(digit).to_digit(16)
}

/// Reads the `N` bytes that are written as two hexadecimal digits each, from index `at` on.
fn unhex<const N: usize>(frame: &[u8], at: usize) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    let mut digits = frame.iter().skip(at);
    for byte in &mut bytes {
        *byte = (digit(*digits.next()?)? << 4 | digit(*digits.next()?)?) as u8;
    }
    Some(bytes)
}

/// Returns the hexadecimal digit for the lowest four bits of a number.
fn to_digit(number: u32) -> u8 {
    let digit = char::from_digit(number & 0xF, 16);
    digit.unwrap_or_default().to_ascii_uppercase() as u8
}

/// Writes bytes as two hexadecimal digits each, from index `at` on.
fn put_hex(frame: &mut [u8], at: usize, bytes: &[u8]) {
    let digits = bytes.iter().flat_map(|byte| [byte >> 4, *byte]);
    for (to, digit) in frame.iter_mut().skip(at).zip(digits) {
        *to = to_digit(digit.into());
    }
}

/// Returns the number of values for which a frame has room, at most `most`. `others` is the number of bytes before the
/// values plus the number after them. The first value begins at bit `first` of the bytes in between, and each value has
/// `width` bits.
fn fitting(length: usize, others: usize, first: usize, width: usize, most: usize) -> usize {
    let bits = 8 * length.saturating_sub(others);
    (bits.saturating_sub(first) / width).min(most)
}

/// Returns the text without the blanks at its start.
fn blanks(text: &[u8]) -> &[u8] {
    let count = text.iter().take_while(|byte| **byte == b' ').count();
    text.get(count..).unwrap_or_default()
}

/// If the text begins with a literal, returns the text after it. A blank in the literal stands for one or more blanks.
fn after<'a>(text: &'a [u8], literal: &[u8]) -> Option<&'a [u8]> {
    literal.iter().try_fold(text, |text, byte| {
        let (first, rest) = text.split_first().filter(|(first, _)| *first == byte)?;
        Some(if *first == b' ' { blanks(rest) } else { rest })
    })
}

/// Splits a text at the first occurrence of a literal from index `from` on. Returns the text before the literal and the
/// text after it.
fn until<'a>(text: &'a [u8], from: usize, literal: &[u8]) -> Option<(&'a [u8], &'a [u8])> {
    (from..text.len()).find_map(|at| {
        let (before, rest) = text.split_at_checked(at)?;
        Some((before, after(rest, literal)?))
    })
}

/// Returns the sign of a number, and the text after the sign and the blanks around it.
fn sign(text: &[u8]) -> (i32, &[u8]) {
    match blanks(text) {
        [b'-', digits @ ..] => (-1, blanks(digits)),
        [b'+', digits @ ..] => (1, blanks(digits)),
        digits => (1, digits),
    }
}

/// Reads a decimal number of up to 18 digits, which may have a sign, a point, and blanks around the sign and the digits.
/// Returns the number times 10 to the power of `decimals`, rounded; halves are rounded away from zero.
fn decimal(text: &[u8], decimals: usize) -> Option<i32> {
    let (sign, digits) = sign(text);
    let end = digits.iter().rposition(|byte| *byte != b' ')? + 1;
    let mut parts = digits.get(..end)?.splitn(2, |byte| *byte == b'.');
    let [whole, fraction] = [parts.next()?, parts.next().unwrap_or_default()];
    let mut all = whole.iter().chain(fraction);
    let count = whole.len() + fraction.len();
    if !(1..=18).contains(&count) || !all.all(u8::is_ascii_digit) {
        return None;
    }
    let zeros = core::iter::repeat(&b'0');
    let decimals_in_text = fraction.iter().chain(zeros).take(decimals);
    let mut digits = whole.iter().chain(decimals_in_text);
    let number = digits.try_fold(0_i32, |number, digit| {
        let tens = number.checked_mul(10)?;
        tens.checked_add(sign * i32::from(digit - b'0'))
    })?;
    let is_up = fraction.get(decimals).is_some_and(|digit| *digit >= b'5');
    number.checked_add(if is_up { sign } else { 0 })
}

/// Reads a number of up to 16 hexadecimal digits, which may have blanks around them.
fn hex(text: &[u8]) -> Option<u32> {
    let text = blanks(text);
    let end = text.iter().rposition(|byte| *byte != b' ')? + 1;
    let mut digits = text.get(..end).filter(|digits| digits.len() <= 16)?.iter();
    digits.try_fold(0, |number, byte| {
        Some(digit(*byte)? | (number <= 0x0FFF_FFFF).then_some(number << 4)?)
    })
}

/// Writes bytes at index `*at`, as far as there is room. Moves `*at` past all of them, even those without room.
fn add(into: &mut [u8], at: &mut usize, bytes: &[u8]) {
    for (to, byte) in into.iter_mut().skip(*at).zip(bytes) {
        *to = *byte;
    }
    *at += bytes.len();
}

/// Writes a number divided by 10 to the power of `decimals`, as `add` writes bytes.
fn add_decimal(into: &mut [u8], at: &mut usize, number: i32, decimals: u32) {
    if number < 0 {
        add(into, at, b"-");
    }
    let digits = number.unsigned_abs();
    let highest = digits.checked_ilog10().unwrap_or_default().max(decimals);
    for place in (0..=highest).rev() {
        let unit = 10_u32.checked_pow(place);
        let digit = unit.map_or(0, |unit| digits / unit % 10);
        add(into, at, &[b'0' + digit as u8]);
        if place == decimals && place > 0 {
            add(into, at, b".");
        }
    }
}

/// Writes a number in hexadecimal digits, as `add` writes bytes.
fn add_hex(into: &mut [u8], at: &mut usize, number: u32) {
    let highest = number.checked_ilog2().unwrap_or_default() / 4;
    for place in (0..=highest).rev() {
        add(into, at, &[to_digit(number >> (4 * place))]);
    }
}
