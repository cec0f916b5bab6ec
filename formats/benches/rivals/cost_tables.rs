//! Writes `docs/costs.md`.

use std::error::Error;
use std::fmt::{self, Write};

use framelock::Format;
use framelock_formats::crsf::Crsf;
use framelock_formats::gnss::Gnss;
use framelock_formats::ibus::Ibus;
use framelock_formats::mavlink::{Mavlink1, Mavlink2};
use framelock_formats::nmea::Nmea;
use framelock_formats::rtcm::Rtcm;
use framelock_formats::sbus::Sbus;
use framelock_formats::ubx::Ubx;

use crate::chip::Program;
use crate::costs::{self, BYTES, Case, SKIPPED};
use crate::{tables, valgrind};

const BEGINNING: &str = "\
# What a byte costs

One command writes this page. It takes a minute or two, and needs valgrind:

```sh
cargo bench -p framelock-rivals -- --costs docs/costs.md
```

Every receiver gets the bytes one by one, as from an interrupt. *framelock* is the receiver's `push`. As in framelock's
examples, the receiver's buffer is twice as long as the longest frame. *`Line`* is the same receiver in a `Line`, which
counts the outcome of each byte. The other crates are used as [their documentation shows](rivals.md).

* **Clean**: frames back to back, as in [rivals.md](rivals.md).
* **Noise**: random bytes, with all 256 values equally likely.
* **Worst**: the stream that is the most expensive for this receiver: clean, noise, or one of a few hostile streams. A
  hostile stream consists of false starts, one after another, that claim long frames. The receiver waits for the end of
  the claimed frame, checks the bytes, and rejects them. The hostile streams are listed below. No sender sends such a
  stream by accident.

The UBX format accepts frames of at most 106 bytes here. The MAVLink format knows the messages that are sent, and one
message with a payload of 255 bytes.
";

const CHIP: &str = "
## On a Cortex-M4

The table shows instructions and cycles per byte, in the [emulator](../tools/emulator/README.md). The emulator's cycles
include no wait states of the flash, so a real chip is slower. The programs are built like the firmware: for size, with
link-time optimisation. Each byte is passed in a call of its own. The byte's cost is counted from the first instruction
of the called function to the return. *One byte* is the number of cycles for the most expensive single byte of all these
streams. An interrupt handler must have time for that many cycles.

| | | clean | | noise | | worst | | one byte |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
| | | instructions | cycles | instructions | cycles | instructions | cycles | cycles |
";

const MOST_PER_CALL: &str = "
## The most bytes that one call examines

The table shows the most bytes about which a `BufferedReceiver` asks its format in one call, whatever bytes arrive. If
the longest frame has *n* bytes, a `push` asks about at most *n* bytes. A `poll` or a `line_event` decides about up to *n*
− 1 pending bytes. It asks about the bytes from each pending byte to the last, so about at most *n* (*n* − 1) / 2 bytes.
`Gnss` asks each of its three layouts. A `line_event` asks them again about incomplete bytes, so for `Gnss` its bound is
twice the number in the table. The bounds do not depend on the buffer.

Only false starts that lie in one another come near these bounds. If an interrupt handler has no time for as many bytes
as `poll` and `line_event` examine, call only `push` there, and the other two in the main loop.
[A test](../formats/tests/suite/limits.rs) counts the bytes for CRSF and RTCM, in streams of such false starts.

| | longest frame | `push` | `poll`, `line_event` |
| --- | ---: | ---: | ---: |
";

const HERE: &str = "
## On a PC

Valgrind's callgrind counts the instructions of a loop over the stream on x86-64. The table shows instructions per byte.

| | | clean | noise | worst |
| --- | --- | ---: | ---: | ---: |
";

/// Returns the whole text.
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
    most_per_call(&mut text)?;
    hostile_streams(&mut text, &cases)?;
    Ok(text)
}

/// Returns three costs: that of the clean stream, that of the noise, and the highest cost of all streams. The clean
/// stream comes first in the list, and the noise second.
fn clean_noise_worst(costs: &[f64]) -> [f64; 3] {
    let worst = costs.iter().copied().fold(0.0, f64::max);
    [costs[0], costs[1], worst]
}

/// Lists the most bytes about which one call asks a format.
fn most_per_call(text: &mut String) -> fmt::Result {
    text.push_str(MOST_PER_CALL);
    let formats = [
        ("SBUS", Sbus::LONGEST, 1),
        ("iBUS", Ibus::LONGEST, 1),
        ("CRSF", Crsf::LONGEST, 1),
        ("UBX", Ubx::<106>::LONGEST, 1),
        ("MAVLink 1", Mavlink1::LONGEST, 1),
        ("MAVLink 2", Mavlink2::LONGEST, 1),
        ("NMEA", Nmea::LONGEST, 1),
        ("RTCM", Rtcm::LONGEST, 1),
        ("`Gnss<1029>`", Gnss::<1029>::LONGEST, 3),
    ];
    for (name, longest, layouts) in formats {
        let (push, all) = (layouts * longest, layouts * longest * (longest - 1) / 2);
        writeln!(text, "| {name} | {longest} | {push} | {all} |")?;
    }
    Ok(())
}

fn hostile_streams(text: &mut String, cases: &[Case]) -> fmt::Result {
    write!(
        text,
        "\n## The hostile streams\n\nEach stream has {BYTES} bytes and repeats the bytes below. The first {SKIPPED} bytes are not counted.\n\n"
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
