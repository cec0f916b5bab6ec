//! `docs/rivals.md`.

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

Made by one command, which takes two minutes:

```sh
cargo bench -p framelock-rivals -- --write docs/rivals.md
```

It says what happened to these crates, in these versions, on these streams, and no more than that. The
streams are made up: real lines fail in other ways too. No crate was given line events, which
framelock's receivers use to settle what is pending when the line falls silent.

* **Each crate is used as its documentation shows**, and at its best: `ublox` and `mavlink-core` know the same
  messages as framelock and leave their payloads as they are; `crsf`'s packets of kinds that it does not know
  count as found. Packets of channels or link statistics that are too short make `crsf` panic, so they are kept
  from it. `parse_rc_ibus` checks 32 bytes; the machine of the textbook finds them for it. framelock decodes what
  its formats decode.
* **The streams** have the same frames and the same faults for each crate of a protocol. *1 % lost*: each
  byte is lost with that probability. *0.1 % flips*: one bit of a byte is inverted. *Bursts*: one byte in
  a thousand begins 1 to 40 random ones in place of what was sent. *Sync-dense*: payloads made of bytes
  that begin frames and of short lengths, and 1 % of the bytes lost. *Length lost*: one frame in ten lacks its
  length byte, or its second byte where there is none.
* **Lost** are frames that arrive whole and are not delivered. **False** are those delivered that are none of
  these: damaged ones whose check is right, and frames inside the payload of others. Where chunks of 64 give
  something else than single bytes, both are there: `crsf` and `sbus` want single bytes.
* **Every answer is confirmed.** framelock's frames are those of the
  [naive reference](../proofs/src/reference.rs), byte by byte and in chunks; each frame that it loses lies
  under a false one whose check is right, which no receiver can tell. The others' are compared with what was sent.
* **Latest** is how many bytes behind its last byte a frame was delivered, at most, fed byte by byte. Behind a
  false beginning framelock waits for the false frame's end, as `uf-crsf`, `ublox` and `mavlink-core` do.
* **Megabytes per second** are the fastest of many passes, in which the crates took turns. Compare them within
  a column; on another machine they differ.
";

const CHIP: &str = "
## On a Cortex-M4

The clean stream, 200 frames, byte by byte, in the [emulator](../tools/emulator/README.md): its cycles have no flash
wait states. Built as the firmware is, for size, with link-time optimisation. *Code* and *constants* are
what the receiver adds to a program that does nothing with the bytes, without `memcpy` and its like
and without the MAVLink dialect, which is the user's. *State* is RAM besides the stack. All of these crates
build for it without `std`; *can panic* says whether the program has one of `core::panicking`'s functions.

Two are faster on the chip. `parse_rc_ibus` behind the textbook's machine never looks back: it drops all bytes of a
wrong frame, and with them the whole frames that began among these, which its column of lost frames shows; it gives
fourteen of the eighteen channels. `sbus-rs` loses about as few as framelock, and has nearly four times the code. Of
framelock's cycles half are for bytes that are only stored, about 38 each with the call, as for any format; each byte
asks about one place at most, whatever comes, so hostile streams cost [less a byte](costs.md) than with `sbus-rs`.

| protocol | | code | constants | state | cycles a frame | can panic |
| --- | --- | ---: | ---: | ---: | ---: | --- |
";

/// The whole text.
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
    text.push_str("\n## What the others do as well, or better\n\n");
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
        "\nMegabytes per second in chunks of 64; *by byte*: the clean stream byte by byte:\n\n\
         | | {columns} | by byte |\n| --- |{} ---: |\n",
        " ---: |".repeat(Fault::ALL.len()),
    )?;
    for row in &played.rows {
        writeln!(text, "| {} | {} |", row.name, speeds(row))?;
    }
    Ok(())
}

/// Returns a line for each rival, which lists where it is at least as good as framelock.
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
            [] => "nothing that was measured".to_owned(),
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
        better.push(format!("finds as many frames as {}", ours.name));
        if latest(rival) < latest(ours) {
            better.push("its latest frame is less late".to_owned());
        }
    }
    for (place, fault) in Fault::ALL.into_iter().enumerate() {
        for ours in ours {
            if rival.by_chunk[place].lost <= ours.by_chunk[place].lost
                && rival.megabytes_per_second[place] >= ours.megabytes_per_second[place]
            {
                better.push(format!("as fast as {}: {}", ours.name, fault.name()));
            }
        }
    }
    if rival.by_byte_clean >= ours[0].by_byte_clean {
        better.push("faster byte by byte".to_owned());
    }
    better
}

fn small_as_good(rival: &Figures, ours: &Figures) -> Vec<&'static str> {
    let flash = |of: &Figures| of.text + of.rodata;
    [
        (flash(rival) <= flash(ours), "no larger on the chip"),
        (rival.state <= ours.state, "no more state"),
        (
            rival.cycles_a_frame <= ours.cycles_a_frame,
            "no more cycles",
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

/// The rivals' versions, as the lock file has them.
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

/// The same, and where it ran.
fn machine() -> Result<String, Box<dyn Error>> {
    let processor = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = processor
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1))
        .unwrap_or(std::env::consts::ARCH);
    Ok(format!("{}, {processor}", compiler_and_day()?))
}
