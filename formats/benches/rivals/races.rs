//! Runs the receivers on faulty streams, and measures their time.

use crate::answer::{Answer, confirm};
use crate::contender::{Cut, Entry};
use crate::figures::{Row, row};
use crate::streams::{FAULTS, Protocol, Stream};
use crate::{crsf, ibus, mavlink2, sbus, ubx};

/// The number of frames in a stream.
const FRAMES: u16 = 6_000;
/// The number of times that each measurement is repeated. Only the fastest one counts, because other work on the
/// machine can only slow a measurement down.
const ROUNDS: usize = 60;

/// A protocol with its contenders and streams.
pub(crate) struct Race {
    protocol: Protocol,
    streams: [Stream; 6],
    contenders: Vec<Contender>,
}

/// A contender, and its results for each stream.
struct Contender {
    entry: Entry,
    by_byte: Vec<Answer>,
    by_chunk: Vec<Answer>,
    /// The speed in megabytes per second in chunks of 64 bytes, for each stream. The last one is that for the first
    /// stream, byte by byte.
    speeds: Vec<f64>,
}

/// Runs all receivers on all streams, and checks each answer.
pub(crate) fn all() -> Vec<Race> {
    let protocols = [
        (crsf::PROTOCOL, crsf::contenders()),
        (ubx::PROTOCOL, ubx::contenders()),
        (mavlink2::PROTOCOL, mavlink2::contenders()),
        (sbus::PROTOCOL, sbus::contenders()),
        (ibus::PROTOCOL, ibus::contenders()),
    ];
    let run = |(protocol, entries): (Protocol, Vec<Entry>)| {
        let streams = FAULTS.map(|fault| Stream::new(&protocol, fault, FRAMES));
        let contender = |entry: Entry| {
            let answers = |cut| {
                let answer = |stream| Answer::of(&entry, &protocol, stream, cut);
                streams.iter().map(answer).collect()
            };
            for stream in &streams {
                confirm(&entry, &protocol, stream);
            }
            let (by_byte, by_chunk) = (answers(Cut::Bytes), answers(Cut::ChunksOf64));
            Contender {
                entry,
                by_byte,
                by_chunk,
                speeds: vec![0.0; streams.len() + 1],
            }
        };
        let contenders = entries.into_iter().map(contender).collect();
        Race {
            protocol,
            streams,
            contenders,
        }
    };
    protocols.into_iter().map(run).collect()
}

impl Race {
    /// Measures the time of each contender. The contenders take turns many times, so that other load on the machine
    /// affects all of them alike.
    pub(crate) fn run(&mut self) {
        let cuts = [Cut::ChunksOf64; 6].into_iter().chain([Cut::Bytes]);
        let measurements: Vec<_> = (0..6).chain([0]).zip(cuts).enumerate().collect();
        for (place, (stream, cut)) in measurements
            .iter()
            .cycle()
            .take(ROUNDS * measurements.len())
        {
            let bytes = &self.streams[*stream].bytes;
            for contender in &mut self.contenders {
                // Make several passes in a row, because the first pass still has the previous contender's data in the
                // caches and the branch predictor.
                for _ in 0..3 {
                    let time = (contender.entry.time)(bytes, *cut).as_secs_f64();
                    let speed = &mut contender.speeds[*place];
                    *speed = speed.max(bytes.len() as f64 / 1e6 / time);
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
            let (name, latest) = (contender.entry.name, contender.latest());
            let [bytes, chunks] = [&contender.by_byte, &contender.by_chunk].map(|it| cells(it));
            if bytes == chunks {
                rows.push([row![table, name], bytes, row![latest]].concat());
            } else {
                rows.push(
                    [
                        row![table, format!("{name}, byte by byte")],
                        bytes,
                        row![latest],
                    ]
                    .concat(),
                );
                rows.push(
                    [
                        row![table, format!("{name}, chunks of 64")],
                        chunks,
                        row![""],
                    ]
                    .concat(),
                );
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

    /// Returns a row for each rival, with the figures in which it is at least as good as framelock. `sizes` has the
    /// figures on the chip.
    pub(crate) fn as_good(&self, sizes: &[Row]) -> Vec<Row> {
        let protocol = self.protocol.name;
        let (ours, rivals) = self
            .contenders
            .split_first()
            .expect("framelock comes first");
        let row = |rival: &Contender| {
            let mut better = rival.as_good(ours);
            let of = |name| {
                sizes
                    .iter()
                    .find(|row| row[0] == "chip sizes" && row[1] == protocol && row[2] == name)
            };
            if let (Some(rival), Some(ours)) = (of(rival.entry.name), of(ours.entry.name)) {
                better.extend(small_as_good(rival, ours).into_iter().map(str::to_owned));
            }
            let better = if better.is_empty() {
                "none".to_owned()
            } else {
                better.join("; ")
            };
            row![
                "as good",
                protocol,
                format!("`{}`", rival.entry.name),
                better
            ]
        };
        rivals.iter().map(row).collect()
    }
}

impl Contender {
    fn latest(&self) -> usize {
        self.by_byte
            .iter()
            .map(|answer| answer.latest)
            .max()
            .unwrap_or(0)
    }

    fn as_good(&self, ours: &Self) -> Vec<String> {
        let mut better = Vec::new();
        let mut pairs = self.by_byte.iter().zip(&ours.by_byte);
        if pairs.all(|(rival, ours)| rival.lost <= ours.lost) {
            better.push("finds at least as many frames".to_owned());
            if self.latest() < ours.latest() {
                better.push("its latest delivery is earlier".to_owned());
            }
        }
        for (place, fault) in FAULTS.into_iter().enumerate() {
            let finds = self.by_chunk[place].lost <= ours.by_chunk[place].lost;
            if finds && self.speeds[place] >= ours.speeds[place] {
                better.push(format!("at least as fast on the stream *{}*", fault.name));
            }
        }
        if self.speeds.last() >= ours.speeds.last() {
            better.push("at least as fast byte by byte".to_owned());
        }
        better
    }
}

/// Compares two rows of sizes: code, constants, state, cycles, panics.
fn small_as_good(rival: &Row, ours: &Row) -> Vec<&'static str> {
    let number = |row: &Row, column: usize| row[column].parse::<u64>().expect("a number");
    let flash = |row| number(row, 3) + number(row, 4);
    let all = [
        (flash(rival) <= flash(ours), "at most as much flash"),
        (number(rival, 5) <= number(ours, 5), "at most as much state"),
        (
            number(rival, 6) <= number(ours, 6),
            "at most as many cycles",
        ),
        (rival[7] == "no", "cannot panic"),
    ];
    all.into_iter()
        .filter_map(|(is_as_good, what)| is_as_good.then_some(what))
        .collect()
}

fn cells(answers: &[Answer]) -> Vec<String> {
    let cell = |answer: &Answer| match (answer.lost, answer.false_frames) {
        (lost, 0) => lost.to_string(),
        (lost, false_frames) => format!("{lost}, {false_frames} false"),
    };
    answers.iter().map(cell).collect()
}
