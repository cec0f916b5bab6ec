//! Results as text, CSV or JSON.

use std::io::{self, Write};

use serde::Serialize;

use super::parameters::{NUMBERS, frame_name};
use super::results::{Point, ReceiverResult, policy_name};
use super::statistics::Share;
use super::sweep::Sweep;

/// All of it, as JSON.
#[derive(Serialize)]
struct Document<'a> {
    /// Who wrote it.
    framelock: &'static str,
    swept: Vec<&'static str>,
    points: &'a [Point],
}

/// One JSON object.
pub(super) fn write_json(
    out: &mut impl Write,
    sweeps: &[Sweep],
    points: &[Point],
) -> io::Result<()> {
    let document = Document {
        framelock: env!("CARGO_PKG_VERSION"),
        swept: sweeps.iter().map(|sweep| sweep.number.name).collect(),
        points,
    };
    serde_json::to_writer_pretty(&mut *out, &document)?;
    writeln!(out)
}

/// A row for each point and receiver, with all parameters in front.
pub(super) fn write_csv(out: &mut impl Write, points: &[Point]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for (index, (point, receiver)) in points
        .iter()
        .flat_map(|point| {
            point
                .receivers
                .iter()
                .map(move |receiver| (point, receiver))
        })
        .enumerate()
    {
        let mut columns = parameter_columns(point);
        columns.extend(line_columns(point));
        columns.extend(receiver_columns(receiver));
        if index == 0 {
            writer.write_record(columns.iter().map(|(name, _)| name))?;
        }
        writer.write_record(columns.iter().map(|(_, value)| value))?;
    }
    writer.flush()
}

type Columns = Vec<(String, String)>;

fn parameter_columns(Point { parameters, .. }: &Point) -> Columns {
    let mut columns = vec![
        ("seed".to_owned(), parameters.seed.to_string()),
        ("frame".to_owned(), frame_name(parameters.frame).to_owned()),
        ("payload".to_owned(), parameters.payload.to_string()),
        ("unreported".to_owned(), parameters.unreported.to_string()),
    ];
    columns.extend(NUMBERS.iter().map(|number| {
        let name = number.name.replace('-', "_");
        (name, optional(number.get(parameters)))
    }));
    columns
}

fn line_columns(Point { line, .. }: &Point) -> Columns {
    [
        ("frames_sent", line.frames_sent),
        ("frames_intact", line.frames_intact.count),
        ("bytes_sent", line.bytes_sent),
        ("bytes_delivered", line.bytes_delivered),
        ("bytes_lost", line.bytes_lost),
        ("framing_errors", line.framing_errors),
        ("breaks", line.breaks),
    ]
    .map(|(name, count)| (name.to_owned(), count.to_string()))
    .into()
}

fn receiver_columns(receiver: &ReceiverResult) -> Columns {
    let mut columns = vec![
        ("policy".to_owned(), policy_name(receiver.policy).to_owned()),
        (
            "idle_gap_rule".to_owned(),
            receiver.idle_gap.is_some().to_string(),
        ),
    ];
    for (
        name,
        Share {
            count,
            value,
            low,
            high,
            ..
        },
    ) in [
        ("delivered", receiver.delivered),
        ("lost_intact", receiver.lost_intact),
        ("wrong_setpoints", receiver.wrong_setpoints),
        ("false_frames", receiver.false_frames),
    ] {
        columns.push((name.to_owned(), count.to_string()));
        columns.push((format!("{name}_share"), value.to_string()));
        columns.push((format!("{name}_low"), low.to_string()));
        columns.push((format!("{name}_high"), high.to_string()));
    }
    let lost = receiver.lost_intact_per_lost_byte;
    let back = &receiver.resynchronisation;
    let error = receiver.actuator_error;
    columns.extend(
        [
            (
                "lost_intact_per_lost_byte",
                optional(lost.map(|lost| lost.value)),
            ),
            (
                "lost_intact_per_lost_byte_low",
                optional(lost.map(|lost| lost.low)),
            ),
            (
                "lost_intact_per_lost_byte_high",
                optional(lost.map(|lost| lost.high)),
            ),
            ("bytes_discarded", receiver.bytes_discarded.to_string()),
            ("resynchronisations", back.count.to_string()),
            ("resynchronisation_median_ms", optional(back.median_ms)),
            (
                "resynchronisation_percentile_99_ms",
                optional(back.percentile_99_ms),
            ),
            ("resynchronisation_longest_ms", optional(back.longest_ms)),
            ("resynchronisation_never", back.never.to_string()),
            (
                "longest_silence_ms",
                receiver.longest_silence_ms.to_string(),
            ),
            (
                "failsafe_engagements",
                receiver.failsafe_engagements.to_string(),
            ),
            (
                "actuator_error_largest",
                optional(error.map(|error| f64::from(error.largest))),
            ),
            ("actuator_error_rms", optional(error.map(|error| error.rms))),
        ]
        .map(|(name, value)| (name.to_owned(), value)),
    );
    columns
}

/// Nothing where there is no value.
fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// Tables for people. One point gets a long table, more get a line for each receiver.
pub(super) fn write_text(
    out: &mut impl Write,
    sweeps: &[Sweep],
    points: &[Point],
) -> io::Result<()> {
    match points {
        [point] => write_one(out, point),
        _ => write_many(out, sweeps, points),
    }
}

fn write_one(out: &mut impl Write, point: &Point) -> io::Result<()> {
    let Point {
        parameters,
        line,
        receivers,
    } = point;
    writeln!(
        out,
        "seed {}, {} trials of {} frames ({}, {}), {} baud, {} frames a second\n",
        parameters.seed,
        parameters.trials,
        parameters.frames,
        frame_name(parameters.frame),
        parameters.payload,
        parameters.baud,
        parameters.rate,
    )?;
    writeln!(out, "frames sent           {:>14}", line.frames_sent)?;
    writeln!(
        out,
        "  arrived intact      {:>14}",
        line.frames_intact.count
    )?;
    writeln!(out, "bytes sent            {:>14}", line.bytes_sent)?;
    writeln!(out, "  delivered           {:>14}", line.bytes_delivered)?;
    writeln!(out, "  lost behind the UART{:>14}", line.bytes_lost)?;
    writeln!(out, "framing errors        {:>14}", line.framing_errors)?;
    writeln!(out, "breaks                {:>14}\n", line.breaks)?;

    let mut row = |name: &str, value: &dyn Fn(&ReceiverResult) -> String| -> io::Result<()> {
        write!(out, "{name:<34}")?;
        for receiver in receivers {
            write!(out, "{:>16}", value(receiver))?;
        }
        writeln!(out)
    };
    row("", &|receiver| policy_name(receiver.policy).to_owned())?;
    row("", &|receiver| {
        receiver
            .idle_gap
            .map_or_else(String::new, |gap| format!("idle gap {gap}"))
    })?;
    row("delivered", &|receiver| {
        receiver.delivered.count.to_string()
    })?;
    row("  of the frames sent", &|receiver| {
        percent(receiver.delivered)
    })?;
    row("lost though intact", &|receiver| {
        receiver.lost_intact.count.to_string()
    })?;
    row("  of the intact frames", &|receiver| {
        percent(receiver.lost_intact)
    })?;
    row("  for each lost byte", &|receiver| {
        let lost = receiver.lost_intact_per_lost_byte;
        lost.map_or_else(none, |lost| format!("{:.6}", lost.value))
    })?;
    row("    95 % interval from", &|receiver| {
        let lost = receiver.lost_intact_per_lost_byte;
        lost.map_or_else(none, |lost| format!("{:.6}", lost.low))
    })?;
    row("    to", &|receiver| {
        let lost = receiver.lost_intact_per_lost_byte;
        lost.map_or_else(none, |lost| format!("{:.6}", lost.high))
    })?;
    row("wrong setpoints", &|receiver| {
        receiver.wrong_setpoints.count.to_string()
    })?;
    row("false frames", &|receiver| {
        receiver.false_frames.count.to_string()
    })?;
    row("resynchronised", &|receiver| {
        receiver.resynchronisation.count.to_string()
    })?;
    row("  never", &|receiver| {
        receiver.resynchronisation.never.to_string()
    })?;
    row("  after, median, ms", &|receiver| {
        milliseconds(receiver.resynchronisation.median_ms)
    })?;
    row("  99 of 100 within, ms", &|receiver| {
        milliseconds(receiver.resynchronisation.percentile_99_ms)
    })?;
    row("  at the latest, ms", &|receiver| {
        milliseconds(receiver.resynchronisation.longest_ms)
    })?;
    row("longest silence, ms", &|receiver| {
        milliseconds(Some(receiver.longest_silence_ms))
    })?;
    row("failsafe engagements", &|receiver| {
        receiver.failsafe_engagements.to_string()
    })?;
    row("actuator error, largest", &|receiver| {
        let error = receiver.actuator_error;
        error.map_or_else(none, |error| error.largest.to_string())
    })?;
    row("actuator error, RMS", &|receiver| {
        let error = receiver.actuator_error;
        error.map_or_else(none, |error| format!("{:.3}", error.rms))
    })
}

fn write_many(out: &mut impl Write, sweeps: &[Sweep], points: &[Point]) -> io::Result<()> {
    for sweep in sweeps {
        write!(out, "{:>14}", sweep.number.name)?;
    }
    writeln!(
        out,
        "  {:<8}{:>5}{:>12}{:>13}{:>12}{:>10}{:>12}{:>11}{:>8}",
        "policy",
        "gap",
        "delivered",
        "lost intact",
        "wrong",
        "false",
        "silence, ms",
        "failsafe",
        "RMS"
    )?;
    for point in points {
        for receiver in &point.receivers {
            for sweep in sweeps {
                write!(out, "{:>14}", optional(sweep.number.get(&point.parameters)))?;
            }
            writeln!(
                out,
                "  {:<8}{:>5}{:>12}{:>13}{:>12}{:>10}{:>12}{:>11}{:>8}",
                policy_name(receiver.policy),
                receiver.idle_gap.map_or_else(none, |gap| gap.to_string()),
                percent(receiver.delivered),
                receiver.lost_intact.count,
                receiver.wrong_setpoints.count,
                receiver.false_frames.count,
                milliseconds(Some(receiver.longest_silence_ms)),
                receiver.failsafe_engagements,
                receiver
                    .actuator_error
                    .map_or_else(none, |error| format!("{:.2}", error.rms)),
            )?;
        }
    }
    Ok(())
}

fn none() -> String {
    "-".to_owned()
}

fn percent(share: Share) -> String {
    if share.of == 0 {
        return none();
    }
    format!("{:.4} %", 100.0 * share.value)
}

fn milliseconds(value: Option<f64>) -> String {
    value.map_or_else(none, |value| format!("{value:.1}"))
}
