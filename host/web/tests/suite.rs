//! Tests that the page shows the state of framelock's machines at any position, however the user
//! reached it.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::ops::Range;

use framelock::lecture::Lecture;
use framelock_description::SHIPPED;
use framelock_receiving::{AnyLine, Policy, Protocol};
use framelock_web::{Run, frames, presets, problem};
use percent_encoding::{NON_ALPHANUMERIC, utf8_percent_encode};
use rand::seq::{IndexedRandom as _, IteratorRandom as _};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// The description that the page shows as an example.
const MOTOR: &str = include_str!("../page/motor.toml");

fn opened(address: &str) -> Run {
    Run::open(address).unwrap()
}

/// Returns the view of a position, with the cells at these places.
fn view(run: &Run, position: usize, places: Range<usize>) -> Value {
    serde_json::from_str(&run.view(position, places.start, places.end)).unwrap()
}

/// Returns one value of the view of a position. `pointer` is a JSON pointer (RFC 6901), such as `/machines/0/status`.
fn see(run: &Run, position: usize, pointer: &str) -> Value {
    let has_cells = pointer.starts_with("/cells");
    let mut view = view(run, position, 0..if has_cells { run.bytes() } else { 0 });
    let value = view.pointer_mut(pointer);
    value
        .unwrap_or_else(|| panic!("there is no {pointer}"))
        .take()
}

/// Returns the value at `pointer` in each element of a list.
fn each<'v>(list: &'v Value, pointer: &str) -> Vec<&'v Value> {
    let list = list.as_array().unwrap().iter();
    list.map(|value| value.pointer(pointer).unwrap()).collect()
}

/// Returns the machines after the last byte has arrived.
fn end(run: &Run) -> Value {
    see(run, run.bytes(), "/machines")
}

/// Returns the addresses of the presets.
fn addresses() -> Vec<String> {
    let presets: Value = serde_json::from_str(&presets()).unwrap();
    let addresses = each(&presets, "/address").into_iter();
    addresses
        .map(|it| it.as_str().unwrap().to_owned())
        .collect()
}

/// Returns the address of frames that a text describes.
fn own(description: &str) -> String {
    let description = utf8_percent_encode(description, NON_ALPHANUMERIC);
    format!("frame=own&description={description}")
}

/// Returns the byte that arrives for each byte on the line, or `None` if it is lost.
fn arrivals(run: &Run) -> Vec<Option<u8>> {
    let cells = see(run, 0, "/cells");
    let received = each(&cells, "/received").into_iter();
    received
        .map(|byte| serde_json::from_value(byte.clone()).unwrap())
        .collect()
}

/// Returns the bytes that arrive up to a position.
fn received(arrivals: &[Option<u8>], position: usize) -> Vec<u8> {
    arrivals.iter().take(position).copied().flatten().collect()
}

/// Returns the counters of new machines after they have received these bytes.
fn counters(address: &str, bytes: &[u8]) -> Value {
    let frame = address.split('&').next().unwrap().strip_prefix("frame=");
    let protocol = match frame.unwrap() {
        "own" => Protocol::described("own", MOTOR.to_owned()).unwrap(),
        name => Protocol::named(name).unwrap(),
    };
    let lines = [Policy::Lecture, Policy::Framelock].map(|policy| AnyLine::new(&protocol, policy));
    let counters = lines.into_iter().flatten().map(|mut line| {
        line.feed(bytes, |_| ());
        json!(line.counters())
    });
    counters.collect()
}

/// Returns the counters that the page shows.
fn shown(view: &Value) -> Value {
    json!(each(&view["machines"], "/counters"))
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
        // The preset's address equals the address that the page writes. The page compares the two to
        // find the current preset.
        let run = opened(address);
        assert_eq!(run.with("").as_ref(), Ok(address));
        let machines = end(&run);
        let outcomes = each(&machines, "").into_iter().map(|machine| {
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

/// A machine's window shows the pending bytes, which are the last bytes received. If there are at most 18, the same
/// number of bytes on the line is marked as pending.
#[test]
fn the_counters_and_pending_bytes_are_those_of_the_machines_at_every_position_of_every_preset() {
    for address in addresses() {
        let run = opened(&address);
        let arrivals = arrivals(&run);
        for position in 0..=run.bytes() {
            let bytes = received(&arrivals, position);
            let view = view(&run, position, position.saturating_sub(20)..position);
            let expected = counters(&address, &bytes);
            assert_eq!(shown(&view), expected, "{address}&at={position}");
            for (nth, window) in each(&view["machines"], "/window").into_iter().enumerate() {
                let held = each(window, "");
                assert_eq!(held, bytes[bytes.len() - held.len()..]);
                let fates = each(&view["cells"], "/fates").into_iter();
                let pending = fates.filter(|fates| fates[nth] == "pending").count();
                assert!(
                    pending == held.len() || held.len() > 18,
                    "{address}&at={position}"
                );
            }
        }
    }
}

#[test]
fn the_lectures_machine_is_shown_at_every_position() {
    for address in addresses().iter().filter(|it| it.starts_with("frame=bin&")) {
        let run = opened(address);
        let mut lecture = Lecture::new();
        for (place, byte) in arrivals(&run).into_iter().enumerate() {
            byte.map(|byte| lecture.push(byte));
            let machine = see(&run, place + 1, "/machines/0");
            assert_eq!(machine["state"], lecture.state.to_string());
            let temporary = <[u8; 3]>::from(lecture.temp);
            assert_eq!(machine["axes"]["temporary"], json!(temporary));
        }
    }
}

/// The idle-gap rule ends the deafness in the first preset, and the ambiguity in the fourth.
#[test]
fn a_pause_between_frames_brings_both_machines_back() {
    for number in [0, 3] {
        let machines = end(&opened(&format!("{}&idle=on", addresses()[number])));
        assert_eq!(each(&machines, "/status"), ["LISTENING"; 2]);
        assert_eq!(each(&machines, "/tally/delivered"), [39; 2]);
    }
}

#[test]
fn the_current_setpoint_is_that_of_the_last_frame() {
    let run = opened("frames=30");
    let bytes = received(&arrivals(&run), run.bytes());
    for (position, frame) in (7..).step_by(7).zip(bytes.chunks(7)) {
        let [pitch, roll, yaw] = [frame[3], frame[4], frame[5]];
        let expected = json!({ "pitch": pitch, "roll": roll, "yaw": yaw });
        let machines = see(&run, position, "/machines");
        assert_eq!(each(&machines, "/axes/setpoint"), [&expected; 2]);
    }
}

/// The idle-gap rule drops pending bytes, and the failsafe parks the actuators.
#[test]
fn silence_drops_what_is_pending_and_parks_the_actuators() {
    let run = opened("frames=3&payload=00FF00FF&edits=20d&idle=on");
    for (position, pointer, expected) in [
        (20, "/axes/phase", json!("Approach")),
        (20, "/axes/setpoint/pitch", json!(255)),
        (20, "/counters/discarded/line_event", json!(0)),
        (run.bytes() + 32, "/axes/phase", json!("Parked")),
        (run.bytes() + 32, "/axes/output/pitch", json!(128)),
        (run.bytes() + 32, "/counters/discarded/line_event", json!(6)),
        (run.bytes() + 32, "/pending", json!(0)),
    ] {
        let value = see(&run, position, &format!("/machines/1{pointer}"));
        assert_eq!(value, expected, "{pointer} at {position}");
    }
}

/// The line carries ten frames per second. The failsafe needs frames less than 300 ms apart.
#[test]
fn the_page_says_why_the_actuators_do_not_follow() {
    let no_frames = ("Parked", json!("no frames"));
    let slowly = ("Approach", json!("moves slowly to the setpoint"));
    let apart = "frames arrive too far apart (300 ms or more)";
    let apart = ("Parked", json!(apart));
    // One frame in `every` arrives intact, and the others lose their first byte.
    for (every, position, (phase, reason)) in [
        (2, 0, &no_frames),
        (2, 21, &slowly),
        (2, 700, &("Live", Value::Null)),
        (2, 732, &no_frames),
        (4, 250, &apart),
        (4, 500, &apart),
        (4, 700, &apart),
    ] {
        let lost = (0..100).filter(|frame| frame % every > 0);
        let edits: Vec<String> = lost.map(|frame| format!("{}d", 7 * frame)).collect();
        let run = opened(&format!("frames=100&edits={}", edits.join(".")));
        let axes = see(&run, position, "/machines/1/axes");
        assert_eq!(axes["phase"], *phase, "1 of {every} at {position}");
        assert_eq!(axes["reason"], *reason, "1 of {every} at {position}");
    }
}

#[test]
fn edits_are_done_and_undone() {
    let mut run = opened("frames=2");
    let plain = view(&run, 14, 0..14);
    let mut edit = |place, action, value| {
        run = opened(&run.edited(place, action, value));
        let bytes = received(&arrivals(&run), 6);
        (run.with("").unwrap(), bytes, view(&run, 14, 0..14))
    };
    edit(3, "insert", 0x41);
    let (address, bytes, _) = edit(4, "insert", 0x42);
    assert_eq!(bytes, [0x41, 0x42, 0x00, 0x41, 0x42, 0x80]);
    assert_eq!(address, "frame=bin&frames=2&edits=3i41.4i42");
    let (_, bytes, _) = edit(4, "flip", 0x03);
    assert_eq!(bytes[4], 0x41);
    let (_, bytes, view) = edit(5, "drop", 0);
    assert_eq!(bytes, [0x41, 0x42, 0x00, 0x41, 0x41]);
    let kinds = &each(&view["cells"], "/kind")[3..6];
    assert_eq!(kinds, ["inserted", "inserted", "lost"]);
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
        let run = opened(&format!("frame={name}&frames=30"));
        // Look one step after the last byte, because a pause or a break may end the last frame.
        let machine = see(&run, run.bytes() + 1, "/machines/0");
        assert_eq!(machine["tally"]["delivered"], 30, "{name}");
        assert_eq!(machine["status"], "LISTENING");
        assert_ne!(machine["fields"], json!([]), "{name}");
    }
}

#[test]
fn frames_of_ones_own_are_received_with_their_names_and_units() {
    let captured = "AA550601E8032C01151D14AA5502020790A2";
    let run = opened(&format!("frame=own&bytes={captured}"));
    let measurement = json!([
        ["kind", "measurement", ""],
        ["position", "10.00", "deg"],
        ["current", "300", "mA"],
        ["temperature", "21", "C"]
    ]);
    let state = json!([["kind", "state", ""], ["state", "7", ""]]);
    for (position, fields) in [(10, json!([])), (11, measurement), (18, state)] {
        assert_eq!(see(&run, position, "/machines/0/fields"), fields);
    }
    let sentence = see(&run, 18, "/sentence");
    let delivers = "delivers a frame: kind state, state 7.";
    assert!(sentence.as_str().unwrap().ends_with(delivers), "{sentence}");
    let cells = see(&run, 18, "/cells");
    assert_eq!(each(&cells, "/fates/0"), ["delivered"; 18]);

    // A user types a description without the checksum. Then one byte is changed. Without the checksum, no receiver can
    // notice the change.
    let plain = MOTOR.replace("checksum", "# checksum");
    let run = opened(&format!("{}&bytes={captured}&edits=4f01", own(&plain)));
    let position = see(&run, 11, "/machines/0/fields/1");
    assert_eq!(position, json!(["position", "10.01", "deg"]));
    let run = opened(&format!("frame=own&bytes={captured}&edits=4f01"));
    assert_eq!(see(&run, 18, "/cells/0/fates/0"), "checksum mismatch");
}

#[test]
fn a_mistake_in_a_description_is_reported_with_its_line_and_column() {
    assert_eq!(problem(MOTOR), "");
    for (from, to, expected) in [
        ("plus", "pluss", "Line 3, column 39: unknown field"),
        (
            "from = 2",
            "to = -1",
            "Line 5, column 12: kind measurement: checksum: it covers itself",
        ),
        ("MODBUS", "MODBUZ", "Line 5, column 21: there is no"),
        ("[[kinds]]", "[[sorts]]", "Line 7, column 3: unknown field"),
        (MOTOR, "", "Line 1, column 1: nothing ends a frame"),
    ] {
        let description = MOTOR.replacen(from, to, 1);
        let problem = problem(&description);
        assert!(problem.starts_with(expected), "{to}: {problem}");
        let opened = Run::open(&own(&description));
        assert_eq!(opened.err(), Some(problem));
    }
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
            let run = opened(&format!("{}&frames=3&edits=5d.9f01", own(&text)));
            for position in 0..run.bytes().min(60) {
                view(&run, position, 0..40);
            }
            shown += usize::from(end(&run)[0]["tally"]["delivered"] != 0);
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
fn before_the_first_frame_no_frame_is_shown() {
    for frame in ["bin", "crsf", "own"] {
        let run = opened(&format!("frame={frame}&edits=1d"));
        assert_eq!(see(&run, 0, "/sentence"), "No byte has arrived yet.");
        for machine in see(&run, 0, "/machines").as_array().unwrap() {
            assert_eq!(machine["status"], "NO FRAME YET");
            assert_eq!(machine["fields"], json!([]));
            assert!(machine["axes"]["setpoint"].is_null());
            let temporary = machine["axes"]["temporary"].as_array();
            assert!(temporary.is_none_or(|all| all.iter().all(Value::is_null)));
        }
        let machines = end(&run);
        let mut statuses = each(&machines, "/status").into_iter();
        assert!(statuses.all(|status| status == "LISTENING"), "{frame}");
    }
}

#[test]
fn a_malformed_address_says_what_is_wrong() {
    let no_key = "the address has no such key";
    let no_edits = "expected edits such as";
    let no_text = "expected a description of up to 16384";
    let no_frame = "expected a frame's name, such as bin, crsf or own";
    let odd = "word 1, '4', is not a whole number of bytes";
    for (pair, complaint) in [
        ("frame=morse", no_frame),
        ("description=%FF", no_text),
        ("lose=0.1", no_key),
        ("frames=0", "expected a number from 1 to 200"),
        ("payload=x", "expected one of these"),
        ("idle=perhaps", "expected on or off"),
        ("edits=21", no_edits),
        ("edits=21d4", no_edits),
        ("edits=1i4\u{e4}", no_edits),
        ("bytes=4", odd),
        ("at=-1", "expected a number"),
        ("deaf", no_key),
    ] {
        let error = Run::open(pair).err().unwrap();
        let expected = format!("{pair}: {complaint}");
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn every_key_is_written_as_it_is_read() {
    for address in [
        "frame=bin-crc8&payload=random&frames=7&idle=on&edits=21d.30f04.40i41&at=12",
        "frame=crsf&bytes=41420D",
        "frame=own&description=sync%20%3D%20%2224%22%0Alength%20%3D%203%20%23%20%25%26%2B%20%C3%A9&bytes=240102",
    ] {
        assert_eq!(opened(address).with("").as_deref(), Ok(address));
    }
    for bytes in ["0x41,0x42", "4142", "41 42", "41:42"] {
        let written = opened(&format!("bytes={bytes}")).with("");
        assert_eq!(written.as_deref(), Ok("frame=bin&bytes=4142"), "{bytes}");
    }
}

/// Changes characters of valid addresses at random. If an address is still valid, writing it and reading it again
/// changes nothing.
#[test]
fn no_address_panics() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut opened, mut rejected) = (0, 0);
    let addresses = [
        addresses(),
        vec![own(MOTOR), "frames=7&idle=on&at=12".to_owned()],
    ]
    .concat();
    for _ in 0..1_000 {
        let mut address: Vec<char> = addresses.choose(&mut random).unwrap().chars().collect();
        for _ in 0..random.random_range(0..3) {
            let place = random.random_range(0..address.len());
            address[place] = "0 19afdi=&.%ä".chars().choose(&mut random).unwrap();
        }
        let address: String = address.into_iter().collect();
        if let Ok(run) = Run::open(&address) {
            let written = run.with("").unwrap();
            let again = Run::open(&written).unwrap();
            assert_eq!(again.with("").as_ref(), Ok(&written), "{address}");
            assert_eq!(view(&again, 40, 0..50), view(&run, 40, 0..50), "{address}");
            opened += 1;
        } else {
            rejected += 1;
        }
    }
    assert!(opened > 100 && rejected > 100, "{opened} {rejected}");
}
