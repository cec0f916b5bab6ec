//! Descriptions that are not shipped.

/// The name and the text of a description.
type Named = (&'static str, &'static str);

/// Returns descriptions that cover the ends of frames and the checksums that no shipped description has.
pub(crate) fn forms() -> Vec<Named> {
    read(include_str!("forms.txt"))
}

pub(crate) fn others() -> Vec<Named> {
    read(include_str!("others.txt"))
}

fn read(file: &'static str) -> Vec<Named> {
    let parts = file.split("\n== ").skip(1);
    parts.map(|part| part.split_once('\n').unwrap()).collect()
}

/// Returns the description with this name among [`others`].
pub(crate) fn other(name: &str) -> Named {
    others().into_iter().find(|one| one.0 == name).unwrap()
}
