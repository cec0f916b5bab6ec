//! A second, independent implementation of the receiver's rule: among the bytes since the last delivered frame, the
//! receiver keeps the longest suffix that can still become a frame.

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{FixedFormat, Parser as _, Receiver};
use framelock_proofs::reference;

/// Returns every history of up to `length` bytes over a small alphabet.
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

/// Returns a receiver that has taken these bytes.
fn after<F: FixedFormat>(history: &[u8]) -> Receiver<F> {
    let mut receiver = Receiver::new();
    for &byte in history {
        receiver.push(byte);
    }
    receiver
}

/// Checks the receiver's step for every byte that may follow the history.
fn step_by_the_rule<F, R>(history: &[u8])
where
    F: FixedFormat<Message = Setpoint>,
    R: reference::NaiveFormat,
{
    for byte in 0..=u8::MAX {
        let mut receiver = after::<F>(history);
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
    // This byte is the right checksum of the payload `AAAA`, so some histories end just before a frame's last byte.
    let right = framelock::motion::crc8(*b"AAAA");
    for history in histories(7, &[b'A', b'B', b'\r', right]) {
        step_by_the_rule::<BinCrc8, reference::BinCrc8>(&history);
    }
}

/// `push` does not store how many bytes are pending. So after `push`, `push_with` computes this number from the bytes.
#[test]
fn after_push_the_outcomes_of_push_with_are_the_same() {
    let told = |receiver: &mut Receiver<Bin>, byte| {
        let mut outcomes = Vec::new();
        let setpoint = receiver.push_with(byte, |one| outcomes.push(one));
        (setpoint, outcomes)
    };
    let (mut frames, mut discarded) = (0, 0);
    for history in histories(6, &[b'A', b'B', b'\r', 0]) {
        let mut noted = Receiver::new();
        for &byte in &history {
            told(&mut noted, byte);
        }
        for byte in [b'A', b'B', b'\r', 0] {
            let [by_push, by_push_with] =
                [after(&history), noted].map(|mut receiver| told(&mut receiver, byte));
            assert_eq!(by_push, by_push_with, "{history:02X?} {byte:02X}");
            frames += usize::from(by_push.0.is_some());
            discarded += usize::from(by_push.1.len() > 1);
        }
    }
    assert!(frames > 10 && discarded > 10, "{frames} {discarded}");
}

/// Two receivers are equal if and only if the same bytes are pending in both. So equal receivers treat all following
/// bytes alike.
#[test]
fn receivers_are_equal_where_the_same_bytes_are_pending() {
    let histories = histories(4, &[b'A', b'B', b'\r', 0]);
    for one in &histories {
        for other in &histories {
            let [first, second] = [one, other].map(|history| after::<Bin>(history));
            let [of_first, of_second] = [one, other].map(|history| {
                let mut pending = history.clone();
                pending.drain(..history.len() - after::<Bin>(history).pending());
                pending
            });
            assert_eq!(first == second, of_first == of_second, "{one:?} {other:?}");
        }
    }
    let held = after::<Bin>(b"A");
    assert_eq!(held, held.clone());
    // The byte 01 marks the beginning of the pending bytes.
    assert_eq!(
        format!("{held:?}"),
        format!("Receiver(Window({}))", 0x01_41)
    );
}
