//! What is known about the protocol, measured by the simulation: with fixed seeds, so a test passes
//! always or never. Intervals are those of 95 %, which fixed seeds were not chosen to meet.
#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

mod findings;
mod limits;

use super::experiment;
use super::parameters::{DEFAULT, Parameters};
use super::payload::Payload;
use super::results::{Point, ReceiverResult};
use super::statistics::Share;
use super::tally::Tally;
use crate::names::PolicyName;

fn tally(parameters: &Parameters) -> Tally {
    experiment::run(parameters, || ()).unwrap()
}

fn simulated(parameters: &Parameters) -> Point {
    Point::new(parameters.clone(), &tally(parameters))
}

fn holds(share: Share, value: f64) -> bool {
    (share.low..=share.high).contains(&value)
}
