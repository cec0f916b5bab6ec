//! The live view: one drawing of the demonstration as it stands. It reads, and changes nothing.
//!
//! Laid out for 80 columns and 24 rows; a lower terminal goes without the bytes, a higher one has
//! room for a chart.

use framelock::Output;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

use super::bytes::{self, ByteOnLine};
use super::demonstration::{Demonstration, Report};
use super::script::Passage;
use crate::view_parts::{RowsLeft, bar, emphasised, phase_name, phase_style};

const TITLE_HEIGHT: u16 = 2;
const STATIONS_HEIGHT: u16 = 9;
const BYTES_HEIGHT: u16 = 6;
const KEYS_HEIGHT: u16 = 1;
const CHART_HEIGHT: u16 = 8;

/// Draws the demonstration as it stands.
pub(super) fn draw(frame: &mut Frame, demonstration: &Demonstration, is_paused: bool) {
    let area = frame.area();
    let mut rows_left = RowsLeft::new(area.height, TITLE_HEIGHT + STATIONS_HEIGHT + KEYS_HEIGHT);
    let line_height = rows_left.exactly(BYTES_HEIGHT);
    let close_up_height = rows_left.exactly(BYTES_HEIGHT);
    let chart_height = rows_left.all_of(CHART_HEIGHT);
    let [title, stations, line, close_up, chart, keys] = Layout::vertical([
        Constraint::Length(TITLE_HEIGHT),
        Constraint::Length(STATIONS_HEIGHT),
        Constraint::Length(line_height),
        Constraint::Length(close_up_height),
        Constraint::Length(chart_height),
        Constraint::Length(KEYS_HEIGHT),
    ])
    .areas(area);

    frame.render_widget(title_of(demonstration), title);
    draw_stations(frame, demonstration, stations);
    let room = bytes::room(line.width.saturating_sub(2));
    let titles = [
        "the line; state after each byte, ok = committed, !! = a wrong commit",
        "a fault from close up: the frame it hits, and the two behind it",
    ];
    draw_bytes(frame, titles[0], demonstration.recent.last(room), line);
    draw_bytes(
        frame,
        titles[1],
        demonstration.recent.close_up.iter(),
        close_up,
    );
    draw_chart(frame, demonstration, chart);
    let space = if is_paused { "goes on" } else { "pauses" };
    let keys_line = Line::from(format!(" q quits, space {space}")).dim();
    frame.render_widget(keys_line, keys);
}

fn title_of(demonstration: &Demonstration) -> Paragraph<'static> {
    let arguments = &demonstration.arguments;
    let what = match demonstration.passage() {
        Passage::Motion => "motion, over a faulty line",
        Passage::Silence => "silence: nothing is sent",
        Passage::Parking => "parking, over a faultless line",
        Passage::Parked if arguments.drop > 0.0 => "parked on 00 41 42 00; one byte is lost",
        Passage::Parked => "parked on 00 41 42 00",
    };
    let (line, _) = demonstration.report();
    let numbers = format!(
        "{:5.1} of {} s  sent {:<5} broken {:<4} ",
        demonstration.now.as_secs_f64(),
        arguments.seconds,
        line.frames_sent,
        line.frames_sent - line.frames_intact,
    );
    let settings = format!(
        " seed {}, {} baud, {} frames/s, drop {}, flip {}",
        arguments.seed, arguments.baud, arguments.rate, arguments.drop, arguments.flip
    );
    Paragraph::new(vec![
        Line::from(vec![
            Span::from(" framelock demo ").bold().reversed(),
            Span::from(settings).dim(),
        ]),
        Line::from(vec![
            Span::from(format!(" {numbers}")),
            Span::from(what).bold(),
        ]),
    ])
}

fn draw_stations(frame: &mut Frame, demonstration: &Demonstration, area: Rect) {
    let areas: [Rect; 2] = Layout::horizontal([Constraint::Fill(1); 2]).areas(area);
    let names = ["the lecture's machine: discard", "the receiver: rescan"];
    let (_, reports) = demonstration.report();
    for ((area, name), report) in areas.into_iter().zip(names).zip(reports) {
        let block = Block::bordered().title(Span::from(format!(" {name} ")).bold());
        let inside = block.inner(area);
        frame.render_widget(block, area);
        let lines = station(&report, demonstration, inside.width);
        frame.render_widget(Paragraph::new(lines), inside);
    }
}

fn station(report: &Report, demonstration: &Demonstration, width: u16) -> Vec<Line<'static>> {
    let Output { setpoint, phase } = report.output;
    let mut lines = vec![Line::from(vec![
        Span::from("state "),
        Span::from(format!("{:<4}", bytes::state(report.pending))).bold(),
        Span::from("failsafe "),
        Span::styled(phase_name(phase).to_uppercase(), phase_style(phase)),
    ])];
    let sent = demonstration.last_sent.map(<[u8; 3]>::from);
    let names = ["pitch", "roll", "yaw"];
    for (index, (name, output)) in names.into_iter().zip(<[u8; 3]>::from(setpoint)).enumerate() {
        let sent = sent.and_then(|axes| axes.get(index).copied());
        let numbers = format!(
            " {output:02X} sent {}",
            sent.map_or_else(|| "--".to_owned(), |sent| format!("{sent:02X}"))
        );
        let mut line = Line::from(format!("{name:<6}"));
        let bar_width = width.saturating_sub(6 + 11);
        line.spans.extend(bar(output, sent, bar_width).spans);
        line.push_span(numbers);
        lines.push(line);
    }
    let tally = &report.tally;
    lines.push(Line::from(vec![
        Span::from(format!("received {:<6}lost ", tally.delivered)),
        emphasised(report.lost, Color::Yellow),
        Span::from(" wrong "),
        emphasised(report.wrong, Color::Red),
    ]));
    lines.push(Line::from(vec![
        Span::from("lost though delivered whole "),
        emphasised(tally.lost_intact, Color::Red),
    ]));
    let discarded = tally.bytes_discarded;
    lines.push(Line::from(format!("bytes discarded {discarded}")));
    lines
}

fn draw_bytes<'a>(
    frame: &mut Frame,
    title: &'static str,
    bytes: impl Iterator<Item = &'a ByteOnLine>,
    area: Rect,
) {
    let block = Block::bordered().title(format!(" {title} "));
    let rows = bytes::rows(bytes).to_vec();
    frame.render_widget(Paragraph::new(rows).block(block), area);
}

/// The curves of the chart.
const CURVES: [(&str, Color); 3] = [
    ("sent", Color::Yellow),
    ("lecture's machine", Color::Red),
    ("receiver", Color::Green),
];

/// The pitch of the last ten seconds: as sent, and as each station put it out.
fn draw_chart(frame: &mut Frame, demonstration: &Demonstration, area: Rect) {
    let mut title = Line::from(" pitch, the last ten seconds: ");
    let mut curves: [Vec<(f64, f64)>; 3] = Default::default();
    for (at, pitches) in &demonstration.samples {
        for (curve, pitch) in curves.iter_mut().zip(pitches) {
            curve.push((at.as_secs_f64(), f64::from(*pitch)));
        }
    }
    let datasets = curves.iter().zip(CURVES).map(|(curve, (name, color))| {
        title.push_span(Span::from(name).fg(color));
        title.push_span(" ");
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(color))
            .data(curve)
    });
    let datasets = datasets.collect();
    let from = (demonstration.now.as_secs_f64() - 10.0).max(0.0);
    let heights = Axis::default()
        .bounds([0.0, 255.0])
        .labels(["00", "80", "FF"]);
    let chart = Chart::new(datasets)
        .block(Block::bordered().title(title))
        .x_axis(Axis::default().bounds([from, from + 10.0]))
        .y_axis(heights);
    frame.render_widget(chart, area);
}

#[cfg(test)]
mod tests;
