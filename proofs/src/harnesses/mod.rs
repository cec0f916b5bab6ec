//! The theorems, as Kani harnesses. `../README.md` says in words what they prove.
//!
//! Each harness's doc comment says what it proves, cites the clause of `docs/protocol.md`, and
//! ends with lines that the table of `cargo xtask prove` is made from: `Theorem:`, `Length:`, and
//! `Run: long` for those that only `--all` runs. No harness assumes anything about input bytes.
#![allow(
    clippy::indexing_slicing,
    reason = "out of bounds is what a harness would find"
)]

mod accounting;
mod any_length;
mod checksum;
mod encoding;
mod failsafe;
mod long_slices;
mod no_panic;
mod reference;
mod resynchronisation;
mod slices;

use framelock::{Bin, Discard, Format, Lecture, Parser, Policy, Receiver, Setpoint, State};

/// Any setpoint.
fn any_setpoint() -> Setpoint {
    kani::any::<[u8; 3]>().into()
}

/// Any state of the lecture's machine: each value of the type is one.
fn any_lecture() -> Lecture {
    let state: usize = kani::any_where(|&state| state < State::ALL.len());
    Lecture {
        state: State::ALL[state],
        temp: any_setpoint(),
    }
}

/// Any state of a receiver: each is `holding` some bytes.
fn any_receiver<F: Format<Word = u64>, P: Policy>() -> Receiver<F, P> {
    Receiver::holding(kani::any(), kani::any())
}

/// Whether seven bytes are a frame of BIN (F1).
fn is_bin(frame: [u8; 7]) -> bool {
    frame[0] == b'A' && frame[1] == b'B' && frame[6] == b'\r'
}

/// Whether eight bytes are a frame of BIN-CRC8 (F2).
fn is_bin_crc8(frame: [u8; 8]) -> bool {
    frame[0] == b'A'
        && frame[1] == b'B'
        && frame[6] == crate::reference::crc8(&frame[2..6])
        && frame[7] == b'\r'
}

/// Commits while a frame is received: how many before its last byte, and with it.
fn receive<P: Parser<Message = Setpoint>, const N: usize>(
    parser: &mut P,
    frame: [u8; N],
) -> (usize, Option<Setpoint>) {
    let mut before = 0;
    let mut i = 0;
    while i < N - 1 {
        before += usize::from(parser.push(frame[i]).is_some());
        i += 1;
    }
    (before, parser.push(frame[N - 1]))
}

type RescanBin = Receiver<Bin>;
type DiscardBin = Receiver<Bin, Discard>;
