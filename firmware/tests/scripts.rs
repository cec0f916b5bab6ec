//! Runs the scripts of `outputs.txt`, `line_errors.txt` and `start.txt`. `outputs.txt` describes their commands.

use nrf52840_emulator::{Assumptions, LineSymbol, MICROSECOND, MILLISECOND};

use crate::bounds::Recorded;
use crate::firmware::Firmware;
use crate::outputs::{led3, pulse, pulses};
use crate::symbols::{Setpoint, frame, setpoint, symbols};

#[test]
fn outputs() {
    each_script_passes(include_str!("outputs.txt"), 17);
}

#[test]
fn line_errors() {
    each_script_passes(include_str!("line_errors.txt"), 19);
}

#[test]
fn start() {
    each_script_passes(include_str!("start.txt"), 5);
}

/// The states that LED3 shows and the log names.
const STATES: [&str; 4] = [
    "no frames",
    "frames arrive too far apart",
    "approach",
    "live",
];

/// The state of a script: the board, the log's lines so far, and the instant of the last command `mark`.
struct Script {
    recorded: Recorded,
    log: Vec<String>,
    mark: u64,
}

fn each_script_passes(text: &str, count: usize) {
    let scripts: Vec<&str> = text.split("\n\n").skip(1).collect();
    assert_eq!(scripts.len(), count);
    for script in scripts {
        let lines = script.lines().filter(|line| !line.starts_with('#'));
        let lines: Vec<String> = lines.map(|line| line.trim_start().to_owned()).collect();
        let (name, commands) = lines.split_first().unwrap();
        let mut script = Script {
            recorded: Recorded::of(Firmware::booted("default")),
            log: Vec::new(),
            mark: 0,
        };
        for line in repeated(commands) {
            let words: Vec<&str> = line.split(' ').collect();
            script.run(words[0], &words[1..], &format!("{name}: {line}"));
        }
    }
}

/// Repeats the lines between `each` and `end` for each value. Blocks may be nested.
fn repeated(lines: &[String]) -> Vec<String> {
    let Some(each) = lines.iter().position(|line| line.starts_with("each ")) else {
        return lines.to_vec();
    };
    let mut open = 0;
    let ends = |line: &String| {
        open += i32::from(line.starts_with("each ")) - i32::from(line == "end");
        open == 0
    };
    let end = each + lines[each..].iter().position(ends).expect("an end");
    let mut words = lines[each].split(' ').skip(1);
    let name = format!("${}", words.next().unwrap());
    let mut all = lines[..each].to_vec();
    for value in words.flat_map(values) {
        let body = lines[each + 1..end].iter();
        let body: Vec<String> = body.map(|line| line.replace(&name, &value)).collect();
        all.extend(repeated(&body));
    }
    all.extend(repeated(&lines[end + 1..]));
    all
}

/// Returns the values of a word: a range, perhaps with a step, or one value in which commas stand for blanks.
fn values(word: &str) -> Vec<String> {
    let Some((from, to)) = word.split_once("..") else {
        return vec![word.replace(',', " ")];
    };
    let (to, step) = to.split_once('/').unwrap_or((to, "1"));
    let range = from.parse::<u64>().unwrap()..to.parse().unwrap();
    let values = range.step_by(step.parse().unwrap());
    values.map(|value| value.to_string()).collect()
}

/// Returns a number: decimal, hexadecimal after 0x, or `max`.
fn number(word: &str) -> u32 {
    match word.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).expect(word),
        None if word == "max" => u32::MAX,
        None => word.parse().expect(word),
    }
}

/// Converts a time to cycles. The word is a number of milliseconds, or of microseconds if it ends with `us`.
fn cycles(word: &str) -> u64 {
    match word.strip_suffix("us") {
        Some(count) => u64::from(number(count)) * MICROSECOND,
        None => u64::from(number(word)) * MILLISECOND,
    }
}

impl Script {
    fn run(&mut self, command: &str, words: &[&str], what: &str) {
        if !self.acts(command, words, what) {
            self.check(command, words, what);
        }
    }

    /// Performs a command that changes something. Returns false for any other command.
    fn acts(&mut self, command: &str, words: &[&str], what: &str) -> bool {
        let value = |place: usize| number(words[place]);
        let demand = |place: usize| setpoint(&words[place..place + 3].join(","));
        let firmware = &mut self.recorded.firmware;
        match command {
            "power-on" => self.recorded = Recorded::of(Firmware::at_power_on(words[0])),
            "erased" => self.recorded = Recorded::of(Firmware::on_an_erased_chip(words[0])),
            "boot" => self.recorded = Recorded::of(Firmware::booted(words[0])),
            "frames" => {
                firmware.drive(value(0).into(), value(1).into(), |_| demand(2));
            }
            "queue" => {
                let now = firmware.board.now();
                firmware.board.line(|line| {
                    for n in 0..value(0) {
                        for byte in frame(demand(2)) {
                            let at = now + u64::from(n) * cycles(words[1]);
                            line.send(at, LineSymbol::Byte(byte));
                        }
                    }
                });
            }
            "send" => {
                firmware.board.send_symbols(&symbols(&words.join(" ")));
            }
            "baud" => {
                let millibaud = u64::from(value(0)) * 1_000;
                firmware.board.line(|line| line.set_millibaud(millibaud));
            }
            "run" => firmware.run_for(cycles(words[0])),
            "then" => firmware.send_and_wait(&[], cycles(words[0])),
            "until" => {
                let end = firmware.board.now() + cycles(words[2]);
                while firmware.board.register(value(0)).expect(what) != value(1) {
                    assert!(firmware.board.now() < end, "{what}");
                    firmware.run_for(10);
                }
            }
            "until-counter" => {
                let end = firmware.board.now() + cycles(words[2]);
                while firmware.counter(words[0]) != value(1) {
                    assert!(firmware.board.now() < end, "{what}");
                    firmware.run_for(MICROSECOND);
                }
            }
            "set" => firmware.board.set_register(value(0), value(1)).expect(what),
            "reset" => firmware.board.reset(),
            "stick" => firmware.board.stick_main_loop().expect(what),
            "fault" => firmware.fault_in(words),
            "break-crystal" => firmware.board.break_crystal(),
            "patch" => {
                let code = u16::try_from(value(1)).expect(what).to_le_bytes();
                firmware.patch(words[0], code);
            }
            "mark" => self.mark = firmware.board.now(),
            "assume" => firmware.assume(|all| *all = Assumptions::named(words[0]).expect(what)),
            "change" => firmware.assume(|all| match words[0] {
                "lost_end" => all.lost_end = value(1),
                "stop_is_ignored" => all.stop_is_ignored = value(1) == 1,
                "bits_to_timeout" => all.bits_to_timeout = value(1).into(),
                "end_lag" => all.end_lag = value(1).into(),
                "causeless_timeout" => all.causeless_timeout = value(1) == 1,
                "doubled_end" => all.doubled_end = Some(value(1).into()),
                "slowness" => all.slowness = all.slowness.max(value(1)),
                _ => panic!("{what}"),
            }),
            _ => return false,
        }
        true
    }

    /// Performs a command that checks something. Panics if the check fails.
    fn check(&mut self, command: &str, words: &[&str], what: &str) {
        let value = |place: usize| number(words[place]);
        let demand = |place: usize| setpoint(&words[place..place + 3].join(","));
        let firmware = &mut self.recorded.firmware;
        match command {
            "is" => assert_eq!(firmware.board.register(value(0)), Ok(value(1)), "{what}"),
            "resets" => {
                let resets = firmware.resets().into_iter();
                let resets: Vec<String> = resets.map(|cause| format!("{cause:?}")).collect();
                assert_eq!(resets, words, "{what}");
            }
            "port" => assert!(firmware.board.debug_port_is_open(), "{what}"),
            "commits" => {
                let expected: Vec<Setpoint> = words.iter().map(|word| setpoint(word)).collect();
                assert_eq!(firmware.commits(), expected, "{what}");
            }
            "counter" => {
                let (least, most) = words[1].split_once("..").unwrap_or((words[1], words[1]));
                let count = firmware.counter(words[0]);
                assert!(
                    (number(least)..=number(most)).contains(&count),
                    "{what}: {count}"
                );
            }
            "wires-are-low" => {
                let pins = firmware.board.pins();
                assert_eq!((pins.outputs[1], pins.high[1]), (0x70, 0), "{what}");
            }
            "pulses" => {
                let pulses = pulses(firmware, self.mark);
                let expected = demand(0).map(|unit| pulse(unit.into()));
                let mut widths = pulses.iter();
                assert!(
                    !pulses.is_empty() && widths.all(|widths| *widths == expected),
                    "{what}"
                );
            }
            "bound" => {
                let most = u8::try_from(value(0)).unwrap();
                self.recorded.assert_bounded(self.mark, most, what);
            }
            "away" => {
                for polled in self.recorded.polled(self.mark) {
                    let mut away = polled.iter().zip(demand(1));
                    let is_near = away.all(|(is, was)| u32::from(is.abs_diff(was)) <= value(0));
                    assert!(is_near, "{what}: {polled:?}");
                }
            }
            "leds" => {
                for (lit, word) in firmware.leds().iter().zip(words) {
                    assert!(*word == "-" || *lit == (*word == "1"), "{what}");
                }
            }
            "led3" => assert_led3(firmware, value(0), &words[1..], what),
            "log" => {
                self.log.extend(firmware.board.log());
                let text = words[1..].join(" ");
                let found = self.log.iter().filter(|line| line.contains(&text));
                assert_eq!(found.count(), value(0) as usize, "{what}: {:#?}", self.log);
            }
            "says" => {
                firmware.board.log();
                assert_led3(firmware, 2_097, words, what);
                self.log = firmware.board.log();
                let text = words[3..].join(" ");
                for state in STATES {
                    let mut lines = self.log.iter().filter(|line| line.contains(state));
                    let is_logged = lines.clone().next().is_some();
                    assert_eq!(
                        is_logged,
                        text.starts_with(state),
                        "{what}: {:#?}",
                        self.log
                    );
                    assert!(
                        !is_logged || lines.any(|line| line.ends_with(&text)),
                        "{what}"
                    );
                }
            }
            _ => panic!("unknown command: {what}"),
        }
    }
}

/// Asserts that the number of milliseconds for which LED3 is lit is between the first two words, and that LED3 goes on
/// as often as the third word says.
fn assert_led3(firmware: &mut Firmware, milliseconds: u32, words: &[&str], what: &str) {
    let (lit, flashes) = led3(firmware, milliseconds.into());
    let [least, most, expected] = [0, 1, 2].map(|place| u64::from(number(words[place])));
    assert!((least..=most).contains(&lit), "{what}: {lit} ms");
    assert_eq!(flashes, expected, "{what}");
}
