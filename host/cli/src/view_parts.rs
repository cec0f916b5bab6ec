//! The parts of live views: colours, bars and phases.

use framelock::motion::Phase;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::Span;

/// The colour for good states. Colour-blind people can distinguish it from [`VERMILLION`], on light and on dark
/// backgrounds; Okabe and Ito chose the pair. Each of the two constants is the one of a terminal's 256 colours that is
/// nearest to the original colour.
pub(crate) const BLUE: Color = Color::Indexed(32);
/// The colour for bad states.
pub(crate) const VERMILLION: Color = Color::Indexed(166);

/// The lecture's names of the states. BIN's receivers are in state `i` while they wait for byte `i` of a frame.
pub(crate) const STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];

/// Returns a bar of `width` cells that is filled up to `value`, with a mark at another value.
pub(crate) fn bar(value: u8, mark: Option<u8>, width: usize) -> Span<'static> {
    let cells = |value: u8, most: usize| (usize::from(value) * most + 127) / 255;
    let filled = cells(value, width);
    let mark = mark.map(|mark| cells(mark, width.saturating_sub(1)));
    let cell = |cell| match cell {
        _ if mark == Some(cell) => '┃',
        _ if cell < filled => '█',
        _ => ' ',
    };
    let bar: String = (0..width).map(cell).collect();
    bar.cyan().bg(Color::Indexed(236))
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

    #[test]
    fn a_bar_is_filled_up_to_the_value_and_marks_another() {
        for (value, mark, expected) in [
            (0, None, "          "),
            (255, None, "██████████"),
            (128, None, "█████     "),
            (140, None, "█████     "),
            (128, Some(0), "┃████     "),
            (128, Some(255), "█████    ┃"),
        ] {
            assert_eq!(bar(value, mark, 10).content, expected);
        }
        assert_eq!(bar(128, Some(128), 0).content, "");
    }
}
