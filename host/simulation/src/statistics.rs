//! Confidence intervals of measured figures. Such an interval contains the true value in 95 of 100
//! cases.

use serde::Serialize;

/// An interval of this many standard deviations to each side of the mean contains 95 % of a normal
/// distribution.
const DEVIATIONS: f64 = 1.959_963_984_540_054;

/// A part of a whole, with its confidence interval.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Share {
    /// The part.
    pub count: u64,
    /// The whole.
    pub of: u64,
    /// `count / of`, or 0 if both are 0.
    pub value: f64,
    /// The interval's lower end.
    pub low: f64,
    /// The interval's upper end.
    pub high: f64,
}

/// A mean, with its confidence interval.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// The interval's lower end.
    pub low: f64,
    /// The interval's upper end.
    pub high: f64,
}

impl Share {
    /// Creates a share with Wilson's interval, which also holds for shares near 0 and 1.
    #[must_use]
    pub fn new(count: u64, of: u64) -> Self {
        let [value, low, high] = match of {
            0 => [0.0, 0.0, 1.0],
            _ => wilson(count, of),
        };
        Self {
            count,
            of,
            value,
            low,
            high,
        }
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "the rounding error is smaller than the interval"
)]
fn wilson(count: u64, of: u64) -> [f64; 3] {
    let (value, trials) = (count as f64 / of as f64, of as f64);
    let square = DEVIATIONS * DEVIATIONS;
    let middle = value + square / (2.0 * trials);
    let width =
        DEVIATIONS * (value * (1.0 - value) / trials + square / (4.0 * trials * trials)).sqrt();
    let end = |place: f64| place / (1.0 + square / trials);
    // Set the ends 0 and 1 exactly, because rounding would leave a small difference.
    let low = if count == 0 { 0.0 } else { end(middle - width) };
    let high = if count == of {
        1.0
    } else {
        end(middle + width)
    };
    [value, low, high]
}

/// The number of independent trials, and the sums of `a`, `b`, `a * a`, `a * b` and `b * b` over
/// the trials. These determine the ratio of `a` to `b`, and its confidence interval.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Ratio([u64; 6]);

impl Ratio {
    /// Creates the sums of one trial with `a = above` and `b = below`.
    pub(crate) fn of(above: u64, below: u64) -> Self {
        Self([1, above, below, above * above, above * below, below * below])
    }

    pub(crate) fn add(&mut self, more: Self) {
        for (sum, more) in self.0.iter_mut().zip(more.0) {
            *sum += more;
        }
    }

    /// Returns the ratio of the first sum to the second. Its interval follows from the differences
    /// between trials. Returns `None` for fewer than two trials or if the second sum is 0.
    #[expect(
        clippy::cast_precision_loss,
        reason = "the rounding error is smaller than the interval"
    )]
    pub(crate) fn mean(self) -> Option<Mean> {
        let [trials, above, below, above_squares, products, below_squares] =
            self.0.map(|sum| sum as f64);
        if trials < 2.0 || below == 0.0 {
            return None;
        }
        let value = above / below;
        let residuals = above_squares - 2.0 * value * products + value * value * below_squares;
        let variance = residuals.max(0.0) * trials / (trials - 1.0) / (below * below);
        let width = DEVIATIONS * variance.sqrt();
        Some(Mean {
            value,
            low: (value - width).max(0.0),
            high: value + width,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::float_cmp,
        reason = "a panic fails the test"
    )]

    use super::*;

    #[test]
    fn wilsons_interval_is_as_published() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
        for (count, of, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let share = Share::new(count, of);
            assert!((share.low - low).abs() < 5e-5, "{share:?}");
            assert!((share.high - high).abs() < 5e-5, "{share:?}");
        }
        let all = Share::new(20, 20);
        assert_eq!((all.value, all.high), (1.0, 1.0));
        assert!((all.low - (1.0 - 0.1611)).abs() < 5e-5);
        assert_eq!((Share::new(0, 0).low, Share::new(0, 0).high), (0.0, 1.0));
    }

    #[test]
    fn a_ratio_with_one_below_in_each_trial_is_a_mean() {
        // 1, 2, 3, 4: mean 2.5, standard deviation 1.2910.
        let Mean { value, low, high } = Ratio([4, 10, 4, 30, 10, 4]).mean().unwrap();
        assert_eq!(value, 2.5);
        assert!(
            (high - value - 1.959_964 * 1.290_994 / 2.0).abs() < 1e-5,
            "{high}"
        );
        assert!((value - low - (high - value)).abs() < 1e-12);
        assert_eq!(Ratio([1, 10, 4, 30, 10, 4]).mean(), None);
        assert_eq!(Ratio([4, 10, 0, 30, 10, 4]).mean(), None);
        // Each trial has two losses and two lost frames, so the ratio is 1 in every trial, and the
        // interval has no width.
        let [value, low, high] = [1.0; 3];
        assert_eq!(
            Ratio([4, 8, 8, 16, 16, 16]).mean(),
            Some(Mean { value, low, high })
        );
    }
}
