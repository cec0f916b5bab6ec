//! Varies one or two parameters over a range of values.

use std::iter;
use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};
use framelock_simulation::{NumericParameter, Parameters};

/// The limit on the number of points. More points are most likely a mistake.
const MOST_POINTS: usize = 10_000;

/// A parameter and its values.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub(super) number: &'static NumericParameter,
    pub(super) values: Vec<f64>,
}

const WANTED: &str = "expected NAME=FROM:TO:STEP, NAME=FROM:TO:xFACTOR or NAME=VALUE,VALUE,..., \
                      such as lose=0:0.1:0.02";

impl FromStr for Sweep {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, range) = text.split_once('=').context(WANTED)?;
        let mut numbers = Parameters::NUMBERS.iter();
        let Some(number) = numbers.find(|number| number.name == name) else {
            let names: Vec<_> = Parameters::NUMBERS.iter().map(|each| each.name).collect();
            bail!(
                "no parameter '{name}' can be swept; these can: {}",
                names.join(", ")
            );
        };
        let values = values(range)?;
        let mut parameters = Parameters::DEFAULT;
        for &value in &values {
            number.set(&mut parameters, value)?;
        }
        Ok(Self { number, values })
    }
}

fn values(range: &str) -> Result<Vec<f64>> {
    let parts: Vec<_> = range.split(':').collect();
    let (from, to, step) = match parts[..] {
        [list] => return list.split(',').map(finite).collect(),
        [from, to, step] => (finite(from)?, finite(to)?, step),
        _ => bail!(WANTED),
    };
    // Values slightly above `to` are accepted, so that rounding does not exclude the last value.
    let values: Vec<_> = if let Some(factor) = step.strip_prefix('x') {
        let factor = finite(factor)?;
        ensure!(
            0.0 < from && from <= to && factor > 1.0,
            "a sweep by a factor needs a FROM of more than 0, a TO that is not below FROM, and a factor of more than 1"
        );
        let values = iter::successors(Some(from), |value| Some(value * factor));
        let values = values.take_while(|&value| value <= to * (1.0 + 1e-9));
        // Round each value as a user would type it, and never exceed `to`.
        let typed = values.map(|value| Ok(finite(&format!("{value:.5e}"))?.min(to)));
        typed.take(MOST_POINTS + 1).collect::<Result<_>>()?
    } else {
        let step = finite(step)?;
        ensure!(
            from <= to && step > 0.0,
            "a sweep by steps goes from the lower value to the higher, by a step of more than 0"
        );
        let values = (0..).map(|index| from + f64::from(index) * step);
        let values = values.take_while(|&value| value <= to + 1e-9 * step);
        // Round each value as a user would type it: -5.3, not -5.300000000000001.
        let typed = values.map(|value| (value * 1e9).round() / 1e9);
        typed.take(MOST_POINTS + 1).collect()
    };
    ensure!(
        values.len() <= MOST_POINTS,
        "the sweep has more than {MOST_POINTS} values: choose a larger step"
    );
    Ok(values)
}

fn finite(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(number) if f64::is_finite(number) => Ok(number),
        _ => bail!("'{text}' is not a number"),
    }
}

/// Returns the parameters of every point. If there are two sweeps, combines each value of the first sweep with each
/// value of the second sweep.
pub(super) fn points(base: Parameters, sweeps: &[Sweep]) -> Result<Vec<Parameters>> {
    let count = sweeps.len();
    ensure!(
        count <= 2,
        "at most two parameters can be swept, not {count}"
    );
    if let [first, second] = sweeps {
        let name = first.number.name;
        ensure!(
            name != second.number.name,
            "--sweep {name} is given twice: sweep each parameter once"
        );
    }
    let mut points = vec![base];
    for Sweep { number, values } in sweeps {
        let mut more = Vec::new();
        for point in points {
            for &value in values {
                let mut point = point;
                number.set(&mut point, value)?;
                more.push(point);
            }
        }
        points = more;
    }
    ensure!(
        points.len() <= MOST_POINTS,
        "the sweeps have {} points, more than {MOST_POINTS}: choose larger steps",
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
    fn a_sweep_has_the_values_of_its_range() {
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
    fn an_invalid_sweep_is_reported() {
        for (text, named) in [
            ("lose", "NAME=FROM:TO:STEP"),
            ("lose=1:2", "NAME=FROM:TO:STEP"),
            ("loose=1", "these can: trials"),
            ("lose=", "'' is not a number"),
            ("lose=0:inf:1", "'inf' is not a number"),
            ("lose=0,2", "--lose is 2: expected a number from 0 to 1"),
            ("frames=1:2:0.5", "--frames is 1.5: expected a whole number"),
            ("rate=5:1:1", "goes from the lower value"),
            ("rate=1:5:0", "a step of more than 0"),
            ("bit-flip=0:1:x10", "more than 0"),
            ("rate=1:5:x1", "a factor of more than 1"),
            ("rate=1:5:1e-9", "more than 10000 values"),
        ] {
            let complaint = text.parse::<Sweep>().unwrap_err().to_string();
            assert!(complaint.contains(named), "{text}: {complaint}");
        }
    }

    #[test]
    fn two_sweeps_make_a_grid() {
        let sweeps = ["rate=10,20".parse().unwrap(), "lose=0,0.1".parse().unwrap()];
        let grid = points(Parameters::DEFAULT, &sweeps).unwrap();
        let seen: Vec<_> = grid.iter().map(|point| (point.rate, point.lose)).collect();
        assert_eq!(seen, [(10.0, 0.0), (10.0, 0.1), (20.0, 0.0), (20.0, 0.1)]);
        let twice = [sweeps[0].clone(), sweeps[0].clone()];
        assert!(points(Parameters::DEFAULT, &twice).is_err());
    }
}
