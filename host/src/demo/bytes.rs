//! The bytes to be shown: those that came last, and a fault from close up; a column for each.

use std::collections::VecDeque;
use std::time::Duration;

use framelock_simulation::Outcome;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};

use crate::frame::LECTURE_STATES;

/// One byte on the line, and what it made of each receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ByteOnLine {
    pub(super) sent: u8,
    /// Its place in its frame: 0 to 6.
    pub(super) place: usize,
    pub(super) received: Option<u8>,
    /// What it made of the lecture's machine and of the receiver; nothing if it was lost.
    pub(super) outcomes: Vec<Outcome>,
}

/// Three frames: the one at fault, the one that follows, and one to see how it goes on.
const CLOSE_UP_LENGTH: usize = 21;

/// For how long a fault is looked at, at least.
const CLOSE_UP_TIME: Duration = Duration::from_millis(1200);

/// How many bytes there may be room for.
const RECENT_LENGTH: usize = 128;

/// What has been on the line lately.
#[derive(Debug, Default)]
pub(super) struct Recent {
    /// The latest first.
    bytes: VecDeque<ByteOnLine>,
    /// The frame of the latest fault, and the two behind it, as far as they have come.
    pub(super) close_up: Vec<ByteOnLine>,
    close_up_from: Duration,
}

impl Recent {
    pub(super) fn push(&mut self, now: Duration, byte: ByteOnLine) {
        let is_fault = byte.received != Some(byte.sent);
        let frame = byte.place + 1;
        self.bytes.truncate(RECENT_LENGTH - 1);
        self.bytes.push_front(byte.clone());
        if !self.close_up.is_empty() && self.close_up.len() < CLOSE_UP_LENGTH {
            self.close_up.push(byte);
        } else if is_fault
            && (self.close_up.is_empty() || now >= self.close_up_from + CLOSE_UP_TIME)
        {
            self.close_up_from = now;
            // From the first byte of the frame on.
            self.close_up = self.last(frame).cloned().collect();
        }
    }

    /// The bytes that came last, at most `count`, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = &ByteOnLine> {
        self.bytes.iter().take(count).rev()
    }
}

/// What a receiver that has that many bytes of a frame waits for.
pub(super) fn state(pending: usize) -> &'static str {
    LECTURE_STATES.get(pending).copied().unwrap_or_default()
}

/// Columns that the rows' names take.
const NAMES_WIDTH: u16 = 10;

/// Columns that a byte takes.
const BYTE_WIDTH: u16 = 3;

/// How many bytes there is room for.
pub(super) fn room(width: u16) -> usize {
    usize::from(width.saturating_sub(NAMES_WIDTH) / BYTE_WIDTH)
}

/// Four rows: what was sent, what arrived, and where it took each machine.
pub(super) fn rows<'a>(bytes: impl Iterator<Item = &'a ByteOnLine>) -> [Line<'static>; 4] {
    let mut rows = ["sent", "received", "lecture", "receiver"].map(|name| {
        let width = usize::from(NAMES_WIDTH);
        Line::from(Span::from(format!("{name:<width$}")).dim())
    });
    for byte in bytes {
        for (row, cell) in rows.iter_mut().zip(column(byte)) {
            row.push_span(cell);
            row.push_span(" ");
        }
    }
    rows
}

fn column(byte: &ByteOnLine) -> [Span<'static>; 4] {
    let fault = Style::new().fg(Color::Red).bold();
    let is_lost = byte.received.is_none();
    let sent_style = if is_lost { fault } else { Style::new() };
    let sent = Span::styled(format!("{:02X}", byte.sent), sent_style);
    let arrived = match byte.received {
        None => Span::styled("--", fault),
        Some(arrived) if arrived == byte.sent => Span::from(format!("{arrived:02X}")),
        Some(arrived) => Span::styled(format!("{arrived:02X}"), fault.reversed()),
    };
    let outcome = |station| byte.outcomes.get(station).map_or(Span::from("  "), cell);
    [sent, arrived, outcome(0), outcome(1)]
}

/// The state after the byte, or how the commit was.
fn cell(outcome: &Outcome) -> Span<'static> {
    match outcome {
        Outcome::Pending(bytes) => Span::from(format!("{:<2}", state(*bytes))).dim(),
        Outcome::Delivered => Span::from("ok").fg(Color::Green).bold(),
        Outcome::Wrong => Span::from("!!").fg(Color::Red).bold(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_byte_has_its_column() {
        let byte = ByteOnLine {
            sent: 0x41,
            place: 0,
            received: Some(0x41),
            outcomes: vec![Outcome::Pending(1), Outcome::Wrong],
        };
        let bytes = [
            byte.clone(),
            ByteOnLine {
                received: None,
                outcomes: Vec::new(),
                ..byte.clone()
            },
            ByteOnLine {
                received: Some(0x43),
                outcomes: vec![Outcome::Pending(6), Outcome::Delivered],
                ..byte
            },
        ];
        let rows = rows(bytes.iter()).map(|row| row.to_string());
        assert_eq!(
            rows,
            [
                "sent      41 41 41 ",
                "received  41 -- 43 ",
                "lecture   B     CR ",
                "receiver  !!    ok ",
            ]
        );
        assert_eq!(room(78), 22);
        assert_eq!(room(3), 0);
    }
}
