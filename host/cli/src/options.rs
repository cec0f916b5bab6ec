//! Parses the values of options: numbers, probabilities, setpoints and frames.

use anyhow::{Context, Result, anyhow, bail, ensure};
use framelock::LineEvent;
use framelock::motion::Setpoint;
use framelock_description::text::{harmless, quoted};
use framelock_receiving::Protocol;

/// Parses a probability, from 0 to 1.
pub(crate) fn probability(text: &str) -> Result<f64> {
    number(text, 0.0, 1.0)
}

/// Parses a number from `least` to `most`.
pub(crate) fn number(text: &str, least: f64, most: f64) -> Result<f64> {
    match text.parse() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => bail!("expected a number from {least} to {most}"),
    }
}

/// Parses a whole number from `least` to `most`.
pub(crate) fn whole<T: TryFrom<u64>>(text: &str, least: u64, most: u64) -> Result<T> {
    let number = text.parse().ok();
    number
        .filter(|number| (least..=most).contains(number))
        .and_then(|number| T::try_from(number).ok())
        .with_context(|| format!("expected a whole number from {least} to {most}"))
}

/// Parses `pitch,roll,yaw`, each a whole number from 0 to 255.
pub(crate) fn setpoint(text: &str) -> Result<Setpoint> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [pitch, roll, yaw] = *fields else {
        bail!(
            "\"{}\" is not three numbers such as 127,200,74",
            quoted(text)
        );
    };
    let demand = |axis: &str, field: &str| {
        let demand = field.parse();
        demand.map_err(|_| {
            anyhow!(
                "{axis} \"{}\" is not a whole number from 0 to 255",
                quoted(field)
            )
        })
    };
    Ok(Setpoint {
        pitch: demand("pitch", pitch)?,
        roll: demand("roll", roll)?,
        yaw: demand("yaw", yaw)?,
    })
}

/// Checks that no break begins the frames of this protocol. Neither raw bytes nor this program's ports have breaks.
pub(crate) fn check_has_no_breaks(protocol: &Protocol) -> Result<()> {
    ensure!(
        protocol.description.ending_event() != Some(LineEvent::Break),
        "a break begins each packet of {protocol}, and this command neither sees nor sends breaks: generate a receiver, \
         and report the breaks to it in the firmware"
    );
    Ok(())
}

/// Returns the shipped description with this name, or reads the description in the file with this name.
pub(crate) fn protocol(name: &str) -> Result<Protocol, String> {
    Protocol::named(name).map_err(|why| harmless(&why.to_string()))
}
