//! What the simulated motion PC does, and when.

use framelock::Setpoint;
use framelock_simulation::SmoothMotion;

/// Where the simulator stands while it is parked. The frame that repeats it is
/// `41 42 00 41 42 00 0D`: its payload holds the sync bytes.
pub(super) const PARKED: Setpoint = Setpoint {
    pitch: 0x41,
    roll: 0x42,
    yaw: 0x00,
};

/// A part of the demonstration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Passage {
    /// Motion, over the line with its faults.
    Motion,
    /// The motion goes on, but nobody sends it.
    Silence,
    /// Smoothly to the parking position, over a line without faults.
    Parking,
    /// One frame for ever, over a line that loses a single byte.
    Parked,
}

impl Passage {
    /// What it is called where there is little room.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Silence => "silence",
            Self::Parking => "parking",
            Self::Parked => "parked",
        }
    }
}

/// The passages and how long each is, in parts of the whole.
const PASSAGES: [(Passage, u64); 6] = [
    (Passage::Motion, 18),
    (Passage::Silence, 7),
    (Passage::Motion, 9),
    (Passage::Parking, 2),
    (Passage::Parked, 10),
    (Passage::Motion, 6),
];

/// All of them.
const PARTS: u64 = 52;

/// When each passage is. Time is counted in frames: slot `n` begins when frame `n` is due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Script {
    /// How many slots there are.
    pub(super) slots: u64,
}

impl Script {
    /// The passage that the slot belongs to, the slot at which it began, and how many it has.
    pub(super) fn passage(self, slot: u64) -> (Passage, u64, u64) {
        let mut begin = 0;
        let mut parts_until = 0;
        for (passage, parts) in PASSAGES {
            parts_until += parts;
            let end = self.slots * parts_until / PARTS;
            if slot < end {
                return (passage, begin, end - begin);
            }
            begin = end;
        }
        (Passage::Motion, begin, 1)
    }

    /// Where the simulator is to be in the slot; ask for each slot in turn.
    pub(super) fn setpoint(self, slot: u64, motion: &mut SmoothMotion) -> Setpoint {
        let (passage, begin, length) = self.passage(slot);
        match passage {
            Passage::Motion | Passage::Silence => return motion.setpoint(slot),
            Passage::Parking if slot == begin => motion.go(slot, PARKED, length),
            Passage::Parked if slot == begin => motion.go(slot, PARKED, 0),
            _ => {}
        }
        motion.here(slot)
    }

    /// Whether the first byte of the slot's frame is lost although the line has no faults: once,
    /// soon after the simulator is parked.
    pub(super) fn loses_first_byte(self, slot: u64) -> bool {
        let (passage, begin, length) = self.passage(slot);
        passage == Passage::Parked && slot == begin + length / 10
    }
}

#[cfg(test)]
mod tests {
    use framelock_simulation::Seed;

    use super::*;

    fn motion(slots: u64, rate: u64, seed: u64) -> Vec<Setpoint> {
        let mut motion = SmoothMotion::new(Seed { seed, trial: 0 }, 2 * rate);
        let script = Script { slots };
        (0..slots)
            .map(|slot| script.setpoint(slot, &mut motion))
            .collect()
    }

    #[test]
    fn passages_follow_each_other_to_the_end() {
        for slots in [1, 2, 51, 52, 53, 1300, 86_400_000] {
            let script = Script { slots };
            let mut slot = 0;
            while slot < slots {
                let (_, begin, length) = script.passage(slot);
                assert_eq!(begin, slot);
                assert!(length > 0);
                assert_eq!(script.passage(slot + length - 1).1, begin);
                slot += length;
            }
            assert_eq!(slot, slots);
        }
    }

    #[test]
    fn the_motion_is_smooth() {
        for seed in 0..20 {
            for pair in motion(2600, 100, seed).windows(2) {
                let [before, after] = pair else { continue };
                let axes = <[u8; 3]>::from(*before)
                    .into_iter()
                    .zip(<[u8; 3]>::from(*after));
                for (before, after) in axes {
                    // The most is asked of the way to the parking position.
                    assert!(before.abs_diff(after) <= 4, "{before} to {after}");
                }
            }
        }
    }

    #[test]
    fn parked_means_the_one_payload() {
        let script = Script { slots: 1300 };
        let parked = (0..1300)
            .zip(motion(1300, 50, 1))
            .filter(|(slot, _)| script.passage(*slot).0 == Passage::Parked);
        assert_eq!(parked.clone().count(), 250);
        assert!(parked.clone().all(|(_, setpoint)| setpoint == PARKED));
        let lossy = parked.filter(|(slot, _)| script.loses_first_byte(*slot));
        assert_eq!(lossy.count(), 1);
    }
}
