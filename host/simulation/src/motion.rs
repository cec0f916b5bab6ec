//! Motion: the position of each axis at any time.

use std::f64::consts::TAU;
use std::time::Duration;

use framelock::motion::Setpoint;

/// The middle position of every axis.
pub const LEVEL: Setpoint = Setpoint {
    pitch: 0x80,
    roll: 0x80,
    yaw: 0x80,
};

/// The shape of a motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Shape {
    /// A sine whose frequency rises steadily from 0.1 to 2 Hz and falls back, in 20 seconds
    SineSweep,
    /// Up for half a period, down for the other half
    Step,
    /// One loop per period: pitch and roll draw an 8, and yaw stays level
    FigureOfEight,
}

impl Shape {
    /// Returns the period in seconds.
    const fn period(self) -> f64 {
        match self {
            Self::SineSweep => 20.0,
            Self::Step | Self::FigureOfEight => 4.0,
        }
    }
}

/// An axis of the simulator.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Axis {
    /// Actuator 1
    Pitch,
    /// Actuator 2
    Roll,
    /// Actuator 3
    Yaw,
}

/// An endless motion around the middle position. Its positions are the same on every computer.
#[derive(Clone, PartialEq, Debug)]
pub struct Motion {
    /// Its shape.
    pub shape: Shape,
    /// The distance from the middle position to either end, in units of the setpoint: at most 127.
    pub amplitude: u8,
    /// The axes that move. The other axes stay in the middle position.
    pub axes: Vec<Axis>,
}

impl Motion {
    /// Returns the axes' positions when `time` has passed since the beginning.
    #[must_use]
    pub fn at(&self, time: Duration) -> Setpoint {
        let time = time.as_secs_f64();
        let part = (time / self.shape.period()).fract();
        let [pitch, roll, yaw] = match self.shape {
            Shape::SineSweep => [sweep(part); 3],
            Shape::Step => [if part < 0.5 { 1.0 } else { -1.0 }; 3],
            Shape::FigureOfEight => [libm::sin(2.0 * TAU * part), libm::sin(TAU * part), 0.0],
        };
        let place = |axis, way: f64| {
            let moves = self.axes.contains(&axis);
            let distance = if moves {
                way * f64::from(self.amplitude)
            } else {
                0.0
            };
            nearest(128.0 + distance)
        };
        Setpoint {
            pitch: place(Axis::Pitch, pitch),
            roll: place(Axis::Roll, roll),
            yaw: place(Axis::Yaw, yaw),
        }
    }
}

/// Returns the sweep's sine at a fraction, 0 to 1, of the sweep's period. The phase is the integral of the frequency,
/// so that the sine has no jumps. The sine makes 10.5 turns while the frequency rises, and 10.5 turns while it falls.
fn sweep(part: f64) -> f64 {
    // The sweep takes 10 seconds from 0.1 to 2 Hz, and 10 seconds back.
    let rise = |time: f64| 0.1 * time + 1.9 * time * time / 20.0;
    let time = part * Shape::SineSweep.period();
    let turns = if time < 10.0 {
        rise(time)
    } else {
        21.0 - rise(20.0 - time)
    };
    libm::sin(TAU * turns.fract())
}

/// Returns the setpoint at a fraction, 0 to 1, of the straight line from one setpoint to another.
#[must_use]
pub fn between(from: Setpoint, to: Setpoint, part: f64) -> Setpoint {
    let axis = |from, to| nearest(f64::from(from) + (f64::from(to) - f64::from(from)) * part);
    Setpoint {
        pitch: axis(from.pitch, to.pitch),
        roll: axis(from.roll, to.roll),
        yaw: axis(from.yaw, to.yaw),
    }
}

/// Returns the nearest value that an axis of a setpoint can have.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the value was clamped before"
)]
fn nearest(position: f64) -> u8 {
    position.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a panic fails the test")]

    use super::*;

    fn eight() -> Motion {
        Motion {
            shape: Shape::FigureOfEight,
            amplitude: 100,
            axes: vec![Axis::Pitch, Axis::Roll, Axis::Yaw],
        }
    }

    fn at(motion: &Motion, seconds: f64) -> [u8; 3] {
        motion.at(Duration::from_secs_f64(seconds)).into()
    }

    #[test]
    fn the_figure_of_eight_goes_through_its_points() {
        for turn in [0.0, 4.0, 400.0] {
            assert_eq!(at(&eight(), turn), [128, 128, 128]);
            assert_eq!(at(&eight(), turn + 0.5), [228, 199, 128]);
            assert_eq!(at(&eight(), turn + 1.0), [128, 228, 128]);
            assert_eq!(at(&eight(), turn + 1.5), [28, 199, 128]);
            assert_eq!(at(&eight(), turn + 3.0), [128, 28, 128]);
        }
    }

    #[test]
    fn the_step_is_up_and_then_down() {
        let step = Motion {
            shape: Shape::Step,
            amplitude: 127,
            axes: vec![Axis::Roll],
        };
        for (seconds, roll) in [(0.0, 255), (1.99, 255), (2.0, 1), (3.99, 1), (4.0, 255)] {
            assert_eq!(at(&step, seconds), [128, roll, 128], "{seconds}");
        }
    }

    /// Counts the periods of the sine. In the middle of each period, pitch falls below the middle
    /// position.
    #[test]
    fn the_sweep_goes_up_and_down_in_frequency_without_jumps() {
        let sweep = Motion {
            shape: Shape::SineSweep,
            ..eight()
        };
        let pitch = |millisecond: u32| at(&sweep, f64::from(millisecond) / 1000.0)[0];
        let turns_between = |from: u32, to: u32| {
            (from * 1000..to * 1000)
                .filter(|&now| pitch(now) >= 128 && pitch(now + 1) < 128)
                .count()
        };
        assert_eq!(turns_between(0, 20), 21);
        assert_eq!(turns_between(0, 5), 3);
        assert_eq!(turns_between(5, 9), 6);
        assert_eq!(turns_between(20, 40), 21);
        for millisecond in 0..40_000 {
            let [now, next] = [millisecond, millisecond + 1].map(pitch);
            // 100 units at 2 Hz: at most 1.26 units per millisecond.
            assert!(now.abs_diff(next) <= 2, "{millisecond}: {now} to {next}");
        }
    }
}
