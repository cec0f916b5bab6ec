//! The script of the simulated motion PC.

use framelock::motion::Setpoint;
use framelock_simulation::SmoothMotion;

/// The setpoint at which the seat stands still. Its frame is `41 42 00 41 42 00 0D`, so the payload
/// contains the sync bytes.
pub(super) const STILL: Setpoint = Setpoint {
    pitch: 0x41,
    roll: 0x42,
    yaw: 0x00,
};

/// A part of the demonstration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Passage {
    /// The PC repeats one frame, over a line that loses a single byte.
    Still,
    /// The seat moves, over the faulty line.
    Ride,
    /// The motion goes on, but the PC sends no frames.
    Silence,
    /// The seat moves over the faulty line again, as before the silence.
    Again,
}

/// The parts of the demonstration and their lengths, in units of 1 / [`PARTS`] of the whole demonstration.
const PASSAGES: [(Passage, u64); 4] = [
    (Passage::Still, 8),
    (Passage::Ride, 5),
    (Passage::Silence, 4),
    (Passage::Again, 3),
];

/// The sum of all lengths in [`PASSAGES`].
const PARTS: u64 = 20;

/// The schedule of the demonstration's parts. Time is counted in slots: slot `n` begins when frame `n` is due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Script {
    /// The number of slots.
    pub(super) slots: u64,
}

impl Script {
    /// Returns the part to which a slot belongs, the part's first slot, and the part's number of slots.
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
        (Passage::Again, begin, 1)
    }

    /// Returns the setpoint of a slot. Call this for every slot, in order.
    pub(super) fn setpoint(self, slot: u64, motion: &mut SmoothMotion) -> Setpoint {
        if self.passage(slot).0 != Passage::Still {
            return motion.setpoint(slot);
        }
        if slot == 0 {
            motion.go(slot, STILL, 0);
        }
        motion.here(slot)
    }

    /// Returns whether the line loses the first byte of the slot's frame. This happens once, while the
    /// seat stands still and the line has no other faults.
    pub(super) fn loses_first_byte(self, slot: u64) -> bool {
        let (passage, begin, length) = self.passage(slot);
        passage == Passage::Still && slot == begin + length / 4
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
        for slots in [1, 2, 19, 20, 21, 1000, 86_400_000] {
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
    fn while_the_seat_stands_still_one_payload_repeats_and_one_byte_is_lost() {
        let script = Script { slots: 1000 };
        let still = (0..1000)
            .zip(motion(1000, 50, 1))
            .filter(|(slot, _)| script.passage(*slot).0 == Passage::Still);
        assert_eq!(still.clone().count(), 400);
        assert!(still.clone().all(|(_, setpoint)| setpoint == STILL));
        let lossy = still.filter(|(slot, _)| script.loses_first_byte(*slot));
        assert_eq!(lossy.count(), 1);
    }
}
