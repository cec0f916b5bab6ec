//! Reads a `.tlog`, in which ground stations store `MAVLink`: before each frame, its time in microseconds since 1970, in
//! eight bytes, the highest first.

use std::io::{BufRead, Read};
use std::iter::from_fn;

use anyhow::Result;

use super::arrivals::Arrival;

/// The bytes of the time, and those of a frame up to its flags.
const TIME: usize = 8;
const HEADER: usize = TIME + 3;

/// Returns each frame with its time. Bytes that are not part of a frame have the time of the frame before.
pub(super) fn arrivals(mut reader: impl BufRead) -> impl Iterator<Item = Result<Arrival>> {
    let mut record: Vec<u8> = Vec::new();
    let mut time = None;
    from_fn(move || {
        let mut fill = |record: &mut Vec<u8>, length: usize| {
            let missing = length.saturating_sub(record.len()) as u64;
            (&mut reader).take(missing).read_to_end(record)
        };
        let rest = match fill(&mut record, HEADER) {
            Err(error) => return Some(Err(error.into())),
            Ok(_) if record.is_empty() => return None,
            Ok(_) => match length(&record) {
                // Search the next record.
                None => record.split_off(1),
                Some(length) => {
                    if let Err(error) = fill(&mut record, length) {
                        return Some(Err(error.into()));
                    }
                    let frame = record.split_off(TIME);
                    let stamp = record[..].try_into().map(i64::from_be_bytes);
                    time = stamp.ok();
                    record = frame;
                    Vec::new()
                }
            },
        };
        let bytes = std::mem::replace(&mut record, rest);
        Some(Ok(Arrival {
            time: Some(time.unwrap_or(0)),
            bytes,
            event: None,
        }))
    })
}

/// Returns the length of a record if these bytes begin one.
fn length(record: &[u8]) -> Option<usize> {
    let (time, frame) = record.split_first_chunk::<TIME>()?;
    // A time before the year 4253 begins with 0.
    match (time[0], frame) {
        (0, &[0xFE, payload, _]) => Some(TIME + 8 + usize::from(payload)),
        // A signature of 13 bytes follows if the lowest flag is set.
        (0, &[0xFD, payload, flags]) => {
            Some(TIME + 12 + usize::from(payload) + 13 * usize::from(flags & 1))
        }
        _ => None,
    }
}
