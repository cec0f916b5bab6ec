//! Tests the example `own_format`. It prints the lines of the comment at its end, its format keeps the laws, and its
//! receiver delivers the right texts after one pause.

use std::cell::RefCell;

use framelock::LineEvent;

use crate::laws::keeps_the_laws;

thread_local! {
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Replaces the `println!` of the example.
macro_rules! println {
    ($($text:tt)*) => { super::PRINTED.with_borrow_mut(|printed| *printed += &(format!($($text)*) + "\n")) };
}

#[path = "../../examples/own_format.rs"]
mod example;

/// The number of repeated frames in a stream.
const REPEATED: usize = 1_000;

#[test]
fn it_prints_the_lines_at_its_end() {
    example::main();
    let text = include_str!("../../examples/own_format.rs");
    let (_, lines) = text.split_once("\n// It prints:\n").expect("the lines");
    let lines: String = lines
        .lines()
        .map(|line| line.replacen("// ", "", 1) + "\n")
        .collect();
    assert_eq!(PRINTED.take(), lines);
}

#[test]
fn its_format_keeps_the_laws() {
    let longest = [&b"\xAA\x1F"[..], &[1; 31], &[31]].concat();
    keeps_the_laws(&example::Text, &[b"\xAA\x00\x00".to_vec(), longest]);
}

/// Returns the sum of a text's bytes.
fn sum(text: &[u8]) -> u8 {
    text.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

#[test]
fn the_receiver_of_texts_is_right_after_one_pause() {
    // The text contains `AA 08`, which begins a wrong frame. This wrong frame ends with the `!` in the next copy of the
    // text, because `!` equals the sum of the wrong text.
    let mut frame = b"\xAA\x08ab!\xAA\x08cdD".to_vec();
    frame.push(sum(&frame[2..]));
    let wrong = [&frame[7..], &frame[..4]].concat();
    assert_eq!(sum(&wrong), b'!');
    let mut receiver = example::TextReceiver::new(example::Text);
    let mut receive = |found: Result<&[u8], LineEvent>| {
        let mut texts = vec![];
        let mut take =
            |found| example::take(&mut receiver, found, |text| texts.push(text.to_vec()));
        match found {
            Ok(bytes) => bytes.iter().for_each(|byte| take(Ok(*byte))),
            Err(event) => take(Err(event)),
        }
        texts
    };
    let stream = frame.repeat(REPEATED);
    assert_eq!(receive(Ok(&stream[1..])), vec![wrong; REPEATED - 1]);
    for lost in 0..frame.len() {
        assert!(receive(Err(LineEvent::Idle)).is_empty());
        assert_eq!(receive(Ok(&stream)), vec![frame[2..10].to_vec(); REPEATED]);
        let mut faulty = frame.repeat(10);
        faulty.remove(lost);
        receive(Ok(&faulty));
    }
}
