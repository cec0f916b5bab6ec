//! Shows the meaning of each key of a description by an example frame.

use framelock::{Classification, Format as _};
use framelock_description::{Description, EncodeError, hex};
use serde_json::{Value as Json, json};

use crate::values;

/// Returns the names and values of a frame as text.
fn shown(description: &Description, frame: &[u8]) -> String {
    let kind = description.kind(frame).unwrap();
    let fields = values(kind, frame).into_iter().map(|(field, values)| {
        let unit = field.unit.as_ref().map(|unit| format!(" {unit}"));
        format!("{} {values}{}", field.name, unit.unwrap_or_default())
    });
    fields.collect::<Vec<_>>().join(", ")
}

/// Encodes values, in the order of the columns. A value is missing if it is `null`.
fn encoded(description: &Description, values: &Json) -> Result<Vec<u8>, EncodeError> {
    let values = values.as_array().unwrap().iter();
    let values = values.map(|value| Some(value.clone()).filter(|value| !value.is_null()));
    description.encode(&values.collect::<Vec<_>>())
}

/// Each entry: a description, values in the order of the columns, the frame in hex, and the displayed text.
#[test]
fn each_key_means_what_it_is_called() {
    for (text, values, frame, expected) in [
        // The frame in the manual of the laser scanner LD06, with a CRC that has no name.
        (
            "sync = '54 2C'\nlength = 47\nchecksum = { width = 8, polynomial = 0x4D, type = 'u8', at = -1 }
             fields = [{ name = 'speed', at = 2, type = 'u16le' },
             { name = 'start', at = 4, type = 'u16le', scale = 0.01, unit = 'deg' },
             { name = 'points', at = 6, type = 'bytes', count = 36 },
             { name = 'end', at = 42, type = 'u16le', scale = 0.01, unit = 'deg' },
             { name = 'at', at = 44, type = 'u16le', unit = 'ms' }]",
            json!([2152, 324.27, "E000E4DC00E2D900E5D500E3D300E4D000E9CD00E4CA00E2C700E9C500E5C200E5C000E5", 334.7, 6714]),
            "542C6808AB7EE000E4DC00E2D900E5D500E3D300E4D000E9CD00E4CA00E2C700E9C500E5C200E5C000E5BE823A1A50",
            "speed 2152, start 324.27 deg, points \
             xE000E4DC00E2D900E5D500E3D300E4D000E9CD00E4CA00E2C700E9C500E5C200E5C000E5, end 334.70 deg, at 6714 ms",
        ),
        // Graupner's SUMD, whose length field counts words.
        (
            "sync = 'A8'\nlength_field = { at = 2, type = 'u8', factor = 2, plus = 5 }\nlongest = 69
             checksum = { name = 'CRC-16/XMODEM', type = 'u16be', at = -2 }
             fields = [{ name = 'status', at = 1, type = 'u8' }, { name = 'payload', at = 3, type = 'bytes' }]",
            json!([1, "2EE02710"]),
            "A8 01 02 2E E0 27 10 EF E4",
            "status 1, payload x2EE02710",
        ),
        // Only the lower bits form the length, and nothing is added to it.
        (
            "sync = '7E'\nlength_field = { at = 1, type = 'u8', mask = 0x0F }\nlongest = 15\nshortest = 3
             fields = [{ name = 'flags', at = 1, type = 'u8', mask = 0xF0 }, { name = 'rest', at = 2, type = 'bytes' }]",
            json!([9, "0102"]),
            "7E 94 01 02",
            "flags 9, rest x0102",
        ),
        // The length has three bytes, the highest first, and counts one byte more than the frame has.
        (
            "sync = '7E'\nlength_field = { at = 1, type = 'u24be', plus = -1 }\nlongest = 15
             fields = [{ name = 'rest', at = 4, type = 'bytes' }]",
            json!(["0102"]),
            "7E 00 00 07 01 02",
            "rest x0102",
        ),
        // A sum, written in hexadecimal digits.
        (
            "sync = '3A'\nterminator = '0A'\nlongest = 20\nchecksum = { name = 'sum', type = 'hex8', at = -3, from = 1 }
             fields = [{ name = 'text', at = 1, type = 'text' }]",
            json!(["ab\u{1B}"]),
            "3A 61 62 1B 44 45 0A",
            "text ab\\x1B",
        ),
        // Scales are exact. Whole scales have no decimal point.
        (
            "sync = '24'\nlength = 8\nfields = [
             { name = 'angle', at = 1, type = 'i16be', scale = 0.01, unit = 'deg' },
             { name = 'height', at = 3, type = 'u16be', scale = 25, unit = 'm' },
             { name = 'small', at = 5, type = 'u8', scale = 0.00390625 },
             { name = 'cells', at = 6, bits = 5, count = 2, scale = 0.1, unit = 'V' }]",
            json!([-179.99, 100, 0.5, 3.1, 0.2]),
            "24 B9 B1 00 04 80 5F 00",
            "angle -179.99 deg, height 100 m, small 0.50000000, cells 3.1 0.2 V",
        ),
        // Bits of a number, with and without a sign.
        (
            "sync = '24'\nlength = 4\nfields = [
             { name = 'low', at = 1, type = 'i16le', mask = 0x0FFF },
             { name = 'high', at = 1, type = 'u16le', mask = 0xF000 },
             { name = 'odd', at = 3, type = 'u8', mask = 0xA0, value = 4 },
             { name = 'even', at = 3, type = 'u8', mask = 0x03 }]",
            json!([-2, 5, 3]),
            "24 FE 5F 83",
            "low -2, high 5, even 3",
        ),
        // Fields may share bytes.
        (
            "sync = '24'\nlength = 4\nfields = [
             { name = 'word', at = 1, type = 'u16le' }, { name = 'low', at = 1, type = 'u8' },
             { name = 'flags', at = 2, bits = 4, bit = 2 }]",
            json!([0x2C05, 5, 11]),
            "24 05 2C 00",
            "word 11269, low 5, flags 11",
        ),
        // A field selects one of several terminators. Another field is at the beginning of the frame.
        (
            "sync = 'C8 | EE'\nterminator = '00 | 04'\nlength = 4\nfields = [
             { name = 'to', at = 0, type = 'u8' }, { name = 'end', at = -1, type = 'u8' }]",
            json!([0xEE, 4]),
            "EE 00 00 04",
            "to 238, end 4",
        ),
        // Only the terminator ends a line of text.
        (
            "terminator = '0D 0A'\nlongest = 40\nfields = [{ name = 'line', at = 0, type = 'text' }]",
            json!(["1.5,2"]),
            "31 2E 35 2C 32 0D 0A",
            "line 1.5,2",
        ),
        // Encoding writes the first of several terminators, after the content.
        (
            "sync = '23'\ncontent = '20-7E except 23'\nterminator = '0D 0A | 0A | 0D 0D 0A'\nlongest = 40
             checksum = { name = 'xor', type = 'hex8', at = -4, from = 1 }
             fields = [{ name = 'text', at = 1, type = 'text' }, { name = 'last', at = -5, type = 'u8', value = 0x3B }]",
            json!(["ab c"]),
            "23 61 62 20 63 3B 37 42 0D 0A",
            "text ab c",
        ),
        // Numbered messages, a checksum that covers an additional byte that is not sent, and a trailer after the frame.
        (
            "sync = 'FD'\nlength_field = { at = 1, type = 'u8', plus = 4 }\nlongest = 20
             messages = { at = 2, type = 'u8', known = [[7], [9, 1], [8, 2, 3]] }
             trailer = { name = 'more', at = 1, mask = 0x80, bytes = 2 }
             checksum = { name = 'sum', type = 'u8', at = -1, from = 2 }
             fields = [{ name = 'message', at = 2, type = 'u8' }, { name = 'payload', at = 3, type = 'bytes' }]",
            json!([9, "05", ""]),
            "FD 01 09 05 0F",
            "message 9, payload x05",
        ),
    ] {
        let description = Description::parse("my.toml", text).unwrap();
        let encoded = encoded(&description, &values).unwrap_or_else(|why| panic!("{text}: {why}"));
        assert_eq!(hex::glued(&encoded), frame.replace(' ', ""), "{text}");
        assert_eq!(shown(&description, &encoded), expected, "{text}");
    }
}

/// Numbers of each size, with and without a sign, are read and written in each byte order.
/// Fields of bits begin at any bit, and have any number of bits. They continue in the next bytes.
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

/// Positions are counted from the end of the content, whichever terminator follows. Bytes outside the content's ranges
/// are not allowed.
#[test]
fn a_frame_may_end_in_several_ways() {
    let text = "sync = '23'\ncontent = '20-7E except 23'\nterminator = '0D 0A | 0A | 0D 0D 0A'\nlongest = 40
        checksum = { name = 'xor', type = 'hex8', at = -4, from = 1 }
        fields = [{ name = 'text', at = 1, type = 'text' }, { name = 'last', at = -5, type = 'u8' }]";
    let description = Description::parse("my.toml", text).unwrap();
    for end in ["\r\n", "\n", "\r\r\n"] {
        let frame = format!("#ab c;7B{end}").into_bytes();
        let classification = description.format().classify(&frame);
        assert_eq!(classification, Classification::Frame(frame.len()));
        assert_eq!(shown(&description, &frame), "text ab c, last 59");
    }
    for text in ["ab#c", "ab\nc", "ab\r", "é"] {
        let encoded = description.encode(&[Some(json!(text)), Some(json!(59))]);
        assert!(
            encoded.is_err_and(|why| why.to_string().contains("their content")),
            "{text}"
        );
    }
    // The end of this text and the terminator would together form another terminator.
    let line = "content = '20-7E'\nterminator = '0D 0A | 0D 0D 0A'\nlongest = 40
        fields = [{ name = 'text', at = 0, type = 'text' }]";
    let line = Description::parse("my.toml", line).unwrap();
    assert!(line.encode(&[Some(json!("ab\r"))]).is_err());
}

/// Two kinds of a motor's frames, with shared entries.
const MOTOR: &str = r#"
    sync = "AA 55"
    length_field = { at = 2, type = "u8" }
    longest = 20
    checksum = { name = "CRC-16/MODBUS", type = "u16le", at = -2 }
    fields = [{ name = "number", at = 3, type = "u8" }]

    [[kinds]]
    name = "measurement"
    shortest = 11
    fields = [
        { name = "which", at = 4, type = "u8", value = 1 },
        { name = "position", at = 5, type = "i32le" },
    ]

    [[kinds]]
    name = "state"
    shortest = 8
    fields = [
        { name = "which", at = 4, type = "u8", value = [2, 3] },
        { name = "text", at = 5, type = "text" },
    ]
"#;

#[test]
fn a_description_may_have_several_kinds() {
    let description = Description::parse("motor.toml", MOTOR);
    // A field that is constant in a kind has no column for that kind.
    let description = description.unwrap();
    let columns: Vec<&str> = description
        .columns
        .iter()
        .map(|column| &*column.name)
        .collect();
    assert_eq!(columns, ["kind", "number", "position", "which", "text"]);
    for (values, told) in [
        (
            json!(["measurement", 1, -2, null, null]),
            "number 1, position -2",
        ),
        (
            json!(["state", 2, null, 3, "on"]),
            "number 2, which 3, text on",
        ),
    ] {
        let frame = encoded(&description, &values).unwrap();
        assert_eq!(shown(&description, &frame), told);
        assert_eq!(values[0], *description.kind(&frame).unwrap().name);
    }
    for (values, told) in [
        (
            json!(["satte", 2, null, 3, "on"]),
            "kind: there is no satte (perhaps state?); there are measurement, state",
        ),
        (json!([null, 2, null, 3, "on"]), "missing field `kind`"),
        (
            json!(["state", 2, null, 1, "on"]),
            "which 1 is no message: the description lists the messages",
        ),
        (json!(["state", 2, null, 3]), "missing field `text`"),
        (json!(["measurement", 1]), "missing field `position`"),
    ] {
        let why = encoded(&description, &values).unwrap_err().to_string();
        assert!(why.starts_with(told), "{why}");
    }
}

/// Frames of the same length. A byte or some bits after the length distinguish them.
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

#[test]
fn what_cannot_be_written_is_told() {
    for (text, values, told) in [
        (
            "sync = '24'\nlength = 3\nfields = [{ name = 'a', at = 1, type = 'i16le', scale = 0.1 }]",
            json!([5000]),
            "a 5000 is not a number from -3276.8 to 3276.7",
        ),
        (
            "sync = '24'\nlength = 3\nfields = [{ name = 'a', at = 1, type = 'i16le', mask = 0x0FF0 }]",
            json!([128]),
            "a 128 is not a whole number from -128 to 127",
        ),
        (
            "sync = '24'\nlength = 3\nfields = [{ name = 'a', at = 1, type = 'u16le', mask = 0x0FA0 }]",
            json!([2]),
            "a 2 has other bits than the mask 0xFA0",
        ),
        (
            "sync = 'C8 | EE'\nlength = 3\nfields = [{ name = 'a', at = 0, type = 'u8' }]",
            json!([5]),
            "a cannot have this value: the description gives its bytes another value",
        ),
        (
            "sync = '24'\nlength = 3\nfields = [{ name = 'a', at = 1, type = 'u16le' }, { name = 'b', at = 2, type = 'u8' }]",
            json!([0x0305, 4]),
            "a cannot have this value: the description gives its bytes another value",
        ),
        (
            "sync = '24'\nterminator = '0A'\nlongest = 9\nfields = [{ name = 'a', at = 1, type = 'text' }]",
            json!(["1\\x0A2"]),
            "there is no frame of 5 bytes with these values",
        ),
        (
            "sync = '24'\nterminator = '0A'\nlongest = 9\nfields = [{ name = 'a', at = 1, type = 'text' }]",
            json!(["123456789"]),
            "there is no frame of 11 bytes with these values: the description allows frames of 2 to 9 bytes",
        ),
    ] {
        let description = Description::parse("my.toml", text).unwrap();
        let why = encoded(&description, &values).unwrap_err().to_string();
        assert!(why.starts_with(told), "{why}");
    }
}
