//! A setpoint in an option or a datagram.

use framelock::motion::Setpoint;
use framelock_description::text::quoted;

/// Reads `pitch,roll,yaw`, each a whole number from 0 to 255.
pub(super) fn parse(text: &str) -> Result<Setpoint, String> {
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
