//! The formats and the streams for which the cost of a byte is measured. There are clean streams, noise, and hostile
//! streams. Hostile streams are designed to be expensive.

use std::error::Error;
use std::hint::black_box;

use framelock::motion::{Bin, BinCrc8};
use framelock::{BufferedReceiver, Encode, Format, Frame, Line, Parser, Receiver};
use framelock_formats::{
    crsf::Crsf, ibus::Ibus, mavlink::Mavlink2, motion::SixAxes, sbus::Sbus, ubx::Ubx,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::chip::{Program, Run};
use crate::contender::{Cut, Entry};
use crate::figures::{Row, row};
use crate::streams::{Protocol, SEED, Stream};
use crate::{crsf, ibus, mavlink2, sbus, ubx, valgrind};

/// The number of bytes in a stream of noise and in a hostile stream.
const BYTES: usize = 6_000;
/// How many bytes at the beginning of a hostile stream are not counted. The very first bytes of a stream cost little,
/// because a receiver decides nothing until the first false frame ends.
const SKIPPED: usize = 1_000;
/// The number of frames in a clean stream.
const FRAMES: u16 = 200;

/// A format, its streams, and the receivers that process them.
pub(crate) struct Case {
    pub(crate) format: &'static str,
    pub(crate) clean: Vec<u8>,
    pub(crate) noise: Vec<u8>,
    /// The hostile streams, each with the bytes that it repeats.
    pub(crate) hostile: Vec<(&'static [u8], Vec<u8>)>,
    pub(crate) contenders: Vec<Counted>,
}

impl Case {
    fn new(
        format: &'static str,
        clean: Vec<u8>,
        periods: &[&'static [u8]],
        contenders: Vec<Counted>,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let mut noise = vec![0; BYTES];
        random.fill(&mut noise[..]);
        let hostile = |&period: &&'static [u8]| {
            let bytes = period.iter().copied().cycle().take(BYTES);
            (period, bytes.collect())
        };
        Self {
            format,
            clean,
            noise,
            hostile: periods.iter().map(hostile).collect(),
            contenders,
        }
    }

    /// Returns the clean stream, the noise, and the hostile streams. Each entry also states how many bytes at the
    /// beginning of the stream are not counted.
    pub(crate) fn streams(&self) -> impl Iterator<Item = (&[u8], usize)> {
        let hostile = self.hostile.iter().map(|(_, bytes)| (&bytes[..], SKIPPED));
        [(&self.clean[..], 0), (&self.noise[..], 0)]
            .into_iter()
            .chain(hostile)
    }
}

/// A receiver that takes a stream byte by byte, so that the cost of a byte can be counted.
pub(crate) struct Counted {
    pub(crate) name: &'static str,
    /// The features of `on-chip` that select the receiver.
    pub(crate) on_chip: String,
    /// Runs the receiver on this machine.
    pub(crate) run: Box<dyn Fn(&[u8])>,
}

/// Returns the tables of costs and sizes on the chip, and of hostile streams.
pub(crate) fn on_chip() -> Result<Vec<Row>, Box<dyn Error>> {
    let nothing = Program::build("nothing")?;
    let (mut costs, mut sizes, mut hostile) = (Vec::new(), Vec::new(), Vec::new());
    for case in &cases() {
        for contender in &case.contenders {
            let program = Program::build(&contender.on_chip)?;
            let mut runs = Vec::new();
            for (stream, skipped) in case.streams() {
                runs.push((
                    program.take(stream, skipped)?,
                    (stream.len() - skipped) as f64,
                ));
            }
            let of = |cost: fn(&Run) -> u64| {
                let each = runs.iter().map(|(run, bytes)| cost(run) as f64 / bytes);
                clean_noise_worst(&each.collect::<Vec<_>>())
            };
            let (instructions, cycles) = (of(|run| run.all.instructions), of(|run| run.all.cycles));
            let mut row = row!["chip costs", case.format, contender.name];
            for (instructions, cycles) in instructions.into_iter().zip(cycles) {
                row.extend(row![format!("{instructions:.1}"), format!("{cycles:.1}")]);
            }
            row.extend(
                runs.iter()
                    .map(|(run, _)| run.costliest)
                    .max()
                    .map(|most| most.to_string()),
            );
            costs.push(row);
            if contender.on_chip.ends_with(",line") {
                continue;
            }
            // Subtract the cycles of empty calls.
            let (clean, empty) = (&runs[0].0, nothing.take(&case.clean, 0)?);
            if clean.frames != u32::from(FRAMES) {
                return Err(
                    format!("{}: {} frames of {FRAMES}", contender.on_chip, clean.frames).into(),
                );
            }
            let [code, constants] = program.more_than(&nothing);
            let cycles = (clean.all.cycles - empty.all.cycles) / u64::from(FRAMES);
            let panics = if program.can_panic { "yes" } else { "no" };
            sizes.push(row![
                "chip sizes",
                case.format,
                contender.name,
                code,
                constants,
                clean.state,
                cycles,
                panics
            ]);
        }
        let periods = case.hostile.iter().map(|(period, _)| {
            let bytes: Vec<String> = period.iter().map(|byte| format!("{byte:02X}")).collect();
            format!("`{}`", bytes.join(" "))
        });
        hostile.push(row![
            "hostile",
            case.format,
            periods.collect::<Vec<_>>().join(", ")
        ]);
    }
    Ok([costs, sizes, hostile].concat())
}

/// Returns the table of costs on this machine.
pub(crate) fn here() -> Result<Vec<Row>, Box<dyn Error>> {
    let (cases, mut rows) = (cases(), Vec::new());
    for (case, counts) in cases.iter().zip(valgrind::count(&cases)?) {
        for (contender, counts) in case.contenders.iter().zip(counts) {
            let costs = clean_noise_worst(&counts).map(|cost| format!("{cost:.1}"));
            rows.push(
                [
                    row!["PC costs", case.format, contender.name],
                    costs.to_vec(),
                ]
                .concat(),
            );
        }
    }
    Ok(rows)
}

/// Returns three costs: that of the clean stream, that of the noise, and the highest cost of all streams. The clean
/// stream comes first in the list, and the noise second.
fn clean_noise_worst(costs: &[f64]) -> [f64; 3] {
    let worst = costs.iter().copied().fold(0.0, f64::max);
    [costs[0], costs[1], worst]
}

/// Returns the formats of this workspace.
pub(crate) fn cases() -> Vec<Case> {
    vec![
        of_protocol(
            "sbus",
            &sbus::PROTOCOL,
            &[b"\x0F", b"\x0F\x55"],
            || BufferedReceiver::<_, [u8; 50]>::new(Sbus),
            sbus::contenders(),
        ),
        of_protocol(
            "ibus",
            &ibus::PROTOCOL,
            &[b"\x20\x40", b"\x20", b"\x20\x20\x40"],
            || BufferedReceiver::<_, [u8; 64]>::new(Ibus),
            ibus::contenders(),
        ),
        of_protocol(
            "crsf",
            &crsf::PROTOCOL,
            &[b"\xC8\x3C", b"\xC8\x3E", b"\xC8\x3E\xC8", b"\xC8"],
            || BufferedReceiver::<_, [u8; 128]>::new(Crsf),
            crsf::contenders(),
        ),
        of_protocol(
            "ubx",
            &ubx::PROTOCOL,
            &[
                b"\xB5\x62\x00",
                b"\xB5\x62\x01\x07\x62\x00",
                b"\xB5\x62",
                b"\xB5",
            ],
            || BufferedReceiver::<Ubx<{ ubx::LONGEST }>, [u8; 2 * ubx::LONGEST]>::new(Ubx),
            ubx::contenders(),
        ),
        of_protocol(
            "mavlink2",
            &mavlink2::PROTOCOL,
            &[
                b"\xFD\xFF\0\0\0\0\0\x83\0\0",
                b"\xFD\xFF\x01\0\0\0\0\x83\0\0",
                // Two interleaved series of false starts. The length byte of a false start in one series is the message
                // byte of a false start in the other series.
                b"\xFD\x83\0\0\xFD\xFF\0\x83\0\0",
                b"\xFD",
            ],
            || BufferedReceiver::<_, [u8; 560]>::new(Mavlink2(mavlink2::DIALECT)),
            mavlink2::contenders(),
        ),
        of_fixed_format::<SixAxes>(
            "six axes",
            "six-axes",
            Rng::random,
            &[b"\xFF", b"\xFF\xFF0123456789AB\n\n", b"\xFF\xFF\n\r"],
        ),
        of_fixed_format::<Bin>(
            "BIN",
            "bin",
            |random| random.random::<[u8; 3]>().into(),
            &[b"A", b"AB", b"AB01234"],
        ),
        of_fixed_format::<BinCrc8>(
            "BIN-CRC8",
            "bin-crc8",
            |random| random.random::<[u8; 3]>().into(),
            // In the last stream, every fourth byte ends a frame in which only the checksum is wrong.
            &[b"A", b"AB", b"AB012345", b"AB0\r"],
        ),
    ]
}

fn of_protocol<F: Format + 'static, const N: usize>(
    feature: &str,
    protocol: &Protocol,
    periods: &[&'static [u8]],
    new: impl Fn() -> BufferedReceiver<F, [u8; N]> + Copy + 'static,
    entries: Vec<Entry>,
) -> Case {
    let mut contenders = ours(feature, new, |frame: Frame<'_, F>| {
        black_box(&frame.message());
    });
    let rivals = entries
        .into_iter()
        .filter(|entry| entry.reference.is_none());
    contenders.extend(rivals.map(|entry| Counted {
        name: entry.name,
        on_chip: format!("{feature}-{}", entry.name),
        run: Box::new(move |stream| {
            black_box((entry.time)(stream, Cut::Bytes));
        }),
    }));
    Case::new(
        protocol.name,
        Stream::clean(protocol, FRAMES),
        periods,
        contenders,
    )
}

fn of_fixed_format<F: Encode + 'static>(
    format: &'static str,
    feature: &str,
    message: impl Fn(&mut ChaCha8Rng) -> F::Message,
    periods: &[&'static [u8]],
) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut clean = Vec::new();
    for _ in 0..FRAMES {
        clean.extend(F::encode(message(&mut random)).as_ref());
    }
    let ours = ours(feature, Receiver::<F>::new, |message: F::Message| {
        black_box(&message);
    });
    Case::new(format, clean, periods, ours)
}

/// Returns framelock's receiver twice: alone, and in a `Line`.
fn ours<P: Parser + 'static>(
    feature: &str,
    new: impl Fn() -> P + Copy + 'static,
    see: impl Fn(P::Message<'_>) + Copy + 'static,
) -> Vec<Counted> {
    vec![
        Counted {
            name: "framelock",
            on_chip: feature.to_owned(),
            run: Box::new(move |stream| {
                let mut receiver = new();
                for &byte in stream {
                    if let Some(message) = receiver.push(byte) {
                        see(message);
                    }
                }
            }),
        },
        Counted {
            name: "framelock, `Line`",
            on_chip: format!("{feature},line"),
            run: Box::new(move |stream| {
                let mut line = Line::new(new());
                for &byte in stream {
                    if let Some(message) = line.push(byte) {
                        see(message);
                    }
                }
                black_box(line.counters());
            }),
        },
    ]
}
