//! What one lost byte costs, by policy and payload.

use plotters::prelude::SeriesLabelPosition;

use super::Measurement;
use crate::names::PolicyName;
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::payload::Payload;
use crate::simulate::plot::{Axis, BLUE, Chart, GREEN, Mark, RED, Series, Value};

const PAYLOADS: [(Payload, &str); 3] = [
    (
        Payload::Random(0x00, 0xFF),
        "random bytes,\nother ones in each frame",
    ),
    (
        Payload::Random(0x40, 0x43),
        "bytes 40 to 43,\nother ones in each frame",
    ),
    (
        Payload::Repeated(0x40, 0x43),
        "bytes 40 to 43,\nthe same in each frame",
    ),
];

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let parameters = PAYLOADS.map(|(payload, _)| Parameters {
        payload,
        trials: 100_000,
        frames: 40,
        lose_one_in: Some(0),
        ..DEFAULT
    });
    let points = measurement.points(parameters.into())?;
    let series = [
        (
            "Discard, the lecture's machine",
            PolicyName::Discard,
            false,
            RED,
        ),
        (
            "Discard with an idle-gap rule",
            PolicyName::Discard,
            true,
            GREEN,
        ),
        ("Rescan, the receiver", PolicyName::Rescan, false, BLUE),
    ]
    .map(|(name, policy, has_idle_gap, colour)| Series {
        name: name.to_owned(),
        colour,
        mark: Mark::Bars,
        values: (0_u32..)
            .zip(&points)
            .filter_map(|(place, point)| {
                let lost = point
                    .receiver(policy, has_idle_gap)?
                    .lost_intact_per_lost_byte?;
                Some(Value::new(place.into(), lost.value))
            })
            .collect(),
    });
    Ok(Chart {
        title: "Intact frames lost for each lost byte",
        subtitle: format!(
            "One byte of the first frame lost, then 39 intact frames at 50 frames/s, 115200 Bd; {} \
             trials, seed {}",
            points.first().map_or(0, |point| point.parameters.trials),
            measurement.seed()
        ),
        x: Axis {
            label: "payload",
            from: -0.5,
            to: 2.5,
            is_logarithmic: false,
        },
        y: Axis {
            label: "intact frames lost, mean",
            from: 0.0,
            to: 8.0,
            is_logarithmic: false,
        },
        series: series.into(),
        bands: Vec::new(),
        places: PAYLOADS.map(|(_, name)| name.to_owned()).into(),
        legend: SeriesLabelPosition::UpperLeft,
    })
}
