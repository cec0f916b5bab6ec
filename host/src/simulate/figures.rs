//! The figures of the report. What each measures, as options of `framelock simulate`, and how it is
//! drawn is in `tables/figures.json`.

use std::time::Duration;

use anyhow::{Context, Result};
use clap::{Args, Command, FromArgMatches};
use framelock::Phase;
use framelock_simulation::{Event, FrameFormat, LEVEL, Parameters, run, theory};
use serde::Deserialize;
use serde_json::{Value, json};

use super::arguments::Experiment;
use super::experiment::{self, Point};
use super::output::rows;
use super::plot::{Axis, Band, Chart, Place, Series};
use crate::view_parts::phase_name;

/// A figure: its runs, and its chart without values.
#[derive(Deserialize)]
pub(super) struct Figure {
    pub(super) name: String,
    runs: Vec<String>,
    /// The outputs in the course of a single trial are drawn, and not what came of many.
    #[serde(default)]
    is_watched: bool,
    chart: Chart,
}

/// All figures.
pub(super) fn all() -> Result<Vec<Figure>> {
    serde_json::from_str(include_str!("tables/figures.json")).context("the figures' file")
}

impl Figure {
    /// Measures it with `effort` per cent of the trials, and draws it.
    pub(super) fn measure(mut self, seed: u64, effort: u32) -> Result<(Vec<Point>, Chart)> {
        let mut runs = Vec::new();
        let mut parameters = Vec::new();
        for (number, options) in self.runs.iter().enumerate() {
            for point in parsed(options)? {
                runs.push(number);
                // At least two: one has no interval.
                let trials = (point.trials * effort / 100).max(2.min(point.trials));
                parameters.push(Parameters {
                    seed,
                    trials,
                    ..point
                });
            }
        }
        let points = experiment::run(parameters)?;
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
        let effort = match effort {
            100 => String::new(),
            effort => format!(" (of which {effort} %)"),
        };
        for (name, value) in [
            ("{trials}", first.parameters.trials.to_string()),
            ("{frames}", first.tally.line.frames_sent.to_string()),
            ("{hours}", format!("{:.1}", hours(first))),
            ("{effort}", effort),
            ("{seed}", seed.to_string()),
        ] {
            chart.subtitle = chart.subtitle.replace(name, &value);
        }
        Ok((points, self.chart))
    }

    /// The axis that has the longest way to park when the burst begins: the demand sent and the
    /// output of the failsafe behind the receiver, at each look.
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
            let output = outputs.get(2)?;
            let [demand, actual] = [*demand, output.setpoint].map(<[u8; 3]>::from);
            let at = Duration::from_micros(*microseconds).as_secs_f64();
            Some((at, demand, actual, output.phase))
        });
        let looks: Vec<_> = looks.collect();
        let burst_at = point.parameters.burst_at.unwrap_or_default();
        let at_burst = looks.iter().find(|(at, ..)| *at >= burst_at);
        let demand = at_burst.map_or([LEVEL.pitch; 3], |(_, demand, ..)| *demand);
        let demands = ["pitch", "roll", "yaw"].into_iter().zip(demand).enumerate();
        let (axis, (name, _)) = demands
            .max_by_key(|(_, (_, demand))| demand.abs_diff(LEVEL.pitch))
            .unwrap_or_default();
        self.chart.y.label = self.chart.y.label.replace("{axis}", name);
        for of_phase in looks.chunk_by(|(.., before), (.., after)| before == after) {
            if let [(from, .., phase), .., (to, ..)] = *of_phase
                && phase != Phase::Live
                && to - from > 0.05
            {
                let name = phase_name(phase);
                self.chart.bands.push(Band { from, to, name });
            }
        }
        let rows = looks.iter().map(|(at, demand, output, _)| {
            json!({ "seconds": at, "demand": demand.get(axis), "output": output.get(axis) })
        });
        Ok(rows.collect())
    }
}

/// The parameters that options of `framelock simulate` mean.
fn parsed(options: &str) -> Result<Vec<Parameters>> {
    let command = Experiment::augment_args(Command::new("run").no_binary_name(true));
    let matches = command.try_get_matches_from(options.split_whitespace())?;
    Experiment::from_arg_matches(&matches)?.points()
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

/// How long the sender sent.
#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn hours(point: &Point) -> f64 {
    point.tally.line.frames_sent as f64 / point.parameters.rate / 3_600.0
}

/// Wrong setpoints by bit error rate, as theory has them: at twenty places in each decade.
fn expected(format: FrameFormat) -> Vec<Place> {
    let places = (-100..=-30).map(|step| {
        let flip = 10_f64.powf(f64::from(step) / 20.0);
        Place::new(flip, theory::wrong_setpoint(format, flip))
    });
    places.filter(|place| place.y > 1e-8).collect()
}

/// What a series shows of the rows that it selects. Zero has no place on a logarithmic axis.
fn measured(series: &Series, rows: &[Value], x: &Axis, y: &Axis) -> Vec<Place> {
    let pointer = series.value.as_ref().unwrap_or(&y.value);
    let is_selected = |row: &&Value| {
        let mut wanted = series.select.iter();
        wanted.all(|(name, value)| row.get(name) == Some(value))
    };
    let number = |row: &Value, pointer: &str| row.pointer(pointer).and_then(Value::as_f64);
    let places = rows.iter().filter(is_selected).flat_map(|row| {
        if let Some(back) = row.pointer(pointer).filter(|value| value.is_object()) {
            return shares_by_frames_lost(back);
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
    places
        .filter(|place| place.y > 0.0 || !y.is_logarithmic)
        .collect()
}

/// Of the losses, how many of a hundred cost 0, 1, 2, 3, 4 intact frames, 5 or more, or all.
fn shares_by_frames_lost(back: &Value) -> Vec<Place> {
    let mut counts = [0.0; 7];
    let lost = back["by_intact_frames_lost"].as_object();
    for (frames, count) in lost.into_iter().flatten() {
        if let Some(sum) = counts.get_mut(frames.parse().unwrap_or(5).min(5)) {
            *sum += count.as_f64().unwrap_or_default();
        }
    }
    let [.., never] = &mut counts;
    *never = back["never"].as_f64().unwrap_or_default();
    let all = counts.iter().sum::<f64>().max(1.0);
    let places = (0_u32..).zip(counts);
    places
        .map(|(x, count)| Place::new(x.into(), 100.0 * count / all))
        .collect()
}
