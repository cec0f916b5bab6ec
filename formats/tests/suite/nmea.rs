//! Receives NMEA sentences from other projects' recordings. These sentences have the line ends, lengths and noise that
//! occur in practice.

use framelock::EncodeInto;
use framelock_formats::gnss::{Gnss, Message};
use framelock_formats::nmea::Nmea;

use crate::{frame, receive};

/// A receiver's channels, in gpsd's `test/daemon/mtk-3301.log`: 204 bytes, with LF at the end.
const PMTKCHN: &str = "$PMTKCHN,14001,29001,23001,02001,21001,11001,16001,28001,05001,20001,22001,18001,06001,19001,07001,09001,\
     25001,08001,13001,30001,10001,03001,04001,27001,26001,01001,24001,15001,31001,17001,12001,32001*46";

/// The satellites of a u-blox receiver, in pynmeagps' `tests/pygpsdata-nmea4.log`: 424 bytes, with CR LF at the
/// end.
const PUBX_03: &str = "$PUBX,03,23,1,-,014,06,08,000,12,U,207,43,28,009,14,-,049,06,,000,15,-,171,44,23,000,17,-,064,32,16,000,\
     19,-,094,33,,000,20,U,251,20,31,038,21,-,354,04,,000,23,U,251,27,31,064,24,U,268,89,26,000,25,-,223,05,,000,48,-,,,15,\
     000,52,-,,,28,013,65,-,176,07,,000,66,U,223,57,35,064,67,-,315,42,23,000,68,-,341,00,29,000,75,-,057,37,,000,76,U,303,\
     78,18,000,77,-,253,27,21,000,84,-,018,19,,000,85,-,078,22,,000,86,-,121,01,,000*02";

/// A sentence of a u-blox F9P, and the end of the UBX frame before it, in gpsd's
/// `test/daemon/ublox-zed-f9p_hpg1.11.log`.
const GNRMC: &str = "$GNRMC,012250.00,A,4552.65525,S,17030.00564,E,0.069,,120419,,,A,V*08";
const UBX_END: &[u8] = b"!\x04\x00\x00c\xAD";

/// Returns the sentences in a stream.
fn received(stream: &[u8]) -> Vec<String> {
    let mut all = Vec::new();
    let text = |sentence: &[u8]| String::from_utf8(sentence.to_vec()).expect("a sentence is text");
    receive::<_, 515>(Nmea, stream, |sentence| all.push(text(sentence)));
    let mut with_others = Vec::new();
    receive::<_, 1100>(Gnss::<1100>, stream, |message| match message {
        Message::Nmea(sentence) => with_others.push(text(sentence)),
        other => panic!("{other:?}"),
    });
    assert_eq!(all, with_others);
    all
}

fn sentence(frame: &str) -> String {
    frame[1..frame.len() - 3].to_owned()
}

#[test]
fn sentences_are_received_with_each_line_end() {
    let frames = [PMTKCHN, PUBX_03, GNRMC];
    for ends in [
        ["\n"; 3],
        ["\r\n"; 3],
        ["\r\r\n"; 3],
        ["\n", "\r\r\n", "\r\n"],
    ] {
        let lines = frames.iter().zip(ends);
        let lines: String = lines.flat_map(|(frame, end)| [*frame, end]).collect();
        assert_eq!(received(lines.as_bytes()), frames.map(sentence), "{ends:?}");
    }
}

#[test]
fn no_sentence_swallows_another_one() {
    let expected = [sentence(GNRMC)];
    for before in [
        UBX_END,
        b"!",
        b"$GPGGA,030130",
        b"$GPTXT\r",
        b"$GPTXT*2",
        b"$\r\r",
    ] {
        for end in ["\n", "\r\n", "\r\r\n"] {
            let stream = [before, GNRMC.as_bytes(), end.as_bytes()].concat();
            assert_eq!(received(&stream), expected, "{}", stream.escape_ascii());
        }
    }
}

#[test]
fn other_line_ends_and_bytes_are_rejected() {
    for stream in [
        "$GPTXT,01,01,02,ok*49\r",
        "$GPTXT,01,01,02,ok*49\r\r\r\n",
        "$GPTXT,01\t,01,02,ok*40\n",
        "$GPTXT,01\x7F,01,02,ok*36\n",
    ] {
        assert_eq!(received(stream.as_bytes()), [""; 0], "{stream:?}");
    }
}

#[test]
fn the_longest_sentence_has_512_bytes() {
    for (length, count) in [(512, 1), (513, 0)] {
        let text = "A".repeat(length - 4);
        let check = text.bytes().fold(0, |xor, byte| xor ^ byte);
        let stream = format!("${text}*{check:02X}\r\r\n");
        assert_eq!(received(stream.as_bytes()).len(), count);
    }
}

#[test]
fn the_shortest_sentence_has_a_character() {
    for (frame, count) in [("$A*41", 1), ("$*00", 0)] {
        for end in ["\n", "\r\n", "\r\r\n"] {
            assert_eq!(received(format!("{frame}{end}").as_bytes()).len(), count);
        }
    }
}

#[test]
fn the_checksum_may_have_lower_case_letters() {
    for (frame, count) in [("$J*4A", 1), ("$J*4a", 1), ("$J*4b", 0), ("$J*4j", 0)] {
        assert_eq!(
            received(format!("{frame}\n").as_bytes()).len(),
            count,
            "{frame}"
        );
    }
}

#[test]
fn sentences_are_written_with_cr_lf() {
    let text = sentence(GNRMC);
    assert_eq!(
        frame(&Nmea, text.as_bytes()),
        format!("{GNRMC}\r\n").into_bytes()
    );
    for wrong in ["a$b", "a!b", "a\nb", "a\r", "é"] {
        let mut buffer = [0; 515];
        assert!(
            Nmea.encode_into(wrong.as_bytes(), &mut buffer).is_err(),
            "{wrong:?}"
        );
    }
}
