//! MAVLink frames that pymavlink 2.4.50 made from mavlink.io's `common.xml` of July 2026 (`mavgen`, `pack`).

use framelock::{Classification, Format as _};
use framelock_description::{Description, hex, shipped};

use crate::values;

/// The last byte of `hdg` is zero, so the sender has left this byte out.
const GLOBAL_POSITION_INT: &str =
    "FD1B000000010121000088130000870EAF1C074EA10640EF070010270000CEFF14000300045A3F";
const ATTITUDE: &str = "FD1000000001011E0000701700000000003F0000803E0000003E7B26";
/// A message with extension fields that older definitions lack.
const MISSION_CURRENT: &str = "FD0F00000001012A000003000A0000004D0000005800000063E9E1";
/// Messages that ArduPilot's definitions lack.
const CURRENT_MODE: &str = "FD090000000101B401000600000005000000017311";
const LINK_NODE_STATUS: &str = "FD24000000010108000001000000000000000400000005000000090000000A0000000B0000000600070008000203C62E";

const HEAD: &str = "
    sync = 'FD'
    length_field = { at = 1, type = 'u8', plus = 12 }
    longest = 267
    checksum = { name = 'CRC-16/MCRF4XX', type = 'u16le', at = -2, from = 1 }
";

fn is_received(description: &Description, frame: &str) -> bool {
    let frame = hex::parse(&[frame]).unwrap();
    description.format().classify(&frame) == Classification::Frame(frame.len())
}

#[test]
fn messages_of_both_definitions_with_all_their_extensions() {
    let all = [
        GLOBAL_POSITION_INT,
        ATTITUDE,
        MISSION_CURRENT,
        CURRENT_MODE,
        LINK_NODE_STATUS,
    ];
    let shipped = Description::parse("mavlink", shipped("mavlink").unwrap()).unwrap();
    let with = |known: &str| {
        let messages = format!("{HEAD}messages = {{ at = 7, type = 'u24le', known = {known} }}");
        Description::parse("my.toml", &messages).unwrap()
    };
    let common = with("'common'");
    for frame in all {
        assert!(is_received(&shipped, frame) && is_received(&common, frame));
    }
    // A dialect and rows. A row replaces the dialect's message with the same number.
    for (known, received) in [
        ("[[436, 193, 9]]", [false, false, false, true, false]),
        ("['common', [436, 193, 9]]", [true; 5]),
        (
            "[[436, 194], 'common', 'ardupilotmega']",
            [true, true, true, false, true],
        ),
    ] {
        let own = with(known);
        assert_eq!(
            all.map(|frame| is_received(&own, frame)),
            received,
            "{known}"
        );
    }
}

#[test]
fn zeros_that_the_sender_leaves_out() {
    for (frame, fields, expected) in [
        (
            GLOBAL_POSITION_INT,
            "{ name = 'lat', at = 14, type = 'i32le' }, { name = 'vx', at = 30, type = 'i16le' },
             { name = 'vz', at = 34, type = 'i16le' }, { name = 'hdg', at = 36, type = 'u16le' }",
            ["481234567", "-50", "3", "4"],
        ),
        (
            ATTITUDE,
            "{ name = 'roll', at = 14, type = 'f32le' }, { name = 'yaw', at = 22, type = 'f32le' },
             { name = 'pitchspeed', at = 30, type = 'f32le' }, { name = 'yawspeed', at = 34, type = 'f32le' }",
            ["0.5", "0.125", "0.0", "0.0"],
        ),
        // Left-out zeros in the middle of a big-endian number, in an array, and in bits.
        (
            "FD 03 00 00 00 01 01 07 00 00 01 02 03 83 41",
            "{ name = 'a', at = 12, type = 'u16be' }, { name = 'b', at = 12, type = 'u8', count = 3 },
             { name = 'c', at = 12, bit = 0, bits = 12 }, { name = 'd', at = 15, type = 'u8' }",
            ["768", "3 0 0", "3", "0"],
        ),
    ] {
        let bytes = hex::parse(&[frame]).unwrap();
        for (number, expected) in expected.iter().enumerate() {
            let field = fields.split("},").nth(number).unwrap().trim_end_matches('}');
            let text = format!("{HEAD}truncated_zeros = true\nfields = [{field}}}]");
            let description = Description::parse("my.toml", &text).unwrap();
            let shown = values(&description.kinds[0], &bytes);
            let shown: Vec<String> = shown.into_iter().map(|(_, values)| values).collect();
            assert_eq!(shown, [*expected], "{field}");
        }
    }
}

/// Encoding leaves the trailing zeros out again.
#[test]
fn zeros_are_left_out_of_frames_that_are_made() {
    let text = format!(
        "{HEAD}truncated_zeros = true
         messages = {{ at = 7, type = 'u24le', known = 'common' }}
         fields = [{{ name = 'source', at = 5, type = 'u16le', value = 0x0101 }},
         {{ name = 'message', at = 7, type = 'u24le', value = 30 }},
         {{ name = 'time', at = 10, type = 'u32le' }},
         {{ name = 'angle', at = 14, type = 'f32le', count = 3 }},
         {{ name = 'speed', at = 26, type = 'f32le', count = 3 }}]"
    )
    .replace("'time'", "'ms'");
    let description = Description::parse("my.toml", &text).unwrap();
    let values = [6000.0, 0.5, 0.25, 0.125, 0.0, 0.0, 0.0].map(|value: f64| {
        Some(if value > 1000.0 {
            6000.into()
        } else {
            value.into()
        })
    });
    // The first column is the kind.
    let row = [&[None][..], &values].concat();
    let frame = description.encode(&row).unwrap();
    assert_eq!(frame, hex::parse(&[ATTITUDE]).unwrap());
}

/// `SYSTEM_TIME`, `CURRENT_MODE`, and a message that only a row names.
#[test]
fn messages_of_a_dialect_have_names() {
    let of = |known: &str| {
        let text = format!(
            "{HEAD}messages = {{ at = 7, type = 'u24le', known = {known} }}
             fields = [{{ name = 'message', at = 7, type = 'u24le' }}, {{ name = 'payload', at = 10, type = 'bytes' }}]"
        );
        Description::parse("my.toml", &text).unwrap()
    };
    let encoded = |description: &Description, name: &str, message: u32| {
        description.encode(&[
            Some(name.into()),
            Some(message.into()),
            Some("x05000000".into()),
        ])
    };
    for (known, number, name) in [
        ("'common'", 2, "SYSTEM_TIME"),
        ("'ardupilotmega'", 436, "CURRENT_MODE"),
        ("['common', [436, 193, 9]]", 436, "CURRENT_MODE"),
        // Rows that give other definitions than the dialect.
        ("['common', [436, 194]]", 436, "my.toml"),
        ("['common', [12345, 7]]", 12345, "my.toml"),
    ] {
        let description = of(known);
        assert!(description.has_kinds());
        let frame = encoded(&description, name, number).unwrap();
        assert_eq!(description.name(&frame), Some(name), "{known}");
        // `encode` also accepts the kind's own name, `my.toml`, instead of the message's name.
        assert_eq!(encoded(&description, "my.toml", number).unwrap(), frame);
    }
    assert!(!of("[[436, 193]]").has_kinds());
    let told = encoded(&of("'common'"), "CURRENT_MODE", 2)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("received as a frame of another kind"),
        "{told}"
    );
}

/// A newer sender may send a longer message than the view knows. Then the row contains the name and the whole payload.
#[test]
fn a_named_message_that_its_view_does_not_show_has_its_payload() {
    let shipped = Description::parse("mavlink", shipped("mavlink").unwrap()).unwrap();
    let whole = shipped.kinds[0]
        .fields
        .iter()
        .find(|field| field.length().is_none());
    let row = |name: &str, payload: &str| {
        let value = |column: &framelock_description::Column| {
            Some(match &*column.name {
                "kind" => name.into(),
                "message" => 30.into(),
                "payload" => payload.into(),
                "compatible_flags" | "sequence" | "system" | "component" => 1.into(),
                _ => return None,
            })
        };
        shipped.columns.iter().map(value).collect::<Vec<_>>()
    };
    let payload = format!("x{}", "07".repeat(40));
    let frame = shipped.encode(&row("ATTITUDE", &payload)).unwrap();
    assert_eq!(frame.len(), 52);
    assert_eq!(shipped.name(&frame), Some("ATTITUDE"));
    let kind = shipped.kind(&frame).unwrap();
    let content = kind.contents(&frame).of(whole.unwrap()).unwrap();
    assert_eq!(content.value().to_string(), payload);
}

#[test]
fn every_message_of_the_dialects_has_one_name() {
    let shipped = Description::parse("mavlink2", shipped("mavlink2").unwrap()).unwrap();
    let names = &shipped.kinds[0].message_names;
    let numbers = names.iter().map(|(number, _)| *number);
    let known = framelock_formats::mavlink::ARDUPILOTMEGA.iter();
    assert!(numbers.eq(known.map(|message| message.number)));
    let distinct: std::collections::HashSet<&str> = names.iter().map(|(_, name)| *name).collect();
    assert_eq!(distinct.len(), names.len());
}

/// A sender leaves out zeros, but never the payload's first byte.
#[test]
fn a_row_without_values_has_one_byte_of_payload() {
    let mavlink2 = Description::parse("mavlink2", shipped("mavlink2").unwrap()).unwrap();
    let view = mavlink2
        .kinds_and_views()
        .find(|kind| kind.name == "ATTITUDE");
    let head: Vec<&str> = view
        .unwrap()
        .fields
        .iter()
        .filter(|field| field.at < 10 && !field.is_appended)
        .map(|field| &*field.name)
        .collect();
    let given = |name: &str| match name {
        "kind" => Some("ATTITUDE".into()),
        "message" => Some(30.into()),
        _ => head.contains(&name).then(|| 0.into()),
    };
    let columns = mavlink2.columns.iter();
    let row: Vec<_> = columns.map(|column| given(&column.name)).collect();
    let frame = mavlink2.encode(&row).unwrap();
    assert_eq!(hex::glued(&frame[..11]), "FD0100000000001E000000");
    assert_eq!(mavlink2.kind(&frame).unwrap().name, "ATTITUDE");
}
