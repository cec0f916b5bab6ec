//! The framelock command line: see `framelock --help`.

fn main() -> std::process::ExitCode {
    framelock_host::run()
}
