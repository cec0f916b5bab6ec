//! The measured figures, in `figures.tsv`. Each line is a row of a table in `docs/rivals.md`: the table's name, then
//! the cells. A test of xtask compares the tables in the page with the file.

use std::error::Error;
use std::fs;
use std::process::Command;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/figures.tsv");

/// A row: the table's name, then the cells.
pub(crate) type Row = Vec<String>;

/// Makes a row of anything that can be displayed.
macro_rules! row {
    ($($cell:expr),+ $(,)?) => { vec![$($cell.to_string()),+] };
}
pub(crate) use row;

pub(crate) fn read() -> Result<Vec<Row>, Box<dyn Error>> {
    let text = fs::read_to_string(FILE)?;
    let rows = text.lines().map(|line| line.split('\t').map(str::to_owned));
    Ok(rows.map(Iterator::collect).collect())
}

/// Replaces each table that has a new row.
pub(crate) fn write(new: Vec<Row>) -> Result<(), Box<dyn Error>> {
    let mut rows = read()?;
    rows.retain(|old| new.iter().all(|row| row[0] != old[0]));
    rows.extend(new);
    let lines = rows.iter().map(|row| row.join("\t") + "\n");
    Ok(fs::write(FILE, lines.collect::<String>())?)
}

/// Compares tables with those in the file. Figures of the chip depend on the compiler, so they are compared only if the
/// compiler has not changed.
pub(crate) fn check(new: &[Row]) -> Result<(), Box<dyn Error>> {
    let old = read()?;
    let run = run_of("costs")?;
    let is_same = old.iter().any(|row| row[0] == run[0] && row[2] == run[2]);
    let mut changed = new.iter().filter(|row| !old.contains(row));
    let changed = changed.find(|row| is_same || !row[0].starts_with("chip"));
    changed.map_or(Ok(()), |row| {
        Err(format!("not as in {FILE}: {}", row.join(" | ")).into())
    })
}

/// Returns a row with this command, today's date, the compiler and the processor.
pub(crate) fn run_of(command: &str) -> Result<Row, Box<dyn Error>> {
    let all = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let mut lines = all.lines();
    let model = lines.find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    let processor = model.unwrap_or(std::env::consts::ARCH);
    Ok(row![
        command,
        says("date", "+%Y-%m-%d")?,
        says("rustc", "--version")?,
        processor
    ])
}

/// Returns the rivals' versions from the lock file.
pub(crate) fn versions() -> Result<Row, Box<dyn Error>> {
    let lock = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.lock"))?;
    let version = |name: &str| {
        let entry = lock.split_once(&format!("name = \"{name}\"\nversion = \""));
        Some(format!("{name} {}", entry?.1.split_once('"')?.0))
    };
    let names = "cobs crsf mavlink-core parse_rc_ibus regex sbus sbus-rs serial-line-ip ublox uf-crsf uf-sbus winnow";
    let versions: Option<Vec<String>> = names.split(' ').map(version).collect();
    Ok(row![
        "versions",
        versions.ok_or("not in Cargo.lock")?.join(", ")
    ])
}

fn says(program: &str, argument: &str) -> Result<String, Box<dyn Error>> {
    let output = Command::new(program).arg(argument).output()?;
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}
