//! The demonstration as lines of text: as it goes, and what came of it.

use std::io::{self, Write};
use std::time::Duration;

use framelock::Setpoint;

use super::simulation::Simulation;
use super::station::Report;
use crate::view_parts::phase_name;

/// How many lines there are at most, so that a long run can still be read.
const MOST_LINES: u32 = 30;

/// Runs the simulation to its end, as fast as it goes; a line for each second, or for several.
pub(super) fn run(simulation: &mut Simulation, out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "                            lecture's machine (discard)       receiver (rescan)\n    \
         time  line        sent    lost wrong output   failsafe    lost wrong output   failsafe"
    )?;
    let seconds = simulation.plan().seconds;
    let step = seconds.div_ceil(MOST_LINES).max(1);
    let mut second = 0;
    while second < seconds {
        second = (second + step).min(seconds);
        simulation.advance_to(Duration::from_secs(second.into()));
        let passage = simulation.passage().name();
        let [discard, rescan] = simulation.reports().map(|report| columns(&report));
        let sent = simulation.sent();
        let line = format!("{second:>6} s  {passage:<8}{sent:>8}{discard}{rescan}");
        writeln!(out, "{}", line.trim_end())?;
    }
    writeln!(out)
}

fn columns(Report { output, tally, .. }: &Report) -> String {
    let Setpoint { pitch, roll, yaw } = output.setpoint;
    let phase = phase_name(output.phase);
    format!(
        "  {:>6}{:>6} {pitch:02X} {roll:02X} {yaw:02X} {phase:<8}",
        tally.lost, tally.wrong,
    )
}

/// What came of it.
pub(super) fn write_summary(simulation: &Simulation, out: &mut impl Write) -> io::Result<()> {
    let plan = simulation.plan();
    writeln!(
        out,
        "seed {}, {} s, {} baud, {} frames a second",
        plan.seed, plan.seconds, plan.baud, plan.rate
    )?;
    writeln!(
        out,
        "in motion a byte is lost with probability {}, a bit inverted with {}",
        plan.drop, plan.flip
    )?;
    if let Some(gap) = plan.idle_gap {
        writeln!(
            out,
            "idle gap: more than {gap} byte times drop the frame under way"
        )?;
    }
    if !simulation.is_over() {
        let now = simulation.now().as_secs_f64();
        writeln!(out, "ended early, after {now:.1} s")?;
    }
    writeln!(
        out,
        "\n{:<30}{:>20}{:>12}\n{:<30}{:>20}{:>12}",
        "", "lecture's machine", "receiver", "", "(discard)", "(rescan)"
    )?;
    let [discard, rescan] = simulation.reports();
    let mut row = |name: &str, value: &dyn Fn(&Report) -> u64| {
        writeln!(
            out,
            "{name:<30}{:>20}{:>12}",
            value(&discard),
            value(&rescan)
        )
    };
    row("frames sent", &|_| simulation.sent())?;
    row("  received", &|report| report.tally.received)?;
    row("  lost", &|report| report.tally.lost)?;
    row("    though delivered whole", &|report| {
        report.tally.lost_though_whole
    })?;
    row("wrong commits", &|report| report.tally.wrong)?;
    row("longest silence, ms", &|report| {
        milliseconds(report.tally.longest_silence)
    })?;
    row("failsafe engagements", &|report| report.tally.engagements)?;
    row("bytes discarded", &|report| {
        report.counters.discarded.total()
    })?;
    writeln!(
        out,
        "\nThe line broke {} frames; the sender itself paused for {} ms at most.",
        simulation.broken(),
        milliseconds(simulation.longest_pause()),
    )
}

/// Whole milliseconds; the run is shorter than the number of them could be.
fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}
