//! Wrong setpoints by bit error rate, measured and as theory has it.

use plotters::prelude::SeriesLabelPosition;

use super::Measurement;
use crate::names::{FrameName, PolicyName};
use crate::simulate::parameters::{DEFAULT, Parameters};
use crate::simulate::payload::Payload;
use crate::simulate::plot::{Axis, BLUE, Chart, Mark, RED, Series, Value};
use crate::simulate::theory;

const BIN: [f64; 8] = [1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2];
const BIN_CRC8: [f64; 4] = [7e-3, 1e-2, 1.5e-2, 3e-2];

pub(super) fn chart(measurement: &Measurement) -> anyhow::Result<Chart> {
    let base = Parameters {
        payload: Payload::Random(0x00, 0xFF),
        // With pauses: two frames have nothing to do with each other.
        rate: 800.0,
        ..DEFAULT
    };
    let bin = BIN.map(|bit_flip| Parameters {
        bit_flip,
        trials: 1_000,
        ..base.clone()
    });
    let bin_crc8 = BIN_CRC8.map(|bit_flip| Parameters {
        bit_flip,
        frame: FrameName::BinCrc8,
        trials: 3_000,
        ..base.clone()
    });
    let points = measurement.points(bin.into_iter().chain(bin_crc8).collect())?;
    let measured = |frame| {
        points
            .iter()
            .filter(move |point| point.parameters.frame == frame)
            .filter_map(|point| {
                let wrong = point.receiver(PolicyName::Rescan, false)?.wrong_setpoints;
                (wrong.count > 0).then_some(Value {
                    x: point.parameters.bit_flip,
                    y: wrong.value,
                    interval: Some((wrong.low, wrong.high)),
                })
            })
            .collect()
    };
    let expected = |frame| {
        // Twenty in each decade.
        (-100..=-30)
            .map(|step| {
                let flip = libm::exp10(f64::from(step) / 20.0);
                Value::new(flip, theory::wrong_setpoint(frame, flip))
            })
            .filter(|value| value.y > 1e-8)
            .collect()
    };
    let series = |name: &str, colour, mark, values| Series {
        name: name.to_owned(),
        colour,
        mark,
        values,
    };
    Ok(Chart {
        title: "Wrong setpoints by bit error rate",
        subtitle: format!(
            "115200 Bd, 800 frames/s, random payload; bars are 95 % intervals; 10⁶ BIN and 3·10⁶ \
             BIN-CRC8 frames a point{}, seed {}",
            match measurement.arguments.effort {
                100 => String::new(),
                effort => format!(" (of which {effort} %)"),
            },
            measurement.seed()
        ),
        x: Axis {
            label: "probability that a bit is inverted",
            from: 1e-5,
            to: 1e-1,
            is_logarithmic: true,
        },
        y: Axis {
            label: "wrong setpoints per frame sent",
            from: 1e-8,
            to: 1.0,
            is_logarithmic: true,
        },
        series: vec![
            series("BIN, theory", RED, Mark::Line, expected(FrameName::Bin)),
            series("BIN, measured", RED, Mark::Dots, measured(FrameName::Bin)),
            series(
                "BIN-CRC8, theory",
                BLUE,
                Mark::Line,
                expected(FrameName::BinCrc8),
            ),
            series(
                "BIN-CRC8, measured",
                BLUE,
                Mark::Dots,
                measured(FrameName::BinCrc8),
            ),
        ],
        bands: Vec::new(),
        places: Vec::new(),
        legend: SeriesLabelPosition::UpperLeft,
    })
}
