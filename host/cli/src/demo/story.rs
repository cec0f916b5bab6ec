//! Explains the demonstration to somebody who has never heard of it.

use super::demonstration::Demonstration;
use super::script::Passage;

/// A heading and a few plain sentences, in lines of at most 78 columns.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Story {
    pub(super) heading: &'static str,
    pub(super) text: &'static str,
}

/// Returns the story of the current passage.
pub(super) fn story(demonstration: &Demonstration) -> Story {
    let [lecture, _] = &demonstration.lanes;
    let is_deaf = lecture.deaf(demonstration.now).is_some();
    let (heading, text) = match demonstration.passage() {
        Passage::Still if is_deaf => (
            "ONE LOST BYTE",
            "One byte was lost, and one frame with it. Since then the lecture's machine\n\
             takes the AB inside each frame for its start, finds no CR at the end, and\n\
             starts over. The line is fine again, but this receiver is deaf: its failsafe\n\
             parks the seat. framelock looks at the bytes again, and hears the next frame.",
        ),
        Passage::Still => (
            "STANDING STILL",
            "A PC tells a motion seat where to be, 10 times a second, over a serial line.\n\
             Two receivers hear it: the usual state machine, from a lecture, and framelock.\n\
             The seat stands still, so one frame repeats. By chance its position holds the\n\
             bytes AB, which also start a frame.",
        ),
        Passage::Ride => (
            "A BAD LINE",
            "The ride begins. The position changes, so the lecture's machine finds its way\n\
             back. Now the line loses a byte here and there. framelock loses the frame that\n\
             the byte was in; the lecture's machine often misses the next one as well.",
        ),
        Passage::Silence => (
            "SILENCE",
            "The PC sends nothing, so no frame can arrive. After each receiver comes\n\
             framelock's failsafe: it holds the seat in its place, then moves it slowly to\n\
             the middle and parks it there.",
        ),
        Passage::Again => (
            "BACK AGAIN",
            "Frames arrive again. The failsafe moves the seat slowly to the position that\n\
             the PC sends, then lets it follow.",
        ),
    };
    Story { heading, text }
}
