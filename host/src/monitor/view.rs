//! The view: one drawing of what the session has to show. It reads, and changes nothing.
//!
//! Laid out for 80 columns and 24 rows; a lower terminal goes without the chart, then without the
//! discarded bytes.

use framelock::{Output, Setpoint};
use ratatui::Frame;
use ratatui::layout::{Constraint, Flex, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Axis, Block, Chart, Clear, Dataset, GraphType, Paragraph};

use super::session::{RecordingState, Shown};
use super::watch::{DiscardedByte, Lock, Report, Sample};
use crate::view_parts::{RowsLeft, bar, emphasised, phase_name, phase_style};

const TITLE_HEIGHT: u16 = 2;
const BOXES_HEIGHT: u16 = 9;
const DISCARDED_HEIGHT: u16 = 4;
const CHART_HEIGHT: u16 = 7;
const KEYS_HEIGHT: u16 = 1;

/// The machine's states, by the lecture's names, with the checksum's where there is one.
const STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];
const STATES_WITH_CHECK: [&str; 8] = ["A", "B", "1", "2", "3", "4", "crc", "CR"];

/// The axes' names and the colors of their curves.
const AXES: [(&str, Color); 3] = [
    ("pitch", Color::Yellow),
    ("roll", Color::Green),
    ("yaw", Color::Magenta),
];

const HELP: &str = " q Esc Ctrl-C  quit
 space         pause the view; the line is counted and recorded all the same
 r             begin a recording in a new file, or end it
 z             set the counters to zero
 ?             this help

 LOCKED     nothing was discarded since the last frame
 SEARCHING  bytes come, but some were discarded since the last frame
 SILENT     no byte for as long as the failsafe waits before it holds
 state      what the machine waits for: [ ] around it
 bar, mark  the setpoint, and what a board's failsafe would put out
 failsafe   hold: stays where it is; ramp: on the way to park;
            approach: on the way back to the demand; live: follows it
 41 42|7F   discarded bytes; between those around a | there was a frame
 discarded  no sync: nothing begins there; broken sync: 'A' without 'B';
            terminator: no CR in its place; check: the checksum failed;
            line: a line error or an idle gap came";

/// Draws it.
pub(super) fn draw(frame: &mut Frame, shown: &Shown) {
    let area = frame.area();
    let mut rows_left = RowsLeft::new(area.height, TITLE_HEIGHT + BOXES_HEIGHT + KEYS_HEIGHT);
    let discarded_height = rows_left.exactly(DISCARDED_HEIGHT);
    let chart_height = rows_left.all_of(CHART_HEIGHT);
    let [title, boxes, chart, discarded, keys] = Layout::vertical([
        Constraint::Length(TITLE_HEIGHT),
        Constraint::Length(BOXES_HEIGHT),
        Constraint::Length(chart_height),
        Constraint::Length(discarded_height),
        Constraint::Length(KEYS_HEIGHT),
    ])
    .areas(area);
    let [left, right] = Layout::horizontal([Constraint::Fill(1); 2]).areas(boxes);

    let report = &shown.report;
    frame.render_widget(title_of(shown), title);
    let block = Block::bordered().title(" setpoint ");
    let lines = axes(report, block.inner(left).width);
    frame.render_widget(Paragraph::new(lines).block(block), left);
    let block = Block::bordered().title(" counters ");
    frame.render_widget(Paragraph::new(counters(shown)).block(block), right);
    draw_chart(frame, report, chart);
    draw_discarded(frame, report, discarded);
    let space = if shown.is_paused { "goes on" } else { "pauses" };
    let record = if matches!(shown.recording, RecordingState::On { .. }) {
        "ends the recording"
    } else {
        "records"
    };
    let line = format!(" q quits, space {space}, r {record}, z counts from zero, ? help");
    frame.render_widget(Line::from(line).dim(), keys);
    if shown.has_help {
        draw_help(frame, area);
    }
}

fn title_of(shown: &Shown) -> Paragraph<'static> {
    let report = &shown.report;
    let mut title = Line::from(vec![
        Span::from(" framelock monitor ").bold().reversed(),
        Span::from(format!(" {} ", shown.title)),
    ]);
    if shown.is_paused {
        title.push_span(Span::from(" PAUSED ").fg(Color::Yellow).reversed());
    }
    if shown.has_ended {
        title.push_span(
            Span::from(" THE INPUT HAS ENDED ")
                .fg(Color::Cyan)
                .reversed(),
        );
    }
    let (lock, color) = match report.lock {
        Lock::Silent => ("SILENT", Color::Red),
        Lock::Searching => ("SEARCHING", Color::Yellow),
        Lock::Locked => ("LOCKED", Color::Green),
    };
    let age = report.age.map_or_else(
        || "no frame yet".to_owned(),
        |age| format!("last frame {:.1} s ago", age.as_secs_f64()),
    );
    let numbers = format!(
        "{:>7.1} frames/s {:>8.0} bytes/s   {age}",
        report.frames_per_second, report.bytes_per_second
    );
    Paragraph::new(vec![
        title,
        Line::from(vec![
            Span::from(format!(" {lock:<9}")).fg(color).bold(),
            Span::from(numbers),
        ]),
    ])
}

/// The setpoint and the failsafe's output, the machine's state, the recording.
fn axes(report: &Report, width: u16) -> Vec<Line<'static>> {
    let Output { setpoint, phase } = report.output;
    let demands = report.setpoint.map(<[u8; 3]>::from);
    let mut lines = Vec::new();
    for (index, ((name, _), output)) in AXES.into_iter().zip(<[u8; 3]>::from(setpoint)).enumerate()
    {
        let demand = demands.and_then(|axes| axes.get(index).copied());
        let number = demand.map_or_else(|| "--".to_owned(), |demand| format!("{demand:02X}"));
        let mut line = Line::from(format!("{name:<6}"));
        let bar_width = width.saturating_sub(6 + 10);
        line.spans
            .extend(bar(demand.unwrap_or(0), Some(output), bar_width).spans);
        line.push_span(format!(" {number} out {output:02X}"));
        lines.push(line);
    }
    lines.push(Line::from(vec![
        Span::from("failsafe "),
        Span::styled(phase_name(phase).to_uppercase(), phase_style(phase)),
    ]));
    lines.push(state(report));
    lines
}

/// The machine's states in a row, the one that it is in between brackets.
fn state(report: &Report) -> Line<'static> {
    let names = if report.frame_length == STATES.len() {
        &STATES[..]
    } else {
        &STATES_WITH_CHECK
    };
    let mut line = Line::from("state   ");
    for (place, name) in names.iter().enumerate() {
        line.push_span(if place == report.pending {
            Span::from(format!("[{name}]")).fg(Color::Cyan).bold()
        } else {
            Span::from(format!(" {name} ")).dim()
        });
    }
    line
}

fn counters(shown: &Shown) -> Vec<Line<'static>> {
    let counters = &shown.report.counters;
    let discarded = &counters.discarded;
    let events = &counters.events;
    let plain = |name: &str, count: u64| Span::from(format!("{name} {count}  "));
    let of_note = |name: &str, count: u64| {
        [
            Span::from(format!("{name} ")),
            emphasised(count, Color::Yellow),
            Span::from(" "),
        ]
    };
    let mut line_errors = Line::default();
    if shown.reports_line_errors {
        line_errors.extend(of_note("line errors: framing", events.framing));
        line_errors.extend(of_note("break", events.line_break));
    } else {
        line_errors.push_span(Span::from("line errors: this input reports none").dim());
    }
    let recording = match &shown.recording {
        RecordingState::Off => Line::from("not recorded").dim(),
        RecordingState::On { name, bytes } => {
            Line::from(format!("recorded in {name}: {bytes}")).fg(Color::Red)
        }
        RecordingState::Failed(problem) => Line::from(problem.clone()).fg(Color::Red).bold(),
    };
    let mut resynchronisations = Line::from(plain("resynchronised", counters.resynchronisations));
    resynchronisations.extend([plain("idle gaps", events.idle)]);
    let mut first = Line::from(plain("bytes", counters.bytes));
    first.extend([plain("frames", counters.frames)]);
    let mut why = Line::from("  ");
    why.extend([
        plain("terminator", discarded.terminator),
        plain("check", discarded.check),
        plain("line", discarded.line_event),
    ]);
    vec![
        first,
        Line::from_iter(of_note("discarded", discarded.total())),
        Line::from_iter([
            Span::from("  "),
            plain("no sync", discarded.no_sync),
            plain("broken sync", discarded.broken_sync),
        ]),
        why,
        resynchronisations,
        line_errors,
        recording,
    ]
}

/// The setpoints of the last ten seconds.
fn draw_chart(frame: &mut Frame, report: &Report, area: Rect) {
    let curve = |axis: usize| -> Vec<(f64, f64)> {
        let demand = |setpoint: Setpoint| <[u8; 3]>::from(setpoint).get(axis).copied();
        let point = |sample: &Sample| {
            let demand = sample.setpoint.and_then(demand)?;
            Some((sample.at.as_secs_f64(), f64::from(demand)))
        };
        report.history.iter().filter_map(point).collect()
    };
    let curves = [curve(0), curve(1), curve(2)];
    let mut title = Line::from(" the last ten seconds:");
    for (name, color) in AXES {
        title.push_span(Span::from(format!(" {name}")).fg(color));
    }
    title.push_span(" ");
    let datasets = curves.iter().zip(AXES).map(|(data, (_, color))| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(color))
            .data(data)
    });
    let now = report.now.as_secs_f64();
    let from = (now - 10.0).max(0.0);
    let chart = Chart::new(datasets.collect())
        .block(Block::bordered().title(title))
        .x_axis(Axis::default().bounds([from, from + 10.0]))
        .y_axis(
            Axis::default()
                .bounds([0.0, 255.0])
                .labels(["00", "80", "FF"]),
        );
    frame.render_widget(chart, area);
}

/// As many of the bytes discarded last as there is room for, newest at the end.
fn draw_discarded(frame: &mut Frame, report: &Report, area: Rect) {
    let block = Block::bordered().title(" bytes discarded last, | where a frame was between ");
    let inside = block.inner(area);
    let per_row = usize::from(inside.width / 3).max(1);
    let room = per_row * usize::from(inside.height);
    let from = report.discarded.len().saturating_sub(room);
    let bytes = report.discarded.get(from..).unwrap_or_default();
    let rows: Vec<Line> = bytes
        .chunks(per_row)
        .map(|row| row.iter().copied().map(hex).collect())
        .collect();
    frame.render_widget(Paragraph::new(rows).block(block), area);
}

fn hex(DiscardedByte { byte, follows }: DiscardedByte) -> Span<'static> {
    let separator = if follows { ' ' } else { '|' };
    Span::from(format!("{separator}{byte:02X}"))
}

fn draw_help(frame: &mut Frame, area: Rect) {
    let text = Text::from(HELP);
    let size = [text.width(), text.height()]
        .map(|length| u16::try_from(length).unwrap_or(u16::MAX).saturating_add(2));
    let [width, height] = size;
    let [area] = Layout::vertical([Constraint::Length(height)])
        .flex(Flex::Center)
        .areas(area);
    let [area] = Layout::horizontal([Constraint::Length(width)])
        .flex(Flex::Center)
        .areas(area);
    frame.render_widget(Clear, area);
    let block = Block::bordered().title(" help, ? or q closes it ".bold());
    frame.render_widget(Paragraph::new(text).block(block), area);
}

#[cfg(test)]
mod tests;
