//! Setpoints from JSON lines.

use framelock::Setpoint;
use serde::Deserialize;
use serde_json::Value;

use super::{AXES, NOT_A_DEMAND, NOT_A_TIME, Row, TIME, seconds};

/// The object of a line whose time is read.
#[derive(Deserialize)]
struct Timed {
    time: Option<f64>,
    pitch: u8,
    roll: u8,
    yaw: u8,
}

/// The setpoint of one line, or none if the line is blank.
pub(super) fn parse(line: &[u8], reads_times: bool) -> Result<Option<Row>, String> {
    // Without its end, behind which the library would see a further line.
    let line = line.trim_ascii_end();
    if line.is_empty() {
        return Ok(None);
    }
    // The library would take an array for an object.
    if line.trim_ascii_start().first() != Some(&b'{') {
        return Err(r#"not a JSON object such as {"pitch":127,"roll":200,"yaw":74}"#.into());
    }
    if !reads_times {
        let setpoint = serde_json::from_slice(line).map_err(|error| why_not(line, &error))?;
        return Ok(Some(Row {
            time: None,
            setpoint,
        }));
    }
    let timed: Timed = serde_json::from_slice(line).map_err(|error| why_not(line, &error))?;
    let time = timed
        .time
        .map(|time| seconds(time).ok_or_else(|| format!("field {TIME}: {time} {NOT_A_TIME}")));
    Ok(Some(Row {
        time: time.transpose()?,
        setpoint: Setpoint {
            pitch: timed.pitch,
            roll: timed.roll,
            yaw: timed.yaw,
        },
    }))
}

/// What is wrong with a line, in the user's words: `error` names neither field nor range.
fn why_not(line: &[u8], error: &serde_json::Error) -> String {
    if let Ok(object) = serde_json::from_slice::<Value>(line) {
        for axis in AXES {
            match object.get(axis) {
                None => return format!("no field {axis}"),
                Some(value) if value.as_u64().is_none_or(|demand| demand > 255) => {
                    return format!("field {axis}: {value} {NOT_A_DEMAND}");
                }
                Some(_) => {}
            }
        }
    }
    let text = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    let text = text.strip_suffix(&place).unwrap_or(&text);
    format!("column {}: {text}", error.column())
}
