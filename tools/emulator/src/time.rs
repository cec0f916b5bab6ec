//! Time is counted in cycles of the core's clock.

/// Cycles of the core clock in a second.
pub const CYCLES_PER_SECOND: u64 = 64_000_000;
/// A microsecond, in cycles.
pub const MICROSECOND: u64 = CYCLES_PER_SECOND / 1_000_000;
/// A millisecond, in cycles.
pub const MILLISECOND: u64 = 1_000 * MICROSECOND;
