//! Bytes on the line and what each made of the two machines: a column per byte.

use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};

use super::recent::ByteOnLine;
use super::station::Outcome;

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
    let sent = Span::from(format!("{:02X}", byte.sent));
    match byte.received {
        None => [
            sent.style(fault),
            Span::styled("--", fault),
            Span::from("  "),
            Span::from("  "),
        ],
        Some(received) => {
            let arrived = format!("{received:02X}");
            let arrived = if received == byte.sent {
                Span::from(arrived)
            } else {
                Span::styled(arrived, fault.reversed())
            };
            [sent, arrived, cell(byte.discard), cell(byte.rescan)]
        }
    }
}

/// The state after the byte, or how the commit was.
fn cell(outcome: Option<Outcome>) -> Span<'static> {
    match outcome {
        None => Span::from("  "),
        Some(Outcome::Waits(state)) => Span::from(format!("{:<2}", state.lecture_name())).dim(),
        Some(Outcome::Right) => Span::from("ok").fg(Color::Green).bold(),
        Some(Outcome::Wrong) => Span::from("!!").fg(Color::Red).bold(),
    }
}

#[cfg(test)]
mod tests {
    use framelock::State;

    use super::*;

    #[test]
    fn each_byte_has_its_column() {
        let byte = ByteOnLine {
            sent: 0x41,
            place: 0,
            received: Some(0x41),
            discard: Some(Outcome::Waits(State::SyncB)),
            rescan: Some(Outcome::Wrong),
        };
        let bytes = [
            byte,
            ByteOnLine {
                received: None,
                ..byte
            },
            ByteOnLine {
                received: Some(0x43),
                discard: Some(Outcome::Waits(State::Terminator)),
                rescan: Some(Outcome::Right),
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
