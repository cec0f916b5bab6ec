//! What live views are made of: bars, counts and phases.

use framelock::motion::Phase;
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};

/// The colour of what is well. With [`VERMILLION`] it is a pair that colour-blind people tell apart, chosen by Okabe and Ito,
/// on light and on dark; each is the nearest of the 256 colours that every terminal has.
pub const BLUE: Color = Color::Indexed(32);
/// The colour of what is not well.
pub const VERMILLION: Color = Color::Indexed(166);

/// Eighths of a cell, from none to all.
pub const EIGHTHS: [char; 9] = [' ', '▏', '▎', '▍', '▌', '▋', '▊', '▉', '█'];

/// A bar of `width` cells for the output; a mark stands where the axis was sent.
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

/// The rows of a terminal that are not given to anything yet.
pub(crate) struct RowsLeft(u16);

impl RowsLeft {
    /// Those of `height` that are not `taken`.
    pub(crate) fn new(height: u16, taken: u16) -> Self {
        Self(height.saturating_sub(taken))
    }

    /// That many rows if there are as many, else none.
    pub(crate) fn exactly(&mut self, height: u16) -> u16 {
        let granted = if self.0 < height { 0 } else { height };
        self.0 -= granted;
        granted
    }

    /// All that are left if there are at least that many, else none.
    pub(crate) fn all_of(self, least: u16) -> u16 {
        if self.0 < least { 0 } else { self.0 }
    }
}

/// A count to which something happened, if it is not zero.
pub(crate) fn emphasised(count: u64, color: Color) -> Span<'static> {
    let span = Span::from(format!("{count:<5}"));
    if count > 0 {
        span.fg(color).bold()
    } else {
        span
    }
}

/// How a phase is shown.
pub(crate) fn phase_style(phase: Phase) -> Style {
    let color = match phase {
        Phase::Live | Phase::Approach => BLUE,
        _ => VERMILLION,
    };
    Style::new().fg(color).bold()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(output: u8, sent: Option<u8>) -> String {
        bar(output, sent, 10).to_string()
    }

    #[test]
    fn the_bar_is_as_long_as_the_output_and_the_mark_where_it_was_sent() {
        assert_eq!(text(0, None), "          ");
        assert_eq!(text(255, None), "██████████");
        assert_eq!(text(128, None), "█████     ");
        assert_eq!(text(140, None), "█████▍    ");
        assert_eq!(text(128, Some(0)), "┃████     ");
        assert_eq!(text(128, Some(255)), "█████    ┃");
        assert_eq!(bar(128, Some(128), 0).to_string(), "");
    }
}
