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

/// Frames per second, slow enough to watch each frame. Motion software sends 50 or more.
pub(super) const RATE: u64 = 10;

/// The parts of the demonstration and their lengths in seconds.
const PASSAGES: [(Passage, u64); 4] = [
    (Passage::Still, 8),
    (Passage::Ride, 5),
    (Passage::Silence, 4),
    (Passage::Again, 3),
];

/// The length of the demonstration in seconds: the sum of all lengths in [`PASSAGES`].
pub(super) const SECONDS: u64 = 20;

/// The slot whose frame loses its first byte. In this slot the seat stands still, and the line has no other faults.
pub(super) const LOSS: u64 = 2 * RATE;

/// Returns the part to which a slot belongs. Slot `n` begins when frame `n` is due.
pub(super) fn passage(slot: u64) -> Passage {
    let mut until = 0;
    for (passage, seconds) in PASSAGES {
        until += seconds * RATE;
        if slot < until {
            return passage;
        }
    }
    Passage::Again
}

/// Returns the setpoint of a slot. Call this for every slot, in order.
pub(super) fn setpoint(slot: u64, motion: &mut SmoothMotion) -> Setpoint {
    if passage(slot) != Passage::Still {
        return motion.setpoint(slot);
    }
    if slot == 0 {
        motion.go(slot, STILL, 0);
    }
    motion.here(slot)
}

#[cfg(test)]
mod tests {
    use framelock_simulation::Seed;

    use super::*;

    #[test]
    fn passages_follow_each_other_to_the_end() {
        let all = PASSAGES
            .iter()
            .flat_map(|&(passage, seconds)| (0..seconds * RATE).map(move |_| passage));
        assert!((0..SECONDS * RATE).map(passage).eq(all));
    }

    #[test]
    fn while_the_seat_stands_still_one_payload_repeats_and_one_byte_is_lost() {
        let mut motion = SmoothMotion::new(Seed { seed: 1, trial: 0 }, 2 * RATE);
        let still = (0..8 * RATE).map(|slot| setpoint(slot, &mut motion));
        assert!(still.eq([STILL; 80]));
        assert_eq!(passage(LOSS), Passage::Still);
    }
}
