//! Draws charts as SVG, for light and dark pages.

use std::fs;
use std::path::Path;

use anyhow::Result;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, EmptyElement, ErrorBar, PathElement, Rectangle, Text};
use plotters::prelude::{
    Cartesian2d, Color, DrawingArea, IntoDrawingArea, RGBColor, SVGBackend, TextStyle,
};
use plotters::series::LineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, FontDesc, FontFamily, FontStyle, WHITE};
use serde::Deserialize;
use serde_json::{Map, Value};

/// The size of a chart in pixels. Charts are narrow, so that words can be read on a telephone.
const SIZE: (u32, u32) = (640, 440);

/// Returns the colour with this name. People with any colour vision can distinguish these colours (Okabe and Ito).
/// The colours of the two receivers have no other meaning in any figure.
fn colour(name: &str) -> RGBColor {
    match name {
        "framelock" => RGBColor(0, 114, 178),
        "lecture" => RGBColor(213, 94, 0),
        "green" => RGBColor(0, 158, 115),
        "purple" => RGBColor(204, 121, 167),
        "black" => BLACK,
        _ => RGBColor(110, 110, 110),
    }
}

/// An axis, from one value to another.
#[derive(Deserialize)]
pub(crate) struct Axis {
    pub(crate) label: String,
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Whether the axis is logarithmic.
    #[serde(default)]
    pub(crate) is_logarithmic: bool,
    /// The label at the start of a logarithmic axis, if zero is drawn there.
    zero: Option<String>,
    /// Whether the series is a step function, with each step midway between two values.
    #[serde(default)]
    is_stepped: bool,
    /// The maximum number of labels on the axis.
    labels: usize,
    /// The path of the values in a row of results. The chart multiplies these values by `scale`, if there is one.
    pub(crate) value: String,
    pub(crate) scale: Option<f64>,
}

/// The style of a series.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Mark {
    Line,
    Dashes,
    /// Dots with their confidence intervals.
    Dots,
    /// Bars, each with its value above it, next to the bars of the other series.
    Bars,
}

#[derive(Deserialize)]
pub(crate) struct Series {
    colour: String,
    mark: Mark,
    /// The path of the values in a row of results, if it differs from the axis's path.
    pub(crate) value: Option<String>,
    /// Selects the rows of this series: a row must have each of these keys with the value given here.
    #[serde(flatten)]
    pub(crate) select: Map<String, Value>,
    #[serde(skip)]
    pub(crate) places: Vec<Place>,
}

/// A label in the chart. If it has a colour, a short line of this colour precedes its text.
#[derive(Deserialize)]
struct Label {
    at: (f64, f64),
    text: String,
    colour: Option<String>,
    #[serde(default)]
    is_dashed: bool,
}

/// A point in the chart, and the confidence interval of its value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// A named part of the x axis. Its name is at the upper or the lower end of the chart.
#[derive(Clone)]
pub(crate) struct Band {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) name: String,
    pub(crate) is_shaded: bool,
}

/// A chart.
#[derive(Deserialize)]
pub(crate) struct Chart {
    title: String,
    /// The parameters of the measurement.
    pub(crate) subtitle: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    labels: Vec<Label>,
    #[serde(skip)]
    pub(crate) bands: Vec<Band>,
    /// If the x axis has names instead of numbers, the names of the values 0, 1, 2 and so on.
    #[serde(default)]
    places: Vec<String>,
}

type Coordinates = Cartesian2d<RangedCoordf64, RangedCoordf64>;
type Drawing<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Coordinates>;
type Page<'b> = DrawingArea<SVGBackend<'b>, Shift>;

impl Place {
    pub(crate) fn new(x: f64, y: f64) -> Self {
        let (low, high) = (y, y);
        Self { x, y, low, high }
    }
}

impl Axis {
    /// Returns the position of a value on the axis. On a logarithmic axis, 0 is at the start.
    fn place(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            value.max(self.from).log10()
        } else {
            value
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.place(self.from)..self.place(self.to)
    }

    fn name(&self, place: f64) -> String {
        // Remove rounding errors.
        let place = (place * 1e6).round() / 1e6 + 0.0;
        match &self.zero {
            Some(zero) if place <= self.range().start => zero.clone(),
            _ if !self.is_logarithmic => place.to_string(),
            _ if place.fract() != 0.0 => String::new(),
            _ if (0.0..=5.0).contains(&place) => 10_f64.powf(place).to_string(),
            _ => {
                let digits = place.to_string();
                let raised = digits.chars().filter_map(|digit| match digit.to_digit(10) {
                    Some(value) => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(value as usize),
                    None => Some('⁻'),
                });
                format!("10{}", raised.collect::<String>())
            }
        }
    }
}

impl Chart {
    /// Writes the chart as SVG.
    pub(crate) fn write(&self, path: &Path) -> Result<()> {
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, SIZE).into_drawing_area())?;
        // On dark pages, the style replaces the colours.
        let style = concat!(">\n", include_str!("figures.css"));
        Ok(fs::write(path, svg.replacen('>', style, 1))?)
    }

    fn draw(&self, page: &Page) -> Result<()> {
        page.fill(&WHITE)?;
        let title = font(20.0).style(FontStyle::Bold);
        page.draw(&Text::new(self.title.as_str(), (16, 12), title))?;
        let mut top = 40;
        for line in self.subtitle.lines() {
            let style = font(14.0).color(&colour("grey"));
            page.draw(&Text::new(line.to_owned(), (16, top), style))?;
            top += 18;
        }
        let (_, area) = page.split_vertically(top);
        let mut chart = ChartBuilder::on(&area)
            .margin_right(24)
            // Leave room for the value above a bar of full height.
            .margin_top(22)
            .margin_left(6)
            .margin_bottom(4)
            .x_label_area_size(if self.places.is_empty() { 46 } else { 62 })
            .y_label_area_size(66)
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
            .label_style(font(15.0))
            .axis_desc_style(font(15.0))
            .bold_line_style(BLACK.mix(0.12))
            .max_light_lines(0);
        if !self.places.is_empty() {
            mesh.disable_x_mesh().x_labels(0);
        }
        mesh.draw()?;
        self.draw_names(&mut chart)?;
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut chart, index, series)?;
        }
        for label in &self.labels {
            let (x, y) = (self.x.place(label.at.0), self.y.place(label.at.1));
            label.draw(page, chart.backend_coord(&(x, y)))?;
        }
        page.present()?;
        Ok(())
    }

    /// Draws the bands and the names of the values.
    fn draw_names(&self, chart: &mut Drawing) -> Result<()> {
        let y = self.y.range();
        for band in &self.bands {
            let (middle, grey) = (f64::midpoint(band.from, band.to), colour("grey"));
            let (at, from_end) = if band.is_shaded {
                let corners = [(band.from, y.start), (band.to, y.end)];
                chart.draw_series([Rectangle::new(corners, grey.mix(0.18).filled())])?;
                (y.end, 6)
            } else {
                for x in [band.from, band.to] {
                    let ends = [0.1, 0.55].map(|part| (x, y.start + part * (y.end - y.start)));
                    chart.draw_series([DashedPathElement::new(
                        ends,
                        2,
                        3,
                        grey.stroke_width(1),
                    )])?;
                }
                (y.start, -20)
            };
            let text = Text::new(band.name.clone(), (0, from_end), centred(14.0));
            chart.draw_series([EmptyElement::at((middle, at)) + text])?;
        }
        for (place, name) in (0_u32..).zip(&self.places) {
            for (line, part) in (0..).zip(name.lines()) {
                let at = EmptyElement::at((f64::from(place), y.start));
                let text = Text::new(part.to_owned(), (0, 6 + 17 * line), centred(14.0));
                chart.draw_series([at + text])?;
            }
        }
        Ok(())
    }

    fn draw_series(&self, chart: &mut Drawing, index: usize, series: &Series) -> Result<()> {
        let colour = colour(&series.colour);
        let thick = colour.stroke_width(3);
        let values = || series.places.iter();
        let points = values().map(|value| (self.x.place(value.x), self.y.place(value.y)));
        let mut points: Vec<_> = points.collect();
        if self.x.is_stepped {
            let pairs = points.iter().zip(points.iter().skip(1));
            let steps = pairs.flat_map(|(from, to)| {
                let middle = f64::midpoint(from.0, to.0);
                [*from, (middle, from.1), (middle, to.1), *to]
            });
            points = steps.collect();
        }
        match series.mark {
            Mark::Line => {
                chart.draw_series(LineSeries::new(points, thick))?;
            }
            Mark::Dashes => {
                chart.draw_series([DashedPathElement::new(points, 6, 4, thick)])?;
            }
            Mark::Dots => {
                chart.draw_series(values().map(|value| {
                    let [low, y, high] = [value.low, value.y, value.high].map(|y| self.y.place(y));
                    let style = colour.filled();
                    ErrorBar::new_vertical(self.x.place(value.x), low, y, high, style, 8)
                }))?;
            }
            Mark::Bars => {
                #[expect(clippy::cast_precision_loss, reason = "a few")]
                let (index, width) = (index as f64, 0.7 / self.series.len() as f64);
                let bottom = self.y.range().start;
                for value in values() {
                    let left = value.x - 0.35 + index * width;
                    let (right, top) = (left + 0.94 * width, self.y.place(value.y));
                    let text = (value.y * 100.0).round() / 100.0;
                    let text = Text::new(text.to_string(), (0, -20), centred(15.0));
                    chart.draw_series([EmptyElement::at((left + width / 2.0, top)) + text])?;
                    let bar = Rectangle::new([(left, bottom), (right, top)], colour.filled());
                    chart.draw_series([bar])?;
                    // A bar of zero must be visible too.
                    let foot = PathElement::new([(left, bottom), (right, bottom)], thick);
                    chart.draw_series([foot])?;
                }
            }
        }
        Ok(())
    }
}

impl Label {
    fn draw(&self, page: &Page, (mut x, y): (i32, i32)) -> Result<()> {
        if let Some(name) = &self.colour {
            let dash = if self.is_dashed { 6 } else { 24 };
            let style = colour(name).stroke_width(4);
            page.draw(&DashedPathElement::new(
                [(x, y), (x + 24, y)],
                dash,
                4,
                style,
            ))?;
            x += 30;
        }
        let style = TextStyle::from(font(15.0)).pos(Pos::new(HPos::Left, VPos::Center));
        page.draw(&Text::new(self.text.as_str(), (x, y), style))?;
        Ok(())
    }
}

/// Returns a font with this size in pixels. The drawing library divides a font's size by 1.24, so this function
/// multiplies the size by 1.24.
fn font(pixels: f64) -> FontDesc<'static> {
    FontDesc::new(FontFamily::SansSerif, pixels * 1.24, FontStyle::Normal)
}

fn centred(pixels: f64) -> TextStyle<'static> {
    TextStyle::from(font(pixels)).pos(Pos::new(HPos::Center, VPos::Top))
}
