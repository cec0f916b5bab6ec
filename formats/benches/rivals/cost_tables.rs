//! `docs/costs.md`.

use std::error::Error;
use std::fmt::{self, Write};
use std::hint::black_box;
use std::time::Instant;

use crate::chip::Program;
use crate::costs::{self, BYTES, Case, SKIPPED};
use crate::{mavlink2, tables, valgrind};

const BEGINNING: &str = "\
# What a byte costs

Made by one command, which takes a minute or two and needs valgrind:

```sh
cargo bench -p framelock-rivals -- --costs docs/costs.md
```

Byte by byte, as from an interrupt. *framelock* is the receiver by its `push`, with the buffer that its examples have,
twice the longest frame; *`Line`* is the same on a line that counts where each byte goes. The others are used as
[their documentation shows](rivals.md).

* **Clean**: frames back to back, as in [rivals.md](rivals.md).
* **Noise**: random bytes, each value as likely as the others.
* **Worst**: the costliest for that receiver of a few streams that were made to be costly: false beginnings that claim
  long frames, one behind the other. Each is checked when as many bytes are there as it claims, and is wrong. They are
  listed below. Nobody sends them by accident.

UBX frames may have 106 bytes here; MAVLink messages are those that are sent and one of 255 bytes.
";

const CHIP: &str = "
## On a Cortex-M4

Instructions and cycles a byte, in the [emulator](../tools/emulator/README.md): the cycles are its model's, without the wait
states of flash, so silicon is slower. Built as the firmware is, for size, with link-time optimisation. Each byte is a
call of a function that takes it, from its first instruction to its return. *One byte* is what the costliest
single byte of all these streams takes in cycles: an interrupt must have so much time.

| | | clean | | noise | | worst | | one byte |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
| | | instructions | cycles | instructions | cycles | instructions | cycles | cycles |
";

const HERE: &str = "
## On a PC

Instructions a byte, as valgrind's callgrind counts them, for x86-64, in a loop over the stream:

| | | clean | noise | worst |
| --- | --- | ---: | ---: | ---: |
";

/// The whole text.
pub(crate) fn document() -> Result<String, Box<dyn Error>> {
    let cases = costs::cases();
    let mut text = BEGINNING.to_owned();
    writeln!(
        text,
        "\n{}. {}.",
        tables::versions()?,
        tables::compiler_and_day()?
    )?;
    text.push_str(CHIP);
    for case in &cases {
        for contender in &case.contenders {
            let Some(features) = &contender.on_chip else {
                continue;
            };
            let program = Program::build(features)?;
            let (mut costs, mut most) = (Vec::new(), 0);
            for (stream, skipped) in case.streams() {
                let run = program.take(stream, skipped)?;
                let bytes = (stream.len() - skipped) as f64;
                let all = [run.all.instructions, run.all.cycles];
                costs.push(all.map(|all| all as f64 / bytes));
                most = most.max(run.costliest);
            }
            let [instructions, cycles] = [0, 1].map(|which| {
                let column: Vec<f64> = costs.iter().map(|cost| cost[which]).collect();
                clean_noise_worst(&column)
            });
            write!(text, "| {} | {} |", case.format, contender.name)?;
            for (instructions, cycles) in instructions.into_iter().zip(cycles) {
                write!(text, " {instructions:.0} | {cycles:.0} |")?;
            }
            writeln!(text, " {most} |")?;
        }
    }
    text.push_str(HERE);
    for (case, counts) in cases.iter().zip(valgrind::count(&cases)?) {
        for (contender, counts) in case.contenders.iter().zip(counts) {
            let [clean, noise, worst] = clean_noise_worst(&counts);
            let (format, name) = (case.format, contender.name);
            writeln!(
                text,
                "| {format} | {name} | {clean:.0} | {noise:.0} | {worst:.0} |"
            )?;
        }
    }
    checks(&mut text)?;
    hostile_streams(&mut text, &cases)?;
    Ok(text)
}

/// MAVLink's check alone, of the longest frame, without a table and with one. They take turns.
fn checks(text: &mut String) -> fmt::Result {
    let frame = [0x55; 278];
    let mut fastest = [f64::MAX; 2];
    for _ in 0..2_000 {
        for (fastest, check) in fastest.iter_mut().zip(mavlink2::CHECKS) {
            let start = Instant::now();
            for _ in 0..20 {
                black_box(check.of(black_box(&frame), None));
            }
            *fastest = fastest.min(start.elapsed().as_secs_f64() / 20.0);
        }
    }
    let [plain, tabled] = fastest.map(|seconds| frame.len() as f64 / 1e6 / seconds);
    writeln!(
        text,
        "\n*`pc-crc-table`* is the feature of that name of the formats, 16 KiB. MAVLink's check alone, of {} bytes, takes \
         {plain:.0} MB/s without it, {tabled:.0} MB/s with it.",
        frame.len()
    )
}

/// Of all streams: the first, the second, and the costliest of all.
fn clean_noise_worst(costs: &[f64]) -> [f64; 3] {
    let worst = costs.iter().copied().fold(0.0, f64::max);
    [costs[0], costs[1], worst]
}

fn hostile_streams(text: &mut String, cases: &[Case]) -> fmt::Result {
    write!(
        text,
        "\n## The hostile streams\n\n{BYTES} bytes, these again and again; the first {SKIPPED} are not counted.\n\n"
    )?;
    for case in cases {
        let periods = case.hostile.iter().map(|(period, _)| {
            let bytes: Vec<String> = period.iter().map(|byte| format!("{byte:02X}")).collect();
            format!("`{}`", bytes.join(" "))
        });
        let periods: Vec<String> = periods.collect();
        writeln!(text, "* {}: {}.", case.format, periods.join(", "))?;
    }
    Ok(())
}
