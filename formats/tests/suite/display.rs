//! Checks that `Display` writes messages and counters in one line, for logs.

use framelock::motion::Bin;
use framelock::{Line, LineEvent, Receiver};
use framelock_formats::{crsf, gnss, mavlink, rtcm, sbus, ubx};

#[test]
fn messages_are_one_line_each() {
    let payload: &[u8] = &[0x43, 0x50, 0];
    let crsf = crsf::Message {
        address: 0xC8,
        kind: 0x0B,
        payload,
    };
    assert_eq!(crsf.to_string(), "type 0x0B, address 0xC8: 43 50 00");
    let (class, id) = (5, 1);
    let ubx = ubx::Message {
        class,
        id,
        payload: &[],
    };
    assert_eq!(ubx.to_string(), "class 0x05, id 0x01");
    let mut mavlink = mavlink::Message {
        sequence: 7,
        system: 1,
        component: 2,
        id: 30,
        payload,
        signature: None,
    };
    let text = "message 30, sequence 7, system 1, component 2";
    assert_eq!(mavlink.to_string(), format!("{text}: 43 50 00"));
    mavlink.signature = Some(mavlink::Signature {
        link: 0,
        timestamp: 0,
        value: [0; 6],
        signed: &[],
    });
    assert_eq!(mavlink.to_string(), format!("{text}, signed: 43 50 00"));
    let mut sbus = sbus::Message {
        channels: [992; 16],
        digital: [true, false],
        ..Default::default()
    };
    let text = format!("channels:{}, digital: on off", " 992".repeat(16));
    assert_eq!(sbus.to_string(), text);
    (sbus.frame_lost, sbus.failsafe) = (true, true);
    assert_eq!(sbus.to_string(), format!("{text}, frame lost, failsafe"));
    let rtcm = rtcm::Message { payload };
    for (message, text) in [
        (gnss::Message::Ubx(ubx), "UBX class 0x05, id 0x01"),
        (gnss::Message::Nmea(b"GPTXT,\x07"), r"NMEA GPTXT,\x07"),
        (gnss::Message::Rtcm(rtcm), "RTCM message 1077: 43 50 00"),
        (
            gnss::Message::Rtcm(rtcm::Message { payload: &[1] }),
            "RTCM no message: 01",
        ),
    ] {
        assert_eq!(message.to_string(), text);
    }
}

#[test]
fn counters_are_one_line() {
    let mut line = Line::new(Receiver::<Bin>::new());
    let nothing =
        "0 bytes, frames: 0 (0 bytes), discarded: none, resynchronisations: 0, line events: none";
    assert_eq!(line.counters().to_string(), nothing);
    for byte in *b"noise AB\0xyz\rAB\0x" {
        line.push(byte);
    }
    line.line_event(LineEvent::Parity, |_| ());
    assert_eq!(
        line.counters().to_string(),
        "17 bytes, frames: 1 (7 bytes), discarded: no sync 6, line event 4, resynchronisations: 1, \
         line events: parity error 1"
    );
}
