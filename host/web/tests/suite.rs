//! Tests that the page shows the state of framelock's machines at any position, however the user
//! reached it.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::ops::Range;
use std::sync::Mutex;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{BufferedReceiver, Line, Receiver};
use framelock_description::{Description, SHIPPED};
use framelock_formats::crsf::Crsf;
use framelock_web::{Run, frames, presets, problem};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::seq::IteratorRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// The description that the page shows as an example.
const MOTOR: &str = include_str!("../page/motor.toml");

fn decoded(address: &str) -> Run {
    Run::open(address).unwrap()
}

fn view(run: &Run, position: usize, places: Range<usize>) -> Value {
    serde_json::from_str(&run.view(position, places.start, places.end)).unwrap()
}

/// Returns the addresses of the presets.
fn addresses() -> Vec<String> {
    let presets: Vec<Value> = serde_json::from_str(&presets()).unwrap();
    let addresses = presets.iter().map(|preset| preset["address"].as_str());
    addresses
        .map(|address| address.unwrap().to_owned())
        .collect()
}

/// Returns the address of frames that a text describes.
fn own(description: &str) -> String {
    format!(
        "frame=own&description={}",
        utf8_percent_encode(description, NON_ALPHANUMERIC)
    )
}

/// Returns the names of the bytes in the last machine's window at a position: the bytes that have arrived and those
/// expected next.
fn names(run: &Run, position: usize) -> Vec<String> {
    let view = view(run, position, 0..0);
    let machine = view["machines"].as_array().unwrap().last().unwrap();
    let window = machine["window"].as_array().unwrap().iter();
    window
        .map(|slot| slot["name"].as_str().unwrap().to_owned())
        .collect()
}

/// Returns the machines after the last byte has arrived.
fn end(run: &Run) -> Value {
    view(run, run.bytes(), 0..0)["machines"].take()
}

/// Returns the byte that arrives for each byte on the line, or `None` if it is lost.
fn arrivals(run: &Run) -> Vec<Option<u8>> {
    let view = view(run, 0, 0..run.bytes());
    let cells = view["cells"].as_array().unwrap().iter();
    let received = cells.map(|cell| cell["received"].as_u64());
    received
        .map(|byte| Some(u8::try_from(byte?).unwrap()))
        .collect()
}

/// Returns the bytes that arrive up to a position.
fn received(arrivals: &[Option<u8>], position: usize) -> Vec<u8> {
    arrivals.iter().take(position).copied().flatten().collect()
}

/// Returns the counters of new machines after they have received these bytes.
fn counters(address: &str, bytes: &[u8]) -> Vec<Value> {
    let mut lecture = Line::new(Lecture::new());
    let mut bin = Line::new(Receiver::<Bin>::new());
    let mut crc8 = Line::new(Receiver::<BinCrc8>::new());
    let mut crsf = Line::new(BufferedReceiver::<_, [u8; 64]>::new(Crsf));
    if address.contains("frame=bin-crc8") {
        crc8.feed(bytes, |_| ());
        vec![json!(crc8.counters())]
    } else if address.contains("frame=crsf") {
        crsf.feed(bytes, |_| ());
        vec![json!(crsf.counters())]
    } else if address.contains("frame=own") {
        let motor = Description::parse("motor.toml", MOTOR).unwrap();
        let mut own =
            Line::new(BufferedReceiver::with_buffer(motor.format().clone(), [0; 42]).unwrap());
        own.feed(bytes, |_| ());
        vec![json!(own.counters())]
    } else {
        for byte in bytes {
            lecture.push(*byte);
            bin.push(*byte);
        }
        vec![json!(lecture.counters()), json!(bin.counters())]
    }
}

/// Returns the counters that the page shows.
fn shown(view: &Value) -> Vec<Value> {
    let machines = view["machines"].as_array().unwrap().iter();
    machines
        .map(|machine| machine["counters"].clone())
        .collect()
}

/// Compares four things for each machine: the status, the number of intact frames delivered, the
/// number of intact frames missed, and the number of delivered frames that nobody sent.
#[test]
fn each_preset_shows_what_it_says() {
    let expected = [
        json!([["DEAF", 3, 36, 0], ["LISTENING", 39, 0, 0]]),
        json!([["LISTENING", 1, 0, 0], ["LISTENING", 1, 0, 0]]),
        json!([["MISSED ONE", 0, 1, 0], ["LISTENING", 1, 0, 0]]),
        json!([["MISREADING", 3, 36, 36], ["MISREADING", 3, 36, 36]]),
        json!([["LISTENING", 39, 0, 0]]),
        json!([["LISTENING", 39, 0, 0]]),
        json!([["LISTENING", 39, 0, 0]]),
    ];
    assert_eq!(addresses().len(), expected.len());
    for (address, expected) in addresses().iter().zip(expected) {
        // The preset's address equals the address that the page writes. The page finds the current
        // preset by this comparison.
        assert_eq!(decoded(address).with("").as_ref(), Ok(address));
        let machines = end(&decoded(address));
        let outcomes = machines.as_array().unwrap().iter().map(|machine| {
            let tally = &machine["tally"];
            json!([
                machine["status"],
                tally["delivered"],
                tally["missed"],
                tally["wrong"]
            ])
        });
        assert_eq!(Value::Array(outcomes.collect()), expected, "{address}");
    }
}

#[test]
fn the_counters_are_those_of_the_machines_at_every_position_of_every_preset() {
    for address in addresses() {
        let run = decoded(&address);
        let arrivals = arrivals(&run);
        for position in 0..=run.bytes() {
            let expected = counters(&address, &received(&arrivals, position));
            assert_eq!(
                shown(&view(&run, position, 0..0)),
                expected,
                "{address}&at={position}"
            );
        }
    }
}

/// The idle-gap rule resolves the ambiguity and ends deafness.
#[test]
fn a_pause_between_frames_brings_both_machines_back() {
    for number in [0, 3] {
        let machines = end(&decoded(&format!("{}&idle=on", addresses()[number])));
        for machine in machines.as_array().unwrap() {
            assert_eq!(
                (&machine["status"], &machine["tally"]["delivered"]),
                (&json!("LISTENING"), &json!(39))
            );
        }
    }
}

#[test]
fn the_current_setpoint_is_that_of_the_last_frame() {
    let run = decoded("frames=30");
    let bytes = received(&arrivals(&run), run.bytes());
    for (position, frame) in (7..).step_by(7).zip(bytes.chunks(7)) {
        for machine in view(&run, position, 0..0)["machines"].as_array().unwrap() {
            let [pitch, roll, yaw] = [frame[3], frame[4], frame[5]];
            let expected = json!({ "pitch": pitch, "roll": roll, "yaw": yaw });
            assert_eq!(machine["axes"]["setpoint"], expected, "at {position}");
        }
    }
}

#[test]
fn back_and_forth_ends_where_it_was() {
    for address in addresses() {
        let run = decoded(&address);
        let positions = 0..=run.bytes() + 32;
        let there: Vec<String> = positions.map(|to| run.view(to, 0, 40)).collect();
        for (position, seen) in there.iter().enumerate().rev() {
            assert_eq!(run.view(position, 0, 40), *seen, "{address}&at={position}");
        }
    }
}

/// The idle-gap rule drops pending bytes, and the failsafe parks the actuators.
#[test]
fn silence_drops_what_is_pending_and_parks_the_actuators() {
    let run = decoded("frames=3&payload=00FF00FF&edits=20d&idle=on");
    let before = &view(&run, 20, 0..0)["machines"][1];
    assert_eq!(
        (
            &before["axes"]["phase"],
            &before["axes"]["setpoint"]["pitch"]
        ),
        (&json!("Approach"), &json!(255))
    );
    assert_eq!(before["counters"]["discarded"]["line_event"], 0);
    let after = &view(&run, run.bytes() + 32, 0..0)["machines"][1];
    assert_eq!(
        (&after["axes"]["phase"], &after["axes"]["output"]["pitch"]),
        (&json!("Parked"), &json!(128))
    );
    assert_eq!(after["counters"]["discarded"]["line_event"], 6);
    assert!(
        after["window"]
            .as_array()
            .unwrap()
            .iter()
            .all(|slot| slot["byte"].is_null())
    );
}

/// The line carries ten frames per second. The failsafe needs more than 3.3 frames per second.
#[test]
fn the_page_says_why_the_actuators_do_not_follow() {
    // Of `every` frames, one arrives intact: the others lose their first byte.
    let run = |every: usize| {
        let lost = (0..100).filter(|frame| frame % every > 0);
        let edits: Vec<String> = lost.map(|frame| format!("{}d", 7 * frame)).collect();
        decoded(&format!("frame=bin&frames=100&edits={}", edits.join(".")))
    };
    let told = |run: &Run, position| {
        let axes = view(run, position, 0..0)["machines"][1]["axes"].take();
        json!([axes["phase"], axes["reason"]])
    };
    let no_frames = json!(["Parked", "no frames"]);
    let five_per_second = run(2);
    assert_eq!(told(&five_per_second, 0), no_frames);
    assert_eq!(
        told(&five_per_second, 21),
        json!(["Approach", "moves slowly to the setpoint"])
    );
    assert_eq!(told(&five_per_second, 700), json!(["Live", null]));
    assert_eq!(told(&five_per_second, 732), no_frames);
    let apart = "frames arrive too far apart (fewer than 4 a second)";
    for position in [250, 500, 700] {
        assert_eq!(told(&run(4), position), json!(["Parked", apart]));
    }
}

/// A view of a long line starts from a saved state.
#[test]
fn a_long_line_is_shown_as_if_byte_by_byte() {
    let repeated = "41420041420D0D4142001020300D6E6F697365C8040B00ECB7".repeat(100);
    for frame in ["frame=bin", "frame=bin-crc8", "frame=crsf"] {
        let address = format!("{frame}&bytes={repeated}&edits=3d.900i41.2000f40");
        let run = decoded(&address);
        let arrivals = arrivals(&run);
        for position in [0, 1, 5, 1_023, 1_024, 1_025, 2_007, 2_048, 2_501] {
            let view = view(&run, position, position.saturating_sub(20)..position);
            let bytes = received(&arrivals, position);
            assert_eq!(
                shown(&view),
                counters(frame, &bytes),
                "{address}&at={position}"
            );
            for (nth, machine) in view["machines"].as_array().unwrap().iter().enumerate() {
                let window = machine["window"].as_array().unwrap().iter();
                let held: Vec<u64> = window.filter_map(|slot| slot["byte"].as_u64()).collect();
                let last = bytes.iter().rev().take(held.len()).rev();
                assert!(last.copied().map(u64::from).eq(held.iter().copied()));
                let cells = view["cells"].as_array().unwrap().iter();
                let pending = cells.filter(|cell| cell["fates"][nth] == "pending");
                assert_eq!(pending.count(), held.len().min(20));
            }
        }
    }
}

#[test]
fn edits_are_done_and_undone() {
    let mut run = decoded("frames=2");
    let plain = view(&run, 14, 0..14);
    let mut edit = |place, action, value| {
        run = decoded(&run.edited(place, action, value));
        (
            run.with("").unwrap(),
            received(&arrivals(&run), 6),
            view(&run, 14, 0..14),
        )
    };
    edit(3, "insert", 0x41);
    let (address, bytes, _) = edit(4, "insert", 0x42);
    assert_eq!(bytes, [0x41, 0x42, 0x00, 0x41, 0x42, 0x80]);
    assert_eq!(address, "frame=bin&frames=2&edits=3i41.4i42");
    let (_, bytes, _) = edit(4, "flip", 0x03);
    assert_eq!(bytes[4], 0x41);
    let (_, bytes, view) = edit(5, "drop", 0);
    assert_eq!(bytes, [0x41, 0x42, 0x00, 0x41, 0x41]);
    let kinds = (3..6).map(|place| &view["cells"][place]["kind"]);
    assert!(kinds.eq(["inserted", "inserted", "lost"]));
    let (address, _, view) = edit(5, "drop", 0);
    assert_eq!(address, "frame=bin&frames=2&edits=3i41.4i42.4f03.5d.5d");
    assert_eq!(view["cells"][5]["kind"], "as sent");
    edit(4, "drop", 0);
    edit(3, "drop", 0);
    edit(0, "flip", 0x80);
    assert_eq!(edit(0, "flip", 0x80).2, plain);
}

#[test]
fn examples_of_every_frame_format_are_sent_and_delivered() {
    let listed: Vec<(String, String)> = serde_json::from_str(&frames()).unwrap();
    let names: Vec<&str> = listed.iter().map(|(name, _)| &**name).collect();
    let shipped: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, [&shipped[..], &["own"]].concat());
    for (name, about) in &listed {
        assert!(!about.is_empty() && !about.contains('#'), "{name}: {about}");
        let run = decoded(&format!("frame={name}&frames=30"));
        let machine = &end(&run)[0];
        assert_eq!(machine["tally"]["delivered"], 30, "{name}");
        assert_eq!(machine["status"], "LISTENING");
        assert_ne!(machine["fields"], json!([]), "{name}");
        // While a frame is incomplete, the page shows a name for each byte that has arrived.
        for position in 0..run.bytes().min(50) {
            let mut view = view(&run, position, 0..0);
            let window = view["machines"][0]["window"].take();
            let mut slots = window.as_array().unwrap().iter();
            assert!(
                slots.all(|slot| slot["byte"].is_null() || slot["name"] != ""),
                "{name}&at={position}: {window}"
            );
        }
    }
}

#[test]
fn frames_of_ones_own_are_received_with_their_names_and_units() {
    let captured = "AA550601E8032C01151D14AA5502020790A2";
    let run = decoded(&format!("frame=own&bytes={captured}"));
    let fields = |position| view(&run, position, 0..18)["machines"][0]["fields"].take();
    assert_eq!(fields(10), json!([]));
    let measurement = json!([
        ["kind", "measurement", ""],
        ["position", "10.00", "deg"],
        ["current", "300", "mA"],
        ["temperature", "21", "C"]
    ]);
    assert_eq!(fields(11), measurement);
    assert_eq!(
        fields(18),
        json!([["kind", "state", ""], ["state", "7", ""]])
    );
    let end = view(&run, 18, 0..18);
    assert!(
        end["sentence"]
            .as_str()
            .unwrap()
            .ends_with("delivers a frame: kind state, state 7."),
        "{end}"
    );
    let fates = end["cells"].as_array().unwrap().iter();
    assert!(
        fates
            .clone()
            .all(|cell| cell["fates"] == json!(["delivered"]))
    );

    // A user types a description without the checksum. Then one byte is changed. Without the checksum, no receiver can
    // notice the change.
    let plain = MOTOR.replace("checksum", "# checksum");
    let run = decoded(&format!("{}&bytes={captured}&edits=4f01", own(&plain)));
    let machine = view(&run, 11, 0..0)["machines"][0].take();
    assert_eq!(machine["fields"][1], json!(["position", "10.01", "deg"]));
    let run = decoded(&format!("frame=own&bytes={captured}&edits=4f01"));
    assert_eq!(end_fates(&run)[0], json!(["checksum mismatch"]));
}

/// Returns each byte's outcomes, after the last byte has arrived.
fn end_fates(run: &Run) -> Vec<Value> {
    let view = view(run, run.bytes(), 0..run.bytes());
    let cells = view["cells"].as_array().unwrap().iter();
    cells.map(|cell| cell["fates"].clone()).collect()
}

#[test]
fn a_mistake_in_a_description_is_reported_with_its_line_and_column() {
    assert_eq!(problem(MOTOR), "");
    for (from, to, told) in [
        ("plus", "pluss", "Line 3, column 39: unknown field"),
        (
            "from = 2",
            "to = -1",
            "Line 5, column 12: checksum: it covers itself",
        ),
        ("MODBUS", "MODBUZ", "Line 5, column 21: there is no"),
        ("[[kinds]]", "[[sorts]]", "Line 7, column 3: unknown field"),
    ] {
        let told_is = problem(&MOTOR.replacen(from, to, 1));
        assert!(told_is.starts_with(told), "{to}: {told_is}");
        let error = Run::open(&own(&MOTOR.replacen(from, to, 1))).err();
        assert_eq!(error, Some(told_is));
    }
    assert!(problem("").starts_with("Line 1, column 1: nothing ends a frame"));
}

/// Changes numbers in the example and in shipped descriptions at random.
#[test]
fn any_description_is_rejected_or_shown() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut shown, mut rejected) = (0, 0);
    for _ in 0..100 {
        let texts = SHIPPED.iter().map(|(_, text)| *text).chain([MOTOR; 14]);
        let text = texts.choose(&mut random).unwrap();
        let numbers = text.split_inclusive(' ').map(|word| {
            let number = word.trim_end_matches([' ', ',', '\n']);
            match number.parse::<i32>() {
                Ok(was) if random.random_ratio(1, 4) => {
                    let is = was + random.random_range(-2..=2);
                    word.replacen(number, &is.to_string(), 1)
                }
                _ => word.to_owned(),
            }
        });
        let text: String = numbers.collect();
        if problem(&text).is_empty() {
            let run = decoded(&format!("{}&frames=3&edits=5d.9f01", own(&text)));
            for position in 0..run.bytes().min(60) {
                view(&run, position, 0..40);
            }
            let tally = &end(&run)[0]["tally"];
            shown += usize::from(tally["delivered"] != 0);
        } else {
            rejected += 1;
        }
    }
    assert!(shown > 20 && rejected > 20, "{shown} {rejected}");
}

#[test]
fn the_guide_contains_the_pages_example() {
    let guide = include_str!("../../../docs/own-frame.md");
    assert!(guide.contains(MOTOR));
}

#[test]
fn each_byte_has_its_name() {
    let bin = ["sync", "sync", "any", "pitch", "roll", "yaw", "terminator"];
    assert_eq!(names(&decoded("frame=bin"), 0), bin);
    let crc8 = [&bin[..6], &["checksum", "terminator"]].concat();
    assert_eq!(names(&decoded("frame=bin-crc8"), 3), crc8);
    let crsf = decoded("frame=crsf&bytes=C8040B00ECB7");
    assert_eq!(names(&crsf, 0), ["address", "length"]);
    let whole = [
        "address", "length", "type", "payload", "payload", "checksum",
    ];
    assert_eq!(names(&crsf, 3), whole);
    // The fourth byte determines the kind.
    let own = decoded("frame=own&bytes=AA5502020790A2AA550601");
    assert_eq!(names(&own, 0), ["sync", "sync", "length", "number"]);
    let state = [
        "sync", "sync", "length", "number", "state", "checksum", "checksum",
    ];
    assert_eq!(names(&own, 4), state);
    let measurement = [
        &state[..4],
        &["position", "position", "current", "current", "temperature"],
        &["checksum", "checksum"],
    ];
    assert_eq!(names(&own, 11), measurement.concat());
    // A frame that is too short for a field does not contain this field.
    let short = "sync = '24'\nlongest = 9\nlength_field = { at = 1, type = 'u8' }\n\
                 checksum = { name = 'xor', type = 'u8', at = -1 }\n\
                 fields = [{ name = 'a', at = 2, type = 'u16le' }, { name = 'b', at = 4, type = 'u16le' }]";
    let short = decoded(&format!("{}&bytes=2405010223", self::own(short)));
    assert_eq!(names(&short, 3), ["sync", "length", "a", "a", "checksum"]);
    let nmea = decoded("frame=nmea&bytes=2447502A3137");
    assert_eq!(
        names(&nmea, 4)[..4],
        ["start", "sentence", "sentence", "sentence"]
    );
    let sbus = names(&decoded("frame=sbus"), 0);
    assert_eq!(sbus[2], "channel1 channel2");
    assert_eq!(sbus[23], "channel17 channel18 frame_lost failsafe unused");
    let signed = decoded("frame=mavlink2&bytes=FD090100000000000000");
    let names = names(&signed, 10);
    assert_eq!(names[..3], ["sync", "length", "incompatible_flags"]);
    assert_eq!(names[19..22], ["checksum", "checksum", "signature"]);
    assert_eq!(names.len(), 9 + 12 + 13);
}

#[test]
fn before_the_first_frame_no_frame_is_shown() {
    for frame in ["bin", "crsf", "own"] {
        let run = decoded(&format!("frame={frame}&edits=1d"));
        let at = |position| view(&run, position, 0..0);
        assert_eq!(at(0)["sentence"], "No byte has arrived yet.");
        for machine in at(0)["machines"].as_array().unwrap() {
            assert_eq!(machine["status"], "NO FRAME YET");
            assert_eq!(machine["fields"], json!([]));
            assert!(machine["axes"]["setpoint"].is_null());
            let temporary = machine["axes"]["temporary"].as_array();
            assert!(temporary.is_none_or(|all| all.iter().all(Value::is_null)));
        }
        let machines = end(&run);
        assert!(
            machines
                .as_array()
                .unwrap()
                .iter()
                .all(|it| it["status"] == "LISTENING")
        );
    }
}

#[test]
fn a_malformed_address_says_what_is_wrong() {
    for (address, complaint) in [
        (
            "frame=morse",
            "frame=morse: expected a frame's name, such as bin, crsf or own",
        ),
        (
            "description=%FF",
            "description=%FF: expected a description of up to 16384",
        ),
        (
            "frame=own&description=length%20%3D%207%0Async%20%3D%20%22G%22",
            "Line 2, column 8: ",
        ),
        ("lose=0.1", "lose=0.1: the address has no such key"),
        ("frames=0", "frames=0: expected a number from 1 to 2000"),
        ("payload=x", "payload=x: expected one of these"),
        ("idle=perhaps", "idle=perhaps: expected on or off"),
        ("edits=21", "edits=21: expected edits such as"),
        ("edits=21d4", "edits=21d4: expected edits such as"),
        ("edits=1i4\u{e4}", "expected edits such as"),
        (
            "bytes=4",
            "bytes=4: word 1, '4', is not a whole number of bytes",
        ),
        ("at=-1", "at=-1: expected a number"),
        ("colour=red", "colour=red: the address has no such key"),
        ("deaf", "deaf: the address has no such key"),
    ] {
        let error = Run::open(address).err().unwrap();
        assert!(error.contains(complaint), "{address}: {error}");
    }
}

#[test]
fn the_first_fault_and_the_first_missed_frame_hold_the_page_and_are_explained() {
    let run = decoded("frame=bin&payload=00414200&edits=21d");
    let held = view(&run, 0, 0..0)["holds"].clone();
    assert_eq!(held, json!([22, 35]));
    let sentence = |position| {
        let view = view(&run, position, 0..0);
        view["sentence"].as_str().unwrap().to_owned()
    };
    assert_eq!(
        sentence(22),
        "41 is lost on the line. Nothing arrives, so no machine can notice it yet."
    );
    let missed = sentence(35);
    assert!(missed.contains("A whole frame has arrived. The lecture's machine misses it: "));
    assert!(missed.contains("framelock delivers a frame: pitch 65"));
    assert!(!sentence(42).contains("misses"), "only the first one");

    // With this payload, a receiver cannot know at which of two offsets the frames begin.
    let ambiguous = decoded("frame=bin&payload=0D414280&edits=21d");
    let held = view(&ambiguous, 0, 0..0)["holds"].clone();
    let position = usize::try_from(held[1].as_u64().unwrap()).unwrap();
    let told = view(&ambiguous, position, 0..0)["sentence"].clone();
    assert!(
        told.as_str()
            .unwrap()
            .contains("framelock misses it, because"),
        "{told}"
    );

    let perfect = decoded("frame=bin&payload=00414200");
    assert_eq!(view(&perfect, 0, 0..0)["holds"], json!([]));
}

#[test]
fn bytes_may_be_spelled_in_the_usual_ways() {
    for bytes in ["0x41,0x42", "4142", "41 42", "41:42"] {
        let run = decoded(&format!("bytes={bytes}"));
        assert_eq!(arrivals(&run), [Some(0x41), Some(0x42)], "{bytes}");
    }
}

#[test]
fn every_key_is_written_as_it_is_read() {
    for address in [
        "frame=bin-crc8&payload=random:40-43&frames=7&seed=9&idle=on&edits=21d.30f04.40i41&at=12",
        "frame=crsf&bytes=41420D",
        "frame=own&description=sync%20%3D%20%2224%22%0Alength%20%3D%203%20%23%20%25%26%2B%20%C3%A9&bytes=240102",
    ] {
        assert_eq!(decoded(address).with("").as_deref(), Ok(address));
    }
}

/// For each key, a pattern of valid pairs of key and value. The last pattern gives pairs that are valid or almost
/// valid.
const PAIRS: [&str; 10] = [
    "frame=(bin|bin-crc8|crsf|ubx|own)",
    "description=length%20%3D%20[1-9]",
    "payload=(motion|noise|random:40-43|[0-9A-F]{8})",
    "frames=[1-9][0-9]?",
    "seed=[0-9]{1,3}",
    "idle=(on|off)",
    "bytes=([0-9A-F]{2}){1,8}",
    "edits=[0-9]{1,2}(d|[fi][0-9A-F]{2})",
    "at=[0-9]{1,2}",
    "(frame|payload|frames|idle|bytes|edits|at|x)=(bin|on|[0-9]{1,3}|.{0,4})",
];

/// Generates addresses that are valid or almost valid.
fn address() -> impl Strategy<Value = String> {
    let pair = prop::sample::select(PAIRS.to_vec());
    prop::collection::vec(pair.prop_flat_map(|pair| pair), 0..6).prop_map(|pairs| pairs.join("&"))
}

/// For each key, the number of valid addresses with this key. The last number counts the wrong addresses.
static OCCURRED: Mutex<[usize; PAIRS.len()]> = Mutex::new([0; PAIRS.len()]);

/// Valid addresses with each key occur, and wrong addresses occur too.
#[test]
fn an_address_is_read_as_it_is_written() {
    any_address();
    let occurred = OCCURRED.lock().unwrap();
    assert!(occurred.iter().all(|times| *times > 5), "{occurred:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    fn any_address(address in address()) {
        let run = Run::open(&address).ok();
        let mut occurred = OCCURRED.lock().unwrap();
        for (pair, times) in PAIRS.iter().zip(&mut *occurred) {
            let (key, _) = pair.split_once('=').unwrap();
            let has_key = address.split('&').any(|it| it.starts_with(&format!("{key}=")));
            *times += usize::from(if key.starts_with('(') { run.is_none() } else { run.is_some() && has_key });
        }
        drop(occurred);
        if let Some(run) = run {
            let written = run.with("").unwrap();
            let again = Run::open(&written).unwrap();
            prop_assert_eq!(again.with("").unwrap(), written);
            prop_assert_eq!(view(&again, 40, 0..50), view(&run, 40, 0..50));
        }
    }

    #[test]
    fn no_address_panics(address in ".{0,60}") {
        let _ = Run::open(&address);
    }
}
