//! How many frames a line carries.

use std::time::Duration;

use anyhow::{Result, bail};

/// Start bit, eight data bits, stop bit.
pub(crate) const BITS_PER_BYTE: u64 = 10;

/// That `rate` frames of `frame_length` bytes in a second fit on a line of `baud`.
///
/// # Errors
/// They do not.
pub(crate) fn check(rate: u32, frame_length: usize, baud: u32) -> Result<()> {
    let bits_per_frame = frame_length as u64 * BITS_PER_BYTE;
    let needed = u64::from(rate) * bits_per_frame;
    if needed > u64::from(baud) {
        bail!(
            "{rate} frames of {frame_length} bytes in a second need {needed} baud: raise --baud \
             from {baud}, or lower --rate to {} at most",
            u64::from(baud) / bits_per_frame
        );
    }
    Ok(())
}

/// How long a frame of `frame_length` bytes takes on a line of `baud`.
pub(crate) fn frame_time(frame_length: usize, baud: u32) -> Duration {
    Duration::from_secs(frame_length as u64 * BITS_PER_BYTE) / baud
}
