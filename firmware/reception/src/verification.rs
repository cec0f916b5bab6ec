//! Theorem 12: the reception. Whatever the chip does, and whenever the handler runs:
//!
//! * S1. No byte is handed on twice, none before it is stored, none while it may be overwritten, and all
//!   are in order.
//! * S2. If a byte was lost or spoilt, or the handler was late, a line event is reported before any later
//!   byte.
//! * S3. A round leaves the UARTE receiving, or is one of at most [`PATIENCE`](crate::PATIENCE) that wait
//!   for it. Rounds are counted only while receiving; so if the handler does not come to receive again,
//!   the watchdog is not fed.
//! * S4. Two rounds leave no event whose interrupt would come again at once; three, if the second has
//!   started the UARTE anew.
//!
//! Proof by induction. [`chip`] is a model of the chip that moves in small steps; [`access`] is what the
//! handler reads and writes of it, and asserts S1 and S2 of each byte that is handed on. [`invariant`] says what
//! always holds of the chip and the handler's state. It holds at the start; every step of the chip keeps it,
//! from any state; and so does every round, and every tick, while the chip makes any steps between any two
//! accesses of the handler and any two bytes that it reads ([`interleaving`]). Hence it holds, with S1 to S3,
//! after any number of steps and rounds. For S4 alone the chip stands still: one that moves may raise the
//! next event at any time.
//!
//! What the model's chip may do: raise RXDRDY any time until the next byte, also after the ENDRX of that
//! byte; raise RXTO unasked while it receives, or never when it is asked; never end a flush; leave AMOUNT as
//! it was if nothing was stored; end a transfer at STOPRX with bytes left in the FIFO; hear nothing from
//! RXTO to STARTRX; lose bytes to overruns while it is stopped; spoil any byte, which is then not stored
//! (framing) or is (parity), counted or not, before ERROR or after it. The handler may be as late as it
//! likes, within what the model counts.
//!
//! What it takes for granted: what a byte leads to has happened before the next byte comes, but for
//! RXDRDY; and before the line has been silent for three byte times. RXTO does not come unasked once a
//! full half starts no other. To look at an event and to clear it is one access: what comes in between is
//! cleared with it, as if it had come before.
//!
//! Halves have two bytes in the model, and the FIFO three. Counts matter only by their differences, so
//! the proof takes one count at which the open half was begun.
mod access;
mod chip;
mod induction;
mod interleaving;
mod invariant;
mod motion;
