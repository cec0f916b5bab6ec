//! Compares the frames that a receiver delivered with the frames that arrived whole. framelock's frames are also
//! compared with the frames of a naive reference.

use std::collections::HashMap;

use crate::contender::Entry;
use crate::protocols::Protocol;
use crate::races::PIECES;
use crate::streams::Stream;

/// The result of a receiver on a stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Answer {
    /// The number of frames that arrived whole and were not delivered.
    pub(crate) lost: usize,
    /// The number of delivered frames that did not arrive whole or were never sent.
    pub(crate) false_frames: usize,
    /// The greatest number of bytes that arrive between the last byte of a frame and the frame's delivery.
    pub(crate) latest: usize,
}

impl Answer {
    pub(crate) fn of(entry: &Entry, protocol: &Protocol, stream: &Stream, piece: usize) -> Self {
        let key = |whole| (protocol.key)(&stream.bytes[whole]);
        let mut missing: HashMap<Vec<u8>, usize> = HashMap::new();
        for whole in &stream.whole {
            let before = missing.insert(key(whole.clone()), whole.end);
            assert!(before.is_none(), "each frame has a key of its own");
        }
        let (mut false_frames, mut latest) = (0, 0);
        for delivered in (entry.deliver)(&stream.bytes, piece) {
            match missing.remove(&delivered.key) {
                Some(end) => latest = latest.max(delivered.taken - end),
                None => false_frames += 1,
            }
        }
        Self {
            lost: missing.len(),
            false_frames,
            latest,
        }
    }
}

/// Panics unless framelock delivers the same frames as the reference, in the same order, in pieces of each size. Also
/// panics if framelock loses a whole frame, unless an earlier delivered frame shares bytes with the lost frame.
pub(crate) fn confirm(entry: &Entry, protocol: &Protocol, stream: &Stream) {
    let Some(reference) = &entry.reference else {
        return;
    };
    let frames = reference(&stream.bytes);
    let keys: Vec<Vec<u8>> = frames
        .iter()
        .map(|frame| (protocol.key)(&stream.bytes[frame.clone()]))
        .collect();
    for piece in PIECES {
        let delivered: Vec<Vec<u8>> = (entry.deliver)(&stream.bytes, piece)
            .into_iter()
            .map(|delivered| delivered.key)
            .collect();
        assert!(
            delivered == keys,
            "{} of {}, in pieces of {piece}: the frames differ from those of the reference",
            entry.name,
            protocol.name
        );
    }
    for whole in &stream.whole {
        let before = frames.partition_point(|frame| frame.start < whole.start);
        let is_committed = frames.get(before) == Some(whole);
        let is_under_another = before > 0 && frames[before - 1].end > whole.start;
        assert!(
            is_committed || is_under_another,
            "{} of {}: the frame at {whole:?} is lost",
            entry.name,
            protocol.name
        );
    }
}
