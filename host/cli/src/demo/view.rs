//! Draws the live view of the demonstration. Drawing changes nothing.

use std::time::Duration;

use framelock_simulation::Fate;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Margin};
use ratatui::style::Stylize;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::bytes;
use super::demonstration::{Demonstration, Report};
use super::script::SECONDS;
use super::story::story;
use crate::view_parts::{BLUE, VERMILLION, bar, phase_style};

/// The size of the smallest terminal on which the view fits.
const LEAST_WIDTH: u16 = 80;
const LEAST_HEIGHT: u16 = 23;

/// Draws the current state of the demonstration. Returns whether the terminal is large enough.
pub(super) fn draw(frame: &mut Frame, demonstration: &Demonstration, is_paused: bool) -> bool {
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
    let area = area.inner(Margin::new(1, 0));
    let heights = [2, 5, 1, 4, 1, 4, 6];
    let [title, story_area, _, lecture, _, framelock, bytes] =
        Layout::vertical(heights.map(Constraint::Length)).areas(area);

    let space = if is_paused { "resumes" } else { "pauses" };
    let keys = format!("q quits, space {space}").dim();
    let name = " framelock demo ".bold().reversed();
    frame.render_widget(ends(vec![name], vec![keys], area.width), title);

    let story = story(demonstration);
    let now = demonstration.now.as_secs_f64();
    let time = format!("{now:.1} of {SECONDS} s").dim();
    let lines = vec![
        ends(vec![story.heading.bold()], vec![time], area.width),
        story.text.replace('\n', " ").into(),
    ];
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }), story_area);

    let (line, reports) = demonstration.report();
    let broken = line.frames_sent - line.frames_intact;
    let names = ["the lecture's machine", "framelock"];
    let receivers = reports.iter().zip(&demonstration.lanes).zip(names);
    for (((report, lane), name), area) in receivers.zip([lecture, framelock]) {
        let lines = vec![
            status(name, report, area.width),
            lane.last(area.width.into())
                .map(|fate| fate.map_or(" ".into(), mark))
                .collect(),
            counts(report, broken),
            seat(report, demonstration, area.width),
        ];
        frame.render_widget(Paragraph::new(lines), area);
    }
    let caption = "Bytes from the last fault on, and what each receiver waits for next";
    let mut lines = vec![Line::default(), caption.dim().into()];
    lines.extend(bytes::rows(demonstration.bytes.close_up.iter()));
    frame.render_widget(Paragraph::new(lines), bytes);
    true
}

/// Returns a row with some text at its left end and some text at its right end.
fn ends(mut left: Vec<Span<'static>>, right: Vec<Span<'static>>, width: u16) -> Line<'static> {
    let used: usize = left.iter().chain(&right).map(Span::width).sum();
    left.push(" ".repeat(usize::from(width).saturating_sub(used)).into());
    left.extend(right);
    left.into()
}

fn status(name: &'static str, report: &Report, width: u16) -> Line<'static> {
    let status = match report.deaf {
        Some(time) if time < Duration::from_millis(100) => " DEAF ".fg(VERMILLION),
        Some(time) => format!(" DEAF for {:.1} s ", time.as_secs_f64()).fg(VERMILLION),
        None => " LISTENING ".fg(BLUE),
    };
    let name = format!("{name:<23}").bold();
    let phase = report.output.phase;
    let phase_name = phase.to_string().to_uppercase();
    let failsafe = vec![
        "failsafe ".into(),
        Span::styled(phase_name, phase_style(phase)),
    ];
    let left = vec![name, status.bold().reversed()];
    ends(left, failsafe, width)
}

/// Returns the mark for the fate of a frame.
fn mark(fate: Fate) -> Span<'static> {
    match fate {
        Fate::Delivered => "●".fg(BLUE),
        Fate::Missed => "○".fg(VERMILLION).bold(),
        Fate::Broken => "×".bold(),
        Fate::Wrong => "!".fg(VERMILLION).bold(),
    }
}

/// Returns a row with the number of frames for each mark. The row is also the legend of the marks.
fn counts(report: &Report, broken: u64) -> Line<'static> {
    let mut line = Line::default();
    for (fate, count, meaning) in [
        (Fate::Delivered, report.tally.delivered, "delivered"),
        (
            Fate::Missed,
            report.tally.lost_intact,
            "missed though whole",
        ),
        (Fate::Broken, broken, "broken by the line"),
        (Fate::Wrong, report.wrong, "wrong"),
    ] {
        line.push_span(mark(fate));
        line.push_span(format!(" {count} {meaning}  "));
    }
    line
}

/// Returns a row with the failsafe's output and the setpoint of each axis.
fn seat(report: &Report, demonstration: &Demonstration, width: u16) -> Line<'static> {
    let setpoint = demonstration.last_sent.map(<[u8; 3]>::from);
    let mut line = Line::from("seat, ┃ as sent  ");
    let bar_width = (width - 17).div_ceil(3).saturating_sub(7);
    let names = ["pitch", "roll", "yaw"];
    for (axis, (name, output)) in names.into_iter().zip(report.output.axes).enumerate() {
        let sent = setpoint.map(|axes| axes[axis]);
        line.push_span(format!("{name:>5} ").dim());
        line.extend(bar(output, sent, bar_width));
        line.push_span(" ");
    }
    line
}

#[cfg(test)]
mod tests;
