//! Formulas for those measured figures that can be calculated.

use framelock::motion::crc8;

/// Returns the probability that a frame after a pause is delivered with a wrong setpoint, if each
/// bit is inverted with the probability `flip`.
///
/// The following bits must arrive as they were sent: the sync, the terminator, all start and stop bits, and the nine
/// idle bits that precede the frame. The bits of the setpoint must change in a way that the checksum does not notice.
/// The formula omits cases in which two unlikely errors coincide. The formula also omits receivers that miss a start
/// bit and are back in step two bytes later. If at most one bit in a hundred is inverted, the omitted cases together
/// add less than 5 % to the result.
pub(crate) fn wrong_setpoint_of_bin(flip: f64) -> f64 {
    // 24 fixed bits, 14 start and stop bits, 9 idle bits. The second factor is 1 - (1 - flip)^24, written so that small
    // numbers lose no digits.
    (1.0 - flip).powi(24 + 14 + 9) * -(24.0 * (-flip).ln_1p()).exp_m1()
}

/// Returns the same probability for frames with a checksum.
pub(crate) fn wrong_setpoint_of_bin_crc8(flip: f64) -> f64 {
    (1.0 - flip).powi(24 + 16 + 9) * unnoticed(flip)
}

/// Returns the probability that an error in payload and checksum goes unnoticed and changes the
/// setpoint.
///
/// A linear code does not notice errors that are code words. The probability of such errors is the mean of
/// (1 - 2 flip)^weight over the 256 words of the dual code (`MacWilliams`). Some of these code words leave the setpoint
/// unchanged: zero, and words that change only the reserved byte and the checksum.
fn unnoticed(flip: f64) -> f64 {
    let crc = |payload: u32| u32::from(crc8(payload.to_be_bytes()) ^ crc8([0; 4]));
    let columns = (0..32)
        .map(|bit| crc(1 << bit))
        .chain((0..8).map(|bit| 1 << bit));
    let columns: Vec<u32> = columns.collect();
    let (mut let_through, mut harmless) = (0.0, 0.0);
    for word in 0..256 {
        let odd = columns
            .iter()
            .filter(|column| (word & **column).count_ones() % 2 == 1);
        let weight = i32::try_from(odd.count()).unwrap_or(i32::MAX);
        let_through += (1.0 - 2.0 * flip).powi(weight) / 256.0;
        let ones = (word.count_ones() + crc(word << 24).count_ones()).cast_signed();
        harmless += flip.powi(ones) * (1.0 - flip).powi(40 - ones);
    }
    let_through - harmless
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a panic fails the test")]

    use super::*;

    /// Tries all errors of up to four bits in payload and checksum. No error of fewer than four
    /// bits goes unnoticed, and the number of unnoticed four-bit errors agrees with theory while
    /// errors are rare.
    #[test]
    fn theory_agrees_with_trying_all_errors() {
        let goes_unnoticed = |error: u64| {
            let [_, _, _, reserved, pitch, roll, yaw, crc] = error.to_be_bytes();
            let change = crc8([reserved, pitch, roll, yaw]) ^ crc8([0; 4]);
            change == crc && pitch | roll | yaw != 0
        };
        let bits: Vec<u64> = (0..40).map(|bit| 1 << bit).collect();
        let mut four = 0_u32;
        for a in 0..40 {
            for b in a..40 {
                for c in b..40 {
                    let error = bits[a] | bits[b] | bits[c];
                    assert!(!goes_unnoticed(error));
                    let further = if a < b && b < c { c + 1..40 } else { 0..0 };
                    for d in further {
                        four += u32::from(goes_unnoticed(error | bits[d]));
                    }
                }
            }
        }
        assert!(four > 0);
        let flip = 1e-3_f64;
        let rare = f64::from(four) * flip.powi(4) * (1.0 - flip).powi(36);
        let theory = unnoticed(flip);
        // Errors of five bits and more cause the difference.
        assert!(rare < theory && theory < 1.02 * rare, "{rare} {theory}");
        // If each bit is inverted with probability 1/2, all 2^40 patterns of inverted bits are equally probable. The
        // checksum does not notice one in 256 patterns. Of these patterns, 256 leave the setpoint unchanged.
        let expected = 1.0 / 256.0 - 256.0 * 0.5_f64.powi(40);
        assert!((unnoticed(0.5) / expected - 1.0).abs() < 1e-9);
    }

    /// Calculated by hand: (1 - p)^47 (1 - (1 - p)^24), in wrong setpoints per million frames.
    #[test]
    fn bin_follows_the_formula() {
        for (flip, wrong) in [(1e-5, 240), (1e-4, 2_386), (1e-3, 22_636), (1e-2, 133_635)] {
            let expected = f64::from(wrong);
            let theory = 1e6 * wrong_setpoint_of_bin(flip);
            assert!((theory - expected).abs() < 0.5, "{flip}: {theory}");
        }
    }
}
