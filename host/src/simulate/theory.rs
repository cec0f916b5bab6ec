//! What the measured figures should be, where that can be worked out.

use crate::names::FrameName;

/// In noise, a false frame of BIN at each byte: three fixed bytes.
#[cfg(test)]
pub(super) const FALSE_FRAME: f64 = 1.0 / (1 << 24) as f64;

/// Start and stop bit.
const FRAMING_BITS: i32 = 2;
/// Sync and terminator.
const FIXED_BITS: i32 = 24;
/// A low bit among those in front of a frame is taken for a start bit, and its character lasts into
/// the frame.
const IDLE_BITS: i32 = 9;
/// Pitch, roll and yaw.
const SETPOINT_BITS: i32 = 24;

/// The probability that a frame with a pause in front of it is committed with a wrong setpoint, if
/// each bit is inverted with the probability `flip`.
///
/// Nothing but bits of payload and checksum may be inverted, and those of the setpoint must be, in a
/// way that the checksum does not notice. Left out is what takes two coincidences, and that a
/// receiver which has missed a start bit may be in step again two bytes later: together less than a
/// twentieth as long as no more than one bit in a hundred is inverted.
pub(super) fn wrong_setpoint(format: FrameName, flip: f64) -> f64 {
    let kept = |bits| (1.0 - flip).powi(bits);
    match format {
        FrameName::Bin => {
            let others = 7 * FRAMING_BITS + FIXED_BITS + IDLE_BITS;
            // 1 - (1 - flip)^24 without the loss of small numbers.
            let inverted = -libm::expm1(f64::from(SETPOINT_BITS) * libm::log1p(-flip));
            kept(others) * inverted
        }
        FrameName::BinCrc8 => {
            let others = 8 * FRAMING_BITS + FIXED_BITS + IDLE_BITS;
            let unnoticed: f64 = unnoticed_by_weight()
                .iter()
                .zip(0..)
                .map(|(&count, weight)| {
                    #[expect(clippy::cast_precision_loss, reason = "less than theory leaves out")]
                    let count = count as f64;
                    count * flip.powi(weight) * kept(PROTECTED_BITS - weight)
                })
                .sum();
            kept(others) * unnoticed
        }
    }
}

/// The four payload bytes and the checksum.
const PROTECTED_BITS: i32 = 40;

/// Of the ways in which so many of the protected bits can be inverted: how many of those that change
/// the setpoint go unnoticed.
///
/// The code's dual has only 256 words; the weights of the code follow from theirs (`MacWilliams`).
fn unnoticed_by_weight() -> [i128; PROTECTED_BITS as usize + 1] {
    let columns: Vec<u8> = (0..32)
        .map(|bit| {
            let payload = (1_u32 << bit).to_be_bytes();
            framelock::crc8(payload) ^ framelock::crc8([0; 4])
        })
        .chain((0..8).map(|bit| 1 << bit))
        .collect();
    let mut dual = [0_i128; PROTECTED_BITS as usize + 1];
    for mask in 0..=u8::MAX {
        let is_set = |column: &&u8| (mask & **column).count_ones() % 2 == 1;
        if let Some(count) = dual.get_mut(columns.iter().filter(is_set).count()) {
            *count += 1;
        }
    }
    let mut weights = [0; PROTECTED_BITS as usize + 1];
    for (weight, count) in weights.iter_mut().enumerate() {
        let sum: i128 = dual
            .iter()
            .enumerate()
            .map(|(dual_weight, words)| words * krawtchouk(weight, dual_weight))
            .sum();
        *count = sum / 256;
    }
    // Those that change nothing but the reserved byte and the checksum leave the setpoint as it is.
    for reserved in 0..=u8::MAX {
        let crc = framelock::crc8([reserved, 0, 0, 0]) ^ framelock::crc8([0; 4]);
        if let Some(count) = weights.get_mut((reserved.count_ones() + crc.count_ones()) as usize) {
            *count -= 1;
        }
    }
    weights
}

/// The coefficient of z^`degree` in (1 - z)^`minus` (1 + z)^(40 - `minus`).
fn krawtchouk(degree: usize, minus: usize) -> i128 {
    let plus = PROTECTED_BITS as usize - minus;
    (0..=degree.min(minus))
        .map(|index| {
            let sign = if index % 2 == 0 { 1 } else { -1 };
            sign * choose(minus, index) * choose(plus, degree - index)
        })
        .sum()
}

fn choose(all: usize, some: usize) -> i128 {
    if some > all {
        return 0;
    }
    (0..some as i128).fold(1, |product, index| {
        product * (all as i128 - index) / (index + 1)
    })
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::indexing_slicing,
        clippy::float_cmp,
        reason = "a panic fails the test"
    )]

    use super::*;

    #[test]
    fn the_checksum_lets_no_error_of_three_bits_through() {
        let weights = unnoticed_by_weight();
        assert_eq!(weights[..4], [0; 4]);
        // By trying all: the errors of four bits in payload and checksum that go unnoticed.
        let mut four = 0;
        let bits: Vec<u64> = (0..40).map(|bit| 1 << bit).collect();
        for a in 0..40 {
            for b in a + 1..40 {
                for c in b + 1..40 {
                    for d in c + 1..40 {
                        let error = bits[a] | bits[b] | bits[c] | bits[d];
                        let [_, _, _, reserved, pitch, roll, yaw, crc] = error.to_be_bytes();
                        let change =
                            framelock::crc8([reserved, pitch, roll, yaw]) ^ framelock::crc8([0; 4]);
                        let is_setpoint = pitch | roll | yaw != 0;
                        four += i128::from(change == crc && is_setpoint);
                    }
                }
            }
        }
        assert_eq!(weights[4], four);
        assert!(four > 0);
        // One in 256 of all errors is a word of the code.
        let all: i128 = weights.iter().sum();
        assert_eq!(all, (1 << 32) - 256);
    }

    #[test]
    fn rare_flips_make_wrong_setpoints_in_proportion() {
        assert_eq!(wrong_setpoint(FrameName::Bin, 0.0), 0.0);
        let rare = wrong_setpoint(FrameName::Bin, 1e-12);
        assert!((rare / 24e-12 - 1.0).abs() < 1e-9, "{rare}");
        let ratio =
            wrong_setpoint(FrameName::BinCrc8, 2e-6) / wrong_setpoint(FrameName::BinCrc8, 1e-6);
        assert!((ratio - 16.0).abs() < 0.01, "{ratio}");
    }
}
