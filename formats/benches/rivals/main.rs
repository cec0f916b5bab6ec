//! Compares framelock's receivers with other crates for the same protocols, on the same faulty streams, and measures
//! the cost of a byte. docs/rivals.md has the commands and the results.

#![allow(
    clippy::indexing_slicing,
    clippy::cast_precision_loss,
    clippy::doc_markdown,
    clippy::type_complexity,
    reason = "a failed benchmark panics; times are rounded; MAVLink and iBUS are names; closures have no shorter types"
)]

use std::error::Error;

mod answer;
mod chip;
mod contender;
mod costs;
mod figures;
mod packets;
mod protocols;
mod races;
mod streams;

fn main() -> Result<(), Box<dyn Error>> {
    let command = std::env::args().nth(1).unwrap_or_default();
    let mut rows = match command.as_str() {
        "check" => {
            let found = races::all().into_iter().flat_map(|race| race.found());
            let found = found.chain(packets::joined());
            let rows = found.chain(costs::on_chip()?).collect::<Vec<_>>();
            return figures::check(&rows);
        }
        "races" => {
            let mut races = races::all();
            races.iter_mut().for_each(races::Race::run);
            let rows = races.iter().flat_map(|race| [race.found(), race.speeds()]);
            rows.flatten().chain(packets::joined()).collect()
        }
        "costs" => costs::on_chip()?,
        _ => return Err("commands: races, costs, check".into()),
    };
    rows.extend([figures::run_of(&command)?, figures::versions()?]);
    figures::write(rows)
}
