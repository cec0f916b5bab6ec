//! Bytes as hexadecimal text, for logs.

use core::fmt;

/// Bytes that [`Display`](fmt::Display) writes as `: 01 0A`. An empty slice is written as an empty string.
pub(crate) struct Hex<'a>(pub(crate) &'a [u8]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = ": ";
        for byte in self.0 {
            write!(f, "{separator}{byte:02X}")?;
            separator = " ";
        }
        Ok(())
    }
}
