//! Charts as SVG.

use std::path::Path;

use anyhow::Result;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, EmptyElement, ErrorBar, PathElement, Rectangle, Text};
use plotters::prelude::{
    Cartesian2d, Circle, Color, IntoDrawingArea, IntoFont, RGBColor, SVGBackend,
    SeriesLabelPosition, ShapeStyle, TextStyle,
};
use plotters::series::LineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontStyle, WHITE};
use serde::Deserialize;
use serde_json::{Map, Value};

/// Pixels.
const SIZE: (u32, u32) = (900, 540);

const FONT: &str = "sans-serif";

/// Colours that people with any colour vision can tell apart (Okabe and Ito).
fn colour(name: &str) -> RGBColor {
    match name {
        "blue" | "approach" => RGBColor(0, 114, 178),
        "red" | "ramp" => RGBColor(213, 94, 0),
        "green" => RGBColor(0, 158, 115),
        "yellow" | "hold" => RGBColor(230, 159, 0),
        _ => RGBColor(110, 110, 110),
    }
}

/// One axis, from one value to another.
#[derive(Deserialize)]
pub(super) struct Axis {
    pub(super) label: String,
    from: f64,
    to: f64,
    /// Powers of ten are equally far apart.
    #[serde(default)]
    pub(super) is_logarithmic: bool,
    /// At most this many labels.
    labels: usize,
    /// Where in a row of results its values are, and by how much they are multiplied.
    pub(super) value: String,
    pub(super) scale: Option<f64>,
}

/// How a series is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Mark {
    Line,
    Dashes,
    /// With the interval.
    Dots,
    /// Beside the bars of the other series, with their values above.
    Bars,
}

#[derive(Deserialize)]
pub(super) struct Series {
    name: String,
    colour: String,
    mark: Mark,
    /// Where in a row its values are, if not where the axis says.
    pub(super) value: Option<String>,
    /// The values that a row must have to be of this series.
    #[serde(flatten)]
    pub(super) select: Map<String, Value>,
    #[serde(skip)]
    pub(super) places: Vec<Place>,
}

/// A place in the chart, and the interval of its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// A part of the x axis with a name of its own.
pub(super) struct Band {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) name: &'static str,
}

/// A chart.
#[derive(Deserialize)]
pub(super) struct Chart {
    title: String,
    /// What it was measured with.
    pub(super) subtitle: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    legend: String,
    pub(super) series: Vec<Series>,
    #[serde(skip)]
    pub(super) bands: Vec<Band>,
    /// Names of the places 0, 1, 2, ... of the x axis, if they have names instead of numbers.
    #[serde(default)]
    places: Vec<String>,
}

type Coordinates = Cartesian2d<RangedCoordf64, RangedCoordf64>;
type Drawing<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Coordinates>;

impl Place {
    pub(super) fn new(x: f64, y: f64) -> Self {
        let (low, high) = (y, y);
        Self { x, y, low, high }
    }
}

impl Axis {
    /// Where a value is on it.
    fn place(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            // What is 0 lies below the axis.
            value.max(self.from / 10.0).log10()
        } else {
            value
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.place(self.from)..self.place(self.to)
    }

    fn name(&self, place: f64) -> String {
        // Without what rounding leaves.
        let place = (place * 1e6).round() / 1e6 + 0.0;
        match self.is_logarithmic {
            false => place.to_string(),
            true if place.fract() == 0.0 => format!("1e{place}"),
            true => String::new(),
        }
    }
}

impl Chart {
    /// Writes the chart as SVG.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&self, path: &Path) -> Result<()> {
        let root = SVGBackend::new(path, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let title = (FONT, 22, FontStyle::Bold).into_font();
        root.draw(&Text::new(self.title.as_str(), (20, 14), title))?;
        let subtitle = (FONT, 14).into_font().color(&colour("grey"));
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
        mesh.x_desc(self.x.label.as_str())
            .y_desc(self.y.label.as_str())
            .x_labels(self.x.labels)
            .y_labels(self.y.labels)
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
        self.draw_names(&mut chart)?;
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut chart, index, series)?;
        }
        let legend = match self.legend.as_str() {
            "upper-left" => SeriesLabelPosition::UpperLeft,
            "lower-middle" => SeriesLabelPosition::LowerMiddle,
            "lower-right" => SeriesLabelPosition::LowerRight,
            _ => SeriesLabelPosition::UpperRight,
        };
        chart
            .configure_series_labels()
            .position(legend)
            .margin(12)
            .label_font((FONT, 14))
            .background_style(WHITE.mix(0.9))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        root.present()?;
        Ok(())
    }

    /// The bands, and the names of the places.
    fn draw_names(&self, chart: &mut Drawing) -> Result<()> {
        let y = self.y.range();
        for band in &self.bands {
            let corners = [(band.from, y.start), (band.to, y.end)];
            let colour = colour(band.name);
            chart.draw_series([Rectangle::new(corners, colour.mix(0.13).filled())])?;
            let middle = f64::midpoint(band.from, band.to);
            let text = Text::new(band.name, (0, 4), centred(14, colour));
            chart.draw_series([EmptyElement::at((middle, y.end)) + text])?;
        }
        for (place, name) in (0_u32..).zip(&self.places) {
            // A name may have two lines.
            for (line, part) in (0..).zip(name.split('\n')) {
                let at = EmptyElement::at((f64::from(place), y.start));
                let text = Text::new(part.to_owned(), (0, 6 + 17 * line), centred(14, BLACK));
                chart.draw_series([at + text])?;
            }
        }
        Ok(())
    }

    fn draw_series(&self, chart: &mut Drawing, index: usize, series: &Series) -> Result<()> {
        let colour = colour(&series.colour);
        let thick = ShapeStyle::from(&colour).stroke_width(2);
        let values = || series.places.iter();
        let points = values().map(|value| (self.x.place(value.x), self.y.place(value.y)));
        let drawn = match series.mark {
            Mark::Line => {
                let line = chart.draw_series(LineSeries::new(points, thick))?;
                line.legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], thick))
            }
            Mark::Dashes => {
                let line = chart.draw_series([DashedPathElement::new(points, 6, 4, thick)])?;
                line.legend(move |(x, y)| {
                    DashedPathElement::new([(x, y), (x + 18, y)], 5, 3, thick)
                })
            }
            Mark::Dots => {
                let dots = chart.draw_series(values().map(|value| {
                    let [low, y, high] = [value.low, value.y, value.high].map(|y| self.y.place(y));
                    let style = colour.filled();
                    ErrorBar::new_vertical(self.x.place(value.x), low, y, high, style, 8)
                }))?;
                dots.legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()))
            }
            Mark::Bars => {
                #[expect(clippy::cast_precision_loss, reason = "a few")]
                let (index, width) = (index as f64, 0.8 / self.series.len() as f64);
                let bottom = self.y.range().start;
                let left = |value: &Place| value.x - 0.4 + index * width;
                let top = |value: &Place| self.y.place(value.y).max(bottom);
                chart.draw_series(values().map(|value| {
                    let at = (left(value) + width / 2.0, top(value));
                    let decimals = if value.y < 10.0 { 2 } else { 1 };
                    let text = format!("{:.decimals$}", value.y);
                    let text = Text::new(text, (0, -18), centred(13, colour));
                    EmptyElement::at(at) + text
                }))?;
                let bars = chart.draw_series(values().map(|value| {
                    let from = (left(value) + 0.04 * width, bottom);
                    let to = (left(value) + 0.96 * width, top(value));
                    Rectangle::new([from, to], colour.mix(0.85).filled())
                }))?;
                bars.legend(move |(x, y)| {
                    Rectangle::new([(x + 2, y - 6), (x + 16, y + 6)], colour.filled())
                })
            }
        };
        drawn.label(&series.name);
        Ok(())
    }
}

fn centred(size: u32, colour: RGBColor) -> TextStyle<'static> {
    (FONT, size)
        .into_font()
        .color(&colour)
        .pos(Pos::new(HPos::Center, VPos::Top))
}
