//! Makes the view of a watched line: lines of text, for a terminal of 80 columns and 24 rows.

use framelock::motion::Output;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::watch::{Connection, DISCARDED_LENGTH, Lock, Watch};
use crate::view_parts::{BLUE, STATES, VERMILLION, bar, phase_style};

const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// Draws the lines, and the keys below them.
pub(super) fn draw(frame: &mut Frame, lines: Vec<Line>, is_paused: bool) {
    let rows = [Constraint::Fill(1), Constraint::Length(1)];
    let [view, keys] = Layout::vertical(rows).areas(frame.area());
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: false }), view);
    let text = if is_paused {
        Line::from(vec![
            " PAUSED ".yellow().reversed(),
            " q quits, space resumes".dim(),
        ])
    } else {
        " q quits, space pauses".dim().into()
    };
    frame.render_widget(text, keys);
}

/// Returns the lines of the view.
pub(super) fn lines(watch: &Watch) -> Vec<Line<'static>> {
    let mut lines = state(watch).to_vec();
    lines.extend(counters(watch));
    lines.push(Line::default());
    lines.extend(discarded(watch));
    lines.push(Line::default());
    if watch.frame.protocol.has_setpoints() {
        lines.extend(axes(watch));
    } else {
        lines.extend(fields(watch));
    }
    lines
}

fn state(watch: &Watch) -> [Line<'static>; 3] {
    let lock = match watch.lock() {
        Lock::Gone => " GONE     ".fg(VERMILLION),
        Lock::Silent => " SILENT   ".fg(VERMILLION),
        Lock::Searching => " SEARCHING".yellow(),
        Lock::Locked => " LOCKED   ".fg(BLUE),
    };
    let age = match watch.framed_at {
        Some(at) => {
            let age = watch.now.saturating_sub(at).as_secs_f64();
            format!("last frame {age:.1} s ago")
        }
        None => "no frame yet".to_owned(),
    };
    let [frames, bytes] = watch.rates;
    let numbers = format!("{frames:>7.1} frames/s {bytes:>8.0} bytes/s   {age}");
    let mut title = vec![" framelock monitor ".bold().reversed()];
    if watch.port == Connection::Ended {
        title.push(" THE INPUT HAS ENDED ".fg(VERMILLION).reversed());
    }
    title.push(format!(" {}", watch.title).into());
    [
        title.into(),
        Line::from(vec![lock.bold(), numbers.into()]),
        Line::default(),
    ]
}

/// Returns lines with the counters, and the last note. Lines with faults are emphasised.
fn counters(watch: &Watch) -> Vec<Line<'static>> {
    let counters = watch.line.counters();
    let (discarded, events) = (&counters.discarded, &counters.events);
    let emphasised = |text: String, count: u32| {
        let color = if count > 0 {
            Color::Yellow
        } else {
            Color::Reset
        };
        Line::from(text).fg(color)
    };
    let mut lines = vec![
        format!(
            "bytes {}   frames {}   pending {}   resynchronised {}",
            counters.bytes,
            counters.frames,
            watch.line.pending().len(),
            counters.resynchronisations
        )
        .into(),
    ];
    let total = discarded.total();
    let first = format!(
        "discarded {total}   no sync {}   broken sync {}   line {}",
        discarded.no_sync, discarded.broken_sync, discarded.line_event
    );
    let second = format!(
        "  bad header {}   too long {}   unknown {}   terminator {}   checksum {}",
        discarded.bad_header,
        discarded.too_long,
        discarded.unknown_message,
        discarded.wrong_terminator,
        discarded.checksum_mismatch
    );
    lines.extend([first, second].map(|text| emphasised(text, total)));
    let (framing, parity, line_break) = (events.framing, events.parity, events.line_break);
    lines.push(match watch.marks {
        Some(_) => emphasised(
            format!("line errors: framing {framing}   parity {parity}   break {line_break}"),
            framing + parity + line_break,
        ),
        None => "line errors: this input reports none".dim().into(),
    });
    let note = watch.notes.last();
    lines.extend(note.map(|note| note.clone().yellow().into()));
    lines
}

/// Returns two rows of discarded bytes, the newest at the end.
fn discarded(watch: &Watch) -> Vec<Line<'static>> {
    let texts: Vec<String> = watch
        .discarded
        .iter()
        .map(|(byte, follows)| format!("{}{byte:02X}", if *follows { ' ' } else { '|' }))
        .collect();
    let mut lines = vec![
        "last discarded bytes; | marks a frame in between"
            .dim()
            .into(),
    ];
    let mut rows = texts.chunks(DISCARDED_LENGTH / 2);
    lines.extend((0..2).map(|_| Line::from(rows.next().unwrap_or(&[]).concat())));
    lines
}

/// Returns lines with the setpoint, the receiver's state, and the failsafe's output and phase.
fn axes(watch: &Watch) -> Vec<Line<'static>> {
    let Output { axes, phase } = watch.output;
    let demands = watch.setpoint.map(<[u8; 3]>::from);
    let mut lines = Vec::new();
    for (axis, (name, output)) in AXES.into_iter().zip(axes).enumerate() {
        let demand = demands.map(|axes| axes[axis]);
        let sent = demand.map_or("--".to_owned(), |demand| demand.to_string());
        let numbers = format!("{name:<6} {sent:>3} out {output:>3} ");
        let bar = bar(demand.unwrap_or(0), Some(output), 60);
        lines.push(vec![numbers.into(), bar].into());
    }
    let mut states = STATES.to_vec();
    if watch.frame.protocol.longest() > states.len() {
        states.insert(6, "crc");
    }
    let mut line = Line::from("state   ");
    for (place, name) in states.iter().enumerate() {
        line.push_span(if place == watch.line.pending().len() {
            format!("[{name}]").cyan().bold()
        } else {
            format!(" {name} ").dim()
        });
    }
    lines.push(line);
    let name = Span::styled(phase.to_string().to_uppercase(), phase_style(phase));
    let reason = watch.standstill.reason(phase);
    let reason = reason.map_or(String::new(), |why| format!(": {why}"));
    lines.push(vec!["failsafe ".into(), name, reason.into()].into());
    lines
}

/// Returns lines with the last frame's length and fields, in three columns.
fn fields(watch: &Watch) -> Vec<Line<'static>> {
    const COLUMN: usize = 26;
    let length = format!("length {}", watch.last.len());
    let mut rows = vec![String::new()];
    for field in [&[length][..], &watch.frame.lines(&watch.last)].concat() {
        let columns = field.chars().count() / COLUMN + 1;
        let field = format!("{field:<width$}", width = columns * COLUMN);
        match rows.last_mut() {
            Some(row) if row.chars().count() + columns * COLUMN <= 3 * COLUMN => *row += &field,
            _ => rows.push(field),
        }
    }
    rows.into_iter().map(Line::from).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::super::watch::tests::{FRAME, ms, watch};
    use super::*;
    use crate::line_errors::Marks;
    use crate::view_parts::tests::screen;

    /// Receives three seconds of a motion at 50 frames per second, then three bytes of noise and the first
    /// four bytes of a frame.
    fn watched() -> Watch {
        let mut watch = watch("bin");
        watch.marks = Some(Marks::new(false));
        for frame in 0..150_u8 {
            let bytes = [b'A', b'B', 0, frame, 0x40, 0xC0, b'\r'];
            watch.receive(ms(10 + 20 * u64::from(frame)), &bytes);
        }
        watch.receive(ms(3_000), b"A\x7F?AB\0\x01");
        watch.advance_to(ms(3_010));
        watch
    }

    /// Checks that the lines contain these texts, in this order.
    fn assert_lines(watch: &Watch, texts: &[&str]) {
        let lines: Vec<String> = lines(watch).iter().map(Line::to_string).collect();
        let text = lines.join("\n");
        let mut rest = &*text;
        for expected in texts {
            let (_, after) = rest
                .split_once(expected)
                .unwrap_or_else(|| panic!("{expected:?}: {text}"));
            rest = after;
        }
    }

    #[test]
    fn the_screen_shows_the_watched_line() {
        let expected = [
            " framelock monitor  /dev/ttyACM0, 115200 baud, bin, framelock",
            " SEARCHING   50.0 frames/s      357 bytes/s   last frame 0.0 s ago",
            "",
            "bytes 1057   frames 150   pending 4   resynchronised 0",
            "discarded 3   no sync 2   broken sync 1   line 0",
            "  bad header 0   too long 0   unknown 0   terminator 0   checksum 0",
            "line errors: framing 0   parity 0   break 0",
            "",
            "last discarded bytes; | marks a frame in between",
            "|41 7F 3F",
            "",
            "",
            "pitch  149 out 149 ██████████████████████████████████┃",
            "roll    64 out  64 ███████████████┃",
            "yaw    192 out 192 ████████████████████████████████████████████┃",
            "state    A  B  1  2 [3] 4  CR",
            "failsafe LIVE",
            "",
            "",
            "",
            "",
            "",
            "",
        ];
        for (is_paused, keys) in [
            (false, " q quits, space pauses"),
            (true, " PAUSED  q quits, space resumes"),
        ] {
            let rows = screen(80, 24, |frame| draw(frame, lines(&watched()), is_paused));
            let rows: Vec<&str> = rows.iter().map(|row| row.trim_end()).collect();
            assert_eq!(rows, [&expected[..], &[keys]].concat());
        }
        for (width, height) in [(1, 1), (10, 3), (40, 12), (300, 100)] {
            screen(width, height, |frame| draw(frame, lines(&watched()), false));
        }
    }

    /// Makes a frame with sixteen channels of 992.
    const SBUS: [u8; 25] = [
        0x0F, 0xE0, 0x03, 0x1F, 0xF8, 0xC0, 0x07, 0x3E, 0xF0, 0x81, 0x0F, 0x7C, 0xE0, 0x03, 0x1F,
        0xF8, 0xC0, 0x07, 0x3E, 0xF0, 0x81, 0x0F, 0x7C, 0x08, 0x00,
    ];

    #[test]
    fn described_frames_are_shown_with_their_fields() {
        let mut watch = watch("sbus");
        watch.marks = Some(Marks::new(false));
        for frame in 0..200 {
            watch.receive(ms(10 + 14 * frame), &SBUS);
        }
        watch.receive(
            ms(3_000),
            &[b"?", &SBUS[..7], b"\xFF\0?", &SBUS[..3]].concat(),
        );
        assert_lines(
            &watch,
            &[
                "115200 baud, sbus, framelock",
                "SEARCHING",
                "frames 200   pending 3 ",
                "discarded 8 ",
                "framing 1 ",
                "|3F 0F E0 03 1F F8 C0 07\n",
                "length 25",
                "\nchannel 992 992 992 992 992 992 992 992 992 992 992 992 992 992 992 992",
                "failsafe   1",
            ],
        );
    }

    #[test]
    fn faults_and_the_end_of_the_input_are_shown() {
        assert_lines(
            &watch("bin"),
            &[
                "SILENT",
                "no frame yet",
                "reports none",
                "-- out 128",
                "state   [A] B",
                "PARKED: no frames",
            ],
        );
        let mut watch = watched();
        // The bytes that were pending are discarded too.
        watch.receive(ms(3_020), b"\xFF\0\x55\xFF\0\0\xFF\0\0");
        assert_lines(
            &watch,
            &[
                "line 4",
                "framing 1   parity 0   break 2",
                "|41 7F 3F 41 42 00 01\n",
            ],
        );
        watch.lose_port(ms(3_030), "unplugged");
        assert_lines(&watch, &["GONE", "UTC: unplugged"]);
        watch.port = Connection::Ended;
        watch.advance_to(ms(10_000));
        let silence = [
            "THE INPUT HAS ENDED",
            " 0.0 frames/s",
            "last frame 7.0 s ago",
            "149 out 128",
            "PARKED: no frames",
        ];
        assert_lines(&watch, &silence);
    }

    #[test]
    fn the_view_says_why_the_platform_does_not_follow() {
        // A sender of five frames per second.
        let mut watch = watch("bin");
        for frame in 0..20 {
            watch.receive(ms(10 + 200 * frame), FRAME);
        }
        watch.advance_to(ms(4_000));
        let apart = "failsafe PARKED: frames arrive too far apart (fewer than 10 a second)";
        assert_lines(&watch, &["LOCKED       5.0 frames/s", apart]);
        // The sender becomes fast.
        for (frames, failsafe) in [
            (0..30, "APPROACH: moves slowly to the setpoint"),
            (30..100, "LIVE"),
        ] {
            for frame in frames {
                watch.receive(ms(4_010 + 20 * frame), FRAME);
            }
            assert_lines(&watch, &["failsafe ", failsafe]);
        }
    }
}
