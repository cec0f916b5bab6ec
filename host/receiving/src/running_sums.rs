//! Computes the checksums of overlapping stretches of a stream from running values.
//!
//! A running value at a position is the checksum of all bytes from a fixed start to this position. The checksum of a
//! stretch follows from the running values at its two ends:
//!
//! | checksum | of the bytes from `a` to `b` |
//! |---|---|
//! | sum | `running[b] - running[a]` |
//! | exclusive or | `running[b] ^ running[a]` |
//! | Fletcher | the differences of both sums; from the second difference, `a`'s first sum is subtracted `b - a` times |
//! | CRC | `running[b] ^ running[a] * x^(8 * (b - a))`, modulo the polynomial |

use framelock_formats::layout::{Algorithm, Crc};

/// Old running values are dropped in batches of this size.
const MANY: usize = 1 << 16;

/// The running values of one algorithm.
#[derive(Clone, Debug)]
pub(crate) struct RunningSums {
    /// The position of the first running value.
    from: usize,
    /// The running values after 0, 1, 2 and more bytes. A CRC's register is kept in the highest bits.
    running: Vec<u32>,
    /// The table of a CRC, which processes a byte at a time.
    table: Vec<u32>,
    /// `x^0`, `x^8`, `x^16` and so on, modulo the polynomial of a CRC.
    powers: Vec<u32>,
    /// The number of bytes that were summed.
    #[cfg(test)]
    touched: usize,
}

impl RunningSums {
    /// Creates the running sums of an empty stream. Pass this algorithm to all other functions too.
    pub(crate) fn new(algorithm: &Algorithm) -> Self {
        let (mut table, mut powers) = (Vec::new(), Vec::new());
        if let Algorithm::Crc(crc) = algorithm {
            let unused = 32 - crc.width;
            let plain = crc.initial(0).reflected_out(false).xor_out(0);
            table.extend((0..=u8::MAX).map(|first| {
                let byte = first_power_first(crc, first);
                Algorithm::Crc(plain).of(&[byte], None) << unused
            }));
            powers.push(1 << unused);
        }
        Self {
            from: 0,
            running: vec![0],
            table,
            powers,
            #[cfg(test)]
            touched: 0,
        }
    }

    /// Returns the same value as [`Algorithm::of`] for the bytes `covered`, which begin at position `at` of the stream.
    ///
    /// As long as positions do not decrease, this function processes each byte of the stream once.
    pub(crate) fn of(
        &mut self,
        algorithm: &Algorithm,
        at: usize,
        covered: &[u8],
        extra: Option<u8>,
    ) -> u32 {
        let end = at + covered.len();
        self.extend(algorithm, at, covered);
        let value = |position: usize| self.running.get(position - self.from).copied();
        let (before, after) = (value(at).unwrap_or(0), value(end).unwrap_or(0));
        let last = extra.map_or(0, u32::from);
        let sum = after.wrapping_sub(before).wrapping_add(last);
        match algorithm {
            Algorithm::Sum => sum,
            Algorithm::InvertedSum => !sum,
            Algorithm::NegatedSum => sum.wrapping_neg(),
            Algorithm::Xor => after ^ before ^ last,
            Algorithm::Fletcher => {
                let (a, b) = (before & 0xFFFF, before >> 16);
                let more = a.wrapping_mul(covered.len().to_le_bytes()[0].into());
                let second = (after >> 16).wrapping_sub(b).wrapping_sub(more);
                let first = (after & 0xFFFF).wrapping_sub(a);
                let sums = first & 0xFFFF | second << 16;
                let sums = extra.map_or(sums, |extra| next(algorithm, &[], sums, extra));
                sums & 0xFF | (sums >> 16 & 0xFF) << 8
            }
            Algorithm::Crc(crc) => {
                while self.powers.len() <= covered.len() {
                    let last = self.powers.last().copied().unwrap_or(0);
                    self.powers.push(next(algorithm, &self.table, last, 0));
                }
                let power = self.powers.get(covered.len()).copied().unwrap_or(0);
                let unused = 32 - crc.width;
                let moved = product(&self.table, unused, before ^ crc.initial << unused, power);
                let register = after ^ moved;
                let register = extra.map_or(register, |extra| {
                    shifted(&self.table, register, first_power_first(crc, extra))
                });
                let remainder = if crc.reflected_out {
                    register.reverse_bits()
                } else {
                    register >> unused
                };
                remainder ^ crc.xor_out
            }
            // Checksums of other kinds have no running values.
            _ => algorithm.of(covered, extra),
        }
    }

    /// Computes the missing running values up to the end of `covered`, which begins at `at`.
    fn extend(&mut self, algorithm: &Algorithm, at: usize, covered: &[u8]) {
        let mut end = self.from + self.running.len() - 1;
        if at < self.from || end < at {
            (self.from, end) = (at, at);
            self.running.clear();
            self.running.push(0);
        }
        let unused = at - self.from;
        if unused >= MANY {
            self.running.drain(..unused);
            self.from = at;
        }
        let more = covered.get(end - at..).unwrap_or_default();
        let mut value = self.running.last().copied().unwrap_or(0);
        self.running.extend(more.iter().map(|&byte| {
            value = next(algorithm, &self.table, value, byte);
            value
        }));
        #[cfg(test)]
        (self.touched += more.len());
    }
}

/// Returns the running value after another byte. `table` is the CRC's table.
#[inline]
fn next(algorithm: &Algorithm, table: &[u32], value: u32, byte: u8) -> u32 {
    match algorithm {
        Algorithm::Crc(crc) => shifted(table, value, first_power_first(crc, byte)),
        Algorithm::Xor => value ^ u32::from(byte),
        // Both sums have 16 bits each. Only the lowest 8 bits of each are significant.
        Algorithm::Fletcher => {
            let first = value.wrapping_add(byte.into()) & 0xFFFF;
            let second = (value >> 16).wrapping_add(first);
            first | second << 16
        }
        _ => value.wrapping_add(byte.into()),
    }
}

/// Returns the byte, with its bits reversed if the CRC processes the lowest bit first.
#[inline]
const fn first_power_first(crc: &Crc, byte: u8) -> u8 {
    if crc.reflected_in {
        byte.reverse_bits()
    } else {
        byte
    }
}

/// Returns the product of two remainders modulo the table's polynomial. Remainders are in the highest bits.
#[expect(
    clippy::cast_possible_truncation,
    reason = "both halves of the product are taken"
)]
fn product(table: &[u32], unused: u32, one: u32, other: u32) -> u32 {
    // A product of polynomials is a product of integers without carries. So split both integers into four parts that
    // keep only every fourth bit. When two parts are multiplied, at most eight ones add up at a position, so the
    // carries end before the next position that is kept.
    const PLACES: u64 = 0x1111_1111_1111_1111;
    let every_fourth = |bits: u32| [0, 1, 2, 3].map(|first| u64::from(bits) & PLACES << first);
    let (one, other) = (every_fourth(one >> unused), every_fourth(other));
    let mut product = 0;
    for (first, one) in (0..).zip(one) {
        for (second, other) in (0..).zip(other) {
            product ^= (one * other) & (PLACES << ((first + second) % 4));
        }
    }
    let [low, high] = [product as u32, (product >> 32) as u32];
    low ^ (0..4).fold(high, |value, _| shifted(table, value, 0))
}

/// Returns the remainder after another byte. Remainders are in the highest bits.
#[inline]
fn shifted(table: &[u32], value: u32, byte: u8) -> u32 {
    let [.., highest] = value.to_le_bytes();
    let entry = table.get(usize::from(highest ^ byte));
    entry.copied().unwrap_or(0) ^ value << 8
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a panic fails the test")]

    use rand::{Rng, SeedableRng, seq::IndexedRandom};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn algorithms(random: &mut ChaCha8Rng) -> Vec<Algorithm<'static>> {
        let crcs = [8, 9, 15, 16, 24, 31, 32].into_iter().map(|width| {
            let mut number = || random.random::<u32>() & u32::MAX >> (32 - width);
            let crc = Crc::new(width, number() | 1)
                .initial(number())
                .xor_out(number());
            let crc = crc.reflected_in(random.random());
            Algorithm::Crc(crc.reflected_out(random.random()))
        });
        let mut algorithms: Vec<Algorithm> = crcs.collect();
        algorithms.extend([
            Algorithm::Sum,
            Algorithm::InvertedSum,
            Algorithm::NegatedSum,
        ]);
        algorithms.extend([Algorithm::Xor, Algorithm::Fletcher]);
        algorithms
    }

    /// Tests stretches that go forward, overlap, leave gaps, and sometimes go back.
    #[test]
    fn sums_of_stretches_are_those_of_the_algorithm() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let stream: Vec<u8> = (0..200_000).map(|_| random.random()).collect();
        let (mut back, mut overlaps, mut gaps) = (0, 0, 0);
        for algorithm in (0..20)
            .flat_map(|_| algorithms(&mut random))
            .collect::<Vec<_>>()
        {
            let (mut sums, mut at) = (RunningSums::new(&algorithm), 0_usize);
            let step = *[3, 400, 30_000].choose(&mut random).unwrap_or(&3);
            for _ in 0..40 {
                let length = random.random_range(0..3_000);
                let covered = &stream[at..(at + length).min(stream.len())];
                let extra = random.random::<bool>().then(|| random.random());
                // Only the lowest bytes of a sum or a CRC are significant.
                let sum = sums.of(&algorithm, at, covered, extra);
                assert_eq!(
                    sum,
                    algorithm.of(covered, extra),
                    "{algorithm:?} {at} {length}"
                );
                let (from, to) = (at, at + covered.len());
                at = (at + random.random_range(0..step)).min(stream.len());
                at -= if random.random_ratio(1, 9) {
                    at.min(50)
                } else {
                    0
                };
                back += u32::from(at < from);
                overlaps += u32::from((from..to).contains(&at));
                gaps += u32::from(at > to);
            }
        }
        assert!(
            back.min(overlaps).min(gaps) > 100,
            "{back} {overlaps} {gaps}"
        );
    }

    /// Tests a stream in which every second byte begins a stretch of 60 000 bytes.
    #[test]
    fn a_byte_is_summed_once() {
        let stream: Vec<u8> = b"\xB5\x62".repeat(100_000);
        let mut sums = RunningSums::new(&Algorithm::Fletcher);
        for at in (0..140_000).step_by(2) {
            sums.of(&Algorithm::Fletcher, at, &stream[at..at + 60_000], None);
        }
        assert!(sums.touched <= stream.len(), "{}", sums.touched);
        assert!(
            sums.running.len() <= MANY + 60_001,
            "{}",
            sums.running.len()
        );
    }
}
