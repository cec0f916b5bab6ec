//! Draws the view of a session. Drawing changes nothing.
//!
//! The layout is for 80 columns and 24 rows. A terminal with few rows shows no discarded bytes.

use framelock::LineEvent;
use framelock::motion::Output;
use ratatui::Frame;
use ratatui::layout::{Constraint, Flex, Layout, Rect};
use ratatui::style::{Color, Stylize};
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

use super::session::MonitorSession;
use super::watch::{Lock, Watch};
use crate::line_errors::Marks;
use crate::view_parts::{BLUE, STATES, VERMILLION, bar, emphasised, phase_style};

const TITLE_ROWS: u16 = 2;
const BOX_ROWS: u16 = 9;
const DISCARDED_ROWS: u16 = 4;
const KEY_ROWS: u16 = 1;

const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// Draws the view.
pub(super) fn draw(frame: &mut Frame, session: &MonitorSession) {
    let area = frame.area();
    let has_setpoints = session.displayed().frame.protocol.has_setpoints();
    let free = area.height.saturating_sub(TITLE_ROWS + BOX_ROWS + KEY_ROWS);
    let discarded_rows = match free {
        ..DISCARDED_ROWS => 0,
        _ if has_setpoints => free,
        _ => DISCARDED_ROWS,
    };
    // There may be many fields, so they get the free rows.
    let box_rows = BOX_ROWS
        + if has_setpoints {
            0
        } else {
            free - discarded_rows
        };
    let heights = [TITLE_ROWS, box_rows, discarded_rows, KEY_ROWS];
    let [title, boxes, discarded, keys] =
        Layout::vertical(heights.map(Constraint::Length)).areas(area);
    let [left, right] = Layout::horizontal([Constraint::Fill(1); 2]).areas(boxes);

    let watch = session.displayed();
    frame.render_widget(Paragraph::new(title_lines(session)), title);
    let block = Block::bordered().title(if has_setpoints {
        " setpoint "
    } else {
        " last frame "
    });
    let lines = if has_setpoints {
        axes(watch, block.inner(left).width)
    } else {
        fields(watch)
    };
    let lines = Paragraph::new(lines).wrap(Wrap { trim: false });
    frame.render_widget(lines.block(block), left);
    let block = Block::bordered().title(" counters ");
    frame.render_widget(Paragraph::new(counters(session)).block(block), right);
    draw_discarded(frame, watch, discarded);
    let space = if session.is_paused() {
        "resumes"
    } else {
        "pauses"
    };
    let line = format!(" q quits, space {space}, z counts from zero, ? help");
    frame.render_widget(Line::from(line).dim(), keys);
    if session.has_help {
        draw_help(frame, area);
    }
}

fn title_lines(session: &MonitorSession) -> Vec<Line<'static>> {
    let watch = session.displayed();
    let mut title = vec![" framelock monitor ".bold().reversed()];
    if session.is_paused() {
        title.push(" PAUSED ".yellow().reversed());
    }
    if session.has_ended {
        title.push(" THE INPUT HAS ENDED ".cyan().reversed());
    }
    // The title is last, since a port's name may be wider than the terminal.
    title.push(format!(" {} ", session.title).into());
    let lock = match watch.lock() {
        _ if session.is_gone => " GONE     ".fg(VERMILLION),
        Lock::Silent => " SILENT   ".fg(VERMILLION),
        Lock::Searching => " SEARCHING".yellow(),
        Lock::Locked => " LOCKED   ".fg(BLUE),
    };
    let age = match watch.framed_at {
        Some(at) => {
            let age = watch.now.at.saturating_sub(at).as_secs_f64();
            format!("last frame {age:.1} s ago")
        }
        None => "no frame yet".to_owned(),
    };
    let [frames, bytes] = watch.rates();
    let numbers = format!("{frames:>7.1} frames/s {bytes:>8.0} bytes/s   {age}");
    vec![
        Line::from(title),
        Line::from(vec![lock.bold(), numbers.into()]),
    ]
}

/// Returns lines with the setpoint, the receiver's state, and the failsafe's output and phase.
fn axes(watch: &Watch, width: u16) -> Vec<Line<'static>> {
    let Output { axes, phase } = watch.output();
    let demands = watch.setpoint.map(<[u8; 3]>::from);
    let bar_width = width.saturating_sub(6 + 12);
    let mut lines = Vec::new();
    for (axis, (name, output)) in AXES.into_iter().zip(axes).enumerate() {
        let demand = demands.map(|axes| axes[axis]);
        let sent = demand.map_or("--".to_owned(), |demand| demand.to_string());
        let mut line = Line::from(format!("{name:<6}"));
        line.extend(bar(demand.unwrap_or(0), Some(output), bar_width));
        line.push_span(format!(" {sent:>3} out {output:>3}"));
        lines.push(line);
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
    let reason = watch
        .reason(phase)
        .map_or(String::new(), |why| format!(": {why}"));
    lines.push(Line::from(vec!["failsafe ".into(), name, reason.into()]));
    lines
}

/// Returns lines with the last frame's fields and the number of pending bytes.
fn fields(watch: &Watch) -> Vec<Line<'static>> {
    let last = watch.last.as_deref().unwrap_or_default();
    let mut lines = vec![
        format!("length {}", last.len()).into(),
        format!("pending {}", watch.line.pending().len()).into(),
    ];
    lines.extend(watch.frame.lines(last).into_iter().map(Line::from));
    lines
}

fn counters(session: &MonitorSession) -> Vec<Line<'static>> {
    let counters = session.displayed().line.counters();
    let (discarded, events) = (&counters.discarded, &counters.events);
    let of_note = |counts: &[(&str, u32)]| {
        let spans = counts.iter().flat_map(|(name, count)| {
            let count = emphasised(u64::from(*count), Color::Yellow);
            [format!("{name} ").into(), count, " ".into()]
        });
        spans.collect::<Line>()
    };
    let line_errors = |marks: &Marks| match marks.error {
        LineEvent::Parity => ("line errors: parity", events.parity),
        _ => ("line errors: framing", events.framing),
    };
    let mut lines = vec![
        format!("bytes {}  frames {}", counters.bytes, counters.frames).into(),
        of_note(&[("discarded", discarded.total())]),
        format!(
            "  no sync {}  broken sync {}",
            discarded.no_sync, discarded.broken_sync
        )
        .into(),
        format!(
            "  terminator {}  checksum {}  line {}",
            discarded.wrong_terminator, discarded.checksum_mismatch, discarded.line_event
        )
        .into(),
        format!(
            "resynchronised {}  idle gaps {}",
            counters.resynchronisations, events.idle
        )
        .into(),
        match &session.marks {
            Some(marks) => of_note(&[line_errors(marks), ("break", events.line_break)]),
            None => Line::from("line errors: this input reports none").dim(),
        },
    ];
    lines.extend(
        session
            .notes
            .last()
            .map(|note| Line::from(note.clone()).yellow()),
    );
    if !session.displayed().frame.protocol.has_setpoints() {
        let (header, long) = (discarded.bad_header, discarded.too_long);
        let unknown = discarded.unknown_message;
        let line = format!("  bad header {header}  too long {long}  unknown {unknown}");
        lines.insert(3, line.into());
    }
    lines
}

/// Draws the last discarded bytes that fit, with the newest at the end.
fn draw_discarded(frame: &mut Frame, watch: &Watch, area: Rect) {
    let block = Block::bordered().title(" last discarded bytes; | marks a frame in between ");
    let inside = block.inner(area);
    let per_row = usize::from(inside.width / 3).max(1);
    let room = per_row * usize::from(inside.height);
    let from = watch.discarded.len().saturating_sub(room);
    let bytes = watch.discarded.iter().skip(from);
    let texts: Vec<String> = bytes
        .map(|(byte, follows)| {
            let separator = if *follows { ' ' } else { '|' };
            format!("{separator}{byte:02X}")
        })
        .collect();
    let rows = texts.chunks(per_row).map(|row| Line::from(row.concat()));
    let rows: Vec<Line> = rows.collect();
    frame.render_widget(Paragraph::new(rows).block(block), area);
}

fn draw_help(frame: &mut Frame, area: Rect) {
    let text = Text::from(include_str!("../help/keys.txt"));
    let [width, height] = [text.width(), text.height()]
        .map(|length| Constraint::Length(u16::try_from(length + 2).unwrap_or(u16::MAX)));
    let [area] = Layout::vertical([height]).flex(Flex::Center).areas(area);
    let [area] = Layout::horizontal([width]).flex(Flex::Center).areas(area);
    frame.render_widget(Clear, area);
    let block = Block::bordered().title(" help, ? or q closes it ".bold());
    frame.render_widget(Paragraph::new(text).block(block), area);
}

#[cfg(test)]
mod tests;
