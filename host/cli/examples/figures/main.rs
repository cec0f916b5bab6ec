//! Makes every figure of docs/line-faults.md, as SVG and CSV.

mod figure;
mod plot;

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;
use framelock_host::simulate::write_csv;

use crate::plot::Chart;

/// Make every figure of docs/line-faults.md, as SVG and CSV
#[derive(Parser)]
struct Arguments {
    /// Write the figures into this directory, which is created if it does not exist
    #[arg(value_name = "DIRECTORY")]
    directory: PathBuf,

    /// Seed the random numbers
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    seed: u64,

    /// Run this percentage of the trials; less than 100 for a quick look
    #[arg(long, default_value_t = 100, value_name = "PERCENT")]
    effort: u32,
}

fn main() -> Result<()> {
    write(&Arguments::parse())?;
    Ok(())
}

/// Writes all figures, and returns their charts.
fn write(arguments: &Arguments) -> Result<Vec<Chart>> {
    let directory = &arguments.directory;
    fs::create_dir_all(directory)
        .with_context(|| format!("cannot make the directory {}", directory.display()))?;
    let mut charts = Vec::new();
    for figure in figure::all()? {
        let path = directory.join(&figure.name).with_extension("svg");
        let cannot_write = || format!("cannot write the figure {}", path.display());
        let (points, chart) = figure.measure(arguments.seed, arguments.effort)?;
        let table = File::create(path.with_extension("csv")).with_context(cannot_write)?;
        write_csv(&mut BufWriter::new(table), &points).with_context(cannot_write)?;
        chart.write(&path).with_context(cannot_write)?;
        println!("{}", path.display());
        charts.push(chart);
    }
    Ok(charts)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use super::*;
    use crate::plot::Place;

    /// With a hundredth of the trials, the command writes all files, and every series has a visible point.
    #[test]
    fn one_command_writes_every_figure_of_the_report() {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("new/figures");
        let arguments = [
            "figures",
            directory.to_str().unwrap(),
            "--effort=1",
            "--seed=4",
        ];
        let charts = write(&Arguments::try_parse_from(arguments).unwrap()).unwrap();
        let linked = include_str!("../../../../docs/line-faults.md");
        let names = figure::all().unwrap().into_iter().map(|figure| figure.name);
        let names: Vec<String> = names.collect();
        assert_eq!(names.len(), linked.matches("](figures/").count());
        assert_eq!(names.len(), charts.len());
        for (name, chart) in names.into_iter().zip(charts) {
            for series in &chart.series {
                assert!(!series.places.is_empty(), "{name} {:?}", series.select);
                for Place { x, y, .. } in &series.places {
                    assert!((chart.x.from..=chart.x.to).contains(x), "{name} {x}");
                    let is_zero = chart.y.is_logarithmic && *y == 0.0;
                    let is_on_axis = (chart.y.from..=chart.y.to).contains(y);
                    assert!(is_zero || is_on_axis, "{name} {y}");
                }
            }
            let path = directory.join(&name).with_extension("svg");
            let svg = fs::read_to_string(&path).unwrap();
            assert!(svg.starts_with("<svg "), "{name}");
            assert!(svg.contains("seed 4"), "{name}");
            assert!(svg.contains("prefers-color-scheme: dark"), "{name}");
            let mut table = csv::Reader::from_path(path.with_extension("csv")).unwrap();
            assert!(table.records().all(|row| &row.unwrap()[0] == "4"), "{name}");
            assert!(linked.contains(&format!("(figures/{name}.svg)")), "{name}");
        }
    }
}
