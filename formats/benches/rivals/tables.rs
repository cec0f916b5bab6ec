//! Writes `docs/rivals.md`.

use std::error::Error;
use std::fmt::{self, Write};
use std::fs;
use std::process::Command;

use crate::answer::Answer;
use crate::chip::Figures;
use crate::streams::{Fault, SEED};
use crate::{FRAMES, Match, Row};

const BEGINNING: &str = "\
# framelock and other crates for the same protocols

One command writes this page. It takes two minutes:

```sh
cargo bench -p framelock-rivals -- --write docs/rivals.md
```

This page states only how these versions of the crates perform on these streams. The streams are generated, and real
lines also fail in other ways. No crate gets line events. With line events, framelock's receivers would decide about
pending bytes as soon as the line falls silent.

* **Each crate is used as its documentation shows**, and in the way in which it performs best. `ublox` and
  `mavlink-core` know the same messages as framelock, and do not decode the payloads. If `crsf` does not know the kind
  of a packet, the packet counts as delivered. `crsf` panics on packets of channels or link statistics that are too
  short, so these packets are not decoded. `parse_rc_ibus` does not find frames. It gets 32 bytes that a textbook state
  machine finds. framelock decodes the frames of its own formats.
* **The streams** are the same for all crates of a protocol: the same frames, with the same faults. *1 % lost*: each
  byte is lost with this probability. *0.1 % flips*: each byte gets one inverted bit with this probability. *Bursts*:
  one byte in a thousand begins a burst, in which 1 to 40 random bytes replace the sent ones. *Sync-dense*: the payloads
  consist of bytes that begin frames and of short lengths, and 1 % of the bytes are lost. *Length lost*: one frame in
  ten lacks its length byte, or its second byte if the protocol has no length byte.
* **Lost** frames arrive whole and are not delivered. **False** frames are delivered, but were not sent or did not
  arrive whole. A false frame is a damaged frame whose check is correct, or a frame inside another frame's payload. Each
  crate gets the streams twice: byte by byte, and in chunks of 64 bytes. If the two results differ, the tables show both
  results. `crsf` and `sbus` need single bytes.
* **Every answer is confirmed.** framelock delivers the same frames as the
  [naive reference](../proofs/src/reference.rs), byte by byte and in chunks. Each frame that framelock loses overlaps a
  false frame. No receiver can recognise this false frame, because its check is correct. The answers of the other crates
  are compared with the sent frames.
* **Latest** is the greatest number of bytes between a frame's last byte and its delivery, if the receiver gets the
  stream byte by byte. After a false start, framelock waits for the end of the false frame, as `uf-crsf`, `ublox` and
  `mavlink-core` do.
* **Megabytes per second** are measured in many passes, in which the crates take turns. Only the fastest pass of each
  crate counts. Compare the figures only within a column, because they differ from machine to machine.
";

const CHIP: &str = "
## On a Cortex-M4

The figures are for a clean stream of 200 frames, byte by byte, in the [emulator](../tools/emulator/README.md). The
emulator's cycles include no wait states of the flash. The programs are built like the firmware: for size, with
link-time optimisation.
*Code* and *constants* are the bytes that the receiver adds to a program that does nothing with the stream. These
figures do not include `memcpy` and similar functions, or the MAVLink dialect, which the user chooses. *State* is RAM
without the stack. All of these crates build for the chip without `std`. *Can panic* says whether the program contains a
function of `core::panicking`.

For a clean stream, framelock takes the fewest cycles in each protocol. On noise or on hostile streams, four crates take
[fewer cycles per byte](costs.md) than framelock. The textbook state machine for `parse_rc_ibus` drops all bytes of an
invalid frame, and never searches these bytes again. So it also loses whole frames that began among these bytes, as the
row of lost frames shows. `parse_rc_ibus` decodes fourteen of the eighteen channels. `sbus` and `uf-sbus` take at most
half as many cycles as framelock in the worst hostile stream, because framelock classifies the remaining bytes again
after each false start. framelock makes at most one classification per received byte, so it takes fewer cycles in the
worst hostile stream than `sbus-rs`. The code of `sbus-rs` is three times as large as the code of framelock.

| protocol | | code | constants | state | cycles a frame | can panic |
| --- | --- | ---: | ---: | ---: | ---: | --- |
";

/// Returns the whole text.
pub(crate) fn document(matches: &[Match], figures: &[Figures]) -> Result<String, Box<dyn Error>> {
    let mut text = BEGINNING.to_owned();
    writeln!(
        text,
        "\n{FRAMES} frames in each stream, seed {SEED}. {}. {}.",
        versions()?,
        machine()?
    )?;
    for played in matches {
        protocol(&mut text, played)?;
    }
    text.push_str("\n## What other crates do as well or better\n\nEach line lists the measurements in which a crate is at least as good as framelock.\n\n");
    for played in matches {
        as_good(&mut text, played, figures)?;
    }
    text.push_str(CHIP);
    for figure in figures {
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            figure.protocol,
            figure.contender,
            figure.text,
            figure.rodata,
            figure.state,
            figure.cycles_a_frame,
            if figure.can_panic { "yes" } else { "no" }
        )?;
    }
    Ok(text)
}

fn protocol(text: &mut String, played: &Match) -> fmt::Result {
    let columns = Fault::ALL.map(Fault::name).join(" | ");
    let whole: Vec<String> = played.whole.iter().map(usize::to_string).collect();
    write!(
        text,
        "\n## {}\n\nWhole frames lost, and false frames:\n\n\
         | | {columns} | latest |\n| --- |{} ---: |\n| arrive whole | {} | |\n",
        played.protocol.name,
        " ---: |".repeat(Fault::ALL.len()),
        whole.join(" | "),
    )?;
    for row in &played.rows {
        let same = cells(&row.by_byte) == cells(&row.by_chunk);
        writeln!(
            text,
            "| {}{} | {} | {} |",
            row.name,
            if same { "" } else { ", byte by byte" },
            cells(&row.by_byte),
            latest(row)
        )?;
        if !same {
            let chunks = cells(&row.by_chunk);
            writeln!(text, "| {}, chunks of 64 | {chunks} | |", row.name)?;
        }
    }
    write!(
        text,
        "\nMegabytes per second, in chunks of 64 bytes. The column *by byte* is for the clean stream, byte by byte.\n\n\
         | | {columns} | by byte |\n| --- |{} ---: |\n",
        " ---: |".repeat(Fault::ALL.len()),
    )?;
    for row in &played.rows {
        writeln!(text, "| {} | {} |", row.name, speeds(row))?;
    }
    Ok(())
}

/// Writes a line for each rival. The line lists the figures in which the rival is at least as good as framelock.
fn as_good(text: &mut String, played: &Match, figures: &[Figures]) -> fmt::Result {
    let (ours, rivals): (Vec<&Row>, Vec<&Row>) = played
        .rows
        .iter()
        .partition(|row| row.name.starts_with("framelock"));
    for rival in rivals {
        let mut better = found_as_good(rival, &ours);
        let of = |contender| {
            let mut all = figures.iter();
            all.find(|of| of.protocol == played.protocol.name && of.contender == contender)
        };
        if let (Some(rival), Some(ours)) = (of(rival.name), of("framelock")) {
            better.extend(small_as_good(rival, ours).into_iter().map(str::to_owned));
        }
        let better = match &better[..] {
            [] => "none".to_owned(),
            better => better.join("; "),
        };
        writeln!(
            text,
            "* {}, `{}`: {better}.",
            played.protocol.name, rival.name
        )?;
    }
    Ok(())
}

fn found_as_good(rival: &Row, ours: &[&Row]) -> Vec<String> {
    let mut better = Vec::new();
    let no_worse = |ours: &&&Row| {
        let mut pairs = rival.by_byte.iter().zip(&ours.by_byte);
        pairs.all(|(rival, ours)| rival.lost <= ours.lost)
    };
    if let Some(ours) = ours.iter().find(no_worse) {
        better.push(format!("finds at least as many frames as {}", ours.name));
        if latest(rival) < latest(ours) {
            better.push("its latest delivery is earlier".to_owned());
        }
    }
    for (place, fault) in Fault::ALL.into_iter().enumerate() {
        for ours in ours {
            if rival.by_chunk[place].lost <= ours.by_chunk[place].lost
                && rival.megabytes_per_second[place] >= ours.megabytes_per_second[place]
            {
                better.push(format!(
                    "at least as fast as {} on the stream *{}*",
                    ours.name,
                    fault.name()
                ));
            }
        }
    }
    if rival.by_byte_clean >= ours[0].by_byte_clean {
        better.push("at least as fast byte by byte".to_owned());
    }
    better
}

fn small_as_good(rival: &Figures, ours: &Figures) -> Vec<&'static str> {
    let flash = |of: &Figures| of.text + of.rodata;
    [
        (flash(rival) <= flash(ours), "at most as much flash"),
        (rival.state <= ours.state, "at most as much state"),
        (
            rival.cycles_a_frame <= ours.cycles_a_frame,
            "at most as many cycles",
        ),
        (!rival.can_panic, "cannot panic"),
    ]
    .into_iter()
    .filter_map(|(is_as_good, what)| is_as_good.then_some(what))
    .collect()
}

fn latest(row: &Row) -> usize {
    row.by_byte
        .iter()
        .map(|answer| answer.latest)
        .max()
        .unwrap_or(0)
}

fn cells(answers: &[Answer]) -> String {
    let cells: Vec<String> = answers
        .iter()
        .map(|answer| match (answer.lost, answer.false_frames) {
            (lost, 0) => lost.to_string(),
            (lost, false_frames) => format!("{lost}, {false_frames} false"),
        })
        .collect();
    cells.join(" | ")
}

fn speeds(row: &Row) -> String {
    let all = row.megabytes_per_second.iter().chain([&row.by_byte_clean]);
    let cells: Vec<String> = all.map(|speed| format!("{speed:.0}")).collect();
    cells.join(" | ")
}

/// Returns the rivals' versions from the lock file.
pub(crate) fn versions() -> Result<String, Box<dyn Error>> {
    const RIVALS: [&str; 8] = [
        "crsf",
        "mavlink-core",
        "parse_rc_ibus",
        "sbus",
        "sbus-rs",
        "ublox",
        "uf-crsf",
        "uf-sbus",
    ];
    let lock = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../Cargo.lock"))?;
    let version = |name| {
        let entry = format!("name = \"{name}\"\nversion = \"");
        let (_, behind) = lock.split_once(&entry).ok_or("not in Cargo.lock")?;
        let (version, _) = behind.split_once('"').ok_or("no version")?;
        Ok::<_, Box<dyn Error>>(format!("{name} {version}"))
    };
    let versions: Result<Vec<String>, _> = RIVALS.into_iter().map(version).collect();
    Ok(versions?.join(", "))
}

/// Returns the date of the run, and the compiler's version.
pub(crate) fn compiler_and_day() -> Result<String, Box<dyn Error>> {
    let day = says("date", "+%Y-%m-%d")?;
    Ok(format!("{day}, {}", compiler()?))
}

pub(crate) fn compiler() -> Result<String, Box<dyn Error>> {
    says("rustc", "--version")
}

fn says(program: &str, argument: &str) -> Result<String, Box<dyn Error>> {
    let output = Command::new(program).arg(argument).output()?;
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}

/// Returns the date, the compiler's version, and the processor.
fn machine() -> Result<String, Box<dyn Error>> {
    let processor = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = processor
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1))
        .unwrap_or(std::env::consts::ARCH);
    Ok(format!("{}, {processor}", compiler_and_day()?))
}
