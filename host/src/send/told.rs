//! What was sent, and how well, in words.

use std::io::{self, Write};

use super::datagrams::DatagramTally;
use super::session::Report;

/// Writes a line for everything that there is to tell.
pub(super) fn write(
    out: &mut impl Write,
    report: &Report,
    line: &str,
    seed: u64,
    datagrams: Option<DatagramTally>,
) -> io::Result<()> {
    let Report {
        frames,
        silent,
        park_frames,
        time,
        punctuality,
        faults,
    } = report;
    writeln!(
        out,
        "framelock: frames sent to {line} in {:.2} s: {frames}, and {park_frames} to park",
        time.as_secs_f64(),
    )?;
    let worst = punctuality.worst.as_secs_f64() * 1e3;
    writeln!(out, "framelock: the latest was {worst:.2} ms late")?;
    if punctuality.hold_ups > 0 {
        writeln!(
            out,
            "framelock: held up {} times, {:.2} s in all, by which what was left was sent later",
            punctuality.hold_ups,
            punctuality.held_up.as_secs_f64()
        )?;
    }
    if let Some(faults) = faults {
        writeln!(
            out,
            "framelock: faults (seed {seed}): of {} bytes {} dropped, {} with a bit inverted, {} \
             sent twice; {} inserted",
            faults.bytes, faults.dropped, faults.flipped, faults.duplicated, faults.inserted
        )?;
    }
    if let Some(DatagramTally { count, bad }) = datagrams {
        writeln!(
            out,
            "framelock: datagrams heard: {count}, bad ones among them: {bad}; frames not sent for \
             want of a fresh one: {silent}"
        )?;
    }
    Ok(())
}
