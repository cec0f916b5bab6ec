//! Built-in motions: where each axis is at a time.

use std::f64::consts::TAU;
use std::time::Duration;

use clap::ValueEnum;
use framelock::Setpoint;

use crate::setpoints::LEVEL;

/// A motion without end.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum MotionName {
    /// A sine whose frequency rises steadily from --from to --to and falls back, once each period
    SineSweep,
    /// Up for half a period, down for the other half
    Step,
    /// Once around in each period: pitch and roll draw an 8, yaw stays level
    FigureOfEight,
}

impl MotionName {
    /// How long a period is unless somebody says otherwise, in seconds.
    pub(super) const fn usual_period(self) -> f64 {
        match self {
            Self::SineSweep => 20.0,
            Self::Step | Self::FigureOfEight => 4.0,
        }
    }
}

/// An axis of the simulator.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(super) enum Axis {
    /// Actuator 1
    Pitch,
    /// Actuator 2
    Roll,
    /// Actuator 3
    Yaw,
}

/// A motion around level.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Motion {
    pub(super) name: MotionName,
    /// The way from level to either end, in units of demand: at most 127.
    pub(super) amplitude: u8,
    /// In seconds.
    pub(super) period: f64,
    /// The sweep's lowest and highest frequency, in hertz.
    pub(super) frequencies: [f64; 2],
    /// Whether pitch, roll and yaw move; what does not stays level.
    pub(super) moves: [bool; 3],
}

impl Motion {
    /// Where the axes are so long after the beginning.
    pub(super) fn at(&self, time: Duration) -> Setpoint {
        let time = time.as_secs_f64();
        let part = (time / self.period).fract();
        let ways = match self.name {
            MotionName::SineSweep => [self.sweep(time); 3],
            MotionName::Step => [if part < 0.5 { 1.0 } else { -1.0 }; 3],
            MotionName::FigureOfEight => [(2.0 * TAU * part).sin(), (TAU * part).sin(), 0.0],
        };
        let mut axes = <[u8; 3]>::from(LEVEL);
        for ((axis, way), moves) in axes.iter_mut().zip(ways).zip(self.moves) {
            if moves {
                *axis = demand(f64::from(*axis) + way * f64::from(self.amplitude));
            }
        }
        axes.into()
    }

    /// The phase is the frequency's integral, so that the sine has no jumps.
    fn sweep(&self, time: f64) -> f64 {
        let [from, to] = self.frequencies;
        let rise = |time: f64| from * time + (to - from) * time * time / self.period;
        let half = rise(self.period / 2.0);
        let (periods, into) = ((time / self.period).floor(), time % self.period);
        let turns = if into < self.period / 2.0 {
            rise(into)
        } else {
            2.0 * half - rise(self.period - into)
        };
        (TAU * (periods * 2.0 * half + turns).fract()).sin()
    }
}

/// The nearest demand that there is.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "it is brought into range before"
)]
pub(super) fn demand(position: f64) -> u8 {
    position.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    const EIGHT: Motion = Motion {
        name: MotionName::FigureOfEight,
        amplitude: 100,
        period: 4.0,
        frequencies: [0.5, 2.0],
        moves: [true; 3],
    };

    fn at(motion: Motion, seconds: f64) -> [u8; 3] {
        motion.at(Duration::from_secs_f64(seconds)).into()
    }

    #[test]
    fn the_figure_of_eight_goes_through_its_points() {
        for turn in [0.0, 4.0, 400.0] {
            assert_eq!(at(EIGHT, turn), [128, 128, 128]);
            assert_eq!(at(EIGHT, turn + 0.5), [228, 199, 128]);
            assert_eq!(at(EIGHT, turn + 1.0), [128, 228, 128]);
            assert_eq!(at(EIGHT, turn + 1.5), [28, 199, 128]);
            assert_eq!(at(EIGHT, turn + 3.0), [128, 28, 128]);
        }
    }

    #[test]
    fn the_step_is_up_and_then_down() {
        let step = Motion {
            name: MotionName::Step,
            amplitude: 127,
            moves: [false, true, false],
            ..EIGHT
        };
        for (seconds, roll) in [(0.0, 255), (1.99, 255), (2.0, 1), (3.99, 1), (4.0, 255)] {
            assert_eq!(at(step, seconds), [128, roll, 128], "{seconds}");
        }
    }

    /// Counts the sine's crossings of level, downwards: one in the middle of each turn.
    #[test]
    fn the_sweep_goes_up_and_down_in_frequency_without_jumps() {
        let sweep = Motion {
            name: MotionName::SineSweep,
            period: 40.0,
            ..EIGHT
        };
        let turns_between = |from: u32, to: u32| {
            let pitch = |millisecond: u32| at(sweep, f64::from(millisecond) / 1000.0)[0];
            (from * 1000..to * 1000)
                .filter(|&now| pitch(now) >= 128 && pitch(now + 1) < 128)
                .count()
        };
        // 0.5 to 2 Hz and back: 25 turns each way, the first 8.75 of them in the first quarter.
        assert_eq!(turns_between(0, 40), 50);
        assert_eq!(turns_between(0, 10), 9);
        assert_eq!(turns_between(10, 20), 16);
        assert_eq!(turns_between(40, 80), 50);
        for millisecond in 0..80_000 {
            let [now, next] = [millisecond, millisecond + 1]
                .map(|millisecond| at(sweep, f64::from(millisecond) / 1000.0)[0]);
            // 100 units at 2 Hz: at most 1.26 in a millisecond.
            assert!(now.abs_diff(next) <= 2, "{millisecond}: {now} to {next}");
        }
    }

    #[test]
    fn an_axis_that_is_not_named_stays_level() {
        let pitch_only = Motion {
            moves: [true, false, false],
            ..EIGHT
        };
        assert_eq!(at(pitch_only, 0.5), [228, 128, 128]);
    }
}
