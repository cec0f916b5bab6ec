//! Theorem 12: the reception. Whatever the chip does, and whenever the handler runs:
//!
//! * S1. Bytes are handed on in order, each once, and none that the chip reports as corrupted. A receiver that is
//!   started in the middle of a byte may take its end for another byte, with a good stop bit. The chip
//!   does not report this; an event was reported before.
//! * S2. If a byte was lost, spoilt or dropped, an event is reported before any later byte is handed on.
//! * S3. What is reported has happened: the causes that ERRORSRC has, a gap, an ENDRX that was lost. An ENDRX counts as
//!   lost if it has not come when its byte has lain in memory from one tick to the next, or when the FIFO
//!   has overrun.
//! * L1. A round takes the byte whose ENDRX has come: it is handed on, or dropped behind a report. It reports
//!   a gap, once. It leaves a transfer open, and of the events that wake none but what the chip does next.
//! * L2. After the last error it hears again with the first round that finds a transfer open for `NONE_WAITS` and no
//!   byte. If a round begins each time between the end of `NONE_WAITS` and the next byte, at most [`chip::FIFO`]
//!   bytes are dropped before. If rounds are later, all bytes are dropped until there is such a round: as long as
//!   bytes follow each other without a pause.
//! * L3. If an ENDRX is lost, the UARTE is stopped, with a report, at the second tick; or, if the byte
//!   looks like none, when the FIFO has overrun. It is started anew in the round that RXTO asks for, five byte times
//!   later, or if RXTO is lost in the first one after twice `GAP`. From then on L2 holds. If
//!   ENDRX comes no more, the watchdog is not fed.
//! * L4. An ENDRX that comes again before the next STARTRX costs nothing. One that comes behind it costs one byte
//!   too many, which looks like none. If a byte is stored after the handler has read memory and before STARTRX, the one
//!   too many takes its place, and nothing is reported. From then on all of this holds again. It is proved for
//!   bytes whose own ENDRX is not late, and with `start` as one step.
//!
//! Proof by induction. [`chip`] is the chip as the handler sees it, [`invariant`] what always holds of both.
//! It holds at the start; whatever the chip does keeps it ([`safety`]); so does every round, and every tick,
//! though **the chip may do anything between any two accesses**: before each, [`chip::Chip::moves`] takes any
//! number of its steps at once. So may it for L4. L1 to L3 are of a chip that does what it must between rounds
//! ([`liveness`]).
//!
//! No event but ENDRX and RXTO is in the model, since no decision asks for another: any of them may be lost, doubled
//! or late. Then a round comes at the next tick instead. RXTO may come at any time, or never.
//!
//! What is taken for granted of the chip, each a row of the self-test:
//!
//! * A1. A byte that waits while a transfer is open is stored, and its ENDRX comes if it comes at all, before
//!   the transfer has been open for `NONE_WAITS`. An ENDRX may be late for any time if the byte in memory
//!   can be told from none.
//! * A2. The FIFO goes on receiving when no transfer is open.
//! * A3. ERRORSRC says so before a byte from behind the error is stored, and before the byte that the error has
//!   corrupted, if that one is stored, as one with a parity error is.
//! * A4. So it does if a byte is lost to an overrun. The FIFO is full then, but for one byte at most. A
//!   transfer that has been open for `NONE_WAITS` takes a byte before the FIFO is full.
//! * A5. ENDRX does not come for a transfer that is open, but for L4: there STARTRX, given once more, leaves one
//!   open. That byte cannot be told from a real one: memory shows its 256 values, all of which may be bytes,
//!   and nothing but ENDRX says that the one came which looks like none.
//!
//! The FIFO has three bytes in the model. Bytes are known by their numbers on the line.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    clippy::struct_excessive_bools,
    reason = "what goes wrong is what a harness would find; what is any is said one thing after the other"
)]

mod chip;
mod invariant;
mod liveness;
mod reports;
mod safety;

/// The reception with times of the model: see [`chip::Chip::time`].
type Reception = crate::Reception<1, 2>;
