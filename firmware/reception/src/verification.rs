//! Theorem 12: the reception. Whatever the chip does, and whenever the handler runs:
//!
//! * S1. Bytes are handed on in order, each once, and none that is spoilt.
//! * S2. If a byte was lost, spoilt or dropped, an event is reported before any later byte is handed on.
//! * S3. What is reported has happened: the causes that ERRORSRC has, a gap, an ENDRX that was lost.
//! * L1. A round takes the byte whose ENDRX has come: it is handed on, or dropped behind a report. It reports
//!   a gap, once. It leaves a transfer open, and of the events that wake none but what the chip does next.
//! * L2. After the last error, at most [`chip::FIFO`] bytes come out before it hears again: it does with the
//!   first time of `NONE_WAITS` in which no byte comes.
//! * L3. If an ENDRX is lost, the UARTE is started anew, with a report, at the second tick; or, if the byte
//!   looks like none, when the FIFO has overrun. If ENDRX comes no more, the watchdog is not fed.
//! * L4. An ENDRX that comes again before the next STARTRX costs nothing. One that comes behind it costs one byte
//!   too many, which looks like none; from then on all of this holds again.
//!
//! Proof by induction. [`chip`] is the chip as the handler sees it, [`invariant`] what always holds of both.
//! It holds at the start; whatever the chip does keeps it ([`safety`]); so does every round, and every tick,
//! though **the chip may do anything between any two accesses**: before each, [`chip::Chip::moves`] takes any
//! number of its steps at once. L1 to L3 are of a chip that does what it must between rounds
//! ([`liveness`]).
//!
//! No event but ENDRX is in the model, since no decision asks for one: any of them may be lost, doubled or
//! late. Then a round comes at the next tick instead.
//!
//! What is taken for granted of the chip, each a row of the self-test:
//!
//! * A1. A byte that waits while a transfer is open is stored, and its ENDRX comes if it comes at all, before
//!   the transfer has been open for `NONE_WAITS`. An ENDRX may be late for any time if the byte in memory
//!   can be told from none.
//! * A2. The FIFO goes on receiving when no transfer is open.
//! * A3. ERRORSRC says so before a byte from behind the error is stored.
//! * A4. So it does if a byte is lost to an overrun.
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
