//! Counts the bytes that a receiver passes to its format in one call. The test `limits` and the benchmark that writes
//! `docs/rivals.md` use this module.

use std::cell::Cell;
use std::fmt::Write as _;

use framelock::{BufferedReceiver, Classification, Format, LineEvent};
use framelock_formats::crsf::Crsf;
use framelock_formats::gnss::Gnss;
use framelock_formats::ibus::Ibus;
use framelock_formats::layout::KnownMessage;
use framelock_formats::mavlink::{Mavlink1, Mavlink2};
use framelock_formats::modbus::ModbusRtu;
use framelock_formats::nmea::Nmea;
use framelock_formats::rtcm::Rtcm;
use framelock_formats::sbus::Sbus;
use framelock_formats::ubx::Ubx;

/// A format that counts the bytes that a receiver passes to it.
#[derive(Clone, Copy)]
struct Counting<'c, F> {
    format: F,
    count: &'c Cell<usize>,
    /// Whether the format examines bytes in `classify_before`. Of the formats in this file, `Gnss` and `ModbusRtu` do.
    is_asked_before: bool,
}

impl<F: Format> Format for Counting<'_, F> {
    const LONGEST: usize = F::LONGEST;
    type Message<'a> = F::Message<'a>;

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.count.set(self.count.get() + bytes.len());
        self.format.classify_after(bytes, seen)
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        if self.is_asked_before {
            self.count.set(self.count.get() + bytes.len());
        }
        self.format.classify_before(bytes, event)
    }

    fn starts(&self, byte: u8) -> bool {
        self.format.starts(byte)
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> F::Message<'a> {
        self.format.decode(frame)
    }
}

/// The calls for which the table has a column.
const CALLS: [&str; 5] = ["push", "poll_step", "line_event_step", "poll", "line_event"];

/// For each of the [`CALLS`], the greatest number of bytes that the call passes to the format.
type Examined = [usize; 5];

/// Returns the bounds that hold for every stream. `longest` is the number of bytes in the longest frame.
fn bounds(longest: usize, is_asked_before: bool) -> Examined {
    let (pending, before) = (longest - 1, if is_asked_before { 2 } else { 1 });
    let all = longest * pending / 2;
    [longest, pending, before * pending, all, before * all]
}

/// The name of a format, the number of bytes in its longest frame, and the most bytes that a receiver examines.
type Row = (&'static str, usize, Examined);

/// Asserts that no call examines more bytes than its bound.
///
/// Pushes a false start that claims the longest frame, and then repeats `start`. Except in NMEA, this byte begins
/// another false start. So all bytes are pending until the last byte of the longest frame comes. Counts the bytes that
/// each call examines, before and after this last byte.
fn row<F: Format, const N: usize>(
    name: &'static str,
    format: F,
    head: &[u8],
    start: u8,
    is_asked_before: bool,
) -> Row {
    let count = &Cell::new(0);
    let mut receiver = BufferedReceiver::<_, [u8; N]>::new(Counting {
        format,
        count,
        is_asked_before,
    });
    let mut most = [0; 5];
    let mut note = |call: usize| most[call] = count.replace(0).max(most[call]);
    let rest = std::iter::repeat_n(&start, F::LONGEST - 1 - head.len());
    for &byte in head.iter().chain(rest) {
        assert!(receiver.push(byte).is_none(), "{name}");
        note(0);
    }
    assert_eq!(receiver.pending(), F::LONGEST - 1, "{name}");
    let all_pending = receiver.clone();

    // The last byte of the frame shows that the first byte is a false start. The other bytes remain undecided.
    assert!(
        receiver
            .push(head.first().copied().unwrap_or(start))
            .is_none(),
        "{name}"
    );
    note(0);
    for mut receiver in [all_pending, receiver.clone()] {
        receiver.clone().line_event(LineEvent::Idle, |_| ());
        note(4);
        while receiver.line_event_step(LineEvent::Idle, |_| ()) {
            note(2);
        }
        note(2);
    }
    let mut polled = receiver.clone();
    while polled.poll_step(|_| ()) {
        note(1);
    }
    note(1);
    assert!(receiver.poll().is_none(), "{name}");
    note(3);
    let bounds = bounds(F::LONGEST, is_asked_before);
    for ((call, most), bound) in CALLS.iter().zip(most).zip(bounds) {
        assert!(
            most <= bound,
            "{name}: {call} examines {most} bytes, not {bound}"
        );
    }
    (name, F::LONGEST, most)
}

const MESSAGES: &[KnownMessage] = &[KnownMessage::with_extra(0, 0, 255)];

/// Returns a row for each format with a `BufferedReceiver`.
fn rows() -> [Row; 10] {
    [
        row::<_, 25>("SBUS", Sbus, &[], 0x0F, false),
        row::<_, 32>("iBUS", Ibus, &[0x20, 0x40], 0x20, false),
        row::<_, 64>("CRSF", Crsf, &[0xC8, 62], 0xC8, false),
        row::<_, 106>("UBX", Ubx::<106>, &[0xB5, 0x62, 1, 7, 98, 0], 0xB5, false),
        row::<_, 263>(
            "MAVLink 1",
            Mavlink1(MESSAGES),
            &[0xFE, 255, 0, 1, 1, 0],
            0xFE,
            false,
        ),
        row::<_, 280>(
            "MAVLink 2",
            Mavlink2(MESSAGES),
            &[0xFD, 255, 1, 0, 0, 1, 1, 0, 0, 0],
            0xFD,
            false,
        ),
        row::<_, 515>("NMEA", Nmea, b"$", b'A', false),
        row::<_, 1029>("RTCM", Rtcm, &[0xD3, 0x03, 0xFF], 0xD3, false),
        row::<_, 1029>(
            "`Gnss<1029>`",
            Gnss::<1029>,
            &[0xD3, 0x03, 0xFF],
            0xD3,
            true,
        ),
        row::<_, 257>("Modbus RTU", ModbusRtu, &[], 0x01, true),
    ]
}

/// Writes the table of `docs/rivals.md`.
pub(crate) fn table() -> String {
    let columns = CALLS.map(|call| format!("`{call}`")).join(" | ");
    let rule = " ---: |".repeat(6);
    let mut text = format!("| | longest frame | {columns} |\n| --- |{rule}\n");
    // After `push`, a receiver of fixed length has nothing left to examine. A line event takes one step, so
    // `line_event_step` and `line_event` have equal bounds.
    let fixed = [("BIN", 7), ("BIN-CRC8", 8), ("six axes", 16)].map(|(name, longest)| {
        let [push, _, _, _, line_event] = bounds(longest, false);
        (name, longest, [push, 0, line_event, 0, line_event])
    });
    for (name, longest, most) in fixed.into_iter().chain(rows()) {
        let columns = most.map(|most| most.to_string()).join(" | ");
        let _ = writeln!(text, "| {name} | {longest} | {columns} |");
    }
    text
}
