//! The receiver's one rule, written down once more: it keeps the longest suffix of what it has
//! seen since the last commit that can still become a frame.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use framelock::{Bin, BinCrc8, Discard, Format, Parser, Receiver, Setpoint};
use framelock_proofs::reference::{self, Format as _};

/// Every history of up to `length` bytes over a small alphabet.
fn histories(length: usize, alphabet: &[u8]) -> Vec<Vec<u8>> {
    let mut all = vec![Vec::new()];
    let mut from = 0;
    for _ in 0..length {
        let to = all.len();
        for shorter in from..to {
            for &byte in alphabet {
                let mut longer = all[shorter].clone();
                longer.push(byte);
                all.push(longer);
            }
        }
        from = to;
    }
    all
}

fn word(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0, |word, &byte| word << 8 | u64::from(byte))
}

/// Every history over {A, B, CR, other}, every byte behind it.
fn step_by_the_rule<F, R>(history: &[u8])
where
    F: Format<Word = u64, Message = Setpoint>,
    R: reference::Format,
{
    for byte in 0..=u8::MAX {
        let count = u8::try_from(history.len()).expect("short");
        let mut receiver = Receiver::<F>::holding(word(history), count);
        let setpoint = receiver.push(byte);

        let mut seen = history.to_vec();
        seen.push(byte);
        let frame =
            seen.len() >= R::LENGTH && R::fails_at(&seen[seen.len() - R::LENGTH..]).is_none();
        let expected = frame.then(|| {
            let frame = &seen[seen.len() - R::LENGTH..];
            Setpoint::from([frame[3], frame[4], frame[5]])
        });
        assert_eq!(setpoint, expected, "{seen:02X?}");
        let longest = (0..R::LENGTH.min(seen.len() + 1))
            .rev()
            .find(|length| R::fails_at(&seen[seen.len() - length..]).is_none());
        let kept = if frame {
            0
        } else {
            longest.expect("the empty suffix at least")
        };
        assert_eq!(receiver.pending(), kept, "{seen:02X?}");
        let held = if frame {
            0
        } else {
            (R::LENGTH - 1).min(seen.len())
        };
        let window = receiver.window();
        assert_eq!(usize::from(window.count()), held, "{seen:02X?}");
        assert_eq!(window.history(), word(&seen[seen.len() - held..]));
    }
}

#[test]
fn bin_keeps_the_longest_suffix_that_can_become_a_frame() {
    for history in histories(6, &[b'A', b'B', b'\r', 0]) {
        step_by_the_rule::<Bin, reference::Bin>(&history);
    }
}

#[test]
fn bin_crc8_keeps_the_longest_suffix_that_can_become_a_frame() {
    // So that checksums that hold occur.
    let right = framelock::crc8(*b"AAAA");
    for history in histories(7, &[b'A', b'B', b'\r', right]) {
        step_by_the_rule::<BinCrc8, reference::BinCrc8>(&history);
    }
}

#[test]
fn holding_makes_the_state_that_the_stream_of_those_bytes_reaches() {
    for history in histories(6, &[b'A', b'B', b'\r', 0]) {
        let mut fed = Receiver::<Bin>::new();
        let mut fed_discarding = Receiver::<Bin, Discard>::new();
        for &byte in &history {
            fed.push(byte);
            fed_discarding.push(byte);
        }
        let count = u8::try_from(history.len()).expect("short");
        assert_eq!(Receiver::<Bin>::holding(word(&history), count), fed);
        // Bytes above those held do not matter, nor does a count beyond what can be held.
        let soiled = word(&history) | u64::MAX << (8 * u32::from(count));
        assert_eq!(Receiver::<Bin>::holding(soiled, count), fed);
        if history.len() == 6 {
            assert_eq!(Receiver::<Bin>::holding(word(&history), u8::MAX), fed);
        }
        // Discard holds a frame's beginning or nothing.
        if fed_discarding.pending() == history.len() {
            assert_eq!(
                Receiver::<Bin, Discard>::holding(word(&history), count),
                fed_discarding
            );
        } else if reference::Bin::fails_at(&history).is_some() {
            assert_eq!(
                Receiver::<Bin, Discard>::holding(word(&history), count),
                Receiver::new()
            );
        }
    }
}

#[test]
fn receivers_are_equal_where_they_hold_the_same_and_show_it() {
    let reset = Receiver::<Bin>::new();
    let held = Receiver::<Bin>::holding(0x41, 1);
    assert_eq!(held, held.clone());
    assert_ne!(held, reset);
    // The marker in front of the byte.
    assert_eq!(
        format!("{held:?}"),
        format!("Receiver(Window({}))", 0x01_41)
    );
}
