//! Theorem 13g for the shipped formats: each keeps the laws of [`Format`], for any bytes, and nothing
//! panics: neither in [`Format::decode`], for bytes that are no frame.
//!
//! The laws that [`Headed`](crate::Headed) gives them (theorem 13g) are asked once more for what each adds, for
//! short frames where a CRC makes longer ones costly; that nothing panics, for longer ones.

mod headed_and_either;

use framelock::{DiscardReason, Format, Verdict};

use crate::{Crsf, Ibus, Mavlink2, Mavlink2Entry, Sbus, SixAxes, Ubx};

/// Of up to `N` bytes, all of them and any shorter beginning.
fn keeps_the_laws<F: Format, const N: usize>(format: &F) {
    let bytes: [u8; N] = kani::any();
    let all: usize = kani::any_where(|&all| 1 <= all && all <= N && all <= F::LONGEST);
    let after = format.judge(&bytes[..all]);
    is_in_bounds::<F>(after, all);
    let starts = format.starts(bytes[0]);
    assert!(starts == (after != Verdict::Reject(DiscardReason::NoSync)));
    let fewer: usize = kani::any_where(|&fewer| 1 <= fewer && fewer <= N);
    if fewer < all {
        let before = format.judge(&bytes[..fewer]);
        is_in_bounds::<F>(before, fewer);
        match before {
            Verdict::Incomplete { at_least } => {
                assert!(at_least <= all || matches!(after, Verdict::Incomplete { .. }));
            }
            _ => assert!(after == before),
        }
    }
    let _ = format.decode(&bytes[..all]);
    kani::cover!(matches!(after, Verdict::Frame(_)));
}

/// Law 1.
fn is_in_bounds<F: Format>(verdict: Verdict, count: usize) {
    match verdict {
        Verdict::Frame(length) => assert!(1 <= length && length <= count),
        Verdict::Incomplete { at_least } => assert!(count < at_least && at_least <= F::LONGEST),
        Verdict::Reject(_) => {}
    }
}

/// Any bytes, up to `N`: the verdict is in bounds, and nothing panics.
fn nothing_panics<F: Format, const N: usize>(format: &F) {
    let bytes: [u8; N] = kani::any();
    let count: usize = kani::any_where(|&count| 1 <= count && count <= N && count <= F::LONGEST);
    let verdict = format.judge(&bytes[..count]);
    is_in_bounds::<F>(verdict, count);
    if let Verdict::Frame(length) = verdict {
        let _ = format.decode(&bytes[..length]);
        kani::cover!(length == N);
    }
}

/// One message, of any id and definition, with so many bytes of payload.
fn dialect(longest: u8) -> impl Fn(u32) -> Option<Mavlink2Entry> {
    let (known, crc_extra): (u32, u8) = (kani::any(), kani::any());
    move |id| (id == known).then_some(Mavlink2Entry { crc_extra, longest })
}

#[kani::proof]
#[kani::unwind(27)]
fn sbus() {
    keeps_the_laws::<_, 25>(&Sbus);
}

#[kani::proof]
#[kani::unwind(34)]
fn ibus() {
    keeps_the_laws::<_, 32>(&Ibus);
}

#[kani::proof]
#[kani::unwind(12)]
fn crsf() {
    keeps_the_laws::<_, 10>(&Crsf::accepting(kani::any::<[u8; 2]>()));
}

#[kani::proof]
#[kani::unwind(16)]
fn ubx() {
    keeps_the_laws::<_, 14>(&Ubx::<13>);
}

#[kani::proof]
#[kani::unwind(16)]
fn mavlink2() {
    keeps_the_laws::<_, 14>(&Mavlink2(dialect(2)));
}

#[kani::proof]
#[kani::unwind(18)]
fn six_axes() {
    keeps_the_laws::<_, 16>(&SixAxes);
}

#[kani::proof]
#[kani::unwind(22)]
fn nothing_panics_in_crsf() {
    nothing_panics::<_, 20>(&Crsf::default());
}

#[kani::proof]
#[kani::unwind(42)]
fn nothing_panics_in_ubx() {
    nothing_panics::<_, 40>(&Ubx::<40>);
}

/// Signed frames among them.
#[kani::proof]
#[kani::unwind(34)]
fn nothing_panics_in_mavlink2() {
    nothing_panics::<_, 32>(&Mavlink2(dialect(7)));
}
