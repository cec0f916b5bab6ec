//! How many frames a line carries.

use std::time::Duration;

use anyhow::{Result, ensure};

use crate::uart::BITS_PER_BYTE;

/// How long `bytes` without pauses take on a line of `baud`.
#[must_use]
pub fn time_on_line(bytes: usize, baud: u32) -> Duration {
    Duration::from_secs(bytes as u64 * BITS_PER_BYTE) / baud
}

/// Checks that frames fit on a line: `rate` in a second, each of `bytes` bytes with `byte_gap` idle
/// bits between them. The error gives the highest rate that fits as a multiple of 1 / `steps`.
///
/// # Errors
/// They do not fit.
#[expect(clippy::cast_precision_loss, reason = "frames are short")]
pub fn check_rate(rate: f64, bytes: usize, byte_gap: u32, baud: u32, steps: f64) -> Result<()> {
    let (length, baud) = (bytes as f64, f64::from(baud));
    let bits = length * BITS_PER_BYTE as f64 + (length - 1.0) * f64::from(byte_gap);
    let needed = (bits * rate).ceil();
    ensure!(
        needed <= baud,
        "{rate} frames of {bytes} bytes in a second need {needed} baud: raise --baud from {baud}, \
         or lower --rate to {} at most",
        (baud / bits * steps).floor() / steps
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_fit_up_to_the_last_bit_of_the_line() {
        // 70 bits, and 6 * 5 between the bytes.
        for (byte_gap, fits, too_many, most) in [(0, 96.0, 97.0, "96"), (5, 67.2, 67.3, "67.2")] {
            assert!(check_rate(fits, 7, byte_gap, 6_720, 10.0).is_ok());
            let complaint = check_rate(too_many, 7, byte_gap, 6_720, 10.0);
            let complaint = complaint.map_err(|error| error.to_string());
            let expected = format!("lower --rate to {most} at most");
            assert!(complaint.is_err_and(|complaint| complaint.ends_with(&expected)));
        }
        assert_eq!(time_on_line(7, 7_000), Duration::from_millis(10));
    }
}
