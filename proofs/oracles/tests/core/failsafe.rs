//! Compares the failsafe with the model in its fuzz oracle, and with known outputs at some times.

use std::sync::Mutex;

use framelock::motion::{Failsafe, FailsafeError, Output, Phase, Setpoint};
use framelock_oracles::{Occurred, Schedule, ScheduleStep, failsafe};
use proptest::prelude::*;

type FailsafeParameters = framelock::motion::FailsafeParameters<u8, 3>;

/// The firmware's parameters: a clock of microseconds, polls every 2 ms, frames every 20 ms.
const FIRMWARE: FailsafeParameters = FailsafeParameters::for_clock(1_000_000, TICK, [128; 3]);
const TICK: u32 = 2_000;
/// The largest difference between two outputs in a row, and the largest one without frames.
const MOST: u8 = 6;
const MOST_WITHOUT_FRAMES: u8 = 2;

#[test]
fn the_firmwares_bounds() {
    assert_eq!(FIRMWARE.check(), Ok(()));
    assert_eq!(FIRMWARE.most_per_poll(), u32::from(MOST));
    // 0.5 s, and 128 units at 255 units a second.
    assert_eq!(FIRMWARE.parked_after(), 500_000 + 501_984);
    // 1 s, and the whole travel at 4 278 of 2^32 a tick.
    const { assert!(FIRMWARE.live_after() == 1_000_000 + 1_000_045) };
}

/// The axis with the longest way to park decides, whichever axis it is.
#[test]
fn any_axis_may_be_the_last_to_park() {
    for park in [[255, 128, 90], [128, 0, 128], [90, 128, 255]] {
        let parameters = FailsafeParameters { park, ..FIRMWARE };
        let expected = FailsafeParameters {
            park: [0; 3],
            ..FIRMWARE
        };
        assert_eq!(parameters.parked_after(), expected.parked_after());
        let farthest = park.map(|park| if park > 127 { 0 } else { 255 });
        let mut failsafe = Failsafe::resumed(parameters, 0, farthest).expect("valid");
        let way = parameters.parked_after() - u64::from(parameters.ramp_after);
        let mut polls = (0_u32..).step_by(TICK as usize);
        let parked = polls.find(|now| failsafe.poll(*now).phase == Phase::Parked);
        let late = u64::from(parked.expect("it parks")).abs_diff(way);
        assert!(late <= TICK.into(), "{park:?}: {late}");
    }
}

/// The usual times are right for every clock, not only for one that counts milliseconds.
#[test]
fn the_usual_times_are_the_same_for_every_clock() {
    for clock in [1_000, 1_024, 32_768, 62_500, 16_000_000] {
        let usual = FailsafeParameters::for_clock(clock, 20 * clock / 1_000, [128; 3]);
        for (time, tenths) in [
            (usual.hold_after, 1),
            (usual.ramp_after, 5),
            (usual.approach_for, 10),
            (usual.approach_travel, 10),
            (usual.live_travel, 2),
        ] {
            // Cut off to whole ticks.
            assert_eq!(time, clock * tenths / 10, "{clock} {tenths}");
        }
        assert_eq!(usual.longest_step, 2 * (20 * clock / 1_000));
        assert_eq!(usual.check(), Ok(()), "{clock}");
    }
}

/// A failsafe with its clock, which polls every 2 ms and checks each output against the one before.
struct Rig {
    failsafe: Failsafe<u8, 3>,
    now: u32,
    last: Output<u8, 3>,
}

impl Rig {
    fn new() -> Self {
        let mut failsafe = Failsafe::new(FIRMWARE, 0).expect("valid");
        let last = failsafe.poll(0);
        Self {
            failsafe,
            now: 0,
            last,
        }
    }

    fn poll_at(&mut self, now: u32) -> Output<u8, 3> {
        self.now = now;
        let output = self.failsafe.poll(now);
        let most = match output.phase {
            Phase::Live | Phase::Approach => MOST,
            _ => MOST_WITHOUT_FRAMES,
        };
        for (from, to) in self.last.axes.into_iter().zip(output.axes) {
            assert!(from.abs_diff(to) <= most, "{:?} {output:?}", self.last);
        }
        self.last = output;
        output
    }

    fn poll(&mut self) -> Output<u8, 3> {
        self.poll_at(self.now.wrapping_add(TICK))
    }

    /// Sends a frame every 20 ms for this many milliseconds. Returns the last output.
    fn frames(&mut self, milliseconds: u32, demands: impl Fn(f64) -> [u8; 3]) -> Output<u8, 3> {
        for tick in 0..milliseconds / 2 {
            if tick % 10 == 0 {
                self.failsafe.frame(demands(f64::from(tick) / 500.0));
            }
            self.poll();
        }
        self.last
    }

    /// Polls without frames for this many milliseconds. Returns the last output.
    fn silence(&mut self, milliseconds: u32) -> Output<u8, 3> {
        for _ in 0..milliseconds / 2 {
            self.poll();
        }
        self.last
    }

    fn live(at: [u8; 3]) -> Self {
        let mut rig = Self::new();
        let output = rig.frames(2_500, |_| at);
        assert_eq!((output.axes, output.phase), (at, Phase::Live));
        rig
    }
}

#[test]
fn a_clock_that_goes_back_moves_nothing() {
    for back in [1, 2, 1_000, 0x7FFF_FFFF] {
        let mut rig = Rig::live([255; 3]);
        let before = rig.last;
        assert_eq!(rig.poll_at(rig.now.wrapping_sub(back)), before);
        assert_eq!(rig.failsafe.clock_faults(), 1);
        // From then on, the time goes on from there.
        assert_eq!(rig.frames(1_000, |_| [255; 3]), before);
        assert_eq!(rig.failsafe.clock_faults(), 1);
    }
    // A clock that only goes back moves nothing, ever.
    let mut rig = Rig::live([255; 3]);
    let before = rig.last;
    for _ in 0..1_000 {
        rig.failsafe.frame([0; 3]);
        assert_eq!(rig.poll_at(rig.now.wrapping_sub(TICK)).axes, before.axes);
    }
    assert_eq!(rig.failsafe.clock_faults(), 1_000);
}

#[test]
fn a_late_poll_moves_an_axis_no_further_than_any_poll() {
    for (stall, has_frame, at, phase) in [
        (5_000, false, 255, Phase::Live),
        (5_000, true, 249, Phase::Live), // 4 ms of live movement
        (99_000, false, 255, Phase::Hold),
        (99_000, true, 255, Phase::Hold),
        (100_000, true, 255, Phase::Hold),
        (2_000_000, false, 253, Phase::Ramp),
        (2_000_000, true, 253, Phase::Ramp),
        (2_000_000_000, true, 253, Phase::Ramp),
    ] {
        let mut rig = Rig::live([255; 3]);
        if has_frame {
            rig.failsafe.frame([0; 3]);
        }
        let output = rig.poll_at(rig.now.wrapping_add(stall));
        assert_eq!(
            (output.axes, output.phase),
            ([at; 3], phase),
            "{stall} {has_frame}"
        );
        assert_eq!(rig.failsafe.late_polls(), 1);
    }
}

/// A frame that equals the present output does not end the approach.
#[test]
fn a_start_at_the_centre_is_still_slow() {
    let mut rig = Rig::new();
    assert_eq!(rig.frames(100, |_| [128; 3]).phase, Phase::Approach);
    let before = rig.last.axes;
    let output = rig.frames(100, |_| [255, 0, 255]);
    assert_eq!(output.phase, Phase::Approach);
    // 255 units a second.
    for (from, to) in before.into_iter().zip(output.axes) {
        assert!(from.abs_diff(to) <= 26, "{output:?}");
    }
    // At the centre all the time, the approach ends a second after the third frame, and no earlier.
    let mut rig = Rig::new();
    assert_eq!(rig.frames(1_040, |_| [128; 3]).phase, Phase::Approach);
    assert_eq!(rig.frames(2, |_| [128; 3]).phase, Phase::Live);
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a demand"
)]
fn whole(demand: f64) -> u8 {
    demand.round() as u8
}

/// The axes need not be at their demands at the same time.
#[test]
fn an_approach_ends_in_any_motion() {
    let sines = |amplitude: f64, hertz: [f64; 3]| {
        move |time: f64| {
            let turn = std::f64::consts::TAU;
            let [a, b, c] = hertz;
            [(a, 0.0), (b, 1.0), (c, 2.0)].map(|(hertz, third)| {
                let angle = turn * (hertz * time + third / 3.0);
                whole(128.0 + amplitude * angle.sin())
            })
        }
    };
    for (amplitude, hertz) in [
        (60.0, [1.0, 1.0, 1.0]),
        (100.0, [1.0, 1.3, 0.8]),
        (20.0, [5.0, 4.0, 3.0]),
        (127.0, [3.0; 3]),
    ] {
        let motion = sines(amplitude, hertz);
        let mut rig = Rig::new();
        // The third frame is taken after 42 ms. From then on, the stated time is 2 000 045 µs.
        rig.frames(2_044, motion);
        assert_eq!(rig.last.phase, Phase::Live, "{amplitude} {hertz:?}");
        // An axis covers the travel in 0.2 s, so it is where the frame before the last one asked, or nearer.
        let fastest = hertz.into_iter().fold(0.0, f64::max) * std::f64::consts::TAU * amplitude;
        if fastest < 255.0 * 5.0 {
            for _ in 0..500 {
                let start = f64::from(rig.now - TICK) / 1e6;
                let output = rig.frames(20, |time| motion(start + time));
                for (at, demand) in output.axes.into_iter().zip(motion(start)) {
                    assert!(at.abs_diff(demand) <= 3, "{amplitude} {hertz:?} {output:?}");
                }
            }
        }
    }
    // A demand that flees from the output can do so only for as long as an axis takes for the whole travel.
    let mut rig = Rig::new();
    rig.frames(100, |_| [0; 3]);
    rig.frames(900, |_| [0; 3]);
    assert_eq!(rig.frames(2_000, |_| [255; 3]).phase, Phase::Live);
}

#[test]
fn a_false_frame_moves_a_parked_axis_not_at_all_and_a_live_one_slowly() {
    let mut rig = Rig::new();
    for _ in 0..50 {
        // One or two frames now and then move nothing.
        for _ in 0..2 {
            rig.failsafe.frame([255, 0, 17]);
            rig.poll();
        }
        let output = rig.silence(100);
        assert_eq!((output.axes, output.phase), ([128; 3], Phase::Parked));
    }
    // In a hold, they neither move the output nor delay the ramp.
    let mut rig = Rig::live([255; 3]);
    rig.silence(200);
    rig.failsafe.frame([0; 3]);
    assert_eq!(rig.silence(278).axes, [255; 3]);
    assert_eq!(rig.last.phase, Phase::Hold);
    assert_eq!(rig.silence(4).phase, Phase::Ramp);
    // A wrong bit in one frame, for 20 ms.
    let mut rig = Rig::live([200; 3]);
    rig.failsafe.frame([72, 200, 200]);
    let lowest = (0..10).map(|_| rig.poll().axes[0]).min();
    assert_eq!(lowest, Some(200 - 26));
    let output = rig.frames(20, |_| [200; 3]);
    assert_eq!((output.axes, output.phase), ([200; 3], Phase::Live));
}

/// Frames that come further apart than `hold_after` move nothing, and are counted.
#[test]
fn slow_frames_are_counted() {
    for (frames_apart, phase, slow_frames) in [
        (50, Phase::Live, 0),
        (98, Phase::Live, 0),
        (100, Phase::Parked, 99),
        (1_000, Phase::Parked, 99),
    ] {
        let mut rig = Rig::new();
        for _ in 0..100 {
            rig.failsafe.frame([128; 3]);
            rig.silence(frames_apart);
        }
        assert_eq!(rig.last.phase, phase, "{frames_apart}");
        assert_eq!(rig.failsafe.slow_frames(), slow_frames, "{frames_apart}");
    }
    // Without frames, nothing is counted. The first frame after an outage is slow, too.
    let mut rig = Rig::new();
    rig.silence(5_000);
    assert_eq!(rig.failsafe.slow_frames(), 0);
    rig.frames(1_000, |_| [128; 3]);
    rig.silence(5_000);
    assert_eq!(rig.failsafe.slow_frames(), 0);
    rig.frames(1_000, |_| [128; 3]);
    assert_eq!(rig.failsafe.slow_frames(), 1);
}

/// Frames that waited during a stall count as one.
#[test]
fn stale_frames_do_not_start() {
    let mut rig = Rig::new();
    for _ in 0..10 {
        rig.failsafe.frame([255; 3]);
    }
    assert_eq!(rig.poll().phase, Phase::Parked);
}

#[test]
fn parameters_are_checked() {
    use FailsafeError as E;
    let with = |change: fn(&mut FailsafeParameters)| {
        let mut parameters = FIRMWARE;
        change(&mut parameters);
        assert_eq!(Failsafe::new(parameters, 0).err(), parameters.check().err());
        parameters.check().err()
    };
    assert_eq!(with(|p| p.longest_step = 0), Some(E::NoStep));
    assert_eq!(with(|p| p.hold_after = 3_999), Some(E::HoldWithinStep));
    assert_eq!(with(|p| p.hold_after = 4_000), None);
    assert_eq!(with(|p| p.ramp_after = 99_999), Some(E::RampBeforeHold));
    assert_eq!(with(|p| p.ramp_after = 100_000), None);
    assert_eq!(with(|p| p.frames_to_start = 1), Some(E::SingleFrame));
    assert_eq!(with(|p| p.frames_to_start = 2), None);
    assert_eq!(with(|p| p.approach_for = 0), Some(E::NoApproach));
    assert_eq!(with(|p| p.live_travel = 15_999), Some(E::LiveTooFast));
    assert_eq!(with(|p| p.live_travel = 16_000), None);
    assert_eq!(
        with(|p| p.approach_travel = 199_999),
        Some(E::ApproachFasterThanLive)
    );
    assert_eq!(with(|p| p.approach_travel = 0x7FFF_FFFF), None);
    assert_eq!(
        with(|p| p.approach_travel = 0x8000_0000),
        Some(E::ApproachTooSlow)
    );
    assert_eq!(
        E::RampBeforeHold.to_string(),
        "ramp_after is less than hold_after"
    );
}

#[test]
fn resumed_it_begins_at_the_output_and_moves_to_park() {
    let output = Setpoint {
        pitch: 130,
        roll: 128,
        yaw: 0,
    };
    let mut failsafe = Failsafe::resumed(FIRMWARE, 7, output).expect("valid");
    let first = failsafe.poll(7);
    assert_eq!((first.axes, first.phase), (output.into(), Phase::Ramp));
    let yaws: Vec<u8> = (1..=252)
        .map(|tick| failsafe.poll(7 + TICK * tick).axes[2])
        .collect();
    assert_eq!(
        [yaws[0], yaws[1], yaws[9], yaws[99], yaws[251]],
        [0, 1, 5, 50, 128]
    );
    assert_eq!(failsafe.poll(8 + TICK * 252).phase, Phase::Parked);
}

/// A silence that is longer than the clock's period is still a silence.
#[test]
fn the_longest_times_do_not_wrap_into_life() {
    let mut rig = Rig::live([255; 3]);
    for _ in 0..5 {
        let output = rig.poll_at(rig.now.wrapping_add(u32::MAX / 2));
        assert_eq!(output.phase, Phase::Ramp);
    }
    assert_eq!(rig.silence(1_000).phase, Phase::Parked);
}

/// Even the largest times that `check` accepts bound the output, and end.
#[test]
fn the_largest_parameters() {
    let parameters = FailsafeParameters {
        park: [128; 3],
        longest_step: u32::MAX / 8,
        hold_after: u32::MAX,
        ramp_after: u32::MAX,
        frames_to_start: u8::MAX,
        approach_for: u32::MAX,
        approach_travel: u32::MAX / 2,
        live_travel: u32::MAX / 2,
    };
    assert_eq!(parameters.check(), Ok(()));
    // A quarter of 255 units.
    assert!(parameters.most_per_poll() <= 64);
    let mut failsafe = Failsafe::new(parameters, 0).expect("valid");
    let (mut now, mut clock) = (0, 0_u32);
    let mut poll = |has_frame| {
        if has_frame {
            failsafe.frame([255; 3]);
        }
        now += u64::from(parameters.longest_step);
        clock = clock.wrapping_add(parameters.longest_step);
        (now, failsafe.poll(clock))
    };
    for _ in 1..255 {
        assert_eq!(poll(true).1.axes, [128; 3]);
    }
    let (start, output) = poll(true);
    assert_eq!(output.phase, Phase::Approach);
    let live = loop {
        let (now, output) = poll(true);
        if output.phase == Phase::Live {
            break now - start;
        }
    };
    assert!(u64::from(parameters.approach_for) <= live);
    assert!(live < parameters.live_after() + u64::from(parameters.longest_step));
    let last = loop {
        let (now, output) = poll(false);
        if output.phase != Phase::Live {
            break now;
        }
    };
    let parked = loop {
        let (now, output) = poll(false);
        if output.phase == Phase::Parked {
            break now;
        }
    };
    assert!(parked - last <= parameters.parked_after());
}

/// Six axes of 16 bits.
#[test]
fn six_axes_of_sixteen_bits() {
    let park = [0_u16, 1, 2, 3, 4, 0x8000];
    let parameters = framelock::motion::FailsafeParameters::for_clock(1_000_000, TICK, park);
    assert_eq!(parameters.most_per_poll(), 1_311);
    let mut failsafe = Failsafe::resumed(parameters, 0, [u16::MAX; 6]).expect("valid");
    assert_eq!(failsafe.poll(TICK).axes, [u16::MAX - 132; 6]);
    for tick in 2..=500 {
        failsafe.poll(TICK * tick);
    }
    let output = failsafe.poll(TICK * 501);
    assert_eq!((output.axes, output.phase), (park, Phase::Parked));
}

/// Draws demands, half of them so close to each other that an axis soon reaches the next one.
fn demands() -> impl Strategy<Value = [u8; 3]> {
    prop_oneof![any::<[u8; 3]>(), [100..103_u8, 100..103, 100..103]]
}

fn any_parameters(most: u32) -> impl Strategy<Value = FailsafeParameters> {
    let time = move || 1..=most;
    (
        [time(), time(), time(), time(), time(), time()],
        2..6_u8,
        demands(),
    )
        .prop_map(
            |([longest_step, hold, ramp, approach_for, live, approach], frames_to_start, park)| {
                let live = longest_step
                    .saturating_mul(4)
                    .saturating_add(live - 1)
                    .min(u32::MAX / 2);
                let hold_after = longest_step.saturating_add(hold - 1);
                FailsafeParameters {
                    park,
                    longest_step,
                    hold_after,
                    ramp_after: hold_after.saturating_add(ramp - 1),
                    frames_to_start,
                    approach_for,
                    approach_travel: live.saturating_add(approach - 1).min(u32::MAX / 2),
                    live_travel: live,
                }
            },
        )
}

/// The phases and counters of the random schedules.
static OCCURRED: Mutex<Occurred> = Mutex::new(Occurred::NOTHING);

#[test]
fn goes_as_the_model_does() {
    any_schedule();
    let missing = OCCURRED.lock().expect("no count panics").missing();
    assert!(missing.is_empty(), "{missing:?}");
}

proptest! {
    /// The failsafe gives the same outputs as the oracle's model, for frames and polls after short and long waits, even
    /// if the clock wraps.
    fn any_schedule(
        parameters in prop_oneof![any_parameters(20), any_parameters(300), any_parameters(1 << 28)],
        start in prop_oneof![any::<u32>(), u32::MAX - 500..=u32::MAX],
        steps in prop::collection::vec(
            prop_oneof![
                4 => (0..20_u32).prop_map(ScheduleStep::Wait),
                2 => (0..400_u32).prop_map(ScheduleStep::Wait),
                1 => (0..400_u32).prop_map(|ticks| ScheduleStep::Wait(0_u32.wrapping_sub(ticks))),
                1 => any::<u32>().prop_map(ScheduleStep::Wait),
                8 => demands().prop_map(ScheduleStep::Frame),
            ],
            0..200,
        ),
    ) {
        let run = failsafe(&Schedule { parameters, start, steps }).expect("no contradiction");
        OCCURRED.lock().expect("no count panics").count_failsafe(&run);
    }
}
