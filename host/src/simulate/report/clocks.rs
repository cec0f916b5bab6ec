//! How far two clocks may differ.

use plotters::prelude::SeriesLabelPosition;

use super::Measurement;
use crate::names::PolicyName;
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::payload::Payload;
use crate::simulate::plot::{Axis, BLUE, Chart, GREEN, Mark, RED, Series, Value};

/// Steps of a quarter per cent to each side.
const STEPS: i32 = 32;

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let base = Parameters {
        payload: Payload::Random(0x00, 0xFF),
        trials: 20,
        frames: 200,
        ..DEFAULT
    };
    let lines = [
        (
            "2 idle bits between the bytes",
            GREEN,
            Parameters {
                byte_gap: 2,
                ..base.clone()
            },
        ),
        ("pauses between the frames only", BLUE, base.clone()),
        (
            "no pause at all",
            RED,
            Parameters {
                // Exactly 70 bits for each frame.
                baud: 112_000,
                rate: 1_600.0,
                ..base
            },
        ),
    ];
    let parameters = lines
        .iter()
        .flat_map(|(_, _, line)| {
            (-STEPS..=STEPS).map(|step| Parameters {
                baud_error: f64::from(step) / 4.0,
                ..line.clone()
            })
        })
        .collect();
    let points = measurement.points(parameters)?;
    let series = lines
        .iter()
        .zip(points.chunks(2 * STEPS as usize + 1))
        .map(|((name, colour, _), points)| Series {
            name: (*name).to_owned(),
            colour: *colour,
            mark: Mark::Line,
            values: points
                .iter()
                .filter_map(|point| {
                    let delivered = point.receiver(PolicyName::Rescan, false)?.delivered;
                    let percent = 100.0 * delivered.value;
                    Some(Value::new(point.parameters.baud_error, percent))
                })
                .collect(),
        })
        .collect();
    Ok(Chart {
        title: "Frames delivered by how far the clocks differ",
        subtitle: format!(
            "BIN, Rescan, random payload, 8N1 with 16 samples a bit and 2 of 3 votes; {} frames a \
             point, seed {}",
            points.first().map_or(0, |point| point.line.frames_sent),
            measurement.seed()
        ),
        x: Axis {
            label: "sender's clock faster than the receiver's by, %",
            from: -8.0,
            to: 8.0,
            is_logarithmic: false,
        },
        y: Axis {
            label: "frames delivered, %",
            from: 0.0,
            to: 104.0,
            is_logarithmic: false,
        },
        series,
        bands: Vec::new(),
        places: Vec::new(),
        legend: SeriesLabelPosition::LowerMiddle,
    })
}
