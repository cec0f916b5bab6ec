//! Compares framelock's receivers with other crates for the same protocols, on the same faulty streams.
//!
//! `cargo bench -p framelock-rivals -- --write docs/rivals.md` runs the comparison and writes the tables. `-- --costs
//! docs/costs.md` only counts the cost of a byte. `-- --figures formats/FIGURES.txt` compares the formats' costs on the
//! chip with that file. Without an argument, the benchmark prints the comparison and the costs. `cargo test` runs the
//! benchmark without `--bench`. In this case the streams are short, every answer is checked, and nothing is timed.

#![allow(
    clippy::indexing_slicing,
    clippy::cast_precision_loss,
    clippy::doc_markdown,
    clippy::type_complexity,
    reason = "a failed benchmark panics; times are rounded; MAVLink and iBUS are names; closures have no shorter types"
)]

use std::error::Error;

use crate::answer::Answer;
use crate::contender::{Cut, Entry};
use crate::streams::{Fault, Protocol, Stream};

mod answer;
mod chip;
mod contender;
mod cost_tables;
mod costs;
mod crsf;
#[path = "../../tests/suite/examined.rs"]
mod examined;
mod figures;
mod ibus;
mod mavlink2;
mod sbus;
mod streams;
mod tables;
mod ubx;
mod valgrind;

/// The number of frames in a stream.
const FRAMES: u16 = 6_000;
/// The number of frames in a stream if nothing is timed.
const FEW_FRAMES: u16 = 300;
/// The number of times that each measurement is repeated. Only the fastest one counts, because other work on the
/// machine can only slow a measurement down.
const ROUNDS: usize = 60;

/// A protocol, and the results of its contenders.
struct Match {
    protocol: Protocol,
    rows: Vec<Row>,
    /// The number of frames that arrived whole in each stream.
    whole: Vec<usize>,
}

/// The results of one contender, for each stream.
struct Row {
    name: &'static str,
    by_byte: Vec<Answer>,
    by_chunk: Vec<Answer>,
    /// The speed in chunks of 64 bytes, for each stream.
    megabytes_per_second: Vec<f64>,
    /// The speed in megabytes per second for the first stream, byte by byte.
    by_byte_clean: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_full = arguments.iter().any(|argument| argument == "--bench");
    if arguments
        .iter()
        .any(|argument| argument == valgrind::ARGUMENT)
    {
        valgrind::take_all(&costs::cases());
        return Ok(());
    }
    let file = |option| {
        let at = arguments.iter().position(|argument| argument == option)?;
        Some(
            arguments
                .get(at + 1)
                .ok_or(format!("{option}: which file?")),
        )
    };
    if let Some(file) = file("--figures").transpose()? {
        return figures::compare(&in_workspace(file));
    }
    let (races, costs) = (file("--write").transpose()?, file("--costs").transpose()?);
    let everything = races.is_none() && costs.is_none();
    if costs.is_some() || is_full && everything {
        write(costs, &cost_tables::document()?)?;
    }
    if races.is_none() && !everything {
        return Ok(());
    }

    let protocols = [
        (crsf::PROTOCOL, crsf::contenders()),
        (ubx::PROTOCOL, ubx::contenders()),
        (mavlink2::PROTOCOL, mavlink2::contenders()),
        (sbus::PROTOCOL, sbus::contenders()),
        (ibus::PROTOCOL, ibus::contenders()),
    ];
    let matches: Vec<Match> = protocols
        .into_iter()
        .map(|(protocol, contenders)| play(protocol, &contenders, is_full))
        .collect();
    if !is_full {
        return Ok(());
    }
    let protocols: Vec<&Protocol> = matches.iter().map(|played| &played.protocol).collect();
    let figures = chip::measure(&protocols)?;
    write(races, &tables::document(&matches, &figures)?)
}

/// Writes the text to a file, whose path is relative to the workspace, or to the terminal if there is no file.
fn write(file: Option<&String>, text: &str) -> Result<(), Box<dyn Error>> {
    match file {
        Some(file) => std::fs::write(in_workspace(file), text)?,
        None => print!("{text}"),
    }
    Ok(())
}

/// Returns the path of a file in the workspace, because Cargo runs benchmarks in the folder of their package.
fn in_workspace(file: &str) -> String {
    format!("{}/../../../{file}", env!("CARGO_MANIFEST_DIR"))
}

fn play(protocol: Protocol, contenders: &[Entry], is_full: bool) -> Match {
    let frames = if is_full { FRAMES } else { FEW_FRAMES };
    let streams = Fault::ALL.map(|fault| Stream::new(&protocol, fault, frames));
    let mut rows = Vec::new();
    for entry in contenders {
        for stream in &streams {
            answer::confirm(entry, &protocol, stream);
        }
        let answers = |cut| {
            let answer = |stream| Answer::of(entry, &protocol, stream, cut);
            streams.iter().map(answer).collect()
        };
        rows.push(Row {
            name: entry.name,
            by_byte: answers(Cut::Bytes),
            by_chunk: answers(Cut::ChunksOf64),
            megabytes_per_second: vec![0.0; streams.len()],
            by_byte_clean: 0.0,
        });
    }
    if is_full {
        race(contenders, &streams, &mut rows);
    }
    Match {
        protocol,
        rows,
        whole: streams.iter().map(|stream| stream.whole.len()).collect(),
    }
}

/// Measures the time of each contender. The contenders take turns many times, so that other load on the machine affects
/// all of them alike.
fn race(contenders: &[Entry], streams: &[Stream], rows: &mut [Row]) {
    let faster = |speed: &mut f64, entry: &Entry, stream: &Stream, cut| {
        // Make several passes in a row, because the first pass still has the previous contender's data in the caches
        // and the branch predictor.
        for _ in 0..3 {
            let time = (entry.time)(&stream.bytes, cut).as_secs_f64();
            *speed = speed.max(stream.bytes.len() as f64 / 1e6 / time);
        }
    };
    for _ in 0..ROUNDS {
        for (place, stream) in streams.iter().enumerate() {
            for (row, entry) in rows.iter_mut().zip(contenders) {
                let speed = &mut row.megabytes_per_second[place];
                faster(speed, entry, stream, Cut::ChunksOf64);
            }
        }
        for (row, entry) in rows.iter_mut().zip(contenders) {
            faster(&mut row.by_byte_clean, entry, &streams[0], Cut::Bytes);
        }
    }
}
