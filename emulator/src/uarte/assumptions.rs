//! Where the product specification (section "UARTE") is silent: what the model does.

/// What the product specification leaves open about the receiver. Firmware should work either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assumptions {
    /// Cycles from RXDRDY until the byte is in RAM. "This event is likely to occur before the
    /// corresponding data has been transferred to Data RAM": by how much is not said.
    pub dma_lag: u64,
    /// Whether RXDRDY comes for a byte with a framing error too, which is not stored.
    pub ready_on_framing_error: bool,
    /// Whether RXDRDY comes for a byte that is lost to an overrun.
    pub ready_on_overrun: bool,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            dma_lag: 32,
            ready_on_framing_error: false,
            ready_on_overrun: false,
        }
    }
}
