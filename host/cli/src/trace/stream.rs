//! Any frames, byte by byte: what is pending, the frames, and what is discarded and why.

use std::io::Write;

use anyhow::Result;
use framelock_description::hex;

use super::table::{Format, character};
use crate::frame::{Frame, Place};
use crate::input::{Input, for_each_arrival};
use crate::line::{AnyLine, Piece, Watched};
use crate::names::PolicyName;

/// Writes a row for each byte as it comes, and one more for each further thing that it decides.
pub(super) fn print(
    frame: &Frame,
    policy: PolicyName,
    format: Format,
    input: Input,
    out: &mut impl Write,
) -> Result<()> {
    let mut line = Watched::new(AnyLine::new(frame, policy)?);
    let (mut offset, mut settled, mut row) = (0, 0, Vec::new());
    if format == Format::Text {
        writeln!(out, "offset  byte    pending  what happened")?;
        out.flush()?;
    }
    for_each_arrival(input, |arrival| {
        for &byte in arrival.bytes() {
            let pieces = line.push(byte);
            let pending = line.pending().len();
            if format == Format::Text {
                let character = character(byte);
                write!(out, "{offset:>6}  {byte:02X} {character:<3}  {pending:>7}")?;
            } else {
                write!(
                    out,
                    r#"{{"offset":{offset},"byte":{byte},"pending":{pending},"what":["#
                )?;
            }
            for (number, Piece { bytes, discarded }) in pieces.iter().enumerate() {
                let from = settled;
                settled += bytes.len();
                let (count, hex) = (bytes.len(), hex::glued(bytes));
                if format == Format::Jsonl {
                    out.write_all(if number > 0 { b"," } else { b"" })?;
                    match discarded {
                        None => {
                            let (offset, time) = (settled - 1, None);
                            row.clear();
                            frame.append_json(&mut row, &Place { offset, time }, bytes);
                            out.write_all(&row)?;
                        }
                        Some(why) => write!(
                            out,
                            r#"{{"discarded":{count},"from":{from},"bytes":"{hex}","why":"{why}"}}"#
                        )?,
                    }
                    continue;
                }
                if number > 0 {
                    write!(out, "\n{:23}", "")?;
                }
                match discarded {
                    None => {
                        write!(out, "  frame from offset {from}:")?;
                        row.clear();
                        frame.append_text(&mut row, bytes);
                        out.write_all(&row)?;
                    }
                    Some(why) => write!(out, "  discarded {hex} from offset {from}: {why}")?,
                }
            }
            writeln!(out, "{}", if format == Format::Text { "" } else { "]}" })?;
            offset += 1;
        }
        Ok(out.flush()?)
    })?;
    if format == Format::Text {
        let counters = line.counters();
        writeln!(
            out,
            "\n{} bytes = {} in {} frames + {} discarded + {} pending",
            counters.bytes,
            counters.frame_bytes,
            counters.frames,
            counters.discarded.total(),
            line.pending().len()
        )?;
    }
    Ok(out.flush()?)
}
