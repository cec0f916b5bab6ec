//! Runs each checker in a process group of its own. The whole group is terminated at the time limit
//! and when the prover is interrupted.

use std::collections::BTreeSet;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::{Context as _, Result};
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use wait_timeout::ChildExt as _;

/// The process groups that are running.
static RUNNING: Mutex<BTreeSet<Pid>> = Mutex::new(BTreeSet::new());

fn running() -> MutexGuard<'static, BTreeSet<Pid>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

fn end(group: Pid) {
    // An error means that the group has already ended.
    let _ = killpg(group, Signal::SIGKILL);
}

/// Installs a handler for Ctrl-C and termination requests. It terminates the running groups and
/// then the prover.
pub(crate) fn end_with_the_prover() -> Result<()> {
    ctrlc::set_handler(|| end_all(130))?;
    Ok(())
}

/// Terminates the running groups, and the prover with this exit code.
pub(crate) fn end_all(code: i32) -> ! {
    // Keep the lock until the end, so that no new group is started.
    let running = running();
    running.iter().copied().for_each(end);
    std::process::exit(code);
}

/// Runs the command. Returns its exit status, or `None` if it was terminated at the time limit.
pub(crate) fn status_within(limit: Duration, command: &mut Command) -> Result<Option<ExitStatus>> {
    let mut groups = running();
    let child = command.process_group(0).spawn();
    let mut child =
        child.with_context(|| format!("{} does not start", command.get_program().display()))?;
    let group = Pid::from_raw(child.id().cast_signed());
    groups.insert(group);
    drop(groups);
    let status = child.wait_timeout(limit);
    end(group);
    child.wait()?;
    running().remove(&group);
    Ok(status?)
}

/// Returns the command's output without trailing white space. If the command fails, the error
/// contains all its output.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    let program = command.get_program().display().to_string();
    let output = command.output();
    let output = output.with_context(|| format!("{program} does not start"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    anyhow::ensure!(
        output.status.success(),
        "{program} ended with {}:\n{text}{}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(text.trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::fs;
    use std::time::Instant;

    use super::*;

    #[test]
    fn at_the_limit_the_processes_that_a_command_has_started_end_too() {
        let file = std::env::temp_dir().join(format!("framelock-child-{}", std::process::id()));
        let mut shell = Command::new("sh");
        shell
            .args(["-c", "sleep 60 & echo $! > $0; wait"])
            .arg(&file);
        let status = status_within(Duration::from_millis(500), &mut shell).unwrap();
        assert!(status.is_none(), "{status:?}");
        let child = fs::read_to_string(&file).unwrap();
        fs::remove_file(&file).unwrap();
        assert!(!child.trim().is_empty());
        // The kernel ends a killed process a little later, and the process may remain until its new parent asks for its
        // status. Without a signal, the child runs for a minute.
        let runs = || {
            let state = fs::read_to_string(format!("/proc/{}/stat", child.trim()));
            state.is_ok_and(|state| !state.contains(") Z "))
        };
        let end = Instant::now() + Duration::from_secs(20);
        while runs() {
            assert!(Instant::now() < end, "{child} still runs");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}
