//! Runs the receivers on faulty streams, and measures their time.

use crate::answer::{Answer, confirm};
use crate::contender::Entry;
use crate::figures::{Row, row};
use crate::protocols::{PROTOCOLS, Protocol};
use crate::streams::{FAULTS, Stream};

/// The number of frames in a stream.
const FRAMES: u16 = 6_000;
/// The number of rounds, each of several passes. Only the fastest pass of each measurement counts, because other work
/// on the machine can only slow a pass down.
const ROUNDS: usize = 60;
/// The pieces in which the receivers get a stream: single bytes, 64 bytes (a common size for half of a DMA buffer), and
/// the whole stream.
pub(crate) const PIECES: [usize; 3] = [1, 64, usize::MAX];

/// A protocol with its contenders and streams.
pub(crate) struct Race {
    protocol: &'static Protocol,
    streams: [Stream; FAULTS.len()],
    contenders: Vec<Contender>,
}

/// A contender, and its results for each stream.
struct Contender {
    entry: Entry,
    by_byte: Vec<Answer>,
    by_chunk: Vec<Answer>,
    /// Speeds in megabytes per second. There is one for each stream, passed in chunks of 64 bytes. The last two are for
    /// the first stream, passed byte by byte and as a whole.
    speeds: [f64; FAULTS.len() + 2],
}

/// For each protocol that has rivals, runs all receivers on all streams, and confirms framelock's answers.
pub(crate) fn all() -> Vec<Race> {
    let mut races = Vec::new();
    for protocol in &PROTOCOLS {
        let entries = (protocol.contenders)();
        if entries.len() == 1 {
            continue;
        }
        let streams = FAULTS.map(|fault| Stream::new(protocol, fault, FRAMES));
        let contender = |entry: Entry| {
            let answers = |piece| {
                let answer = |stream| Answer::of(&entry, protocol, stream, piece);
                streams.iter().map(answer).collect()
            };
            for stream in &streams {
                confirm(&entry, protocol, stream);
            }
            Contender {
                by_byte: answers(1),
                by_chunk: answers(64),
                speeds: Default::default(),
                entry,
            }
        };
        let contenders = entries.into_iter().map(contender).collect();
        races.push(Race {
            protocol,
            streams,
            contenders,
        });
    }
    races
}

impl Race {
    /// Measures the time of each contender. The contenders take turns many times, so that other load on the machine
    /// affects all of them alike.
    pub(crate) fn run(&mut self) {
        let chunks = self.streams.iter().map(|stream| (stream, 64));
        let clean = &self.streams[0];
        let all: Vec<_> = chunks.chain([(clean, 1), (clean, usize::MAX)]).collect();
        for (place, (stream, piece)) in all.iter().enumerate().cycle().take(ROUNDS * all.len()) {
            for contender in &mut self.contenders {
                // Make several passes in a row, because the first pass still has the previous contender's data in the
                // caches and the branch predictor.
                for _ in 0..3 {
                    let time = (contender.entry.time)(&stream.bytes, *piece).as_secs_f64();
                    let speed = &mut contender.speeds[place];
                    *speed = speed.max(stream.bytes.len() as f64 / 1e6 / time);
                }
            }
        }
    }

    /// Returns the table of lost and false frames.
    pub(crate) fn found(&self) -> Vec<Row> {
        let table = format!("{} found", self.protocol.name);
        let whole = self
            .streams
            .iter()
            .map(|stream| stream.whole.len().to_string());
        let mut rows = vec![[row![table, "arrive whole"], whole.collect(), row![""]].concat()];
        for contender in &self.contenders {
            let (name, answers) = (contender.entry.name, &contender.by_byte);
            let latest = answers.iter().map(|answer| answer.latest).max();
            let latest = row![latest.expect("an answer for each stream")];
            let [bytes, chunks] = [answers, &contender.by_chunk].map(|it| cells(it));
            if bytes == chunks {
                rows.push([row![table, name], bytes, latest].concat());
            } else {
                let [by_byte, by_chunk] = ["byte by byte", "chunks of 64"]
                    .map(|how| row![table, format!("{name}, {how}")]);
                rows.push([by_byte, bytes, latest].concat());
                rows.push([by_chunk, chunks, row![""]].concat());
            }
        }
        rows
    }

    /// Returns the table of speeds.
    pub(crate) fn speeds(&self) -> Vec<Row> {
        let table = format!("{} speed", self.protocol.name);
        let row = |contender: &Contender| {
            let speeds = contender.speeds.iter().map(|speed| format!("{speed:.0}"));
            [row![table, contender.entry.name], speeds.collect()].concat()
        };
        self.contenders.iter().map(row).collect()
    }
}

fn cells(answers: &[Answer]) -> Vec<String> {
    let cell = |answer: &Answer| match (answer.lost, answer.false_frames) {
        (lost, 0) => lost.to_string(),
        (lost, false_frames) => format!("{lost}, {false_frames} false"),
    };
    answers.iter().map(cell).collect()
}
