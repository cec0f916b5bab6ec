//! The picture of the demonstration: the same lines for the live view and for plain text.

use std::io::{self, Write};
use std::time::Duration;

use framelock::motion::Phase;

use super::story::{ByteOnLine, END, Fate, Outcome, Station, Story};

/// The width of the picture.
const WIDTH: usize = 78;

/// The lecture's names of the states. BIN's receivers are in state `i` while they wait for byte `i` of a frame.
const STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];

/// Styles: parameters of the escape sequence SGR. Good states are blue, and bad states are vermillion, as in Okabe and
/// Ito's palette. Colour-blind people can distinguish these two colours.
const PLAIN: &str = "";
const BOLD: &str = "1";
const DIM: &str = "2";
const GOOD: &str = "1;38;5;32";
const BAD: &str = "1;38;5;166";
const GOOD_REVERSED: &str = "1;7;38;5;32";
const BAD_REVERSED: &str = "1;7;38;5;166";
const BAR: &str = "36;48;5;236";

/// A part of a line, with its style.
type Span = (String, &'static str);

/// Returns the picture below a title, as lines with escape sequences.
pub(super) fn painted(story: &Story) -> Vec<String> {
    let title = ends(
        vec![(" framelock demo ".into(), "1;7")],
        ("Ctrl-C ends".into(), DIM),
    );
    let paint = |(text, style): Span| format!("\x1B[0;{style}m{text}\x1B[0m");
    let rows = [title, Vec::new()].into_iter().chain(lines(story));
    let row = |row: Vec<Span>| " ".to_owned() + &row.into_iter().map(paint).collect::<String>();
    rows.map(row).collect()
}

/// Writes the picture as plain text.
pub(super) fn write(story: &Story, out: &mut impl Write) -> io::Result<()> {
    for line in lines(story) {
        let text: String = line.into_iter().map(|(text, _)| text).collect();
        writeln!(out, "{}", text.trim_end())?;
    }
    writeln!(out)
}

/// Writes how many whole frames each receiver missed, and the longest time for which it was deaf.
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
fn lines(story: &Story) -> Vec<Vec<Span>> {
    let part = story.part();
    let time = format!("{:.1} of {} s", story.time.as_secs_f64(), END.as_secs());
    let mut text = part.text.lines();
    let mut rows = vec![ends(vec![(part.heading.into(), BOLD)], (time, DIM))];
    rows.extend((0..4).map(|_| vec![(text.next().unwrap_or("").into(), PLAIN)]));
    for station in &story.stations {
        let fates = &station.fates[station.fates.len().saturating_sub(WIDTH)..];
        let blank = || (" ".into(), PLAIN);
        let marks = fates.iter().map(|fate| fate.map_or_else(blank, mark));
        rows.extend([
            Vec::new(),
            status(station, story.time),
            marks.collect(),
            counts(station),
            seat(station, story),
        ]);
    }
    let caption = "Bytes from the last fault on, and what each receiver waits for next";
    rows.extend([Vec::new(), vec![(caption.into(), DIM)]]);
    rows.extend(close_up(&story.close_up));
    rows
}

/// Returns a row with some text at its left end and some text at its right end.
fn ends(mut left: Vec<Span>, right: Span) -> Vec<Span> {
    let lengths = left.iter().chain([&right]);
    let used: usize = lengths.map(|(text, _)| text.chars().count()).sum();
    left.extend([(" ".repeat(WIDTH.saturating_sub(used)), PLAIN), right]);
    left
}

fn status(station: &Station, now: Duration) -> Vec<Span> {
    let status = match station.deaf_for(now) {
        // A time of less than 0.1 s is not shown.
        Some(time) if time < Duration::from_millis(100) => (" DEAF ".into(), BAD_REVERSED),
        Some(time) => (format!(" DEAF for {} ", seconds(time)), BAD_REVERSED),
        None => (" LISTENING ".into(), GOOD_REVERSED),
    };
    let phase = station.output.phase;
    let style = match phase {
        Phase::Live | Phase::Approach => GOOD,
        _ => BAD,
    };
    let failsafe = format!("failsafe {}", phase.to_string().to_uppercase());
    ends(
        vec![(format!("{:<23}", station.name), BOLD), status],
        (failsafe, style),
    )
}

/// Returns the mark for the outcome of a frame.
fn mark(fate: Fate) -> Span {
    let (mark, style) = match fate {
        Fate::Delivered => ("●", GOOD),
        Fate::Missed => ("○", BAD),
        Fate::Broken => ("×", BOLD),
        Fate::Wrong => ("!", BAD),
    };
    (mark.into(), style)
}

/// Returns a row with the number of frames for each mark. The row is also the legend of the marks.
fn counts(station: &Station) -> Vec<Span> {
    let meanings = [
        (Fate::Delivered, "delivered"),
        (Fate::Missed, "missed though whole"),
        (Fate::Broken, "broken by the line"),
        (Fate::Wrong, "wrong"),
    ];
    let spans = meanings.into_iter().flat_map(|(fate, meaning)| {
        let count = format!(" {} {meaning}  ", station.count(fate));
        [mark(fate), (count, PLAIN)]
    });
    spans.collect()
}

/// Returns a row with the failsafe's output and the setpoint of each axis.
fn seat(station: &Station, story: &Story) -> Vec<Span> {
    let setpoint = story.setpoint.map(<[u8; 3]>::from);
    let mut line = vec![("seat, ┃ as sent  ".into(), PLAIN)];
    for (axis, name) in ["pitch", "roll", "yaw"].into_iter().enumerate() {
        let mark = setpoint.map(|axes| axes[axis]);
        line.push((format!("{name:>5} "), DIM));
        line.push((bar(station.output.axes[axis], mark, 13), BAR));
        line.push((" ".into(), PLAIN));
    }
    line
}

/// Returns a bar of `width` cells that is filled up to `value`, with a mark at another value.
fn bar(value: u8, mark: Option<u8>, width: usize) -> String {
    let cells = |value: u8, most: usize| (usize::from(value) * most + 127) / 255;
    let filled = cells(value, width);
    let mark = mark.map(|mark| cells(mark, width - 1));
    let cell = |cell| match cell {
        _ if mark == Some(cell) => '┃',
        _ if cell < filled => '█',
        _ => ' ',
    };
    (0..width).map(cell).collect()
}

/// Returns four rows with a column for each byte: the byte sent, the byte that arrived, and the state of each receiver
/// afterwards.
fn close_up(frames: &[[ByteOnLine; 7]]) -> [Vec<Span>; 4] {
    let mut rows =
        ["sent", "arrived", "lecture", "framelock"].map(|name| vec![(format!("{name:<10}"), DIM)]);
    for frame in frames {
        for (place, byte) in frame.iter().enumerate() {
            let separator = if place == 6 { "│" } else { " " };
            for (row, cell) in rows.iter_mut().zip(column(byte)) {
                row.extend([cell, (separator.into(), DIM)]);
            }
        }
    }
    rows
}

fn column(byte: &ByteOnLine) -> [Span; 4] {
    let hex = |byte: u8| format!("{byte:02X}");
    let [sent, arrived] = match byte.received {
        None => [(hex(byte.sent), BAD), ("--".into(), BAD)],
        Some(same) if same == byte.sent => [(hex(same), PLAIN), (hex(same), PLAIN)],
        Some(changed) => [(hex(byte.sent), PLAIN), (hex(changed), BAD_REVERSED)],
    };
    let outcome = |station| match byte.outcomes.get(station) {
        None => ("  ".into(), PLAIN),
        Some(Outcome::Pending(bytes)) => (format!("{:<2}", STATES[*bytes]), DIM),
        Some(Outcome::Delivered) => ("ok".into(), GOOD),
        Some(Outcome::Wrong) => ("!!".into(), BAD),
    };
    [sent, arrived, outcome(0), outcome(1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::story::tests::story_at;

    #[test]
    fn every_moment_fits_the_least_terminal() {
        for milliseconds in (0..=20_000).step_by(250) {
            let rows = lines(&story_at(milliseconds));
            assert_eq!(rows.len(), 21);
            let width = |row: &Vec<Span>| {
                row.iter()
                    .map(|(text, _)| text.chars().count())
                    .sum::<usize>()
            };
            assert!(rows.iter().all(|row| width(row) <= WIDTH), "{rows:?}");
            let painted = painted(&story_at(milliseconds));
            assert!(painted.len() == 23 && painted.iter().all(|row| !row.contains('\n')));
        }
    }
}
