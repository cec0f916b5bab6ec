//! The close-up of a fault: a column for each byte.

use std::time::Duration;

use framelock_simulation::Outcome;
use ratatui::style::{Style, Stylize};
use ratatui::text::{Line, Span};

use crate::view_parts::{BLUE, STATES, VERMILLION};

/// One byte on the line, and the outcome at each receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ByteOnLine {
    pub(super) sent: u8,
    /// The byte's index in its frame, 0 to 6.
    pub(super) place: usize,
    pub(super) received: Option<u8>,
    /// The outcomes at the lecture's machine and at framelock; empty if the byte was lost.
    pub(super) outcomes: Vec<Outcome>,
}

impl ByteOnLine {
    /// Returns whether the line lost or changed the byte.
    pub(super) fn is_fault(&self) -> bool {
        self.received != Some(self.sent)
    }
}

/// The length of three frames: the frame with the fault and the two frames after it.
const CLOSE_UP_LENGTH: usize = 21;

/// The shortest time for which a fault is shown.
const CLOSE_UP_TIME: Duration = Duration::from_millis(1200);

/// The bytes of the current frame and of the last fault.
#[derive(Debug, Default)]
pub(super) struct Bytes {
    /// The bytes of the current frame that have been sent so far.
    pub(super) frame: Vec<ByteOnLine>,
    /// The frame with the last fault and the two frames after it; before the first fault, the first three frames.
    /// Contains only the bytes of these frames that have already been sent.
    pub(super) close_up: Vec<ByteOnLine>,
    close_up_from: Duration,
}

impl Bytes {
    /// Takes the next byte, which belongs to the frame that was due at `due`.
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
            // The close-up starts at the first byte of the frame.
            self.close_up.clone_from(&self.frame);
        }
    }
}

/// The width of the rows' names.
const NAMES_WIDTH: usize = 10;

/// Returns four rows: the bytes sent, the bytes that arrived, and the state of each receiver afterwards.
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

/// Returns the receiver's state after the byte. If the byte caused a commit, returns a mark for a right or a wrong
/// commit instead.
fn cell(outcome: &Outcome) -> Span<'static> {
    match outcome {
        Outcome::Pending(bytes) => Span::from(format!("{:<2}", STATES[*bytes])).dim(),
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
