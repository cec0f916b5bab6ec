//! Draws the live view of `framelock demo` as a moving picture, `docs/demo.svg`. A browser plays this SVG without a
//! script. `cargo run --example demo_picture` writes the file.
//!
//! A terminal recorder would store the times at which the output arrives. Two recordings would then differ, and no test
//! could check that the committed picture shows the current view. Also, a picture by the recorder termtosvg needs 450
//! KB for six seconds. This picture needs 140 KB for ten seconds, follows the reader's dark or light theme, and stands
//! still for readers who want no motion.
//!
//! A cell that does not change over several drawings is written once. All cells that are visible in the same drawings
//! form one group. The group's CSS classes state the first of these drawings and the number of these drawings.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::fs;
use std::time::Duration;

use anyhow::{Context, Result};
use framelock_host::demo::{BLUE, EIGHTHS, VERMILLION, drawings};
use ratatui::buffer::Cell;
use ratatui::style::{Color, Modifier};

const COLUMNS: u16 = 80;
const ROWS: u16 = 23;

/// The number of drawings, and the time between two drawings. There are a hundred drawings, so each drawing is visible
/// for one per cent of the time.
const DRAWINGS: usize = 100;
const STEP: Duration = Duration::from_millis(100);

/// The drawing for readers who want no motion.
const STILL: usize = 70;

/// The width and height of a cell, and the margin around all cells, in pixels.
const WIDTH: u16 = 10;
const HEIGHT: u16 = 21;
const MARGIN: u16 = 12;

const HEAD: &str = "\
<title>After one lost byte the lecture's machine is deaf; framelock goes on</title>
<style>
text{font:16.6px ui-monospace,SFMono-Regular,Menlo,Consolas,'DejaVu Sans Mono',monospace}
rect{shape-rendering:crispEdges}.bold{font-weight:bold}.dim{opacity:.75}
.paper{fill:#fff}.ink{fill:#1f2328}.blue{fill:#0072b2}.vermillion{fill:#c04e00}
.bar{fill:#56b4e9}.mark{fill:#1f2328}.track{fill:#d8dee4}
@media(prefers-color-scheme:dark){
.paper{fill:#0d1117}.ink{fill:#e6edf3}.blue{fill:#56b4e9}.vermillion{fill:#ff8c42}
.bar{fill:#0072b2}.mark{fill:#f0e442}.track{fill:#30363d}}
.part{visibility:hidden;animation:10s step-end infinite}.still{visibility:visible}
@media(prefers-reduced-motion:reduce){.part{animation:none!important}}
";

const fn class(color: Color) -> &'static str {
    match color {
        Color::White => "paper",
        BLUE => "blue",
        VERMILLION => "vermillion",
        Color::Cyan => "bar",
        Color::Yellow => "mark",
        Color::Indexed(_) => "track",
        _ => "ink",
    }
}

/// The drawings in which a cell keeps its content: the index of the first such drawing, and the index after the last
/// such drawing.
type Seen = (usize, usize);

/// The content of a group: its bars and its texts. `texts` is keyed by a row and a set of CSS classes. Each entry holds
/// the symbols of this row that have these classes, together with their columns.
#[derive(Default)]
struct Group {
    bars: String,
    texts: BTreeMap<(u16, String), Vec<(u16, String)>>,
}

/// The path of the picture, which the README shows.
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/demo.svg");

fn main() -> Result<()> {
    fs::write(FILE, picture()?).with_context(|| format!("cannot write {FILE}"))
}

/// Draws the first ten seconds of the demonstration.
fn picture() -> Result<String> {
    let drawings = drawings((COLUMNS, ROWS), STEP, DRAWINGS)?;
    let mut groups: BTreeMap<Seen, Group> = BTreeMap::new();
    let places = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (column, row)));
    for place in places {
        let cells = drawings.iter().filter_map(|drawing| drawing.cell(place));
        let cells: Vec<&Cell> = cells.collect();
        let mut from = 0;
        for same in cells.chunk_by(|before, after| before == after) {
            let until = from + same.len();
            if let Some(cell) = same.first() {
                groups.entry((from, until)).or_default().add(place, cell)?;
            }
            from = until;
        }
    }
    Ok(svg(&groups)?)
}

impl Group {
    fn add(&mut self, (column, row): (u16, u16), cell: &Cell) -> fmt::Result {
        let has = |modifier| cell.modifier.contains(modifier);
        let is_reversed = has(Modifier::REVERSED);
        let normal = [cell.fg, cell.bg];
        let [ink, paper] = if is_reversed {
            [Color::White, cell.fg]
        } else {
            normal
        };
        let (x, y) = (MARGIN + column * WIDTH, MARGIN + row * HEIGHT);
        let mut bar = |width, color| {
            if width == 0 {
                return Ok(());
            }
            let (y, height, class) = (y + 1, HEIGHT - 2, class(color));
            let rect = format_args!("width='{width}' height='{height}' class='{class}'");
            writeln!(self.bars, "<rect x='{x}' y='{y}' {rect}/>")
        };
        if is_reversed || paper != Color::Reset {
            bar(WIDTH, paper)?;
        }
        // A blank is the first of the [`EIGHTHS`], so it draws a bar of width zero.
        let symbol = cell.symbol();
        let mut parts = (0..).zip(EIGHTHS);
        if let Some((eighths, _)) = parts.find(|(_, part)| symbol.starts_with(*part)) {
            return bar(eighths * WIDTH / 8, ink);
        }
        let bold = if has(Modifier::BOLD) { " bold" } else { "" };
        let dim = if has(Modifier::DIM) { " dim" } else { "" };
        let classes = format!("{}{bold}{dim}", class(ink));
        let symbol = symbol.replace('&', "&amp;").replace('<', "&lt;");
        let text = self.texts.entry((row, classes)).or_default();
        text.push((column, symbol));
        Ok(())
    }

    /// Writes each word separately. Sets the word's width to the width of its cells, so that the width does not depend
    /// on the font.
    fn write_texts(&self, svg: &mut String) -> fmt::Result {
        for ((row, classes), text) in &self.texts {
            for word in text.chunk_by(|(before, _), (after, _)| before + 1 == *after) {
                let (column, length) = (word.first().map_or(0, |(column, _)| *column), word.len());
                let (x, y) = (MARGIN + column * WIDTH, MARGIN + row * HEIGHT + 16);
                let width = length * usize::from(WIDTH);
                let word: String = word.iter().map(|(_, symbol)| symbol.as_str()).collect();
                writeln!(
                    svg,
                    "<text x='{x}' y='{y}' class='{classes}' textLength='{width}'>{word}</text>"
                )?;
            }
        }
        Ok(())
    }
}

fn svg(groups: &BTreeMap<Seen, Group>) -> Result<String, fmt::Error> {
    let [width, height] = [COLUMNS * WIDTH, ROWS * HEIGHT].map(|length| length + 2 * MARGIN);
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' role='img'>\n{HEAD}"
    );
    for number in 0..DRAWINGS {
        write!(
            svg,
            "@keyframes n{number}{{0%{{visibility:visible}}{number}%{{visibility:hidden}}}}"
        )?;
        // Start a millisecond later, so that no animation starts exactly when one drawing replaces another.
        let begin = STEP.as_millis() * (DRAWINGS - number) as u128 + 1;
        writeln!(
            svg,
            ".n{number}{{animation-name:n{number}}}.f{number}{{animation-delay:-{begin}ms}}"
        )?;
    }
    svg.push_str("</style>\n<rect width='100%' height='100%' rx='10' class='paper'/>\n");
    for (&(from, until), group) in groups {
        let part = if until - from < DRAWINGS { "part" } else { "" };
        let still = if (from..until).contains(&STILL) {
            "still"
        } else {
            ""
        };
        let (count, bars) = (until - from, &group.bars);
        write!(svg, "<g class='{part} f{from} n{count} {still}'>\n{bars}")?;
        group.write_texts(&mut svg)?;
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn the_committed_picture_is_of_the_current_view() {
        let committed = fs::read_to_string(FILE).unwrap();
        assert!(
            picture().unwrap().lines().eq(committed.lines()),
            "it is old"
        );
        assert!(committed.len() < 250_000);
    }
}
