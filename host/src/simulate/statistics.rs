//! How sure one may be of a figure: intervals that hold the true one in 95 of 100 cases.

use serde::Serialize;

/// So many standard deviations to each side hold 95 % of a normal distribution.
const DEVIATIONS: f64 = 1.959_963_984_540_054;

/// How many of how many, and the interval.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Share {
    pub(super) count: u64,
    pub(super) of: u64,
    /// `count / of`, 0 if both are.
    pub(super) value: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// A mean, and the interval.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct Mean {
    pub(super) value: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Share {
    /// With Wilson's interval, which is right for shares near 0 and 1 too.
    #[expect(
        clippy::cast_precision_loss,
        reason = "what it loses is less than the interval"
    )]
    pub(super) fn new(count: u64, of: u64) -> Self {
        if of == 0 {
            return Self {
                count,
                of,
                value: 0.0,
                low: 0.0,
                high: 1.0,
            };
        }
        let (value, trials) = (count as f64 / of as f64, of as f64);
        let square = DEVIATIONS * DEVIATIONS;
        let middle = value + square / (2.0 * trials);
        let width =
            DEVIATIONS * (value * (1.0 - value) / trials + square / (4.0 * trials * trials)).sqrt();
        let scale = 1.0 + square / trials;
        Self {
            count,
            of,
            value,
            // Exact where rounding would leave a little.
            low: if count == 0 {
                0.0
            } else {
                (middle - width) / scale
            },
            high: if count == of {
                1.0
            } else {
                (middle + width) / scale
            },
        }
    }
}

/// Sums over independent trials, from which the ratio of two quantities is told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ratio {
    pub(super) trials: u64,
    pub(super) above: u64,
    pub(super) below: u64,
    pub(super) above_squares: u64,
    pub(super) products: u64,
    pub(super) below_squares: u64,
}

impl Ratio {
    /// `above / below`, its interval from how much the trials differ; none without two trials and
    /// something below.
    #[expect(
        clippy::cast_precision_loss,
        reason = "what it loses is less than the interval"
    )]
    pub(super) fn mean(self) -> Option<Mean> {
        if self.trials < 2 || self.below == 0 {
            return None;
        }
        let (trials, below) = (self.trials as f64, self.below as f64);
        let value = self.above as f64 / below;
        let residuals = self.above_squares as f64 - 2.0 * value * self.products as f64
            + value * value * self.below_squares as f64;
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
        let ratio = Ratio {
            trials: 4,
            above: 10,
            below: 4,
            above_squares: 30,
            products: 10,
            below_squares: 4,
        };
        let Mean { value, low, high } = ratio.mean().unwrap();
        assert_eq!(value, 2.5);
        assert!(
            (high - value - 1.959_964 * 1.290_994 / 2.0).abs() < 1e-5,
            "{high}"
        );
        assert!((value - low - (high - value)).abs() < 1e-12);
        assert_eq!(Ratio { trials: 1, ..ratio }.mean(), None);
        assert_eq!(Ratio { below: 0, ..ratio }.mean(), None);
        // Two losses in each trial, one frame for each: no doubt at all.
        let sure = Ratio {
            trials: 4,
            above: 8,
            below: 8,
            above_squares: 16,
            products: 16,
            below_squares: 16,
        };
        assert_eq!(
            sure.mean(),
            Some(Mean {
                value: 1.0,
                low: 1.0,
                high: 1.0
            })
        );
    }
}
