//! Writes results as JSON, CSV or text. CSV and text are made from the JSON.

use std::io::{self, Write};
use std::slice;

use framelock_simulation::{Parameters, Payload, ReceiverTally, Share};
use serde_json::{Value, json};

use super::experiment::Point;
use super::sweep::Sweep;

/// Returns the counts of the line.
fn line(point: &Point) -> Value {
    let line = &point.tally.line;
    json!({
        "frames_sent": line.frames_sent,
        "frames_intact": Share::new(line.frames_intact, line.frames_sent),
        "bytes_sent": line.bytes_sent,
        "bytes_delivered": line.bytes_delivered,
        "bytes_lost": line.bytes_lost,
        "framing_errors": line.framing_errors,
        "breaks": line.breaks,
    })
}

/// Returns the results of a receiver.
fn result(point: &Point, receiver: &ReceiverTally) -> Value {
    let line = &point.tally.line;
    let gap = point.parameters.idle_gap;
    // The error is in units of the setpoint. The error is given for smooth motion only, because the failsafe's approach
    // cannot follow any other payload.
    let is_motion = point.parameters.payload == Payload::Motion;
    let rms = receiver.error_rms().filter(|_| is_motion);
    let error = rms.map(|rms| json!({ "largest": receiver.largest_error, "rms": rms }));
    json!({
        "policy": receiver.kind.policy,
        "idle_gap": receiver.kind.has_idle_gap.then_some(gap),
        "delivered": Share::new(receiver.delivered, line.frames_sent),
        "lost_intact": Share::new(receiver.lost_intact, line.frames_intact),
        "lost_intact_per_lost_byte": receiver.lost_per_byte(),
        "wrong_setpoints": Share::new(receiver.wrong_setpoints, line.frames_sent),
        "false_frames": Share::new(receiver.false_frames, line.bytes_delivered),
        "bytes_discarded": receiver.bytes_discarded,
        "resynchronisation": {
            "count": receiver.times_back(),
            "median_ms": receiver.back_within_ms(50),
            "percentile_99_ms": receiver.back_within_ms(99),
            "longest_ms": receiver.back_within_ms(100),
            "never": receiver.never_back,
            "by_intact_frames_lost": receiver.back_by_frames,
        },
        "longest_silence_ms": receiver.longest_silence_ms(),
        "failsafe_engagements": receiver.engagements,
        "actuator_error": error,
    })
}

/// Returns a row for each receiver of a point, with the point's parameters and the counts of its line.
#[must_use]
pub fn rows(point: &Point) -> Vec<Value> {
    let receivers = point.tally.receivers.iter();
    let rows = receivers.map(|receiver| {
        let has_rule = receiver.kind.has_idle_gap;
        let policy = json!(receiver.kind.policy);
        let name = text(Some(&policy)) + if has_rule { "+gap" } else { "" };
        json!({
            "parameters": point.parameters,
            "line": line(point),
            "policy": policy,
            "idle_gap_rule": has_rule,
            "name": name,
            "receiver": result(point, receiver),
        })
    });
    rows.collect()
}

/// Writes all results as one JSON object.
pub(super) fn write_json(
    out: &mut impl Write,
    sweeps: &[Sweep],
    points: &[Point],
) -> io::Result<()> {
    let points = points.iter().map(|point| {
        let receivers = point.tally.receivers.iter();
        let receivers = receivers.map(|receiver| result(point, receiver));
        json!({
            "parameters": point.parameters,
            "line": line(point),
            "receivers": receivers.collect::<Vec<_>>(),
        })
    });
    let document = json!({
        "framelock": env!("CARGO_PKG_VERSION"),
        "swept": sweeps.iter().map(|sweep| sweep.number.name).collect::<Vec<_>>(),
        "points": points.collect::<Vec<_>>(),
    });
    serde_json::to_writer_pretty(&mut *out, &document)?;
    writeln!(out)
}

/// The CSV columns after the parameters, and for each column the path of its value in the JSON of a row.
const COLUMNS: &str = include_str!("tables/columns.txt");

/// Writes a CSV row for each point and receiver, beginning with all parameters.
///
/// # Errors
/// Returns an error if the rows cannot be written.
pub fn write_csv(out: &mut impl Write, points: &[Point]) -> io::Result<()> {
    let numbers = Parameters::NUMBERS.iter().map(|number| number.name);
    let parameters = ["seed", "frame", "payload", "unreported"].into_iter();
    let parameters = parameters.chain(numbers).map(|name| {
        let name = name.replace('-', "_");
        (format!("/parameters/{name}"), name)
    });
    let results = COLUMNS.lines().filter_map(|line| line.split_once(' '));
    let results = results.map(|(name, place)| (place.trim_start().to_owned(), name.to_owned()));
    let (places, names): (Vec<_>, Vec<_>) = parameters.chain(results).unzip();

    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(names)?;
    for row in points.iter().flat_map(rows) {
        writer.write_record(places.iter().map(|place| text(row.pointer(place))))?;
    }
    writer.flush()
}

/// Returns a value as a user would type it, or an empty text if there is none.
fn text(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(text)) => text.clone(),
        // JSON writes the whole number 5 as 5.0; drop the `.0`.
        Some(Value::Number(number)) if number.is_f64() => {
            number.as_f64().unwrap_or_default().to_string()
        }
        Some(value) => value.to_string(),
    }
}

/// Returns the text of a table cell: the value at a path in the row's JSON, or a hyphen if there is
/// none. `%` after the path formats a share, and `.N` formats a number with N decimals.
fn cell(row: &Value, place: &str) -> String {
    let (pointer, unit) = place.split_once(' ').unwrap_or((place, ""));
    let value = row.pointer(pointer).unwrap_or(&Value::Null);
    let shown = match unit.strip_prefix('.').map(str::parse) {
        Some(Ok(places)) => value.as_f64().map(|value| format!("{value:.places$}")),
        _ if unit == "%" && value["of"] == 0 => None,
        _ if unit == "%" => value["value"]
            .as_f64()
            .map(|share| format!("{:.4} %", 100.0 * share)),
        _ => Some(text(Some(value))).filter(|text| !text.is_empty()),
    };
    shown.unwrap_or_else(|| "-".to_owned())
}

/// Writes tables for people. For one point, writes a long table. For several points, writes a line for each receiver of
/// each point.
pub(super) fn write_text(
    out: &mut impl Write,
    sweeps: &[Sweep],
    points: &[Point],
) -> io::Result<()> {
    let rows: Vec<_> = points.iter().flat_map(rows).collect();
    match (points, rows.first()) {
        ([_], Some(first)) => {
            let names = [
                "seed", "trials", "frames", "frame", "payload", "baud", "rate",
            ];
            let [seed, trials, frames, frame, payload, baud, rate] =
                names.map(|name| cell(first, &format!("/parameters/{name}")));
            writeln!(
                out,
                "seed {seed}, {trials} trials of {frames} frames ({frame}, {payload})\n\
                 {baud} baud, {rate} frames a second\n"
            )?;
            let line = include_str!("tables/line.txt");
            write_table(out, line, [22, 14], slice::from_ref(first))?;
            writeln!(out)?;
            write_table(out, include_str!("tables/receiver.txt"), [24, 14], &rows)
        }
        _ => write_many(out, sweeps, &rows),
    }
}

/// Writes a table. Each line of `table` consists of a name and a path. The table shows the name, followed by the value
/// that each row has at the path.
fn write_table(
    out: &mut impl Write,
    table: &str,
    [name_width, width]: [usize; 2],
    rows: &[Value],
) -> io::Result<()> {
    for (name, place) in table.lines().filter_map(|line| line.split_once('/')) {
        write!(out, "{name:<name_width$.name_width$}")?;
        for row in rows {
            write!(out, "{:>width$}", cell(row, &format!("/{place}")))?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes a line for each row, with the swept value and the most important results. If there are two sweeps, writes a
/// table for each value of the first sweep.
fn write_many(out: &mut impl Write, sweeps: &[Sweep], rows: &[Value]) -> io::Result<()> {
    let columns = [
        ("delivered", 11, "/receiver/delivered %"),
        ("lost", 7, "/receiver/lost_intact/count"),
        ("wrong", 7, "/receiver/wrong_setpoints/count"),
        ("false", 7, "/receiver/false_frames/count"),
        ("silence", 8, "/receiver/longest_silence_ms .1"),
        ("holds", 7, "/receiver/failsafe_engagements"),
        ("RMS", 6, "/receiver/actuator_error/rms .2"),
    ];
    let place = |sweep: &Sweep| format!("/parameters/{}", sweep.number.name.replace('-', "_"));
    let (part, swept) = match sweeps {
        [first, second] => (Some(first), second),
        [swept] => (None, swept),
        _ => return Ok(()),
    };
    write!(out, "{:>12}  {:<13}", swept.number.name, "policy")?;
    for (name, width, _) in columns {
        write!(out, "{name:>width$}")?;
    }
    writeln!(out)?;
    let mut before = None;
    for row in rows {
        if let Some(part) = part {
            let value = cell(row, &place(part));
            if before.as_ref() != Some(&value) {
                writeln!(out, "{} {value}:", part.number.name)?;
            }
            before = Some(value);
        }
        let (value, name) = (cell(row, &place(swept)), cell(row, "/name"));
        write!(out, "{value:>12}  {name:<13}")?;
        for (_, width, place) in columns {
            write!(out, "{:>width$}", cell(row, place))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
