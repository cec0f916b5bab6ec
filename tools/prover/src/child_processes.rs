//! Runs each CBMC in a process group of its own. The whole group is terminated at the limit of processor time, and when
//! the prover is interrupted.

use std::collections::BTreeSet;
use std::fs::File;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context as _, Result};
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;

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

/// Runs the command, and writes its output into the file. Returns its exit status, or `None` if it was terminated at
/// the limit. The limit counts seconds of processor time, so other programs on the machine do not affect the outcome.
pub(crate) fn status_within(
    seconds: u64,
    command: &Command,
    output: File,
) -> Result<Option<ExitStatus>> {
    let mut limited = Command::new("sh");
    limited
        .args(["-c", r#"ulimit -S -t "$0" && exec "$@""#])
        .arg(seconds.to_string())
        .arg(command.get_program())
        .args(command.get_args())
        .envs(
            command
                .get_envs()
                .filter_map(|(name, value)| Some((name, value?))),
        )
        .stdout(output.try_clone()?)
        .stderr(output);
    let mut groups = running();
    let mut child = limited.process_group(0).spawn()?;
    let group = Pid::from_raw(child.id().cast_signed());
    groups.insert(group);
    drop(groups);
    let status = child.wait();
    // Terminates the processes that the command has started.
    end(group);
    running().remove(&group);
    let status = status?;
    let is_late = status.signal() == Some(Signal::SIGXCPU as i32);
    Ok((!is_late).then_some(status))
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
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn at_the_limit_the_processes_that_a_command_has_started_end_too() {
        let file = std::env::temp_dir().join(format!("framelock-child-{}", std::process::id()));
        let mut shell = Command::new("sh");
        shell
            .args(["-c", "sleep 60 & echo $! > $0; while :; do :; done"])
            .arg(&file);
        let nowhere = File::create("/dev/null").unwrap();
        let status = status_within(1, &shell, nowhere).unwrap();
        assert!(status.is_none(), "{status:?}");
        let child = fs::read_to_string(&file).unwrap();
        fs::remove_file(&file).unwrap();
        assert!(!child.trim().is_empty());
        // The kernel ends a killed process a little later, and the process may remain until its new parent asks for its
        // status. A child that is not killed runs for a minute.
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
