//! Descriptions that come with the crate.

/// Their names and texts.
macro_rules! shipped {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../frames/", $name, ".toml")))),*]
    };
}

/// The names of the shipped descriptions, and their texts.
pub const SHIPPED: &[(&str, &str)] = shipped!(
    "bin" "bin-crc8" "sbus" "ibus" "crsf" "ubx" "nmea" "rtcm" "gnss" "mavlink" "mavlink1" "mavlink2" "six-axes"
    "six-axes-be"
);

/// The text of the shipped description of that name.
#[must_use]
pub fn shipped(name: &str) -> Option<&'static str> {
    let found = SHIPPED.iter().find(|(shipped, _)| *shipped == name);
    found.map(|(_, text)| *text)
}

/// That there is none of that name.
pub(crate) fn no_such(name: &str) -> String {
    let names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
    let nearest = names
        .iter()
        .min_by_key(|shipped| strsim::damerau_levenshtein(shipped, name));
    let nearest = nearest.unwrap_or(&"");
    format!(
        "there is no frame {name:?}, the nearest name is {nearest}: the frames are {}",
        names.join(", ")
    )
}
