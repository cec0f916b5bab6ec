//! The parts of live views: bars, counts and phases.

use framelock::motion::Phase;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};

/// The colour for good states. Colour-blind people can distinguish it from [`VERMILLION`], on light and on dark
/// backgrounds; Okabe and Ito chose the pair. Each of the two constants is the one of a terminal's 256 colours that is
/// nearest to the original colour.
pub(crate) const BLUE: Color = Color::Indexed(32);
/// The colour for bad states.
pub(crate) const VERMILLION: Color = Color::Indexed(166);

/// The lecture's names of the states. BIN's receivers are in state `i` while they wait for byte `i` of a frame.
pub(crate) const STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];

/// The characters that fill 0 to 8 eighths of a terminal cell.
const EIGHTHS: [char; 9] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];

/// Returns a bar of `width` cells for the output, with a mark at the value that was sent.
pub(crate) fn bar(output: u8, sent: Option<u8>, width: u16) -> Line<'static> {
    let cells = usize::from(width);
    let eighths = usize::from(output) * cells * 8 / usize::from(u8::MAX);
    let mark = sent.map(|sent| usize::from(sent) * cells.saturating_sub(1) / usize::from(u8::MAX));
    (0..cells)
        .map(|cell| {
            if mark == Some(cell) {
                return Span::from("┃").fg(Color::Yellow).bold();
            }
            let filled = eighths.saturating_sub(cell * 8).min(8);
            let part = EIGHTHS.get(filled).copied().unwrap_or(' ');
            Span::from(part.to_string())
                .fg(Color::Cyan)
                .bg(Color::Indexed(236))
        })
        .collect()
}

/// Formats a count, and emphasises it if it is not zero.
pub(crate) fn emphasised(count: u64, color: Color) -> Span<'static> {
    let span = Span::from(format!("{count:<5}"));
    if count > 0 {
        span.fg(color).bold()
    } else {
        span
    }
}

/// Returns the style of a phase.
pub(crate) fn phase_style(phase: Phase) -> Style {
    let color = match phase {
        Phase::Live | Phase::Approach => BLUE,
        _ => VERMILLION,
    };
    Style::new().fg(color).bold()
}

#[cfg(test)]
pub(crate) mod tests {
    use ratatui::backend::TestBackend;
    use ratatui::{Frame, Terminal};

    use super::*;

    /// Draws a view on a screen of this size. Returns the rows of the screen as text.
    pub(crate) fn screen(width: u16, height: u16, draw: impl FnOnce(&mut Frame)) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a screen");
        terminal.draw(draw).expect("writing to memory cannot fail");
        let cells = terminal.backend().buffer().content();
        let rows = cells.chunks(usize::from(width).max(1));
        rows.map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect())
            .collect()
    }

    fn text(output: u8, sent: Option<u8>) -> String {
        bar(output, sent, 10).to_string()
    }

    #[test]
    fn the_bar_shows_the_output_and_the_mark_shows_the_value_sent() {
        assert_eq!(text(0, None), "          ");
        assert_eq!(text(255, None), "██████████");
        assert_eq!(text(128, None), "█████     ");
        assert_eq!(text(140, None), "█████▍    ");
        assert_eq!(text(128, Some(0)), "┃████     ");
        assert_eq!(text(128, Some(255)), "█████    ┃");
        assert_eq!(bar(128, Some(128), 0).to_string(), "");
    }
}
