//! The demonstration as lines of text: as it goes, and what came of it.

use std::io::{self, Write};
use std::time::Duration;

use framelock::Setpoint;

use super::demonstration::{Demonstration, Report};
use crate::view_parts::phase_name;

/// How many lines there are at most, so that a long run can still be read.
const MOST_LINES: u32 = 30;

/// Runs the demonstration to its end, as fast as it goes; a line for each second, or for several.
pub(super) fn run(demonstration: &mut Demonstration, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "                            lecture's machine (discard)       receiver (rescan)\n    \
         time  line        sent    lost wrong output   failsafe    lost wrong output   failsafe"
    )?;
    let seconds = demonstration.arguments.seconds;
    let step = seconds.div_ceil(MOST_LINES).max(1);
    let mut second = 0;
    while second < seconds {
        second = (second + step).min(seconds);
        demonstration.advance_to(Duration::from_secs(second.into()));
        let passage = demonstration.passage().name();
        let (line, reports) = demonstration.report();
        let sent = line.frames_sent;
        let stations: String = reports.iter().map(columns).collect();
        let line = format!("{second:>6} s  {passage:<8}{sent:>8}{stations}");
        writeln!(out, "{}", line.trim_end())?;
    }
    writeln!(out)
}

fn columns(report: &Report) -> String {
    let Setpoint { pitch, roll, yaw } = report.output.setpoint;
    let phase = phase_name(report.output.phase);
    let (lost, wrong) = (report.lost, report.wrong);
    format!("  {lost:>6}{wrong:>6} {pitch:02X} {roll:02X} {yaw:02X} {phase:<8}")
}

type Value<'a> = &'a dyn Fn(&Report) -> u64;

/// What came of it.
pub(super) fn write_summary(demonstration: &Demonstration, out: &mut impl Write) -> io::Result<()> {
    let arguments = &demonstration.arguments;
    writeln!(
        out,
        "seed {}, {} s, {} baud, {} frames a second",
        arguments.seed, arguments.seconds, arguments.baud, arguments.rate
    )?;
    writeln!(
        out,
        "in motion a byte is lost with probability {}, a bit inverted with {}",
        arguments.drop, arguments.flip
    )?;
    if let Some(gap) = arguments.idle_gap {
        writeln!(
            out,
            "idle gap: more than {gap} byte times drop the frame under way"
        )?;
    }
    if !demonstration.is_over() {
        let now = demonstration.now.as_secs_f64();
        writeln!(out, "ended early, after {now:.1} s")?;
    }
    writeln!(
        out,
        "\n{:<30}{:>20}{:>12}\n{:<30}{:>20}{:>12}",
        "", "lecture's machine", "receiver", "", "(discard)", "(rescan)"
    )?;
    let (line, reports) = demonstration.report();
    let rows: [(&str, Value); 8] = [
        ("frames sent", &|_| line.frames_sent),
        ("  received", &|report| report.tally.delivered),
        ("  lost", &|report| report.lost),
        ("    though delivered whole", &|report| {
            report.tally.lost_intact
        }),
        ("wrong commits", &|report| report.wrong),
        ("longest silence, ms", &|report| {
            report.tally.longest_silence / 1_000
        }),
        ("failsafe engagements", &|report| report.tally.engagements),
        ("bytes discarded", &|report| report.tally.bytes_discarded),
    ];
    for (name, value) in rows {
        write!(out, "{name:<30}")?;
        for (report, width) in reports.iter().zip([20, 12]) {
            write!(out, "{:>width$}", value(report))?;
        }
        writeln!(out)?;
    }
    writeln!(
        out,
        "\nThe line broke {} frames; the sender itself paused for {} ms at most.",
        line.frames_sent - line.frames_intact,
        demonstration.longest_pause().as_millis(),
    )
}
