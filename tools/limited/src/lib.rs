//! Processes with a time limit, for tests. A process that hangs is killed at its limit, so its test fails. Without a
//! limit, a test that waits for the output or the end of such a process would hang for ever.

use std::io::{self, Read, Write};
use std::ops::Deref;
use std::process::{ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

use shared_child::SharedChild;

/// The usual limit. On an idle computer, no process with this limit takes a tenth of it, so a test rarely fails because
/// the computer is busy.
pub const LIMIT: Duration = Duration::from_secs(300);

/// The longest time for which a child of an ended process may keep the process's output open.
const HELD: Duration = Duration::from_secs(5);

/// A process that is killed at its time limit, or when this value is dropped. If it is killed at the limit, `wait`
/// returns an exit status that is not a success, and reads from its pipes end unless a child keeps the pipes open.
#[derive(Debug)]
pub struct Process {
    /// The pipe to standard input, unless the test has taken it.
    pub stdin: Option<ChildStdin>,
    /// The pipe from standard output, unless the test has taken it.
    pub stdout: Option<ChildStdout>,
    /// The pipe from standard error, unless the test has taken it.
    pub stderr: Option<ChildStderr>,
    child: Arc<SharedChild>,
}

impl Process {
    /// Starts a process with the usual limit.
    ///
    /// # Errors
    /// Returns an error if the process does not start.
    pub fn start(command: &mut Command) -> io::Result<Self> {
        Self::start_within(LIMIT, command)
    }

    /// Starts a process that is killed after this time.
    ///
    /// # Errors
    /// Returns an error if the process does not start.
    pub fn start_within(limit: Duration, command: &mut Command) -> io::Result<Self> {
        let child = Arc::new(SharedChild::spawn(command)?);
        let (watched, name) = (Arc::clone(&child), format!("{command:?}"));
        // This thread ends when the process ends, or at the limit.
        thread::spawn(move || {
            if matches!(watched.wait_timeout(limit), Ok(None)) {
                // An error means that the process has ended in the meantime.
                let _ = watched.kill();
                eprintln!("killed after {limit:?}: {name}");
            }
        });
        Ok(Self {
            stdin: child.take_stdin(),
            stdout: child.take_stdout(),
            stderr: child.take_stderr(),
            child,
        })
    }

    /// Closes standard input, and waits for the process to end.
    ///
    /// # Errors
    /// Returns an error if the operating system does not report the exit status.
    pub fn wait(&mut self) -> io::Result<ExitStatus> {
        drop(self.stdin.take());
        self.child.wait()
    }

    /// Writes the input to the process, and waits for its end. Returns its output.
    ///
    /// # Errors
    /// Returns an error if the output cannot be read.
    pub fn feed(mut self, input: &[u8]) -> io::Result<Output> {
        let stdin = self.stdin.take();
        let (stdout, stderr) = (read(self.stdout.take()), read(self.stderr.take()));
        let status = thread::scope(|scope| {
            // The process may end before it has read everything, so ignore the error.
            scope.spawn(move || stdin.is_some_and(|mut stdin| stdin.write_all(input).is_ok()));
            self.wait()
        })?;
        let bytes = |pipe: Receiver<io::Result<Vec<u8>>>| {
            let held = "a child of the process still holds its output";
            let read = pipe.recv_timeout(HELD);
            read.unwrap_or_else(|_| Err(io::Error::other(held)))
        };
        Ok(Output {
            status,
            stdout: bytes(stdout)?,
            stderr: bytes(stderr)?,
        })
    }

    /// Closes standard input, and waits for the end of the process. Returns its output.
    ///
    /// # Errors
    /// Returns an error if the output cannot be read.
    pub fn wait_with_output(self) -> io::Result<Output> {
        self.feed(&[])
    }
}

/// Gives access to the process's id, its exit status if it has ended, and a function that kills it.
impl Deref for Process {
    type Target = SharedChild;

    fn deref(&self) -> &SharedChild {
        &self.child
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // An error means that the process has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Starts a thread that reads a pipe to its end, and then sends the bytes.
fn read(pipe: Option<impl Read + Send + 'static>) -> Receiver<io::Result<Vec<u8>>> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = pipe.map_or(Ok(0), |mut pipe| pipe.read_to_end(&mut bytes));
        // The test has already failed if nobody receives.
        let _ = sender.send(read.map(|_| bytes));
    });
    receiver
}

/// A command that is run to its end.
pub trait RunToEnd {
    /// Runs the command with this input and the usual limit. Returns its output.
    ///
    /// # Errors
    /// Returns an error if the process does not start, or its output cannot be read.
    fn run_to_end(&mut self, input: &[u8]) -> io::Result<Output>;
}

impl RunToEnd for Command {
    fn run_to_end(&mut self, input: &[u8]) -> io::Result<Output> {
        run_within(LIMIT, self, input)
    }
}

/// Runs a command with this input, for at most this time. Returns its output.
///
/// # Errors
/// Returns an error if the process does not start, or its output cannot be read.
pub fn run_within(limit: Duration, command: &mut Command, input: &[u8]) -> io::Result<Output> {
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Process::start_within(limit, command)?.feed(input)
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    const SHORT: Duration = Duration::from_millis(200);

    fn shell(commands: &str) -> Command {
        let mut shell = Command::new("sh");
        shell.args(["-c", commands]);
        shell
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        shell
    }

    #[test]
    fn a_read_from_a_silent_process_ends_at_the_limit() {
        let began = Instant::now();
        let mut silent = Process::start_within(SHORT, &mut shell("exec sleep 30")).expect("sh");
        let mut bytes = Vec::new();
        let mut stdout = silent.stdout.take().expect("a pipe");
        let read = stdout.read_to_end(&mut bytes);
        assert_eq!(read.expect("an end"), 0);
        assert!(!silent.wait().expect("a status").success());
        assert!(began.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn a_process_that_does_not_end_fails_at_the_limit() {
        for commands in ["exec sleep 30", "sleep 30; true"] {
            let began = Instant::now();
            let output = run_within(SHORT, &mut shell(commands), b"");
            assert!(
                !output.is_ok_and(|output| output.status.success()),
                "{commands}"
            );
            assert!(began.elapsed() < Duration::from_secs(20), "{commands}");
        }
    }

    #[test]
    fn a_process_that_ends_in_time_has_its_output_and_status() {
        let commands = "cat; echo told >&2; exit 3";
        let input = vec![b'x'; 1 << 20];
        let output = shell(commands).run_to_end(&input).expect("sh");
        assert_eq!(output.status.code(), Some(3));
        assert!(output.stdout == input);
        assert_eq!(output.stderr, b"told\n");
    }

    #[test]
    fn output_that_a_child_of_the_process_holds_is_an_error() {
        let output = shell("sleep 30 & exit 0").run_to_end(b"");
        assert!(output.is_err(), "{output:?}");
    }

    #[test]
    fn a_process_ends_with_the_test_that_started_it() {
        let process = Process::start(&mut shell("exec sleep 30")).expect("sh");
        let id = process.id().to_string();
        drop(process);
        let found = shell(&format!("kill -0 {id}")).run_to_end(b"").expect("sh");
        assert!(!found.status.success());
    }
}
