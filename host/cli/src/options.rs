//! Parses the values of options: numbers, probabilities and setpoints.

use framelock::motion::Setpoint;
use framelock_description::text::quoted;

/// Parses a probability, from 0 to 1.
pub(crate) fn probability(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1.0)
}

/// Parses a number from `least` to `most`.
pub(crate) fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("expected a number from {least} to {most}")),
    }
}

/// Parses a whole number from `least` to `most`.
pub(crate) fn whole<T: TryFrom<u64>>(text: &str, least: u64, most: u64) -> Result<T, String> {
    let number = text.parse().ok();
    number
        .filter(|number| (least..=most).contains(number))
        .and_then(|number| T::try_from(number).ok())
        .ok_or_else(|| format!("expected a whole number from {least} to {most}"))
}

/// Parses `pitch,roll,yaw`, each a whole number from 0 to 255.
pub(crate) fn setpoint(text: &str) -> Result<Setpoint, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [pitch, roll, yaw] = *fields else {
        return Err(format!(
            "\"{}\" is not three numbers such as 127,200,74",
            quoted(text)
        ));
    };
    let demand = |axis: &str, field: &str| {
        let demand = field.parse();
        demand.map_err(|_| {
            format!(
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
