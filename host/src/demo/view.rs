//! The live view: one drawing of the simulation as it stands. It reads, and changes nothing.
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

use super::bytes;
use super::recent::ByteOnLine;
use super::script::Passage;
use super::simulation::{Sample, Simulation};
use super::station::Report;
use crate::view_parts::{RowsLeft, bar, emphasised, phase_name, phase_style};

const TITLE_HEIGHT: u16 = 2;
const STATIONS_HEIGHT: u16 = 9;
const BYTES_HEIGHT: u16 = 6;
const KEYS_HEIGHT: u16 = 1;
const CHART_HEIGHT: u16 = 8;

/// Draws the simulation as it stands.
pub(super) fn draw(frame: &mut Frame, simulation: &Simulation, is_paused: bool) {
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

    frame.render_widget(title_of(simulation), title);
    draw_stations(frame, simulation, stations);
    let room = bytes::room(line.width.saturating_sub(2));
    let titles = [
        "the line; state after each byte, ok = committed, !! = a wrong commit",
        "a fault from close up: the frame it hits, and the two behind it",
    ];
    draw_bytes(frame, titles[0], simulation.recent().last(room), line);
    draw_bytes(
        frame,
        titles[1],
        simulation.recent().close_up().iter(),
        close_up,
    );
    draw_chart(frame, simulation, chart);
    let space = if is_paused { "goes on" } else { "pauses" };
    let keys_line = Line::from(format!(" q quits, space {space}")).dim();
    frame.render_widget(keys_line, keys);
}

fn title_of(simulation: &Simulation) -> Paragraph<'static> {
    let plan = simulation.plan();
    let what = match simulation.passage() {
        Passage::Motion => "motion, over a faulty line",
        Passage::Silence => "silence: nothing is sent",
        Passage::Parking => "parking, over a faultless line",
        Passage::Parked if plan.drop > 0.0 => "parked on 00 41 42 00; one byte is lost",
        Passage::Parked => "parked on 00 41 42 00",
    };
    let numbers = format!(
        "{:5.1} of {} s  sent {:<5} broken {:<4} ",
        simulation.now().as_secs_f64(),
        plan.seconds,
        simulation.sent(),
        simulation.broken(),
    );
    let settings = format!(
        " seed {}, {} baud, {} frames/s, drop {}, flip {}",
        plan.seed, plan.baud, plan.rate, plan.drop, plan.flip
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

fn draw_stations(frame: &mut Frame, simulation: &Simulation, area: Rect) {
    let areas: [Rect; 2] = Layout::horizontal([Constraint::Fill(1); 2]).areas(area);
    let names = ["the lecture's machine: discard", "the receiver: rescan"];
    for ((area, name), report) in areas.into_iter().zip(names).zip(simulation.reports()) {
        let block = Block::bordered().title(Span::from(format!(" {name} ")).bold());
        let inside = block.inner(area);
        frame.render_widget(block, area);
        let lines = station(&report, simulation, inside.width);
        frame.render_widget(Paragraph::new(lines), inside);
    }
}

fn station(report: &Report, simulation: &Simulation, width: u16) -> Vec<Line<'static>> {
    let Output { setpoint, phase } = report.output;
    let mut lines = vec![Line::from(vec![
        Span::from("state "),
        Span::from(format!("{:<4}", report.state.lecture_name())).bold(),
        Span::from("failsafe "),
        Span::styled(phase_name(phase).to_uppercase(), phase_style(phase)),
    ])];
    let sent = simulation.last_sent().map(<[u8; 3]>::from);
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
    let tally = report.tally;
    lines.push(Line::from(vec![
        Span::from(format!("received {:<6}lost ", tally.received)),
        emphasised(tally.lost, Color::Yellow),
        Span::from(" wrong "),
        emphasised(tally.wrong, Color::Red),
    ]));
    lines.push(Line::from(vec![
        Span::from("lost though delivered whole "),
        emphasised(tally.lost_though_whole, Color::Red),
    ]));
    let discarded = report.counters.discarded.total();
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

/// The colors of the curves.
const SENT: Color = Color::Yellow;
const DISCARD: Color = Color::Red;
const RESCAN: Color = Color::Green;

/// The pitch of the last ten seconds: as sent, and as each station put it out.
fn draw_chart(frame: &mut Frame, simulation: &Simulation, area: Rect) {
    let curve = |pitch: fn(&Sample) -> Option<u8>| -> Vec<(f64, f64)> {
        simulation
            .samples()
            .filter_map(|sample| Some((sample.at.as_secs_f64(), f64::from(pitch(sample)?))))
            .collect()
    };
    let sent = curve(|sample| sample.sent);
    let discard = curve(|sample| Some(sample.discard));
    let rescan = curve(|sample| Some(sample.rescan));
    let dataset = |color, data| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(color))
            .data(data)
    };
    let title = Line::from(vec![
        Span::from(" pitch, the last ten seconds: "),
        Span::from("sent").fg(SENT),
        Span::from(", "),
        Span::from("lecture's machine").fg(DISCARD),
        Span::from(", "),
        Span::from("receiver ").fg(RESCAN),
    ]);
    let now = simulation.now().as_secs_f64();
    let from = (now - 10.0).max(0.0);
    let chart = Chart::new(vec![
        dataset(SENT, &sent),
        dataset(DISCARD, &discard),
        dataset(RESCAN, &rescan),
    ])
    .block(Block::bordered().title(title))
    .x_axis(Axis::default().bounds([from, from + 10.0]))
    .y_axis(
        Axis::default()
            .bounds([0.0, 255.0])
            .labels(["00", "80", "FF"]),
    );
    frame.render_widget(chart, area);
}

#[cfg(test)]
mod tests;
