//! Reads a `.tlog`, in which ground stations store `MAVLink`. A record is a time and a frame. The time is a
//! big-endian number of microseconds since 1970, in eight bytes.

use std::io::{BufRead, Read};
use std::iter::from_fn;

use anyhow::Result;

use super::arrivals::Arrival;

/// The number of bytes of a time.
const TIME: usize = 8;
/// The number of bytes of a time and of a frame's first three bytes.
const HEADER: usize = TIME + 3;

/// Returns each frame with its time. Bytes that are not part of a record have the time of the frame before.
pub(super) fn arrivals(mut reader: impl BufRead) -> impl Iterator<Item = Result<Arrival>> {
    let (mut record, mut time) = (Vec::new(), 0);
    from_fn(move || next(&mut reader, &mut record, &mut time).transpose())
}

/// Returns the next arrival. `record` holds bytes that were read, but not returned yet.
fn next(
    reader: &mut impl BufRead,
    record: &mut Vec<u8>,
    time: &mut i64,
) -> Result<Option<Arrival>> {
    let mut fill = |record: &mut Vec<u8>, length: usize| {
        let missing = length.saturating_sub(record.len()) as u64;
        reader.take(missing).read_to_end(record)
    };
    fill(record, HEADER)?;
    if record.is_empty() {
        return Ok(None);
    }
    let bytes = match length(record) {
        Some(length) => {
            fill(record, length)?;
            let frame = record.split_off(TIME);
            *time = i64::from_be_bytes(record[..].try_into()?);
            record.clear();
            frame
        }
        // Search for the next record.
        None => vec![record.remove(0)],
    };
    Ok(Some(Arrival::new(Some(*time), bytes)))
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
