//! Numbers as options of the command line.

/// A probability, from 0 to 1.
pub(crate) fn probability(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1.0)
}

/// A number from `least` to `most`.
pub(crate) fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("a number from {least} to {most} is wanted")),
    }
}

/// A whole number from `least` to `most`.
pub(crate) fn whole<T: TryFrom<u64>>(text: &str, least: u64, most: u64) -> Result<T, String> {
    let number = text.parse().ok();
    number
        .filter(|number| (least..=most).contains(number))
        .and_then(|number| T::try_from(number).ok())
        .ok_or_else(|| format!("a whole number from {least} to {most} is wanted"))
}
