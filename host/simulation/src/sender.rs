//! The sender: one frame after the other.

use rand::{Rng, RngCore};

use crate::motion::SmoothMotion;
use crate::parameters::Parameters;
use crate::payload::{Frame, Payload};
use crate::random::{Purpose, Seed, whole};

/// What is sent, frame after frame, without end.
pub(crate) fn frames(parameters: &Parameters, seed: Seed) -> impl Iterator<Item = Frame> + use<> {
    let (format, payload) = (parameters.frame, parameters.payload);
    let mut random = seed.random(Purpose::Sender);
    // Two seconds from one point to the next.
    let mut motion = SmoothMotion::new(seed, whole(2.0 * parameters.rate).max(1));
    let repeated = match payload {
        Payload::Repeated(from, to) => [(); 4].map(|()| random.random_range(from..=to)),
        Payload::Constant(payload) => payload,
        Payload::Ambiguous => {
            let x = random.random();
            if random.random() {
                [0x0D, 0x41, 0x42, x]
            } else {
                [x, 0x0D, 0x41, 0x42]
            }
        }
        Payload::Motion | Payload::Random(..) | Payload::Noise => [0; 4],
    };
    (0..).map(move |slot| {
        let payload = match payload {
            Payload::Motion => {
                let [pitch, roll, yaw] = motion.setpoint(slot).into();
                [0, pitch, roll, yaw]
            }
            Payload::Random(from, to) => [(); 4].map(|()| random.random_range(from..=to)),
            Payload::Noise => {
                let bytes = random.next_u64().to_le_bytes().into_iter();
                return Frame {
                    bytes: bytes.take(format.length()).collect(),
                    setpoint: None,
                };
            }
            Payload::Repeated(..) | Payload::Constant(_) | Payload::Ambiguous => repeated,
        };
        Frame::new(format, payload)
    })
}
