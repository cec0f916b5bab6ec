//! Measures the cost of a byte on clean streams, noise, and hostile streams. Hostile streams are designed to be
//! expensive.

use std::error::Error;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::chip::{Program, Run};
use crate::figures::{Row, row};
use crate::protocols::{PROTOCOLS, Protocol};
use crate::streams::{SEED, Stream};

/// The number of bytes in a stream of noise and in a hostile stream.
const BYTES: usize = 6_000;
/// The number of bytes at the beginning of a hostile stream that are not counted. The very first bytes of a stream cost
/// little, because a receiver decides nothing until the first false frame ends.
const SKIPPED: usize = 1_000;
/// The number of frames in a clean stream.
const FRAMES: u16 = 200;

/// Returns a protocol's clean stream, the noise, and the hostile streams. Each entry also states how many bytes at the
/// beginning of the stream are not counted.
fn streams(protocol: &Protocol) -> Vec<(Vec<u8>, usize)> {
    let mut noise = vec![0; BYTES];
    ChaCha8Rng::seed_from_u64(SEED).fill(&mut noise[..]);
    let hostile = |period: &&[u8]| {
        let bytes = period.iter().copied().cycle().take(BYTES);
        (bytes.collect(), SKIPPED)
    };
    let mut streams = vec![(Stream::clean(protocol, FRAMES), 0), (noise, 0)];
    streams.extend(protocol.hostile.iter().map(hostile));
    streams
}

/// Returns the tables of costs and sizes on the chip, and of hostile streams.
pub(crate) fn on_chip() -> Result<Vec<Row>, Box<dyn Error>> {
    let nothing = Program::build("nothing")?;
    let (mut costs, mut sizes, mut hostile) = (Vec::new(), Vec::new(), Vec::new());
    for protocol in &PROTOCOLS {
        let Protocol { name, feature, .. } = protocol;
        let streams = streams(protocol);
        let contenders = (protocol.contenders)();
        for (suffix, contender) in contenders.iter().flat_map(|entry| &entry.on_chip) {
            let program = Program::build(&format!("{feature}{suffix}"))?;
            let mut runs = Vec::new();
            for (stream, skipped) in &streams {
                let bytes = (stream.len() - skipped) as f64;
                runs.push((program.take(stream, *skipped)?, bytes));
            }
            let of = |cost: fn(&Run) -> u64| {
                let each = runs.iter().map(|(run, bytes)| cost(run) as f64 / bytes);
                clean_noise_worst(&each.collect::<Vec<_>>())
            };
            let (instructions, cycles) = (of(|run| run.all.instructions), of(|run| run.all.cycles));
            let mut row = row!["chip costs", name, contender];
            for (instructions, cycles) in instructions.into_iter().zip(cycles) {
                row.extend(row![format!("{instructions:.1}"), format!("{cycles:.1}")]);
            }
            let costliest = runs.iter().map(|(run, _)| run.costliest).max();
            row.extend(costliest.map(|most| most.to_string()));
            costs.push(row);
            if suffix == ",line" {
                continue;
            }
            // Subtract the cycles of empty calls.
            let (clean, empty) = (&runs[0].0, nothing.take(&streams[0].0, 0)?);
            if clean.frames != u32::from(FRAMES) {
                return Err(
                    format!("{feature}{suffix}: {} frames of {FRAMES}", clean.frames).into(),
                );
            }
            let [code, constants] = program.more_than(&nothing);
            let cycles = (clean.all.cycles - empty.all.cycles) / u64::from(FRAMES);
            let panics = if program.can_panic { "yes" } else { "no" };
            let sizes_and_cycles = row![code, constants, clean.state, cycles, panics];
            sizes.push([row!["chip sizes", name, contender], sizes_and_cycles].concat());
        }
        let period = |bytes: &&[u8]| {
            let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            format!("`{}`", bytes.join(" "))
        };
        let periods: Vec<String> = protocol.hostile.iter().map(period).collect();
        hostile.push(row!["hostile", name, periods.join(", ")]);
    }
    Ok([costs, sizes, hostile].concat())
}

/// Returns three costs: that of the clean stream, that of the noise, and the highest cost of all streams. The clean
/// stream comes first in the list, and the noise second.
fn clean_noise_worst(costs: &[f64]) -> [f64; 3] {
    let worst = costs.iter().copied().fold(0.0, f64::max);
    [costs[0], costs[1], worst]
}
