//! One or two parameters that go through a range.

use std::fmt;
use std::str::FromStr;

use anyhow::{bail, ensure};

use super::occurrences::whole;
use super::parameters::{NUMBERS, Number, Parameters};

/// More points than that are a mistake.
const MOST_POINTS: usize = 10_000;

/// A parameter, and the values it goes through.
#[derive(Clone)]
pub(super) struct Sweep {
    pub(super) number: &'static Number,
    pub(super) values: Vec<f64>,
}

impl fmt::Debug for Sweep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={:?}", self.number.name, self.values)
    }
}

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse(text).map_err(|error| error.to_string())
    }
}

fn parse(text: &str) -> anyhow::Result<Sweep> {
    const WANTED: &str =
        "NAME=FROM:TO:STEP, NAME=FROM:TO:xFACTOR or NAME=VALUE,VALUE,... is wanted";
    let Some((name, values)) = text.split_once('=') else {
        bail!("{WANTED}");
    };
    let Some(number) = NUMBERS.iter().find(|number| number.name == name) else {
        let names: Vec<_> = NUMBERS.iter().map(|number| number.name).collect();
        bail!(
            "no parameter '{name}' can be swept; these can: {}",
            names.join(", ")
        );
    };
    let parts: Vec<_> = values.split(':').collect();
    let values = match parts[..] {
        [list] => list.split(',').map(finite).collect::<anyhow::Result<_>>()?,
        [from, to, step] => {
            let (from, to) = (finite(from)?, finite(to)?);
            match step.strip_prefix('x') {
                Some(factor) => geometric(from, to, finite(factor)?)?,
                None => arithmetic(from, to, finite(step)?)?,
            }
        }
        _ => bail!("{WANTED}"),
    };
    let mut parameters = Parameters::default();
    for &value in &values {
        number.set(&mut parameters, value)?;
    }
    Ok(Sweep { number, values })
}

fn finite(text: &str) -> anyhow::Result<f64> {
    match text.parse() {
        Ok(number) if f64::is_finite(number) => Ok(number),
        _ => bail!("'{text}' is no number"),
    }
}

fn arithmetic(from: f64, to: f64, step: f64) -> anyhow::Result<Vec<f64>> {
    ensure!(
        from <= to && step > 0.0,
        "from the lower value to the higher, by a step of more than 0"
    );
    // A hair more, so that rounding does not take the last one away.
    let steps = (to - from) / step + 1e-9;
    values(steps, |index| {
        // As it would be typed: -5.3, and not -5.300000000000001.
        let value = from + index * step;
        (value * 1e9).round() / 1e9
    })
}

fn geometric(from: f64, to: f64, factor: f64) -> anyhow::Result<Vec<f64>> {
    ensure!(
        0.0 < from && from <= to && factor > 1.0,
        "from a value of more than 0 to a higher one, by a factor of more than 1"
    );
    let mut value = from;
    let steps = libm::log(to / from) / libm::log(factor) + 1e-9;
    values(steps, |index| {
        if index > 0.0 {
            value *= factor;
        }
        // As it would be typed, and never beyond the last.
        format!("{value:.5e}")
            .parse::<f64>()
            .unwrap_or(value)
            .min(to)
    })
}

fn values(steps: f64, at: impl FnMut(f64) -> f64) -> anyhow::Result<Vec<f64>> {
    ensure!(
        steps < f64::from(u32::try_from(MOST_POINTS)?),
        "these are more than {MOST_POINTS} values: choose a longer step"
    );
    let last = u32::try_from(whole(steps))?;
    Ok((0..=last).map(f64::from).map(at).collect())
}

/// The parameters at every point; of two sweeps, each value of the first with each of the second.
///
/// # Errors
/// If there are too many points, or the same parameter is swept twice.
pub(super) fn points(base: &Parameters, sweeps: &[Sweep]) -> anyhow::Result<Vec<Parameters>> {
    ensure!(
        sweeps.len() <= 2,
        "two parameters can be swept, not {}",
        sweeps.len()
    );
    if let [first, second] = sweeps {
        let (name, other) = (first.number.name, second.number.name);
        ensure!(name != other, "--sweep {name} is there twice");
    }
    let mut points = vec![base.clone()];
    for sweep in sweeps {
        let mut more = Vec::new();
        for point in points {
            for &value in &sweep.values {
                let mut point = point.clone();
                sweep.number.set(&mut point, value)?;
                more.push(point);
            }
        }
        points = more;
    }
    ensure!(
        points.len() <= MOST_POINTS,
        "these are {} points, more than {MOST_POINTS}: choose longer steps",
        points.len()
    );
    points.iter().try_for_each(Parameters::check)?;
    Ok(points)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::float_cmp,
        reason = "a panic fails the test"
    )]

    use super::*;

    fn values_of(text: &str) -> Vec<f64> {
        text.parse::<Sweep>().unwrap().values
    }

    #[test]
    fn values_are_those_that_were_asked_for() {
        assert_eq!(
            values_of("baud-error=-1:1:0.5"),
            [-1.0, -0.5, 0.0, 0.5, 1.0]
        );
        assert_eq!(
            values_of("baud-error=-0.3:0.3:0.1"),
            [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]
        );
        assert_eq!(
            values_of("bit-flip=1e-5:1e-2:x10"),
            [1e-5, 1e-4, 1e-3, 1e-2]
        );
        assert_eq!(values_of("frames=10,1,100"), [10.0, 1.0, 100.0]);
        assert_eq!(values_of("lose=0:0:1"), [0.0]);
    }

    #[test]
    fn what_cannot_be_swept_is_told() {
        for (text, named) in [
            ("lose", "NAME=FROM:TO:STEP"),
            ("lose=1:2", "NAME=FROM:TO:STEP"),
            ("loose=1", "these can: trials"),
            ("lose=", "'' is no number"),
            ("lose=0:inf:1", "'inf' is no number"),
            ("lose=0,2", "--lose is 2: a number from 0 to 1"),
            ("frames=1:2:0.5", "--frames is 1.5: a whole number"),
            ("rate=5:1:1", "from the lower value"),
            ("rate=1:5:0", "a step of more than 0"),
            ("bit-flip=0:1:x10", "more than 0"),
            ("rate=1:5:x1", "a factor of more than 1"),
            ("rate=1:5:1e-9", "more than 10000 values"),
        ] {
            let complaint = text.parse::<Sweep>().unwrap_err();
            assert!(complaint.contains(named), "{text}: {complaint}");
        }
    }

    #[test]
    fn two_sweeps_make_a_grid() {
        let sweeps = ["rate=10,20".parse().unwrap(), "lose=0,0.1".parse().unwrap()];
        let grid = points(&Parameters::default(), &sweeps).unwrap();
        let seen: Vec<_> = grid.iter().map(|point| (point.rate, point.lose)).collect();
        assert_eq!(seen, [(10.0, 0.0), (10.0, 0.1), (20.0, 0.0), (20.0, 0.1)]);
        let twice = [sweeps[0].clone(), sweeps[0].clone()];
        assert!(points(&Parameters::default(), &twice).is_err());
    }
}
