//! Runs the scripts of `scripts.txt`, which test the peripherals register by register.

use std::collections::BTreeMap;

use crate::boards::{BUFFER, asleep};
use nrf52840_emulator::{Assumptions, Board, LineSymbol, MICROSECOND};

/// The commands of each script, and the numbers that the lines `name NAME NUMBER` define.
#[derive(Default)]
struct Scripts {
    scripts: BTreeMap<&'static str, Vec<&'static str>>,
    names: BTreeMap<&'static str, u32>,
}

impl Scripts {
    fn parse(text: &'static str) -> Self {
        let (mut all, mut script) = (Self::default(), "");
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            if let Some((name, value)) =
                line.strip_prefix("name ").and_then(|it| it.split_once(' '))
            {
                let value = all.number(value);
                all.names.insert(name, value);
            } else if let Some(command) = line.strip_prefix("    ") {
                all.scripts.entry(script).or_default().push(command);
            } else if !line.is_empty() {
                assert!(!all.scripts.contains_key(line), "two scripts: {line}");
                script = line;
            }
        }
        all
    }

    /// Returns the value of a sum of names and numbers.
    fn number(&self, text: &str) -> u32 {
        let term = |term: &str| {
            let hex = term
                .strip_prefix("0x")
                .map(|hex| u32::from_str_radix(hex, 16).unwrap());
            let name = || self.names.get(term).copied();
            hex.or_else(name)
                .unwrap_or_else(|| term.parse().expect(text))
        };
        text.split('+').map(term).fold(0, u32::wrapping_add)
    }

    fn cycles(&self, text: &str) -> u64 {
        let (count, unit) = match text.strip_suffix("us") {
            Some(count) => (count, MICROSECOND),
            None => text
                .strip_suffix("ms")
                .map_or((text, 1), |count| (count, 1_000 * MICROSECOND)),
        };
        u64::from(self.number(count)) * unit
    }

    fn run(&self, board: &mut Board, script: &str) {
        for command in &self.scripts[script] {
            let words: Vec<&str> = command.split(' ').collect();
            self.command(
                board,
                words[0],
                &words[1..],
                &format!("{script}: {command}"),
            );
        }
    }

    fn command(&self, board: &mut Board, command: &str, words: &[&str], what: &str) {
        let number = |place: usize| self.number(words[place]);
        match command {
            "set" => board.set_register(number(0), number(1)).expect(what),
            "refuse" => {
                let error = board
                    .set_register(number(0), number(1))
                    .expect_err(what)
                    .to_string();
                assert!(error.contains(&words[2..].join(" ")), "{what}: {error}");
            }
            "is" => assert_eq!(board.register(number(0)).expect(what), number(1), "{what}"),
            "event" => {
                let raised = board.register(number(0)).expect(what) == 1;
                assert_eq!(raised, words[1] == "yes", "{what}");
                board.set_register(number(0), 0).expect(what);
            }
            "wait" => board.run_for(self.cycles(words[0])).expect(what),
            "send" => {
                board.send_symbols(
                    &words
                        .iter()
                        .flat_map(|word| symbols(word))
                        .collect::<Vec<_>>(),
                );
            }
            "noise" => {
                let (at, length) = (board.now() + self.cycles(words[0]), self.cycles(words[1]));
                board.line(|line| line.invert(at, length));
            }
            "ram" => {
                let expected: Vec<_> = words[1..].iter().flat_map(|word| symbols(word)).collect();
                let mut bytes = vec![0; expected.len()];
                board
                    .memory()
                    .read(BUFFER + number(0), &mut bytes)
                    .expect(what);
                let bytes: Vec<_> = bytes.into_iter().map(LineSymbol::Byte).collect();
                assert_eq!(bytes, expected, "{what}");
            }
            "put" => {
                let halves = words[1..]
                    .iter()
                    .map(|word| u16::try_from(self.number(word)).unwrap());
                let bytes: Vec<u8> = halves.flat_map(u16::to_le_bytes).collect();
                board.patch(BUFFER + number(0), &bytes).expect(what);
            }
            "pulses" => {
                let widths = words[1..].iter().map(|word| word.parse::<u64>().ok());
                let period = board.trace().pwm_periods[number(0) as usize];
                assert_eq!(
                    period.pulses().to_vec(),
                    widths.collect::<Vec<_>>(),
                    "{what}"
                );
            }
            "periods" => assert_eq!(
                board.trace().pwm_periods.len(),
                number(0) as usize,
                "{what}"
            ),
            "pins" => assert_eq!(board.pins().high, [number(0), number(1)], "{what}"),
            "resets" => {
                let causes = board
                    .trace()
                    .resets
                    .iter()
                    .map(|reset| format!("{:?}", reset.cause));
                assert_eq!(causes.collect::<Vec<_>>(), words, "{what}");
            }
            "reset" => board.reset(),
            "brown-out" => board.brown_out(),
            "halt" => board.halt_for(self.cycles(words[0])),
            "skip" => board.skip_counts(number(0)).expect(what),
            "wire" if words[0] == "line" => board.wire_line_to(number(1)),
            "wire" => board.wire_loopback(number(1)),
            "port" => assert_eq!(board.debug_port_is_open(), words[0] == "open", "{what}"),
            "break-uicr" => board.break_uicr(number(0), number(1)),
            "assume" => board.assume(Assumptions::named(words[0]).expect(what)),
            "do" => self.run(board, &words.join(" ")),
            _ => panic!("unknown command: {what}"),
        }
    }
}

/// Returns the symbols of a word: "text", two hex digits, bad:62, break:20, or idle:20.
fn symbols(word: &str) -> Vec<LineSymbol> {
    let hex = |hex: &str| u8::from_str_radix(hex, 16).expect(word);
    if let Some(text) = word.strip_prefix('"') {
        return text
            .trim_end_matches('"')
            .bytes()
            .map(LineSymbol::Byte)
            .collect();
    }
    vec![match word.split_once(':') {
        None => LineSymbol::Byte(hex(word)),
        Some(("bad", byte)) => LineSymbol::BadStop(hex(byte)),
        Some(("break", bits)) => LineSymbol::Break(bits.parse().unwrap()),
        Some((_, bits)) => LineSymbol::Idle(bits.parse().unwrap()),
    }]
}

#[test]
fn each_script_passes() {
    let all = Scripts::parse(include_str!("scripts.txt"));
    assert!(all.scripts.len() > 70);
    for script in all.scripts.keys() {
        let mut board = asleep();
        board.line(|line| line.set_millibaud(1_000_000_000));
        all.run(&mut board, script);
    }
}
