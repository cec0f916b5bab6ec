//! How often the failsafe engages although the sender never pauses.

use plotters::prelude::SeriesLabelPosition;

use super::Measurement;
use crate::names::PolicyName;
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::plot::{Axis, BLUE, Chart, GREEN, Mark, RED, Series, Value};

const LOSSES: [(f64, &str); 3] = [
    (0.01, "1 % of the bytes lost"),
    (0.03, "3 %"),
    (0.1, "10 %"),
];

/// In milliseconds: between the multiples of the time from frame to frame.
const HOLD_AFTER: [u32; 9] = [30, 50, 70, 90, 110, 150, 190, 230, 290];

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let mut parameters = Vec::new();
    for (lose, _) in LOSSES {
        parameters.extend(HOLD_AFTER.map(|hold_after| Parameters {
            lose,
            hold_after: hold_after.into(),
            trials: 32,
            frames: 20_000,
            ..DEFAULT
        }));
    }
    let points = measurement.points(parameters)?;
    let mut series = Vec::new();
    for (policy, name, mark) in [
        (PolicyName::Rescan, "Rescan", Mark::Line),
        (PolicyName::Discard, "Discard", Mark::Dashes),
    ] {
        for ((lose, losses), colour) in LOSSES.into_iter().zip([GREEN, BLUE, RED]) {
            let values = points
                .iter()
                .filter(|point| point.parameters.lose.total_cmp(&lose).is_eq())
                .filter_map(|point| {
                    let engagements = point.receiver(policy, false)?.failsafe_engagements;
                    let frames =
                        f64::from(point.parameters.trials) * f64::from(point.parameters.frames);
                    let hours = frames / point.parameters.rate / 3_600.0;
                    #[expect(clippy::cast_precision_loss, reason = "few")]
                    let an_hour = engagements as f64 / hours;
                    (engagements > 0).then(|| Value::new(point.parameters.hold_after, an_hour))
                })
                .collect();
            series.push(Series {
                name: format!("{name}, {losses}"),
                colour,
                mark,
                values,
            });
        }
    }
    Ok(Chart {
        title: "Needless holds by how soon the failsafe holds",
        subtitle: format!(
            "A sender that never stops, 50 frames/s, 115200 Bd; {:.1} h a point, a line ends where none \
             was seen; seed {}",
            points.first().map_or(0.0, |point| {
                f64::from(point.parameters.trials) * f64::from(point.parameters.frames)
                    / 50.0
                    / 3_600.0
            }),
            measurement.seed()
        ),
        x: Axis {
            label: "hold after a silence of, ms (a frame is due every 20 ms)",
            from: 20.0,
            to: 300.0,
            is_logarithmic: false,
        },
        y: Axis {
            label: "failsafe engagements an hour",
            from: 0.1,
            to: 100_000.0,
            is_logarithmic: true,
        },
        series,
        bands: Vec::new(),
        places: Vec::new(),
        legend: SeriesLabelPosition::UpperRight,
    })
}
