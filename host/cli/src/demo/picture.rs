//! The picture of the demonstration: the same lines for the live view and for plain text.

use std::io::{self, Write};
use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Margin;
use ratatui::style::{Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::story::{ByteOnLine, END, Fate, Outcome, Station, Story};
use crate::view_parts::{BLUE, STATES, VERMILLION, bar, phase_style};

/// The width of the picture.
const WIDTH: usize = 78;

/// The size of the smallest terminal on which the picture fits, with a title above it and a margin.
const LEAST_WIDTH: u16 = 80;
const LEAST_HEIGHT: u16 = 23;

/// Draws the picture. Returns whether the terminal is large enough.
pub(super) fn draw(frame: &mut Frame, story: &Story, is_paused: bool) -> bool {
    let area = frame.area();
    if area.width < LEAST_WIDTH || area.height < LEAST_HEIGHT {
        let text = format!(
            "The demo needs {LEAST_WIDTH} columns and {LEAST_HEIGHT} rows; this terminal has {} and {}. \
             Enlarge the terminal, or press q and run: framelock demo | cat",
            area.width, area.height
        );
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), area);
        return false;
    }
    let space = if is_paused { "resumes" } else { "pauses" };
    let keys = format!("q quits, space {space}").dim();
    let title = " framelock demo ".bold().reversed();
    let mut rows = vec![ends(vec![title], keys), Line::default()];
    rows.extend(lines(story));
    frame.render_widget(Paragraph::new(rows), area.inner(Margin::new(1, 0)));
    true
}

/// Writes the picture as plain text.
pub(super) fn write(story: &Story, out: &mut impl Write) -> io::Result<()> {
    for line in lines(story) {
        writeln!(out, "{}", line.to_string().trim_end())?;
    }
    writeln!(out)
}

/// Writes the numbers of frames that the receivers missed.
pub(super) fn write_conclusion(story: &Story, out: &mut impl Write) -> io::Result<()> {
    if story.time < END {
        writeln!(out, "ended early, after {}\n", seconds(story.time))?;
    }
    for station in &story.stations {
        writeln!(
            out,
            "{:<21} missed {} whole frames, and was deaf for at most {}",
            station.name,
            station.count(Fate::Missed),
            seconds(station.longest_deafness(story.time))
        )?;
    }
    Ok(())
}

fn seconds(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}

/// Returns the picture's rows.
fn lines(story: &Story) -> Vec<Line<'static>> {
    let part = story.part();
    let time = format!("{:.1} of {} s", story.time.as_secs_f64(), END.as_secs()).dim();
    let mut text = part.text.lines();
    let mut rows = vec![ends(vec![part.heading.bold()], time)];
    rows.extend((0..4).map(|_| Line::from(text.next().unwrap_or(""))));
    for station in &story.stations {
        let fates = &station.fates[station.fates.len().saturating_sub(WIDTH)..];
        rows.extend([
            Line::default(),
            status(station, story.time),
            fates
                .iter()
                .map(|fate| fate.map_or(" ".into(), mark))
                .collect(),
            counts(station),
            seat(station, story),
        ]);
    }
    let caption = "Bytes from the last fault on, and what each receiver waits for next";
    rows.extend([Line::default(), caption.dim().into()]);
    rows.extend(close_up(&story.close_up));
    rows
}

/// Returns a row with some text at its left end and some text at its right end.
fn ends(mut left: Vec<Span<'static>>, right: Span<'static>) -> Line<'static> {
    let used: usize = left.iter().map(Span::width).sum();
    left.push(
        " ".repeat(WIDTH.saturating_sub(used + right.width()))
            .into(),
    );
    left.push(right);
    left.into()
}

fn status(station: &Station, now: Duration) -> Line<'static> {
    let status = match station.deaf_for(now) {
        // A time that would be rounded to zero is not shown.
        Some(time) if time < Duration::from_millis(100) => " DEAF ".fg(VERMILLION),
        Some(time) => format!(" DEAF for {} ", seconds(time)).fg(VERMILLION),
        None => " LISTENING ".fg(BLUE),
    };
    let phase = station.output.phase;
    let failsafe = format!("failsafe {}", phase.to_string().to_uppercase());
    ends(
        vec![
            format!("{:<23}", station.name).bold(),
            status.bold().reversed(),
        ],
        Span::styled(failsafe, phase_style(phase)),
    )
}

/// Returns the mark for the outcome of a frame.
fn mark(fate: Fate) -> Span<'static> {
    match fate {
        Fate::Delivered => "●".fg(BLUE),
        Fate::Missed => "○".fg(VERMILLION).bold(),
        Fate::Broken => "×".bold(),
        Fate::Wrong => "!".fg(VERMILLION).bold(),
    }
}

/// Returns a row with the number of frames for each mark. The row is also the legend of the marks.
fn counts(station: &Station) -> Line<'static> {
    let meanings = [
        (Fate::Delivered, "delivered"),
        (Fate::Missed, "missed though whole"),
        (Fate::Broken, "broken by the line"),
        (Fate::Wrong, "wrong"),
    ];
    let spans = meanings.into_iter().flat_map(|(fate, meaning)| {
        let count = station.count(fate);
        [mark(fate), format!(" {count} {meaning}  ").into()]
    });
    spans.collect()
}

/// Returns a row with the failsafe's output and the setpoint of each axis.
fn seat(station: &Station, story: &Story) -> Line<'static> {
    let setpoint = story.setpoint.map(<[u8; 3]>::from);
    let mut line = Line::from("seat, ┃ as sent  ");
    let axes = ["pitch", "roll", "yaw"]
        .into_iter()
        .zip(station.output.axes);
    for (axis, (name, output)) in axes.enumerate() {
        line.push_span(format!("{name:>5} ").dim());
        line.push_span(bar(output, setpoint.map(|axes| axes[axis]), 13));
        line.push_span(" ");
    }
    line
}

/// Returns four rows with a column for each byte: the byte sent, the byte that arrived, and the state of each receiver
/// afterwards.
fn close_up(frames: &[[ByteOnLine; 7]]) -> [Line<'static>; 4] {
    let mut rows = ["sent", "arrived", "lecture", "framelock"]
        .map(|name| Line::from(format!("{name:<10}").dim()));
    for frame in frames {
        for (place, byte) in frame.iter().enumerate() {
            let separator = if place == 6 { "│" } else { " " };
            for (row, cell) in rows.iter_mut().zip(column(byte)) {
                row.push_span(cell);
                row.push_span(separator.dim());
            }
        }
    }
    rows
}

fn column(byte: &ByteOnLine) -> [Span<'static>; 4] {
    let fault = Style::new().fg(VERMILLION).bold();
    let sent = format!("{:02X}", byte.sent);
    let [sent, arrived] = match byte.received {
        None => [sent, "--".into()].map(|text| Span::styled(text, fault)),
        Some(same) if same == byte.sent => [Span::from(sent.clone()), sent.into()],
        Some(changed) => [
            sent.into(),
            Span::styled(format!("{changed:02X}"), fault.reversed()),
        ],
    };
    let outcome = |station| match byte.outcomes.get(station) {
        None => "  ".into(),
        Some(Outcome::Pending(bytes)) => format!("{:<2}", STATES[*bytes]).dim(),
        Some(Outcome::Delivered) => "ok".fg(BLUE).bold(),
        Some(Outcome::Wrong) => "!!".fg(VERMILLION).bold(),
    };
    [sent, arrived, outcome(0), outcome(1)]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;
    use crate::demo::story::tests::story_at;
    use crate::view_parts::tests::screen;

    /// At 7 s the lecture's machine has missed 49 frames, and its failsafe has parked the seat.
    const DEAF: [&str; 23] = [
        "  framelock demo                                          q quits, space pauses",
        "",
        " ONE LOST BYTE                                                      7.0 of 20 s",
        " One byte was lost, and one frame with it. Since then the lecture's machine",
        " takes the AB inside each frame for its start, finds no CR at the end, and",
        " starts over. The line is fine again, but this receiver is deaf: its failsafe",
        " parks the seat. framelock looks at the bytes again, and hears the next frame.",
        "",
        " the lecture's machine   DEAF for 4.9 s                         failsafe PARKED",
        " ●●●●●●●●●●●●●●●●●●●●×○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○○",
        " ● 20 delivered  ○ 49 missed though whole  × 1 broken by the line  ! 0 wrong",
        " seat, ┃ as sent  pitch ███┃███        roll ███┃███         yaw ┃██████",
        "",
        " framelock               LISTENING                                failsafe LIVE",
        " ●●●●●●●●●●●●●●●●●●●●×●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●●",
        " ● 69 delivered  ○ 0 missed though whole  × 1 broken by the line  ! 0 wrong",
        " seat, ┃ as sent  pitch ███┃           roll ███┃            yaw ┃",
        "",
        " Bytes from the last fault on, and what each receiver waits for next",
        " sent      41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│",
        " arrived   -- 42 00 41 42 00 0D│41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│",
        " lecture      A  A  B  1  2  3 │4  CR A  B  1  2  3 │4  CR A  B  1  2  3 │",
        " framelock    A  A  B  1  2  3 │4  CR 2  3  4  CR ok│B  1  2  3  4  CR ok│",
    ];

    #[test]
    fn the_live_view_and_the_plain_text_are_the_same_picture() {
        let story = story_at(7_000);
        let rows = screen(80, 23, |frame| assert!(draw(frame, &story, false)));
        let rows: Vec<&str> = rows.iter().map(|row| row.trim_end()).collect();
        assert_eq!(rows, DEAF);
        let mut plain = Vec::new();
        write(&story, &mut plain).unwrap();
        let picture = DEAF[2..].iter().map(|row| row.trim_start());
        let picture: Vec<&str> = picture.chain([""]).collect();
        let plain = String::from_utf8(plain).unwrap();
        assert_eq!(plain.lines().collect::<Vec<_>>(), picture);
    }

    #[test]
    fn every_moment_fits_the_least_terminal() {
        for milliseconds in (0..=20_000).step_by(250) {
            let rows = lines(&story_at(milliseconds));
            assert_eq!(rows.len(), 21);
            assert!(rows.iter().all(|row| row.width() <= WIDTH), "{rows:?}");
        }
    }

    #[test]
    fn on_a_terminal_that_is_too_small_it_says_what_it_needs() {
        let story = story_at(3_000);
        for (width, height) in [(1, 1), (50, 12), (79, 23), (80, 22)] {
            let rows = screen(width, height, |frame| assert!(!draw(frame, &story, false)));
            let text = rows.join("");
            assert_eq!(text.contains("framelock demo | cat"), width >= 50, "{text}");
        }
    }
}
