//! Shows the meaning of most keys of a description by the example frames in `examples.txt`, and by loops over values.

use framelock::{BufferedReceiver, Classification, Format as _};
use framelock_description::{Description, EncodeError, hex};
use serde_json::{Value as Json, json};

/// Returns the names and values of a frame as text.
pub(crate) fn shown(description: &Description, frame: &[u8]) -> String {
    let kind = description.kind(frame).unwrap();
    let fields = kind.values(frame).map(|(field, content)| {
        let values = content.values().map(|value| format!(" {value}"));
        let unit = field.unit.as_ref().map(|unit| format!(" {unit}"));
        let values = values.chain(unit).collect::<Vec<_>>().concat();
        format!("{}{values}", field.name)
    });
    fields.collect::<Vec<_>>().join(", ")
}

/// Encodes values, which are in the order of the columns, or have the names of the columns. A value that is `null` is
/// missing.
fn encoded(description: &Description, values: &Json) -> Result<Vec<u8>, EncodeError> {
    let columns = description.columns.iter().enumerate();
    let row = columns.map(|(number, column)| {
        let value = values.get(number).or(values.get(&*column.name));
        value.cloned().filter(|value| !value.is_null())
    });
    description.encode(&row.collect::<Vec<_>>())
}

/// Returns the names of the kinds of all frames in a stream. Panics if a byte is discarded.
fn received<'d>(description: &'d Description, stream: &[u8]) -> Vec<&'d str> {
    let format = description.format();
    let buffer = vec![0; 2 * format.longest()];
    let mut receiver = BufferedReceiver::with_buffer(format.clone(), buffer).unwrap();
    let mut kinds = vec![];
    receiver.feed(stream, |found| {
        let frame = found.message().expect("no byte is discarded");
        kinds.push(&*description.kinds[frame.message().0].name);
    });
    kinds
}

/// Checks a line of an example. `frame` is the last frame, and whether it was encoded.
fn check(description: &Description, frame: &mut (Vec<u8>, bool), step: &str, rest: &str) {
    let json = |text| serde_json::from_str::<Json>(text).unwrap();
    let is_frame =
        |bytes: &[u8]| description.format().classify(bytes) == Classification::Frame(bytes.len());
    match step {
        "values" => *frame = (encoded(description, &json(rest)).unwrap(), true),
        "also" => assert_eq!(
            encoded(description, &json(rest)).unwrap(),
            frame.0,
            "{rest}"
        ),
        "frame" => {
            let bytes = hex::parse(&[rest]).unwrap();
            assert!(is_frame(&bytes), "{rest}");
            assert!(!frame.1 || bytes == frame.0, "{rest}: {:02X?}", frame.0);
            *frame = (bytes, false);
        }
        "rejected" => assert!(!is_frame(&hex::parse(&[rest]).unwrap()), "{rest}"),
        "shows" => assert_eq!(shown(description, &frame.0), rest),
        "kind" => assert_eq!(description.name(&frame.0), Some(rest)),
        "columns" => {
            let columns = description.columns.iter().map(|column| &*column.name);
            assert_eq!(columns.collect::<Vec<_>>().join(", "), rest);
        }
        "refused" => {
            let (values, told) = rest.split_once(" => ").unwrap();
            let why = encoded(description, &json(values)).unwrap_err().to_string();
            assert!(why.starts_with(told), "{values}: {why}");
        }
        _ => {
            let (stream, kinds) = rest.split_once(" => ").unwrap();
            let found = received(description, &hex::parse(&[stream]).unwrap().repeat(20));
            assert_eq!(found, kinds.split(' ').collect::<Vec<_>>().repeat(20));
        }
    }
}

const STEPS: [&str; 9] = [
    "values", "also", "frame", "rejected", "shows", "kind", "columns", "refused", "stream",
];

#[test]
fn each_example_does_what_its_lines_say() {
    for example in include_str!("../examples.txt").split("\n## ").skip(1) {
        let (title, lines) = example.split_once('\n').unwrap();
        println!("{title}");
        let step = |line: &str| {
            line.split_once(' ')
                .is_some_and(|(step, _)| STEPS.contains(&step))
        };
        let (steps, keys): (Vec<&str>, Vec<&str>) = lines.lines().partition(|line| step(line));
        let description = Description::parse("my.toml", &keys.join("\n")).unwrap();
        let mut frame = (vec![], false);
        assert!(!steps.is_empty());
        for line in steps {
            let (step, rest) = line.split_once(' ').unwrap();
            check(&description, &mut frame, step, rest);
        }
    }
}

/// A field of bits begins at any bit, has 1 to 64 bits, and continues in the next bytes.
#[test]
fn bits_are_counted_from_the_lowest_bit_and_continue_in_the_next_bytes() {
    for (first, width) in (0..8).flat_map(|first| (1..=64).map(move |width| (first, width))) {
        let text = format!(
            "sync = '24'\nlength = 10\nfields = [{{ name = 'a', at = 1, bit = {first}, bits = {width} }}]"
        );
        let description = Description::parse("bits.toml", &text).unwrap();
        for value in [u64::MAX, 0xA5C3_9687_5A3C_6978, 1] {
            let value = value >> (64 - width) | 1;
            let frame = description.encode(&[Some(json!(value))]).unwrap();
            let [bytes @ .., _, _, _, _, _, _, _] = (u128::from(value) << first).to_le_bytes();
            assert_eq!(frame, [&[0x24][..], &bytes].concat(), "{first} {width}");
            assert_eq!(
                shown(&description, &frame),
                format!("a {value}"),
                "{first} {width}"
            );
        }
    }
}

/// The values of a list may be in any order.
#[test]
fn a_field_with_a_list_of_values_has_each_of_them_and_no_other() {
    let text = "sync = '24'\nlength = 2\nfields = [{ name = 'a', at = 1, type = 'u8', value = [9, 2, 200, 7, 3] }]";
    let description = Description::parse("list.toml", text).unwrap();
    for value in 0..=u8::MAX {
        let is_listed = [9, 2, 200, 7, 3].contains(&value);
        let layout = &description.kinds[0].layout();
        let is_frame = layout.classify(&[0x24, value]) == Classification::Frame(2);
        assert_eq!(is_frame, is_listed, "{value}");
        assert_eq!(
            description.encode(&[Some(json!(value))]).is_ok(),
            is_listed,
            "{value}"
        );
    }
}

/// Numbers of 1, 2, 3, 4 and 8 bytes, with and without a sign, are read and written in each byte order.
#[test]
fn numbers_have_a_size_a_sign_and_an_order() {
    for (bytes, order) in [1, 2, 3, 4, 8]
        .into_iter()
        .flat_map(|bytes| [(bytes, "be"), (bytes, "le")])
    {
        let mut number: Vec<u8> = (0x81..).take(bytes).collect();
        let unsigned = number
            .iter()
            .fold(0, |value, byte| value << 8 | i128::from(*byte));
        let signed = unsigned - (1 << (8 * bytes));
        let name = match (bytes, order) {
            (1, _) => "8".to_owned(),
            (2.., "le") => {
                number.reverse();
                format!("{}le", 8 * bytes)
            }
            _ => format!("{}be", 8 * bytes),
        };
        let frame = [b"$", &*number].concat();
        for (class, value) in [("u", unsigned), ("i", signed)] {
            let text = format!(
                "sync = '24'\nlength = {}\nfields = [{{ name = 'it', at = 1, type = '{class}{name}' }}]",
                frame.len()
            );
            let description = Description::parse("my.toml", &text).unwrap();
            let json = serde_json::from_str(&value.to_string()).unwrap();
            assert_eq!(
                description.encode(&[Some(json)]).as_ref(),
                Ok(&frame),
                "{text}"
            );
            assert_eq!(shown(&description, &frame), format!("it {value}"), "{text}");
        }
    }
}

/// The kinds have frames of the same lengths. A number, a number's bits or a field of bits distinguishes the kinds.
#[test]
fn kinds_are_told_apart_by_what_is_always_the_same_in_each() {
    for rest in [
        "type = 'u8', value",
        "type = 'u16be', mask = 0x0FF0, value",
        "bits = 3, bit = 2, value",
    ] {
        for length in [
            "length = 9",
            "length_field = { at = 1, type = 'u8' }\nlongest = 20\nshortest = 8",
        ] {
            let kinds = (1..=3).map(|number| {
                format!("[[kinds]]\nname = 'k{number}'\nfields = [{{ name = 'which', at = 3, {rest} = {number} }}]\n")
            });
            let kinds = kinds.collect::<Vec<_>>().concat();
            let text = format!(
                "sync = '24'\n{length}\nchecksum = {{ name = 'sum', type = 'u8', at = -1 }}\n{kinds}"
            );
            let description = Description::parse("my.toml", &text).unwrap();
            for name in ["k1", "k2", "k3"] {
                let frame = description.encode(&[Some(name.into())]);
                let frame = frame.unwrap_or_else(|why| panic!("{text}: {name}: {why}"));
                assert_eq!(description.kind(&frame).unwrap().name, name);
            }
        }
    }
}
