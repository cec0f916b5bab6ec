//! Tests the default functions `push` and `next` of [`Parser`].

use framelock::{DiscardReason, Found, LineEvent, Parser};

/// A parser that defines only the required functions. Each letter is a frame, and every other byte is discarded.
struct Letters;

impl Parser for Letters {
    type Message<'a> = char;

    fn push_with(&mut self, byte: u8, mut account: impl FnMut(Found<()>)) -> Option<char> {
        let letter = char::from(byte);
        account(if letter.is_ascii_alphabetic() {
            Found::frame(1, ())
        } else {
            Found::discarded(1, DiscardReason::NoSync)
        });
        letter.is_ascii_alphabetic().then_some(letter)
    }

    fn feed(&mut self, _: &[u8], _: impl FnMut(Found<char>)) {
        unimplemented!("no test feeds slices")
    }

    fn line_event(&mut self, _: LineEvent, _: impl FnMut(Found<char>)) {}

    fn pending(&self) -> usize {
        0
    }

    fn reset(&mut self) {}

    fn next_with(&mut self, bytes: &mut &[u8], mut account: impl FnMut(Found<()>)) -> Option<char> {
        while let Some((byte, rest)) = bytes.split_first() {
            *bytes = rest;
            if let Some(letter) = self.push_with(*byte, &mut account) {
                return Some(letter);
            }
        }
        None
    }
}

#[test]
fn a_machine_of_ones_own_has_push_and_next() {
    let mut letters = Letters;
    assert_eq!((letters.push(b'a'), letters.push(b'1')), (Some('a'), None));
    let mut bytes = &b"1b2c3"[..];
    assert_eq!(letters.next(&mut bytes), Some('b'));
    assert_eq!(bytes, b"2c3");
    assert_eq!(letters.next(&mut bytes), Some('c'));
    assert_eq!(letters.next(&mut bytes), None);
}
