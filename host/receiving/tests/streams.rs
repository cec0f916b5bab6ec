//! Receives streams that other programs have made. The file `streams.txt` lists them.

#![allow(missing_docs, clippy::unwrap_used, reason = "a panic fails the test")]

use framelock::{Found, LineEvent};
use framelock_description::{Description, hex};
use framelock_description_oracles::values;
use framelock_receiving::{AnyLine, Policy, Protocol};

/// Returns the names and values of a frame.
fn shown(description: &Description, frame: &[u8]) -> String {
    let kind = description.kind(frame).unwrap();
    let fields = kind.values(frame);
    let fields = fields.map(|(field, content)| format!("{} {}", field.name, content.value()));
    fields.collect::<Vec<_>>().join(", ")
}

#[test]
fn streams_of_other_programs_are_received_and_encoded_again() {
    let blocks = include_str!("streams.txt").replace('\r', "");
    let mut names = Vec::new();
    for block in blocks.split("\n\n").skip(1) {
        let mut lines = block.trim().lines().filter(|line| !line.starts_with('#'));
        let (name, stream) = lines.next().unwrap().split_once(": ").unwrap();
        let protocol = Protocol::named(name).unwrap();
        let description = &protocol.description;
        let mut line = AnyLine::new(&protocol, Policy::Framelock).unwrap();
        let mut frames = Vec::new();
        let mut add = |found: Found<&[u8]>| frames.extend(found.message().map(<[u8]>::to_vec));
        for word in stream.split(' ') {
            match word {
                "pause" => line.line_event(LineEvent::Idle, &mut add),
                "break" => line.line_event(LineEvent::Break, &mut add),
                byte => line.feed(&hex::parse(&[byte]).unwrap(), &mut add),
            }
        }
        line.line_event(LineEvent::Idle, &mut add);
        assert_eq!(line.counters().discarded.total(), 0, "{name}");
        let received: Vec<String> = frames
            .iter()
            .map(|frame| shown(description, frame))
            .collect();
        assert_eq!(received, lines.collect::<Vec<_>>(), "{name}");
        for frame in frames {
            assert_eq!(
                description.encode(&values(description, &frame)).as_ref(),
                Ok(&frame)
            );
            let sent = hex::glued(&description.sent(&frame).unwrap());
            assert!(stream.replace(' ', "").contains(&sent), "{name}: {sent}");
        }
        names.push(name);
    }
    assert_eq!(
        names.join(" "),
        "cobs slip kiss hdlc modbus-rtu modbus-rtu dsmr-p1 vedirect dmx512"
    );
}
