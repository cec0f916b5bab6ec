//! Prints the demonstration as lines of text, and the table of counts at its end.

use std::io::{self, Write};
use std::time::Duration;

use super::demonstration::{Demonstration, Report};
use super::story::story;

/// The limit on the number of lines with counts. It keeps the output of a long run readable.
const MOST_LINES: u32 = 20;

/// Runs the demonstration to its end without waiting. Prints the story. Between the story's parts, prints a line for
/// each second. In a long run, a line covers several seconds.
pub(super) fn run(demonstration: &mut Demonstration, out: &mut impl Write) -> io::Result<()> {
    let seconds = demonstration.arguments.seconds;
    let step = seconds.div_ceil(MOST_LINES);
    writeln!(
        out,
        "{:<31}{:<29}framelock\n{:>8}{:>8}{COLUMNS}{COLUMNS}",
        "", "lecture", "time", "sent"
    )?;
    let (mut second, mut told) = (0, None);
    loop {
        let story = story(demonstration);
        if told.as_ref() != Some(&story) {
            writeln!(out, "\n{}\n{}\n", story.heading, story.text)?;
            told = Some(story);
        }
        if second > 0 {
            let (line, reports) = demonstration.report();
            let sent = line.frames_sent;
            let stations: String = reports.iter().map(columns).collect();
            let line = format!("{second:>6} s{sent:>8}{stations}");
            writeln!(out, "{}", line.trim_end())?;
        }
        if second == seconds {
            return writeln!(out);
        }
        second = (second + step).min(seconds);
        demonstration.advance_to(Duration::from_secs(second.into()));
    }
}

const COLUMNS: &str = "    lost        deaf  failsafe";

fn columns(report: &Report) -> String {
    let deaf = match report.deaf {
        None => "-".to_owned(),
        Some(time) if time < Duration::from_millis(100) => "<0.1 s".to_owned(),
        Some(time) => format!("{:.1} s", time.as_secs_f64()),
    };
    let phase = report.output.phase;
    format!("{:>8}{deaf:>12}  {phase:<8}", report.lost)
}

type Value<'a> = &'a dyn Fn(&Report) -> u64;

/// Writes the options and the table of counts.
pub(super) fn write_summary(demonstration: &Demonstration, out: &mut impl Write) -> io::Result<()> {
    let arguments = &demonstration.arguments;
    writeln!(
        out,
        "seed {}, {} s, {} baud, {} frames a second\n\
         in the ride a byte is lost with probability {}, a bit inverted with {}",
        arguments.seed,
        arguments.seconds,
        arguments.baud,
        arguments.rate,
        arguments.drop,
        arguments.flip
    )?;
    if let Some(gap) = arguments.idle_gap {
        writeln!(
            out,
            "idle gap: a pause of more than {gap} byte times drops the incomplete frame"
        )?;
    }
    if !demonstration.is_over() {
        let now = demonstration.now.as_secs_f64();
        writeln!(out, "ended early, after {now:.1} s")?;
    }
    writeln!(out, "\n{:<30}{:>20}{:>12}", "", "lecture", "framelock")?;
    let (line, reports) = demonstration.report();
    let rows: [(&str, Value); 8] = [
        ("frames sent", &|_| line.frames_sent),
        ("  received", &|report| report.tally.delivered),
        ("  lost", &|report| report.lost),
        ("    though delivered whole", &|report| {
            report.tally.lost_intact
        }),
        ("wrong commits", &|report| report.wrong),
        ("deaf for at most, ms", &|report| {
            u64::try_from(report.longest_deafness.as_millis()).unwrap_or(u64::MAX)
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
    let broken = line.frames_sent - line.frames_intact;
    let mut missed = reports.iter().map(|report| report.tally.lost_intact);
    let [lecture, framelock] = [(); 2].map(|()| missed.next().unwrap_or_default());
    writeln!(
        out,
        "\nBroken by the line: {broken}. Missed though whole: lecture {lecture}, framelock {framelock}."
    )
}
