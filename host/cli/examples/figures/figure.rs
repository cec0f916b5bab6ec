//! The figures of the report. `figures.json` has, for each figure, the options of `framelock simulate`
//! and the chart.

use std::time::Duration;

use anyhow::{Context, Result};
use framelock::motion::{Phase, Setpoint};
use framelock_host::simulate::{Point, parameters, rows, run_all};
use framelock_simulation::{Event, FrameFormat, Parameters, run, theory};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::plot::{Axis, Band, Chart, Place, Series};

/// A figure: its simulations, and its chart, which does not contain values yet.
#[derive(Deserialize)]
pub(crate) struct Figure {
    pub(crate) name: String,
    runs: Vec<String>,
    /// Whether the figure shows the outputs during a single trial, instead of the results of many trials.
    #[serde(default)]
    is_watched: bool,
    chart: Chart,
}

/// All figures.
pub(crate) fn all() -> Result<Vec<Figure>> {
    serde_json::from_str(include_str!("figures.json")).context("the figures' file")
}

impl Figure {
    /// Runs the simulations with `effort` per cent of the trials, and draws the figure.
    pub(crate) fn measure(mut self, seed: u64, effort: u32) -> Result<(Vec<Point>, Chart)> {
        let mut runs = Vec::new();
        let mut all = Vec::new();
        for (number, options) in self.runs.iter().enumerate() {
            for point in parameters(options)? {
                runs.push(number);
                // At least two trials are needed, since a single trial has no confidence interval.
                let trials = (point.trials.saturating_mul(effort) / 100).max(2.min(point.trials));
                all.push(Parameters {
                    seed,
                    trials,
                    ..point
                });
            }
        }
        let points = run_all(all)?;
        let first = points.first().context("a figure without runs")?;
        let rows: Vec<_> = if self.is_watched {
            self.looks(first)?
        } else {
            let runs = runs.into_iter().zip(&points);
            runs.flat_map(|(run, point)| rows_of_run(run, point))
                .collect()
        };
        let chart = &mut self.chart;
        for series in &mut chart.series {
            series.places = match series.select.get("theory").and_then(Value::as_str) {
                Some("bin") => expected(FrameFormat::Bin),
                Some(_) => expected(FrameFormat::BinCrc8),
                None => measured(series, &rows, &chart.x, &chart.y),
            };
        }
        for (name, value) in [
            ("{trials}", first.parameters.trials.to_string()),
            ("{frames}", first.tally.line.frames_sent.to_string()),
            ("{hours}", format!("{:.1}", hours(first))),
            ("{seed}", seed.to_string()),
        ] {
            chart.subtitle = chart.subtitle.replace(name, &value);
        }
        Ok((points, self.chart))
    }

    /// Returns the sent setpoint and the failsafe's output at each poll of the failsafe.
    fn looks(&mut self, point: &Point) -> Result<Vec<Value>> {
        let trial = run(&point.parameters, 0, true)?;
        let looks = trial.events.iter().flatten().filter_map(|event| {
            let Event::Look {
                microseconds,
                demand,
                outputs,
            } = event
            else {
                return None;
            };
            let at = Duration::from_micros(*microseconds).as_secs_f64();
            Some((at, demand, outputs.get(2)?))
        });
        let looks: Vec<_> = looks.collect();
        let burst_at = point.parameters.burst_at.unwrap_or_default();
        let burst_length = point.parameters.burst_length / 1e3;
        let bands = &mut self.chart.bands;
        bands.push(Band {
            from: burst_at,
            to: burst_at + burst_length,
            name: "noise on the line".to_owned(),
            is_shaded: true,
        });
        for of_phase in looks.chunk_by(|(.., before), (.., after)| before.phase == after.phase) {
            if let [(from, .., output), .., (to, ..)] = *of_phase
                && output.phase != Phase::Live
                && to - from > 0.05
            {
                bands.push(Band {
                    from,
                    to,
                    name: output.phase.to_string(),
                    is_shaded: false,
                });
            }
        }
        let rows = looks.iter().map(|(at, demand, output)| {
            json!({ "seconds": at, "demand": demand, "output": Setpoint::from(output.axes) })
        });
        Ok(rows.collect())
    }
}

fn rows_of_run(run: usize, point: &Point) -> Vec<Value> {
    let mut rows = rows(point);
    for row in &mut rows {
        let engagements = row.pointer("/receiver/failsafe_engagements");
        let engagements = engagements.and_then(Value::as_f64);
        row["run"] = run.into();
        row["engagements_an_hour"] = engagements.map(|count| count / hours(point)).into();
    }
    rows
}

/// Returns the sender's total sending time in all trials, in hours.
#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn hours(point: &Point) -> f64 {
    point.tally.line.frames_sent as f64 / point.parameters.rate / 3_600.0
}

/// Returns the theoretical share of wrong setpoints at twenty bit error rates per decade.
fn expected(format: FrameFormat) -> Vec<Place> {
    let places = (-100..=-30).map(|step| {
        let flip = 10_f64.powf(f64::from(step) / 20.0);
        Place::new(flip, theory::wrong_setpoint(format, flip))
    });
    places.filter(|place| place.y > 1e-8).collect()
}

/// Computes the points of a series from the rows that the series selects. On a logarithmic y axis, the series ends with
/// its first zero.
fn measured(series: &Series, rows: &[Value], x: &Axis, y: &Axis) -> Vec<Place> {
    let pointer = series.value.as_ref().unwrap_or(&y.value);
    let is_selected = |row: &&Value| {
        let mut wanted = series.select.iter();
        wanted.all(|(name, value)| row.get(name) == Some(value))
    };
    let number = |row: &Value, pointer: &str| row.pointer(pointer).and_then(Value::as_f64);
    let places = rows.iter().filter(is_selected).flat_map(|row| {
        if let Some(back) = row.pointer(pointer).filter(|value| value.is_object()) {
            return shares_by_frames_lost(back, x.to);
        }
        let place = number(row, &x.value)
            .zip(number(row, pointer))
            .map(|(x, value)| {
                let end = |name| number(row, &pointer.replace("/value", name)).unwrap_or(value);
                let [y, low, high] =
                    [value, end("/low"), end("/high")].map(|value| value * y.scale.unwrap_or(1.0));
                Place { x, y, low, high }
            });
        place.into_iter().collect()
    });
    let mut has_ended = false;
    let places = places.take_while(|place| {
        let shown = !has_ended;
        has_ended = y.is_logarithmic && place.y <= 0.0;
        shown
    });
    places
        .filter(|place| x.from <= place.x && place.x <= x.to)
        .collect()
}

/// Returns the cumulative distribution of the cost of a loss: for each `x`, the percentage of losses that cost at most
/// `x` intact frames.
fn shares_by_frames_lost(back: &Value, most: f64) -> Vec<Place> {
    let counts = back["by_intact_frames_lost"].as_object();
    let counts: Vec<(f64, f64)> = counts
        .into_iter()
        .flatten()
        .filter_map(|(frames, count)| Some((frames.parse().ok()?, count.as_f64()?)))
        .collect();
    let never = back["never"].as_f64().unwrap_or_default();
    let all = counts.iter().map(|(_, count)| count).sum::<f64>() + never;
    let steps = (0_u32..).map(f64::from).take_while(|&x| x <= most);
    let share = |x: f64| {
        let back = counts.iter().filter(|(frames, _)| *frames <= x);
        100.0 * back.map(|(_, count)| count).sum::<f64>() / all
    };
    steps.map(|x| Place::new(x, share(x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_that_never_end_are_in_the_share() {
        let back = json!({ "by_intact_frames_lost": { "0": 1, "2": 2 }, "never": 1 });
        let shares = shares_by_frames_lost(&back, 3.0).into_iter();
        assert!(shares.map(|place| place.y).eq([25.0, 25.0, 75.0, 75.0]));
    }
}
