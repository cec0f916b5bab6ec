//! What really arrived: known to the simulation, and to no receiver.

use framelock::Setpoint;

/// A byte's place in what was sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Origin {
    /// The frame's number.
    pub(super) frame: u64,
    /// The byte's place in it, from 0.
    pub(super) place: usize,
}

/// A sent frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SentFrame {
    pub(super) number: u64,
    pub(super) setpoint: Setpoint,
    /// When its first start bit began, in time steps.
    pub(super) begin: u64,
    /// Whether every byte of it arrived as it was sent, and nothing between them.
    pub(super) is_intact: bool,
}

/// Follows the bytes that are delivered.
#[derive(Debug)]
pub(super) struct Truth {
    length: usize,
    /// The bytes delivered last are the first so many of that frame, and as they were sent.
    intact: Option<(u64, usize)>,
    /// The same, whether or not they are as they were sent.
    aligned: Option<(u64, usize)>,
}

/// What a delivered byte ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Ends {
    /// The frame that arrived intact.
    pub(super) intact: Option<u64>,
    /// The frame of which every byte came, in its order, but some perhaps with another value.
    pub(super) aligned: Option<u64>,
}

impl Truth {
    /// Frames have `length` bytes.
    pub(super) fn new(length: usize) -> Self {
        Self {
            length,
            intact: None,
            aligned: None,
        }
    }

    /// A byte is delivered: where it comes from, if it does come from a frame, and whether it is as
    /// it was sent.
    pub(super) fn deliver(&mut self, origin: Option<Origin>, is_as_sent: bool) -> Ends {
        self.aligned = extended(self.aligned, origin);
        self.intact = extended(self.intact, origin.filter(|_| is_as_sent));
        let whole = |run: Option<(u64, usize)>| {
            let (frame, bytes) = run?;
            (bytes == self.length).then_some(frame)
        };
        Ends {
            intact: whole(self.intact),
            aligned: whole(self.aligned),
        }
    }

    /// The UART reports an error: a frame under way does not arrive intact.
    pub(super) fn line_error(&mut self) {
        self.intact = None;
    }
}

fn extended(run: Option<(u64, usize)>, origin: Option<Origin>) -> Option<(u64, usize)> {
    let Origin { frame, place } = origin?;
    (place == 0 || run == Some((frame, place))).then_some((frame, place + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(bytes: &[(u64, usize, bool)]) -> (Vec<u64>, Vec<u64>) {
        let mut truth = Truth::new(3);
        let (mut intact, mut aligned) = (Vec::new(), Vec::new());
        for &(frame, place, is_as_sent) in bytes {
            let ends = truth.deliver(Some(Origin { frame, place }), is_as_sent);
            intact.extend(ends.intact);
            aligned.extend(ends.aligned);
        }
        (intact, aligned)
    }

    #[test]
    fn a_frame_is_intact_if_all_of_it_came_as_it_was_sent() {
        let whole = [(0, 0, true), (0, 1, true), (0, 2, true)];
        assert_eq!(ended(&whole), (vec![0], vec![0]));
        let corrupted = [(0, 0, true), (0, 1, false), (0, 2, true)];
        assert_eq!(ended(&corrupted), (vec![], vec![0]));
        let lost = [(0, 0, true), (0, 2, true), (1, 0, true)];
        assert_eq!(ended(&lost), (vec![], vec![]));
        let across = [(0, 0, true), (1, 1, true), (0, 2, true)];
        assert_eq!(ended(&across), (vec![], vec![]));
        // A doubled first byte leaves a whole frame behind the double; any other does not.
        let first_doubled = [(0, 0, true), (0, 0, true), (0, 1, true), (0, 2, true)];
        assert_eq!(ended(&first_doubled), (vec![0], vec![0]));
        let doubled = [(0, 0, true), (0, 1, true), (0, 1, true), (0, 2, true)];
        assert_eq!(ended(&doubled), (vec![], vec![]));
    }

    #[test]
    fn what_comes_between_breaks_a_frame() {
        let first = Some(Origin { frame: 0, place: 0 });
        let second = Some(Origin { frame: 0, place: 1 });
        let mut truth = Truth::new(2);
        truth.deliver(first, true);
        truth.deliver(None, true);
        assert_eq!(
            truth.deliver(second, true),
            Ends {
                intact: None,
                aligned: None
            }
        );
        truth.deliver(first, true);
        truth.line_error();
        assert_eq!(
            truth.deliver(second, true),
            Ends {
                intact: None,
                aligned: Some(0)
            }
        );
    }
}
