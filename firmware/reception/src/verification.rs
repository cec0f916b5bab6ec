//! Theorem 12: the reception. The following statements hold whatever the chip does and whenever the handler runs. A
//! byte *looks like no byte* if its value is [`NO_BYTE`](crate::NO_BYTE).
//!
//! * S1. Bytes are handed on in order and once each. No byte that the chip reports as corrupted is handed on. There is
//!   one limit: a receiver that is started in the middle of a byte may mistake the rest of this byte for another byte
//!   with a good stop bit. The chip does not report this, but the reception has reported an event before it.
//! * S2. If a byte was lost, corrupted or dropped, an event is reported before any later byte is handed on.
//! * S3. Every reported event has happened: a cause in ERRORSRC, a gap, or a lost ENDRX. An ENDRX counts as
//!   lost if it has not come although its byte has lain in memory from one tick to the next, or although the FIFO
//!   has overrun.
//! * L1. A round takes the byte whose ENDRX has come, and either hands it on, or drops it after a report. The round
//!   reports a gap once, and leaves a transfer open. After the round, no event that wakes the handler is set, unless a
//!   later step of the chip has set it.
//! * L2. After the last error, the reception leaves the drain in the first round that finds a transfer open for
//!   `NONE_WAITS` and no byte. If a round always begins between the end of `NONE_WAITS` and the next byte, at most
//!   [`chip::FIFO`] bytes are dropped before that round. If rounds are later and bytes follow each other without a
//!   pause, all bytes are dropped until there is such a round.
//! * L3. If an ENDRX is lost, the reception reports it and stops the UARTE at the second tick. If the byte looks like
//!   no byte, it does so when the FIFO has overrun. The UARTE is restarted in the round that RXTO requests, five byte
//!   times later. If RXTO is lost, it is restarted in the first round after twice `GAP`. From then on L2 holds. If
//!   ENDRX never comes again, the watchdog is not fed.
//! * L4. An ENDRX that comes twice before the next STARTRX costs nothing. A duplicate ENDRX after STARTRX delivers one
//!   spurious byte, with the value `NO_BYTE`. If a byte is stored after the handler has read memory and before STARTRX,
//!   the spurious byte replaces the stored one, and nothing is reported. From then on the whole theorem holds again. L4
//!   is proved for bytes whose own ENDRX is not late, and with `start` as one step.
//!
//! The proof is by induction. [`chip`] models the chip as the handler sees it. [`invariant`] states the invariant of
//! the chip and the reception. The invariant holds at the start, and every step of the chip preserves it ([`safety`]).
//! Every round and every tick also preserves the invariant, although **the chip may do anything between any two
//! accesses**: before each access, [`chip::Chip::moves`] takes any number of the chip's steps. L4 is proved with the
//! same freedom. L1 to L3 assume that the chip makes progress between rounds (fairness; see [`liveness`]).
//!
//! ENDRX and RXTO are the only events in the model, because no decision reads any other event. Any other event may be
//! lost, duplicated or late. In this case the next tick requests the round. RXTO may come at any time, or never.
//!
//! The proof makes these assumptions about the chip. The self-test has a row for each:
//!
//! * A1. A byte that waits while a transfer is open is stored before the transfer has been open for `NONE_WAITS`. Its
//!   ENDRX comes within the same time, if it comes at all. If the byte in memory does not look like no byte, its ENDRX
//!   may be late by any time.
//! * A2. The FIFO continues to receive while no transfer is open.
//! * A3. ERRORSRC shows an error before any byte received after the error is stored. If the corrupted byte itself
//!   is stored, as with a parity error, ERRORSRC shows the error before that, too.
//! * A4. A3 also holds for a byte that is lost to an overrun. At an overrun the FIFO is full, or lacks at most one byte.
//!   A transfer that has been open for `NONE_WAITS` takes a byte before the FIFO is full.
//! * A5. ENDRX does not come for a transfer that is still open. In the exceptional case of L4, a second STARTRX leaves
//!   the open transfer open. The handler cannot distinguish the spurious byte of L4 from a real one: any of the 256
//!   values in memory may be a received byte, and only ENDRX shows that a byte with the value `NO_BYTE` has come.
//!
//! The FIFO of the model holds three bytes. The model identifies bytes by their numbers on the line.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    clippy::struct_excessive_bools,
    reason = "a harness finds every overflow and wrong index; the model's state is a list of flags"
)]

mod chip;
mod invariant;
mod liveness;
mod reports;
mod safety;

/// The reception with the model's times: see [`chip::Chip::time`].
type Reception = crate::Reception<1, 2>;
