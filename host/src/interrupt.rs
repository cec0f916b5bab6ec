//! Ctrl-C, and its relatives SIGTERM and SIGHUP.

/// What the shell reports for a program that Ctrl-C ended.
const EXIT_CODE_INTERRUPTED: i32 = 130;

/// Calls `first` at the first one. A second one ends the process, for when the end itself has to
/// wait.
pub(crate) fn watch(mut first: impl FnMut() + Send + 'static) -> Result<(), ctrlc::Error> {
    let mut is_second = false;
    ctrlc::set_handler(move || {
        if std::mem::replace(&mut is_second, true) {
            std::process::exit(EXIT_CODE_INTERRUPTED);
        }
        first();
    })
}
