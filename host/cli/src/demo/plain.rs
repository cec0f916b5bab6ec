//! Prints the demonstration as lines of text, and the table of counts at its end.

use std::io::{self, Write};
use std::time::Duration;

use super::demonstration::{Demonstration, PARAMETERS, Report};
use super::script::{RATE, SECONDS};
use super::story::story;

/// Runs the demonstration to its end without waiting. Prints the story, and a line for each second between the story's
/// parts.
pub(super) fn run(demonstration: &mut Demonstration, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "{:<31}{:<29}framelock\n{:>8}{:>8}{COLUMNS}{COLUMNS}",
        "", "lecture", "time", "sent"
    )?;
    let mut current = None;
    for second in 0..=SECONDS {
        demonstration.advance_to(Duration::from_secs(second));
        let story = story(demonstration);
        if current != Some(story) {
            writeln!(out, "\n{}\n{}\n", story.heading, story.text)?;
            current = Some(story);
        }
        if second > 0 {
            let (line, reports) = demonstration.report();
            let sent = line.frames_sent;
            let stations: String = reports.iter().map(columns).collect();
            let line = format!("{second:>6} s{sent:>8}{stations}");
            writeln!(out, "{}", line.trim_end())?;
        }
    }
    writeln!(out)
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

/// Writes the table of counts.
pub(super) fn write_summary(demonstration: &Demonstration, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "{RATE} frames a second. While the seat moves, the line loses a byte with\n\
         probability {}, and inverts a bit of it with probability {}.",
        PARAMETERS.lose, PARAMETERS.flip
    )?;
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
    let [lecture, framelock] = [0, 1].map(|station| reports[station].tally.lost_intact);
    writeln!(
        out,
        "\nBroken by the line: {broken}. Missed though whole: lecture {lecture}, framelock {framelock}."
    )
}
