//! The bytes to be shown: a fault from close up, a column for each byte.

use std::time::Duration;

use framelock_simulation::{FrameFormat, Outcome};
use ratatui::style::{Style, Stylize};
use ratatui::text::{Line, Span};

use crate::view_parts::{BLUE, VERMILLION};

/// One byte on the line, and what it made of each receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ByteOnLine {
    pub(super) sent: u8,
    /// Its place in its frame: 0 to 6.
    pub(super) place: usize,
    pub(super) received: Option<u8>,
    /// What it made of the lecture's machine and of framelock; nothing if it was lost.
    pub(super) outcomes: Vec<Outcome>,
}

impl ByteOnLine {
    /// Whether the line lost or changed it.
    pub(super) fn is_fault(&self) -> bool {
        self.received != Some(self.sent)
    }
}

/// Three frames: the one at fault, the one that follows, and one to see how it goes on.
const CLOSE_UP_LENGTH: usize = 21;

/// For how long a fault is looked at, at least.
const CLOSE_UP_TIME: Duration = Duration::from_millis(1200);

/// The frame under way, and the last fault.
#[derive(Debug, Default)]
pub(super) struct Bytes {
    /// The frame under way, as far as it has come.
    pub(super) frame: Vec<ByteOnLine>,
    /// The frame of the last fault and the two behind it, as far as they have come; before there is
    /// a fault, the first three.
    pub(super) close_up: Vec<ByteOnLine>,
    close_up_from: Duration,
}

impl Bytes {
    /// The next byte, of the frame that was due at that time.
    pub(super) fn push(&mut self, due: Duration, byte: ByteOnLine) {
        let (is_fault, is_first) = (byte.is_fault(), self.close_up.is_empty());
        if byte.place == 0 {
            self.frame.clear();
        }
        self.frame.push(byte.clone());
        if (1..CLOSE_UP_LENGTH).contains(&self.close_up.len()) {
            self.close_up.push(byte);
        } else if is_first || is_fault && due >= self.close_up_from + CLOSE_UP_TIME {
            self.close_up_from = due;
            // From the first byte of the frame on.
            self.close_up.clone_from(&self.frame);
        }
    }
}

/// Columns that the rows' names take.
const NAMES_WIDTH: usize = 10;

/// Four rows: what was sent, what arrived, and what each machine waits for next.
pub(super) fn rows<'a>(bytes: impl Iterator<Item = &'a ByteOnLine>) -> [Line<'static>; 4] {
    let mut rows = ["sent", "arrived", "lecture", "framelock"]
        .map(|name| Line::from(Span::from(format!("{name:<NAMES_WIDTH$}")).dim()));
    for byte in bytes {
        let separator = if byte.place == 6 { "│" } else { " " };
        for (row, cell) in rows.iter_mut().zip(column(byte)) {
            row.push_span(cell);
            row.push_span(separator.dim());
        }
    }
    rows
}

fn column(byte: &ByteOnLine) -> [Span<'static>; 4] {
    let fault = Style::new().fg(VERMILLION).bold();
    let is_lost = byte.received.is_none();
    let sent_style = if is_lost { fault } else { Style::new() };
    let sent = Span::styled(format!("{:02X}", byte.sent), sent_style);
    let arrived = match byte.received {
        None => Span::styled("--", fault),
        Some(arrived) if byte.is_fault() => {
            Span::styled(format!("{arrived:02X}"), fault.reversed())
        }
        Some(arrived) => Span::from(format!("{arrived:02X}")),
    };
    let outcome = |station| byte.outcomes.get(station).map_or(Span::from("  "), cell);
    [sent, arrived, outcome(0), outcome(1)]
}

/// What the machine waits for after the byte, or how the commit was.
fn cell(outcome: &Outcome) -> Span<'static> {
    match outcome {
        Outcome::Pending(bytes) => {
            let state = FrameFormat::Bin
                .states()
                .get(*bytes)
                .copied()
                .unwrap_or_default();
            Span::from(format!("{state:<2}")).dim()
        }
        Outcome::Delivered => Span::from("ok").fg(BLUE).bold(),
        Outcome::Wrong => Span::from("!!").fg(VERMILLION).bold(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_byte_has_its_column() {
        let byte = |place, received, outcomes: &[Outcome]| ByteOnLine {
            sent: 0x41,
            place,
            received,
            outcomes: outcomes.to_vec(),
        };
        let bytes = [
            byte(0, Some(0x41), &[Outcome::Pending(1), Outcome::Wrong]),
            byte(1, None, &[]),
            byte(6, Some(0x43), &[Outcome::Pending(6), Outcome::Delivered]),
        ];
        let rows = rows(bytes.iter()).map(|row| row.to_string());
        assert_eq!(
            rows,
            [
                "sent      41 41 41│",
                "arrived   41 -- 43│",
                "lecture   B     CR│",
                "framelock !!    ok│",
            ]
        );
    }
}
