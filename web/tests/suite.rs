//! What the page shows is what framelock's machines do, at any position, however one came there.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::ops::Range;

use framelock::can_go_deaf::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{BufferedReceiver, Line, Receiver};
use framelock_formats::Crsf;
use framelock_simulation::{Parameters, Policy, run};
use framelock_web::{Run, presets};
use proptest::prelude::*;
use serde_json::{Value, json};

fn decoded(address: &str) -> Run {
    decoded_file(address, &[])
}

fn decoded_file(address: &str, file: &[u8]) -> Run {
    let mut run = Run::open(address, file).unwrap();
    while run.decode() < run.bytes() {}
    run
}

fn view(run: &Run, position: usize, places: Range<usize>) -> Value {
    serde_json::from_str(&run.view(position, places.start, places.end)).unwrap()
}

/// Addresses of the presets.
fn addresses() -> Vec<String> {
    let presets: Vec<Value> = serde_json::from_str(&presets()).unwrap();
    let addresses = presets.iter().map(|preset| preset["address"].as_str());
    addresses
        .map(|address| address.unwrap().to_owned())
        .collect()
}

/// The machines when the last byte has come.
fn end(run: &Run) -> Value {
    view(run, run.bytes(), 0..0)["machines"].take()
}

/// The bytes that arrive up to a position.
fn received(run: &Run, position: usize) -> Vec<u8> {
    let view = view(run, 0, 0..position);
    let cells = view["cells"].as_array().unwrap().iter();
    let received = cells.filter_map(|cell| cell["received"].as_u64());
    received.map(|byte| u8::try_from(byte).unwrap()).collect()
}

/// The counters of fresh machines that take those bytes.
fn counters(address: &str, bytes: &[u8]) -> Vec<Value> {
    let mut lecture = Line::new(Lecture::new());
    let mut bin = Line::new(Receiver::<Bin>::new());
    let mut crc8 = Line::new(Receiver::<BinCrc8>::new());
    let mut crsf = Line::new(BufferedReceiver::<_, 64>::new(Crsf));
    for byte in bytes {
        lecture.push(*byte);
        bin.push(*byte);
        crc8.push(*byte);
        crsf.feed(&[*byte], |_| ());
    }
    if address.contains("frame=bin-crc8") {
        vec![json!(crc8.counters())]
    } else if address.contains("frame=crsf") {
        vec![json!(crsf.counters())]
    } else {
        vec![json!(lecture.counters()), json!(bin.counters())]
    }
}

/// The counters that are shown.
fn shown(view: &Value) -> Vec<Value> {
    let machines = view["machines"].as_array().unwrap().iter();
    machines
        .map(|machine| machine["counters"].clone())
        .collect()
}

/// Status, whole frames delivered, whole frames missed, and frames that nobody sent, of each machine.
#[test]
fn each_preset_shows_what_it_says() {
    let expected = [
        json!([["DEAF", 3, 36, 0], ["LISTENING", 39, 0, 0]]),
        json!([["LISTENING", 1, 0, 0], ["LISTENING", 1, 0, 0]]),
        json!([["MISSED ONE", 0, 1, 0], ["LISTENING", 1, 0, 0]]),
        json!([["MISREADING", 3, 36, 36], ["MISREADING", 3, 36, 36]]),
        json!([["LISTENING", 39, 0, 0]]),
        json!([["LISTENING", 39, 0, 0]]),
    ];
    assert_eq!(addresses().len(), expected.len());
    for (address, expected) in addresses().iter().zip(expected) {
        // It is written as the page writes it, which so knows which is shown.
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
        for position in 0..=run.bytes() {
            let expected = counters(&address, &received(&run, position));
            assert_eq!(
                shown(&view(&run, position, 0..0)),
                expected,
                "{address}&at={position}"
            );
        }
    }
}

/// The idle-gap rule takes the ambiguity away, and ends deafness.
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

/// With the same seed, losses and payloads.
#[test]
fn losses_cost_what_the_simulation_says() {
    for (lose, payload, seed) in [
        (0.01, "motion", 7),
        (0.005, "random:40-43", 1),
        (0.02, "00414200", 3),
    ] {
        let parameters = Parameters {
            seed,
            payload: payload.parse().unwrap(),
            frames: 300,
            lose,
            ..Parameters::DEFAULT
        };
        let simulated = run(&parameters, 0, false).unwrap().tally();
        let run = decoded(&format!(
            "payload={payload}&frames=300&lose={lose}&seed={seed}"
        ));
        let machines = end(&run);
        for (machine, policy) in [
            (&machines[0], Policy::Discard),
            (&machines[1], Policy::Rescan),
        ] {
            let tally = simulated
                .receivers
                .iter()
                .find(|tally| tally.kind.policy == policy)
                .unwrap();
            let commits = tally.delivered + tally.wrong_setpoints + tally.false_frames;
            assert_eq!(machine["counters"]["bytes"], simulated.line.bytes_delivered);
            assert_eq!(machine["counters"]["frames"], commits);
            assert_eq!(machine["tally"]["delivered"], tally.delivered);
            assert_eq!(machine["tally"]["missed"], tally.lost_intact);
            assert!(tally.lost_intact > 0 || policy == Policy::Rescan);
        }
    }
}

#[test]
fn the_current_setpoint_is_that_of_the_last_frame() {
    let run = decoded("frames=30");
    let bytes = received(&run, run.bytes());
    for (position, frame) in (7..).step_by(7).zip(bytes.chunks(7)) {
        for machine in view(&run, position, 0..0)["machines"].as_array().unwrap() {
            let [pitch, roll, yaw] = [frame[3], frame[4], frame[5]];
            let expected = json!({ "pitch": pitch, "roll": roll, "yaw": yaw });
            assert_eq!(machine["setpoint"], expected, "at {position}");
        }
    }
}

#[test]
fn back_and_forth_ends_where_it_was() {
    for address in addresses() {
        let run = decoded(&address);
        let there: Vec<Value> = (0..=run.bytes() + 32)
            .map(|to| view(&run, to, 0..40))
            .collect();
        for (position, seen) in there.iter().enumerate().rev() {
            assert_eq!(
                view(&run, position, 0..40),
                *seen,
                "{address}&at={position}"
            );
        }
    }
}

/// What the idle-gap rule drops, and where the failsafe takes the actuators.
#[test]
fn silence_drops_what_is_pending_and_parks_the_actuators() {
    let run = decoded("frames=3&payload=00FF00FF&edits=20d&idle=on");
    let before = &view(&run, 20, 0..0)["machines"][1];
    assert_eq!(
        (&before["phase"], &before["setpoint"]["pitch"]),
        (&json!("Approach"), &json!(255))
    );
    assert_eq!(before["counters"]["discarded"]["line_event"], 0);
    let after = &view(&run, run.bytes() + 32, 0..0)["machines"][1];
    assert_eq!(
        (&after["phase"], &after["output"]["pitch"]),
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

/// It is decoded in pieces, and shown from states on the way.
#[test]
fn a_long_recording_is_shown_as_if_byte_by_byte() {
    let frame = b"AB\0AB\0\rAB\0\x10\x20\x30\rnoise\xC8\x04\x0B\0\xEC\xB7";
    let file: Vec<u8> = frame.iter().copied().cycle().take(40_000).collect();
    for frame in ["frame=bin", "frame=bin-crc8", "frame=crsf"] {
        let address = format!("{frame}&file=40000&edits=3d.9000i41.20000f40");
        let run = decoded_file(&address, &file);
        for position in [
            0, 1, 5, 16_383, 16_384, 16_385, 17_400, 20_007, 32_768, 40_001,
        ] {
            let view = view(&run, position, position.saturating_sub(20)..position);
            let bytes = received(&run, position);
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
    let other = Run::open("file=40001", &file).err().unwrap();
    assert!(other.contains("40001 bytes"), "{other}");
}

#[test]
fn edits_are_done_and_undone() {
    let mut run = decoded("frames=2");
    let plain = view(&run, 14, 0..14);
    let mut edit = |place, action, value| {
        run = decoded(&run.edited(place, action, value));
        (
            run.with("").unwrap(),
            received(&run, 6),
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
fn a_malformed_address_says_what_is_wrong() {
    for (address, complaint) in [
        (
            "frame=morse",
            "frame=morse: bin, bin-crc8 or crsf is wanted",
        ),
        ("lose=2", "lose=2: a number from 0 to 1 is wanted"),
        ("flip=NaN", "flip=NaN: a number from 0 to 1"),
        ("frames=0", "frames=0: a number from 1 to 2000"),
        ("payload=x", "payload=x: one of these is wanted"),
        ("idle=perhaps", "idle=perhaps: on or off"),
        ("edits=21", "edits=21: edits such as"),
        ("edits=21d4", "edits=21d4: edits such as"),
        ("edits=1i4\u{e4}", "edits such as"),
        ("bytes=4", "bytes=4: up to 4096 bytes"),
        ("at=-1", "at=-1: a number"),
        ("colour=red", "colour=red: the address has no such key"),
        ("deaf", "deaf: the address has no such key"),
    ] {
        let error = Run::open(address, &[]).err().unwrap();
        assert!(error.contains(complaint), "{address}: {error}");
    }
}

#[test]
fn every_key_is_written_as_it_is_read() {
    for address in [
        "frame=bin-crc8&payload=random:40-43&frames=7&lose=0.25&flip=0.5&seed=9&idle=on&edits=21d.30f04.40i41&at=12",
        "frame=crsf&bytes=41420D",
        "frame=bin&file=3&at=2",
    ] {
        let file: &[u8] = if address.contains("file") {
            b"AB\0"
        } else {
            b""
        };
        assert_eq!(
            Run::open(address, file)
                .ok()
                .and_then(|run| run.with("").ok())
                .as_deref(),
            Some(address)
        );
    }
}

/// Addresses, well-formed and nearly so.
fn address() -> impl Strategy<Value = String> {
    let key = "frame|payload|frames|lose|flip|seed|idle|bytes|file|edits|at";
    let value = "bin|crsf|on|off|motion|noise|random:40-43|[0-9]{1,3}|0\\.[0-9]|[0-9A-F]{8}|\
                 [0-9]{1,2}[di][0-9A-F]{0,2}|.{0,4}";
    prop::collection::vec((key, value), 0..6).prop_map(|pairs| {
        let pairs = pairs.iter().map(|(key, value)| format!("{key}={value}"));
        pairs.collect::<Vec<_>>().join("&")
    })
}

proptest! {
    #[test]
    fn an_address_is_read_as_it_is_written(address in address()) {
        if let Ok(run) = Run::open(&address, &[]) {
            let written = run.with("").unwrap();
            let again = Run::open(&written, &[]).unwrap();
            prop_assert_eq!(again.with("").unwrap(), written);
            prop_assert_eq!(view(&again, 40, 0..50), view(&run, 40, 0..50));
        }
    }

    #[test]
    fn no_address_panics(address in ".{0,60}") {
        let _ = Run::open(&address, &[]);
    }
}
