//! Hints: messages that say why the bytes of a stream are in no frame. A hint states a reason only if the bytes show
//! it.
//!
//! Hints are found by trying: the beginning of a bad stream is received in other notations, with changed bytes or line
//! ends, as frames of other descriptions, and with other checksums. The hint names the first way in which nearly all
//! bytes become frames, unless this may be a coincidence.

use std::collections::HashSet;

use clap::ValueEnum as _;
use framelock::BufferedReceiver;
use framelock_description::SHIPPED;
use framelock_formats::AnyOf;
use framelock_formats::layout::{CheckedLayout, Checksum, Layout};
use framelock_receiving::{AnyLine, Policy, Protocol};

use super::summary::Summary;
use crate::input::{Arrivals, Input, InputNotation};

/// A stream, and how it was received.
pub(super) struct Stream<'s> {
    pub(super) protocol: &'s Protocol,
    /// The first bytes of the stream.
    pub(super) beginning: &'s [u8],
    pub(super) summary: &'s Summary,
    /// Whether pauses are reported to the receiver.
    pub(super) has_pauses: bool,
}

/// The end of a hint, which names a change of the input or of the frames, such as ` with --input hex`. Empty if nothing
/// changes.
type Change = String;

/// A function that receives bytes. For each frame, it returns the index of the frame's kind, and the frame's length.
type Receiver<'r> = Box<dyn Fn(&[u8]) -> Vec<(usize, usize)> + 'r>;

impl Stream<'_> {
    /// Returns a hint if most bytes are in no frame, or if many bytes are in no frame and the bytes show the reason.
    pub(super) fn hint(&self) -> Option<String> {
        let (bytes, discarded) = (self.summary.bytes, self.summary.discarded);
        let is_good = |share| self.summary.frames > 0 && discarded <= bytes / share;
        if bytes == 0 || is_good(8) {
            return None;
        }
        let advice = match self.change(!is_good(2)) {
            Some(change) => format!("nearly all would be in frames{change}"),
            None if is_good(2) => return None,
            None => self.general_advice().to_owned(),
        };
        let protocol = self.protocol;
        let place = format!("{discarded} of {bytes} bytes are in no frame of {protocol}");
        Some(format!("{place}; {advice}"))
    }

    /// Returns the advice for a stream in which no change shows the reason.
    fn general_advice(&self) -> &'static str {
        let needs_pauses = self.protocol.description.ending_event().is_some();
        if needs_pauses && !self.has_pauses {
            "silence ends these frames: read a port, a live stream or a file with times, with --idle-gap"
        } else if self.is_decimal_text() {
            "the input looks like text with decimal numbers: describe it as axes-text does (see docs/own-frame.md)"
        } else {
            "check --frame, --input, the baud rate and parity, and whether the line is inverted"
        }
    }

    /// Returns true if the beginning is text that consists mostly of decimal numbers, and is neither frames nor bytes
    /// in another notation.
    fn is_decimal_text(&self) -> bool {
        let bytes = self.beginning;
        let digits = bytes.iter().filter(|byte| byte.is_ascii_digit()).count();
        let is_mostly = |(input, spelled): &(Change, Vec<u8>)| {
            let is_of_text = input.ends_with("hex") || input.ends_with("csv");
            is_of_text && 64 * spelled.len() > bytes.len()
        };
        let is_number_text = is_text(bytes) && 10 * digits > 3 * bytes.len();
        self.summary.frames == 0 && is_number_text && !self.inputs().iter().any(is_mostly)
    }

    /// Returns the first change after which nearly all bytes of the beginning are in frames. If `is_bad` is false,
    /// tries only other checksums and notations.
    fn change(&self, is_bad: bool) -> Option<Change> {
        // Many descriptions fit a stream with few different values, such as zeros.
        if self.beginning.iter().collect::<HashSet<_>>().len() < 4 {
            return None;
        }
        let mut receivers = vec![(Change::new(), receiver(self.protocol.clone()))];
        receivers.extend(with_changed_checksums(self.protocol));
        for (name, _) in SHIPPED.iter().filter(|_| is_bad) {
            let shipped = Protocol::named(name).ok()?;
            let layouts = shipped.description.format().all();
            let marks = |it: &CheckedLayout| it.sync.length + it.terminator.length;
            let has_marks = |it: &CheckedLayout| marks(it) > 0 || it.checksum.is_some();
            // Packets that may contain any bytes fit too many streams.
            if layouts.iter().all(has_marks) {
                receivers.push((format!(" of {name} (--frame {name})"), receiver(shipped)));
            }
        }
        let mut inputs = self.inputs();
        inputs.retain(|(input, _)| is_bad || input.is_empty() || input.contains("--input"));
        for (frames, receive) in &receivers {
            for (input, bytes) in &inputs {
                let received = receive(bytes);
                let are_nearly_all = 4 * sum_of_lengths(&received) > 3 * bytes.len();
                // Valid text in another notation that contains the user's frames is no coincidence.
                let is_text = frames.is_empty() && input.contains("--input");
                if are_nearly_all && (is_text || !may_be_chance(&received, receive)) {
                    // If more than one in sixteen of the user's checksums are right, this is no coincidence: the
                    // checksum in the user's description is right, but the line may have errors.
                    let right = receivers[0].1(bytes).len();
                    let has_errors = frames == ANY_CHECKSUM && 16 * right > received.len();
                    let change = [&**frames, input].concat();
                    return Some(change).filter(|change| !change.is_empty() && !has_errors);
                }
            }
        }
        None
    }

    /// Returns the beginning of the stream as it is, with each change of its bytes, and as read in each other notation.
    fn inputs(&self) -> Vec<(Change, Vec<u8>)> {
        let bytes = self.beginning;
        let each = |change: fn(&u8) -> u8| bytes.iter().map(change).collect();
        let mut inputs = Vec::new();
        let mut add = |change: &str, bytes: Vec<u8>| inputs.push((change.to_owned(), bytes));
        add("", bytes.to_vec());
        add(" with --data-bits 7", each(|byte| byte & 0x7F));
        add(" if every bit were inverted", each(|byte| !byte));
        let line_ends = [("CR LF", "\r\n"), ("CR", "\r"), ("LF", "\n")];
        for (name, end) in line_ends.into_iter().filter(|_| is_text(bytes)) {
            let lines = bytes.split(|byte| b"\r\n".contains(byte));
            let lines = lines.filter(|line| !line.is_empty());
            let lines = lines.flat_map(|line| [line, end.as_bytes()].concat());
            add(&format!(" if lines ended with {name}"), lines.collect());
        }
        // The first notation is raw bytes.
        for notation in &InputNotation::value_variants()[1..] {
            let arrivals = Arrivals::new(Input::new("", bytes), Some(*notation));
            let mut noted = Vec::new();
            // The last line may be incomplete, which is an error. `noted` then contains the bytes before the error.
            for arrival in arrivals.into_iter().flatten().map_while(Result::ok) {
                noted.extend(arrival.bytes);
            }
            let value = notation.to_possible_value().expect("no notation is hidden");
            add(&format!(" with --input {}", value.get_name()), noted);
        }
        inputs
    }
}

/// Returns a receiver of these frames.
fn receiver<'r>(protocol: Protocol) -> Receiver<'r> {
    Box::new(move |bytes| {
        let mut frames = Vec::new();
        if let Ok(mut line) = AnyLine::new(&protocol, Policy::Framelock) {
            line.feed(bytes, |found| {
                let length = found.bytes();
                let frame = found.message();
                frames.extend(frame.map(|frame| (protocol.description.number(frame), length)));
            });
        }
        frames
    })
}

const ANY_CHECKSUM: &str = " with any checksums";

/// Returns receivers that also accept the user's frames with a changed checksum. Such a receiver returns no frames if
/// fewer than two frames have the changed checksum.
fn with_changed_checksums(protocol: &Protocol) -> Vec<(Change, Receiver<'_>)> {
    let own = protocol.description.format().all();
    let mut receivers = Vec::new();
    let mut add = |name: &str, change: &dyn Fn(&mut Layout)| {
        let changed = own.iter().filter_map(|layout| {
            let mut changed = **layout;
            change(&mut changed);
            let marks = changed.sync.length + changed.terminator.length;
            let is_sure = changed.checksum.is_some() || marks > 1;
            let is_tried = layout.checksum.is_some() && is_sure;
            changed.check().ok().filter(|_| is_tried)
        });
        let layouts: Vec<CheckedLayout> = own.iter().copied().chain(changed).collect();
        let receive = move |bytes: &[u8]| {
            let mut frames = Vec::new();
            let buffer = vec![0; 2 * protocol.longest()];
            if let Some(mut receiver) = BufferedReceiver::with_buffer(AnyOf(&layouts), buffer) {
                receiver.feed(bytes, |found| {
                    let frame = found.decoded();
                    frames.extend(frame.map(|(kind, frame)| (kind, frame.len())));
                });
            }
            let changed = frames.iter().filter(|(kind, _)| *kind >= own.len());
            if changed.count() < 2 {
                frames.clear();
            }
            frames
        };
        receivers.push((name.to_owned(), Box::new(receive) as Receiver));
    };
    for from in 0..=2 {
        let name = format!(" whose checksums cover the bytes from {from} on");
        add(&name, &|layout| {
            let changed = |checksum| Checksum { from, ..checksum };
            layout.checksum = layout.checksum.map(changed);
        });
    }
    add(ANY_CHECKSUM, &|layout| layout.checksum = None);
    add(" without checksums (see docs/recordings.md)", &|layout| {
        (layout.checksum, layout.fixed, layout.behind) = (None, &[], 0);
    });
    receivers
}

/// Returns true if a receiver may have found these frames by chance, because it finds such frames in random bytes too.
fn may_be_chance(found: &[(usize, usize)], receive: &Receiver) -> bool {
    let mut state = 1_u32;
    let random = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    });
    let mut by_chance = receive(&random.take(4096).collect::<Vec<u8>>());
    by_chance.retain(|(kind, _)| found.iter().any(|(other, _)| other == kind));
    !by_chance.is_empty() && (found.len() < 3 || sum_of_lengths(&by_chance) > 1024)
}

fn sum_of_lengths(frames: &[(usize, usize)]) -> usize {
    frames.iter().map(|(_, length)| length).sum()
}

fn is_text(bytes: &[u8]) -> bool {
    let is_character = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    bytes.iter().all(is_character)
}
