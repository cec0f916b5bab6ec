//! The symbols that a sender puts on the line, as text.

use nrf52840_emulator::LineSymbol;

/// Demands for pitch, roll and yaw.
pub(crate) type Setpoint = [u8; 3];

/// Returns the frame of a setpoint.
pub(crate) fn frame([pitch, roll, yaw]: Setpoint) -> [u8; 7] {
    [b'A', b'B', 0, pitch, roll, yaw, b'\r']
}

/// Parses three demands, separated by commas.
pub(crate) fn setpoint(text: &str) -> Setpoint {
    let demands = text.split(',').map(|demand| demand.parse().expect(text));
    demands.collect::<Vec<u8>>().try_into().expect(text)
}

/// Returns the symbols of some words: bytes (two hex digits), `bad:78` (a byte without a stop bit), `break:15` and
/// `idle:15` (bits), `frame:1,2,3`, or `parity:1,2,3` (a frame with parity bits). `78*9` is nine times the word, and
/// `*9` is nine times all words before it.
pub(crate) fn symbols(words: &str) -> Vec<LineSymbol> {
    let mut all = Vec::new();
    for word in words.split_whitespace() {
        let (name, times) = word.split_once('*').unwrap_or((word, "1"));
        let times: usize = times.parse().expect(word);
        if name.is_empty() {
            all = all.repeat(times);
        } else {
            all.extend(symbol(name).repeat(times));
        }
    }
    all
}

fn symbol(word: &str) -> Vec<LineSymbol> {
    let byte = |hex| u8::from_str_radix(hex, 16).expect(word);
    match word.split_once(':') {
        None => vec![LineSymbol::Byte(byte(word))],
        Some(("bad", hex)) => vec![LineSymbol::BadStop(byte(hex))],
        Some(("break", bits)) => vec![LineSymbol::Break(bits.parse().expect(word))],
        Some(("idle", bits)) => vec![LineSymbol::Idle(bits.parse().expect(word))],
        Some(("frame", demand)) => frame(setpoint(demand)).map(LineSymbol::Byte).to_vec(),
        // The sender adds an even parity bit, but the receiver expects a stop bit in its place. If a byte has an even
        // number of ones, the parity bit is 0, so the receiver sees a bad stop bit.
        Some((_, demand)) => frame(setpoint(demand))
            .into_iter()
            .flat_map(|byte| match byte.count_ones() % 2 {
                0 => vec![LineSymbol::BadStop(byte)],
                _ => vec![LineSymbol::Byte(byte), LineSymbol::Idle(1)],
            })
            .collect(),
    }
}
