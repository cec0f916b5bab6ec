//! Theorem 12: the reception. S1 to S3 hold whatever the chip does and whenever the handler runs, as long as the chip
//! satisfies the assumptions A1 to A5 below. L1 to L4 have further conditions. A byte *looks like no byte* if its value
//! is [`NO_BYTE`](crate::NO_BYTE).
//!
//! * S1. Bytes are handed on in order and once each. No byte that the chip reports as corrupted is handed on. There is
//!   one limit: a receiver that is started in the middle of a byte may mistake the rest of this byte for another byte
//!   with a good stop bit. The chip does not report this false byte. After a restart, the reception has reported an
//!   event before the false byte. After [`begin`](crate::Reception::begin), no event precedes the false byte, and no
//!   other byte was handed on before it.
//! * S2. If a byte was lost, corrupted or dropped, an event is reported before any later byte is handed on.
//! * S3. Every reported event has happened. It is a cause in ERRORSRC, a gap, or a lost ENDRX. A gap is measured from
//!   STARTRX, or from a later line error, to the round. So it includes the duration of the byte that ends the silence,
//!   and the delay of the round: a round that is late by `GAP` reports a gap on a line without pauses. An ENDRX that
//!   has not come counts as lost once its byte has lain in memory from one tick to the next, or the FIFO has overrun.
//! * L1. Unless the reception is stopping the UARTE, a round takes the byte whose ENDRX has come, and hands the byte on
//!   or drops it. If the round drops the byte, an event has been reported between the last byte that was handed on and
//!   the end of this round. Each gap is reported once. The round leaves a transfer open, unless an ENDRX is late or
//!   lost. It also clears ENDRX and ERROR.
//! * L2. After the last error, the reception leaves the drain in the first round that finds a transfer open, the timer
//!   at `NONE_WAITS` or later, and no byte in memory. All bytes that are read before this round are dropped. If no byte
//!   arrives after the last error, these are at most the byte in memory and the bytes in the FIFO. While bytes follow
//!   each other without a pause, and each round begins only after the next byte is stored, the drain does not end.
//! * L3. If an ENDRX is lost, the reception reports the loss and stops the UARTE by the second tick. If the byte in
//!   memory looks like no byte, the report and the stop come only when the FIFO has overrun. The UARTE is restarted in
//!   the round that RXTO requests, five byte times after the stop. If RXTO is lost, the UARTE is restarted in the first
//!   round after twice the time `GAP` since the stop. From then on L2 holds. If one ENDRX after another is lost, the
//!   watchdog is no longer fed.
//! * L4. An ENDRX that comes twice before the next STARTRX costs nothing. A duplicate ENDRX after STARTRX delivers at
//!   most one spurious byte, with the value `NO_BYTE`. The round that answers the duplicate reads memory, then gives
//!   STARTRX. If the open transfer stores a byte between these two accesses, the spurious byte replaces the stored one,
//!   and nothing is reported. From then on the whole theorem holds again. L4 is proved for bytes whose own ENDRX is
//!   neither late nor lost. The proof treats the call of `start` as a single step.
//!
//! The proof is by induction. [`chip`] models the chip as the handler sees it. [`invariant`] states the invariant of
//! the chip and the reception. The invariant holds at the start, and every step of the chip preserves it ([`safety`]).
//! Every round and every tick also preserves the invariant, even though **the chip may do anything between any two
//! accesses**: before each access, [`chip::Chip::moves`] takes any number of the chip's steps. The proof of L4 also
//! lets the chip take steps between two accesses. L1 to L3 are proved for rounds and ticks during which the chip takes
//! no step. L2 and L3 also assume that the chip makes progress between rounds (fairness; see [`liveness`]).
//!
//! ENDRX and RXTO are the only events that a handler reads. All other events only wake the handler, and may be lost,
//! duplicated or late. The model has only one of them, ERROR. If no event wakes the handler, the next tick requests the
//! round. RXTO may come at any time, or never.
//!
//! The proof makes these assumptions about the chip. The self-test's table has rows for them, except for a parity
//! error:
//!
//! * A1. The reception resets the timer to 0 when it opens a transfer, and when it begins a drain. If at such a reset a
//!   byte waits and a transfer is open, the byte is stored before the timer reaches `NONE_WAITS`. If the byte looks
//!   like no byte, its ENDRX also comes before the timer reaches `NONE_WAITS`, or never. The ENDRX of a byte with
//!   another value may be late by any amount of time, or lost. A byte that enters the FIFO after such a reset may be
//!   stored at any later time. There is one exception: if a corrupted byte is stored, as with a parity error, its error
//!   begins a drain. The byte is stored before the timer of this drain reaches `NONE_WAITS`. In the model, a byte and
//!   its error arrive together.
//! * A2. The FIFO continues to receive while no transfer is open.
//! * A3. When a byte that was received after an error is stored, ERRORSRC already shows the error. If the corrupted
//!   byte itself is stored, as with a parity error, ERRORSRC also shows the error by then.
//! * A4. When a byte that follows a lost byte is stored, ERRORSRC already shows the overrun. An overrun may lose any
//!   bytes of the FIFO, but at least one byte stays there. The FIFO does not overrun while a transfer is open and the
//!   timer is at `NONE_WAITS` or later, because the transfer takes a byte first.
//! * A5. ENDRX does not come while a transfer is open, except in L4. In the case of L4, a second STARTRX does not end
//!   the open transfer. The handler cannot distinguish the spurious byte of L4 from a real byte. A received byte may
//!   have any of the 256 values. Only ENDRX shows that a byte with the value `NO_BYTE` has come.
//!
//! The FIFO of the model holds three bytes. The model numbers the bytes in the order in which they are sent, and
//! identifies each byte by its number.

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
