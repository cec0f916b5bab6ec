//! How many intact frames go by before one is delivered again.

use plotters::prelude::SeriesLabelPosition;

use super::Measurement;
use crate::names::PolicyName;
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::payload::Payload;
use crate::simulate::plot::{Axis, BLUE, Chart, Mark, RED, Series, Value, YELLOW};
use crate::simulate::results::ReceiverResult;

/// The last bar but one holds as many and more.
const MOST: u64 = 5;

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let base = Parameters {
        trials: 50_000,
        frames: 100,
        rate: 1_600.0,
        lose_one_in: Some(0),
        ..DEFAULT
    };
    let [random, repeated] = [Payload::Random(0x40, 0x43), Payload::Repeated(0x40, 0x43)];
    let points = measurement.points(
        [random, repeated]
            .map(|payload| Parameters {
                payload,
                ..base.clone()
            })
            .into(),
    )?;
    let series = [
        (
            "Discard, other bytes in each frame",
            random,
            PolicyName::Discard,
            YELLOW,
        ),
        (
            "Discard, the same bytes in each frame",
            repeated,
            PolicyName::Discard,
            RED,
        ),
        ("Rescan, either", repeated, PolicyName::Rescan, BLUE),
    ]
    .map(|(name, payload, policy, colour)| Series {
        name: name.to_owned(),
        colour,
        mark: Mark::Bars,
        values: points
            .iter()
            .find(|point| point.parameters.payload == payload)
            .and_then(|point| point.receiver(policy, false))
            .map_or_else(Vec::new, shares),
    });
    let mut places: Vec<_> = (0..MOST).map(|frames| frames.to_string()).collect();
    places.push(format!("{MOST} or more"));
    places.push("never\n(99 frames)".to_owned());
    Ok(Chart {
        title: "Intact frames lost until one is delivered again",
        subtitle: format!(
            "One byte lost, payload bytes 40 to 43, no pauses: each frame is 0.6 ms at 115200 Bd; {} \
             trials, seed {}",
            points.first().map_or(0, |point| point.parameters.trials),
            measurement.seed()
        ),
        x: Axis {
            label: "intact frames lost on the way back",
            from: -0.5,
            to: 6.5,
            is_logarithmic: false,
        },
        y: Axis {
            label: "share of the losses, %",
            from: 0.0,
            to: 110.0,
            is_logarithmic: false,
        },
        series: series.into(),
        bands: Vec::new(),
        places,
        legend: SeriesLabelPosition::UpperRight,
    })
}

/// In per cent.
#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn shares(receiver: &ReceiverResult) -> Vec<Value> {
    let back = &receiver.resynchronisation;
    let all = (back.count + back.never).max(1) as f64;
    let mut values: Vec<_> = (0..=MOST)
        .map(|frames| {
            let counted = back
                .by_intact_frames_lost
                .iter()
                .filter(|(lost, _)| **lost == frames || frames == MOST && **lost > MOST);
            let count: u64 = counted.map(|(_, count)| count).sum();
            Value::new(frames as f64, 100.0 * count as f64 / all)
        })
        .collect();
    values.push(Value::new(
        (MOST + 1) as f64,
        100.0 * back.never as f64 / all,
    ));
    values
}
