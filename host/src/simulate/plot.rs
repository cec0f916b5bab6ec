//! Charts as SVG and PNG, the same in both. The font comes with the program.

use std::fs;
use std::path::Path;

use anyhow::{Context, anyhow};
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, EmptyElement, ErrorBar, PathElement, Rectangle, Text};
use plotters::prelude::{
    BitMapBackend, Cartesian2d, Circle, Color, DrawingArea, DrawingAreaErrorKind, DrawingBackend,
    IntoDrawingArea, IntoFont, RGBColor, SVGBackend, SeriesLabelPosition, ShapeStyle, TextStyle,
};
use plotters::series::LineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontStyle, WHITE, register_font};

/// Pixels.
const SIZE: (u32, u32) = (900, 540);

const FONT: &str = "sans-serif";

/// Colours that people with any colour vision can tell apart (Okabe and Ito).
pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const RED: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const YELLOW: RGBColor = RGBColor(230, 159, 0);
pub(super) const GREY: RGBColor = RGBColor(110, 110, 110);

/// One axis, from one value to another.
pub(super) struct Axis {
    pub(super) label: &'static str,
    pub(super) from: f64,
    pub(super) to: f64,
    /// Powers of ten are equally far apart.
    pub(super) is_logarithmic: bool,
}

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Line,
    Dashes,
    /// With the interval, if there is one.
    Dots,
    /// Beside the bars of the other series, with their values above.
    Bars,
}

pub(super) struct Series {
    pub(super) name: String,
    pub(super) colour: RGBColor,
    pub(super) mark: Mark,
    pub(super) values: Vec<Value>,
}

/// A value, and its interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) interval: Option<(f64, f64)>,
}

impl Value {
    pub(super) fn new(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            interval: None,
        }
    }
}

/// A part of the x axis with a name of its own.
pub(super) struct Band {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) name: &'static str,
    pub(super) colour: RGBColor,
}

/// A chart.
pub(super) struct Chart {
    pub(super) title: &'static str,
    /// What it was measured with.
    pub(super) subtitle: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
    pub(super) bands: Vec<Band>,
    /// Names of the places 0, 1, 2, ... of the x axis, if they have names instead of numbers.
    pub(super) places: Vec<String>,
    pub(super) legend: SeriesLabelPosition,
}

type Context2d<'a, DB> = ChartContext<'a, DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

impl Axis {
    /// Where a value is on it.
    fn place(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            // What is 0 lies below the axis.
            libm::log10(value.max(self.from / 10.0))
        } else {
            value
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.place(self.from)..self.place(self.to)
    }

    fn name(&self, place: f64) -> String {
        if !self.is_logarithmic {
            // Whole steps, without what rounding leaves of them.
            return ((place * 1e6).round() / 1e6 + 0.0).to_string();
        }
        if (place - place.round()).abs() > 1e-6 {
            return String::new();
        }
        let digits = format!("{place:.0}");
        let raised = digits.chars().filter_map(|digit| match digit {
            '-' => Some('⁻'),
            _ => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit.to_digit(10)? as usize),
        });
        format!("10{}", raised.collect::<String>())
    }

    /// How many labels there are.
    fn labels(&self) -> usize {
        let range = self.range();
        if self.is_logarithmic {
            super::occurrences::whole(range.end - range.start + 1.0)
                .try_into()
                .unwrap_or(10)
        } else {
            12
        }
    }
}

impl Chart {
    /// Writes `name.svg` and `name.png` to the directory.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(super) fn write(&self, directory: &Path, name: &str) -> anyhow::Result<()> {
        for style in [FontStyle::Normal, FontStyle::Bold] {
            let font = match style {
                FontStyle::Bold => dejavu::sans::bold(),
                _ => dejavu::sans::regular(),
            };
            register_font(FONT, style, font).map_err(|_| anyhow!("the font is broken"))?;
        }
        let path = directory.join(name).with_extension("svg");
        let mut text = String::new();
        self.draw(&SVGBackend::with_string(&mut text, SIZE).into_drawing_area())
            .with_context(|| format!("cannot draw {name}"))?;
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        let path = path.with_extension("png");
        self.draw(&BitMapBackend::new(&path, SIZE).into_drawing_area())
            .with_context(|| format!("cannot write {}", path.display()))
    }

    fn draw<DB: DrawingBackend>(&self, root: &DrawingArea<DB, Shift>) -> Drawn<DB> {
        root.fill(&WHITE)?;
        let title = (FONT, 22, FontStyle::Bold).into_font();
        root.draw(&Text::new(self.title, (20, 14), title))?;
        let subtitle = (FONT, 14).into_font().color(&GREY);
        root.draw(&Text::new(self.subtitle.as_str(), (20, 42), subtitle))?;
        let (_, area) = root.split_vertically(64);
        let mut chart = ChartBuilder::on(&area)
            .margin_right(24)
            .margin_top(14)
            .margin_left(8)
            .margin_bottom(6)
            .x_label_area_size(if self.places.is_empty() { 48 } else { 64 })
            .y_label_area_size(76)
            .build_cartesian_2d(self.x.range(), self.y.range())?;
        let x_name = |place: &f64| self.x.name(*place);
        let y_name = |place: &f64| self.y.name(*place);
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(self.x.label)
            .y_desc(self.y.label)
            .x_labels(self.x.labels())
            .y_labels(self.y.labels())
            .x_label_formatter(&x_name)
            .y_label_formatter(&y_name)
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 15))
            .bold_line_style(BLACK.mix(0.12))
            .light_line_style(BLACK.mix(0.0));
        if !self.places.is_empty() {
            mesh.disable_x_mesh().x_labels(0);
        }
        mesh.draw()?;
        self.draw_bands(&mut chart)?;
        self.draw_places(&mut chart)?;
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut chart, index, series)?;
        }
        if self.series.len() > 1 {
            chart
                .configure_series_labels()
                .position(self.legend.clone())
                .margin(12)
                .label_font((FONT, 14))
                .background_style(WHITE.mix(0.9))
                .border_style(BLACK.mix(0.3))
                .draw()?;
        }
        root.present()
    }

    fn draw_bands<DB: DrawingBackend>(&self, chart: &mut Context2d<'_, DB>) -> Drawn<DB> {
        let y = self.y.range();
        for band in &self.bands {
            let corners = [(band.from, y.start), (band.to, y.end)];
            let colour = band.colour.mix(0.13).filled();
            chart.draw_series([Rectangle::new(corners, colour)])?;
            let style = centred(14, band.colour);
            let middle = (f64::midpoint(band.from, band.to), y.end);
            chart.draw_series([EmptyElement::at(middle) + Text::new(band.name, (0, 4), style)])?;
        }
        Ok(())
    }

    fn draw_places<DB: DrawingBackend>(&self, chart: &mut Context2d<'_, DB>) -> Drawn<DB> {
        let bottom = self.y.range().start;
        for (place, name) in (0_u32..).zip(&self.places) {
            // A name may have two lines.
            for (line, part) in (0..).zip(name.split('\n')) {
                let at = EmptyElement::at((f64::from(place), bottom));
                let text = Text::new(part.to_owned(), (0, 6 + 17 * line), centred(14, BLACK));
                chart.draw_series([at + text])?;
            }
        }
        Ok(())
    }

    fn draw_series<DB: DrawingBackend>(
        &self,
        chart: &mut Context2d<'_, DB>,
        index: usize,
        series: &Series,
    ) -> Drawn<DB> {
        let colour = series.colour;
        let thick = ShapeStyle::from(&colour).stroke_width(2);
        let at = |value: &Value| (self.x.place(value.x), self.y.place(value.y));
        let points = series.values.iter().map(at);
        match series.mark {
            Mark::Line => {
                let line = LineSeries::new(points, thick);
                chart
                    .draw_series(line)?
                    .label(&series.name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], thick));
            }
            Mark::Dashes => {
                let line = DashedPathElement::new(points, 6, 4, thick);
                chart
                    .draw_series([line])?
                    .label(&series.name)
                    .legend(move |(x, y)| {
                        DashedPathElement::new([(x, y), (x + 18, y)], 5, 3, thick)
                    });
            }
            Mark::Dots => {
                chart.draw_series(series.values.iter().filter_map(|value| {
                    let (low, high) = value.interval?;
                    let (x, y) = at(value);
                    let (low, high) = (self.y.place(low), self.y.place(high));
                    Some(ErrorBar::new_vertical(x, low, y, high, colour, 8))
                }))?;
                chart
                    .draw_series(points.map(|point| Circle::new(point, 4, colour.filled())))?
                    .label(&series.name)
                    .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
            }
            Mark::Bars => self.draw_bars(chart, index, series)?,
        }
        Ok(())
    }

    fn draw_bars<DB: DrawingBackend>(
        &self,
        chart: &mut Context2d<'_, DB>,
        index: usize,
        series: &Series,
    ) -> Drawn<DB> {
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        let (index, count) = (index as f64, self.series.len() as f64);
        let width = 0.8 / count;
        let colour = series.colour;
        let bottom = self.y.range().start;
        let left = |value: &Value| value.x - 0.4 + index * width;
        let bars = series.values.iter().map(|value| {
            let from = (left(value) + 0.04 * width, bottom);
            let to = (
                left(value) + 0.96 * width,
                self.y.place(value.y).max(bottom),
            );
            Rectangle::new([from, to], colour.mix(0.85).filled())
        });
        chart
            .draw_series(bars)?
            .label(&series.name)
            .legend(move |(x, y)| {
                Rectangle::new([(x + 2, y - 6), (x + 16, y + 6)], colour.filled())
            });
        for value in &series.values {
            let top = (left(value) + width / 2.0, self.y.place(value.y).max(bottom));
            let text = Text::new(short(value.y), (0, -18), centred(13, colour));
            chart.draw_series([EmptyElement::at(top) + text])?;
        }
        Ok(())
    }
}

/// Three digits.
fn short(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        0.01..10.0 => format!("{value:.2}"),
        10.0.. => format!("{value:.1}"),
        _ => format!("{value:.0e}"),
    }
}

fn centred(size: u32, colour: RGBColor) -> TextStyle<'static> {
    (FONT, size)
        .into_font()
        .color(&colour)
        .pos(Pos::new(HPos::Center, VPos::Top))
}
