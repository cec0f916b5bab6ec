#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use framelock::Encode;
use framelock::motion::Bin;

use super::*;

/// A reader that returns a few bytes at a time.
struct Pieces<'a>(&'a [u8], usize);

impl Read for Pieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = buffer.len().min(self.1);
        self.0.read(buffer.get_mut(..length).unwrap())
    }
}

fn read(text: impl AsRef<[u8]>, piece: usize, reads_times: bool) -> Result<Vec<Row>> {
    let input = Input::new("moves", Pieces(text.as_ref(), piece));
    let frame = Protocol::named("bin").unwrap();
    rows(input, InputFormat::Auto, &frame, reads_times)?.collect()
}

fn row(time: Option<u64>, setpoint: [u8; 3]) -> Row {
    Row {
        time: time.map(Duration::from_millis),
        frame: Bin::encode(setpoint.into()).to_vec(),
    }
}

#[test]
fn setpoints_may_have_many_notations_and_arrive_in_pieces() {
    let two = [row(None, [1, 2, 3]), row(None, [4, 5, 6])];
    for text in [
        "1,2,3\n4,5,6\n",
        "1,2,3\r\n4,5,6\r\n",
        "1,2,3\n4,5,6",
        " 1 , 2 , 3 \n\n\"4\",5,6\n",
        "\n \n1,2,3\n  \t\n4,5,6\n \n",
        "pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}1,2,3\n4,5,6\n",
        "pitch;roll;yaw\n1;2;3\n4;5;6\n",
        "1\t2\t3\n\t\t\n4\t5\t6\n",
        "\u{FEFF}# a motion; by hand\n\npitch;roll;yaw\n# begin\n1;2;3\n \n  # \"go on\n4;5;6\n;;\n",
        "time,Yaw,ROLL,pitch,note\n6,3,2,1,\"a, b\"\n5,6,5,4,\"over\ntwo lines\"\n",
        "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n",
        "# two\n{\"pitch\":1,\"roll\":2,\"yaw\":3}\n# and\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
        "[{\"pitch\":1,\"roll\":2,\"yaw\":3},{\"pitch\":4,\"roll\":5,\"yaw\":6}]",
        "\n[\n  {\n \"pitch\": 1, \"roll\": 2,\n \"yaw\": 3 },\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n]\n",
        "\n \n{ \"yaw\": 3, \"roll\": 2, \"pitch\": 1, \"time\": \"x\" }\r\n\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
        "\u{FEFF}{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"more\":[{}]}\n",
    ] {
        for length in [1, 2, 3, 5, 8, 1000] {
            assert_eq!(read(text, length, false).unwrap(), two, "{length}: {text}");
        }
    }
    // An ignored column may contain bytes that are not UTF-8.
    let latin_1 = b"pitch,roll,yaw,note\n1,2,3,H\xF6he\n4,5,6,\n";
    assert_eq!(read(latin_1, 9, false).unwrap(), two);
    for nothing in [
        "[]",
        "# nothing",
        "",
        "\n\n",
        "pitch,roll,yaw\n",
        "pitch,roll,yaw",
    ] {
        assert_eq!(read(nothing, 9, false).unwrap(), []);
    }
}

#[test]
fn times_are_read_on_request() {
    let two = [row(Some(0), [1, 2, 3]), row(Some(50), [4, 5, 6])];
    for text in [
        "0,1,2,3\n5e-2,4,5,6\n",
        "0;1;2;3\n0,05;4;5;6\n",
        "0,00;1;2;3\n0,05;4;5;6\n",
        "time,yaw,pitch,roll\n0.000,3,1,2\n0.05,6,4,5\n",
        "{\"time\":0,\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"time\":0.05}\n",
    ] {
        assert_eq!(read(text, 9, true).unwrap(), two, "{text}");
    }
    assert_eq!(read("1,2,3\n", 9, true).unwrap(), [row(None, [1, 2, 3])]);
}

/// Each line has a text, in which `\n` and `\r` stand for line ends, and the error that the text causes.
const WRONG: &str = r#"
    1,2,256 => line 1: yaw 256 is not a whole number from 0 to 255
    1,2,3\n1,-2,3\n => line 2: roll -2 is not a whole number from 0 to 255
    roll,pitch,yaw\n1,2.5,3\n => line 2: pitch 2.5 is not a whole number from 0 to 255
    1,2,3\n\n1,,3 => line 3: roll "" is not a whole number from 0 to 255
    up,2,3 => line 1: pitch "up" is not a whole number from 0 to 255
    {"pitch":1,"roll":-1,"yaw":3} => line 1: roll -1 is not a whole number from 0 to 255
    {"pitch":"1","roll":2,"yaw":3} => line 1: pitch "1" is not a whole number from 0 to 255
    {"pitch":1,"roll":2,"yaw":2.5} => line 1: yaw 2.5 is not a whole number from 0 to 255
    {"pitch":1,"roll":2,"yaw":null} => line 1: yaw null is not a whole number from 0 to 255
    1,2 => line 1: columns: 2, expected: 3; columns other than pitch,roll,yaw need a header that names all columns
    1,2,3\n1,2,3,"a\nb"\n => line 3: columns: 4, expected: 3; columns other than
    1,2,3\r4,5,6\n => line 1: columns: 5, expected: 3; columns other than
    pitch,roll\n1,2 => line 2: missing field `yaw`
    pitch,roll,yaw,roll\n1,2,3,4 => line 2: duplicate field `roll`
    \n{"pitch":1,"roll":2}\n => line 2: missing field `yaw`
    {"pitch":1,"pitch":1,"roll":2,"yaw":3} => line 1: duplicate field `pitch`, at column 18
    {"pitch":1,\n => line 1: EOF while parsing a value, at column 11
    # one\n1,2,3\n# two\n\n1,2,256 => line 5: yaw 256
    1;2;3\n1;2;2,5 => line 2: yaw 2.5 is not a whole number
    [{"pitch":1,"roll":2,"yaw":3},\n\n{"pitch":1,"roll":2}] => line 3: missing field `yaw`
    [{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,\n"roll":2,"roll":3}] => line 2: duplicate field `roll`
    [\n{"pitch":1,"roll":2,"yaw":3}\n{} => line 3: expected `,` or `]`
    [\n{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,"roll":2,"yaw":300}] => line 4: yaw 300 is
    [1,2,3] => line 1: not a JSON object such as {"pitch":127
    {"pitch":1,"roll":2,"yaw":3}\n1,2,3 => line 2: not a JSON object such as {"pitch":127,"roll":200
"#;

/// A table like [`WRONG`], whose texts are read with times.
const WRONG_TIMES: &str = r#"
    0,1,2,3\n-1,1,2,3 => line 2: time -1 is not a number of seconds, 0 or more
    0,1,2,3\nsoon,1,2,3 => line 2: time "soon" is not a number of seconds, 0 or more
    0,1,2,3\nNaN,1,2,3 => line 2: time null is not a number of seconds, 0 or more
    {"time":-1,"pitch":1,"roll":2,"yaw":3} => line 1: time -1 is not a number of seconds, 0 or more
    2.1701381,1,2,3\n2.170138,1,2,3 => line 2: the time 2.170138s is earlier than 2.1701381s, the time of the row above; times may not decrease
    time,pitch,roll,yaw,time\n1,1,2,3,1 => line 2: duplicate field `time`
    {"pitch":1,"roll":2,"yaw":3}\n{"time":1,"pitch":1,"roll":2,"yaw":3} => line 2: this row has a time, but the rows above have none
    {"time":1,"pitch":1,"roll":2,"yaw":3}\n{"pitch":1,"roll":2,"yaw":3} => line 2: this row has no time, but the rows above have times
"#;

#[test]
fn an_error_names_its_line_and_the_expected_value() {
    for (table, reads_times) in [(WRONG, false), (WRONG_TIMES, true)] {
        for case in table.lines().filter(|line| !line.trim().is_empty()) {
            let (text, told) = case.trim().split_once(" => ").unwrap();
            let text = text.replace("\\n", "\n").replace("\\r", "\r");
            let problem = read(&text, 9, reads_times).unwrap_err().to_string();
            assert!(
                problem.starts_with(&format!("moves: {told}")),
                "{text}: {problem}"
            );
        }
    }
}
