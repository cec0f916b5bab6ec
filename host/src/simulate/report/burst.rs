//! One axis through a burst of noise, into the failsafe and back.

use framelock::{Phase, Setpoint};
use plotters::prelude::SeriesLabelPosition;

use super::{Measurement, write_table};
use crate::setpoints::LEVEL;
use crate::simulate::experiment;
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::plot::{Axis, BLUE, Band, Chart, GREY, Mark, RED, Series, Value, YELLOW};
use crate::simulate::results::Point;
use crate::simulate::trial::Sample;

const BURST_AT: f64 = 1.5;
const BURST_MILLISECONDS: f64 = 1_600.0;
const SECONDS: u32 = 5;

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let parameters = Parameters {
        seed: measurement.seed(),
        trials: 1,
        frames: 50 * SECONDS,
        burst_at: Some(BURST_AT),
        burst_length: BURST_MILLISECONDS,
        ..DEFAULT
    };
    let mut samples = Vec::new();
    let tally = experiment::run_one(&parameters, 0, &mut |sample| samples.push(sample))?;
    write_table(
        &measurement.table,
        &[Point::new(parameters.clone(), &tally)],
    )?;
    let (axis, axis_name) = axis_farthest_from_park(&samples);
    let trace = |name: &str, colour, mark, setpoint: fn(&Sample) -> Setpoint| Series {
        name: name.to_owned(),
        colour,
        mark,
        values: samples
            .iter()
            .map(|sample| Value::new(seconds(sample), axis(setpoint(sample)).into()))
            .collect(),
    };
    let demand = trace("demand sent", GREY, Mark::Dashes, |sample| sample.demand);
    let output = trace("output of the failsafe", BLUE, Mark::Line, |sample| {
        let [_, _, rescan, _] = sample.outputs;
        rescan.setpoint
    });
    Ok(Chart {
        title: "An axis through a burst of noise",
        subtitle: format!(
            "Burst of {BURST_MILLISECONDS} ms at {BURST_AT} s; 50 frames/s, Rescan; hold after {} ms, \
             to park (128) after {} ms, full travel in {} ms; seed {}",
            parameters.hold_after,
            parameters.ramp_after,
            parameters.full_travel,
            measurement.seed()
        ),
        x: Axis {
            label: "time, s",
            from: 0.0,
            to: f64::from(SECONDS),
            is_logarithmic: false,
        },
        y: Axis {
            label: axis_name,
            from: 30.0,
            to: 220.0,
            is_logarithmic: false,
        },
        series: vec![demand, output],
        bands: bands(&samples),
        places: Vec::new(),
        legend: SeriesLabelPosition::LowerRight,
    })
}

type AxisOf = fn(Setpoint) -> u8;

/// The axis that has the longest way to park when the burst begins.
fn axis_farthest_from_park(samples: &[Sample]) -> (AxisOf, &'static str) {
    let axes: [(AxisOf, _); 3] = [
        (|setpoint| setpoint.pitch, "pitch, units of demand"),
        (|setpoint| setpoint.roll, "roll, units of demand"),
        (|setpoint| setpoint.yaw, "yaw, units of demand"),
    ];
    let [first, ..] = axes;
    let demand = samples
        .iter()
        .find(|sample| seconds(sample) >= BURST_AT)
        .map_or(LEVEL, |sample| sample.demand);
    let way = |(axis, _): &(AxisOf, _)| axis(demand).abs_diff(axis(LEVEL));
    axes.into_iter().max_by_key(way).unwrap_or(first)
}

/// What the failsafe was doing whenever it did not just follow.
fn bands(samples: &[Sample]) -> Vec<Band> {
    let phase = |sample: &Sample| {
        let [_, _, rescan, _] = sample.outputs;
        rescan.phase
    };
    let runs = samples.chunk_by(|before, after| phase(before) == phase(after));
    let mut bands = Vec::new();
    for run in runs {
        let [first, .., last] = run else { continue };
        let (name, colour) = match phase(first) {
            Phase::Live => continue,
            Phase::Hold => ("hold", YELLOW),
            Phase::Ramp => ("ramp", RED),
            Phase::Parked => ("parked", GREY),
            Phase::Approach => ("approach", BLUE),
        };
        let (from, to) = (seconds(first), seconds(last));
        if to - from > 0.05 {
            bands.push(Band {
                from,
                to,
                name,
                colour,
            });
        }
    }
    bands
}

#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn seconds(sample: &Sample) -> f64 {
    sample.microseconds as f64 / 1e6
}
