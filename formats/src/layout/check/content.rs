//! Checks a layout's content and its other terminators.

use super::reject_if;
use crate::layout::{Contradiction, Encoding, Layout, Length, Part, Patterns, larger};

/// Checks the content and the terminators, independently of a frame's length.
pub(super) const fn check_content(layout: &Layout) -> Result<(), Contradiction> {
    if layout.content.is_empty() {
        reject_if!(
            layout.has_other_terminators(),
            Part::OtherTerminators,
            "other terminators: without a content, other bytes of a frame may look like them: give a content"
        );
        return Ok(());
    }
    reject_if!(
        !matches!(layout.length, Length::Delimiter),
        Part::Content,
        "content: only frames that a delimiter ends can have a content"
    );
    if let Some(checksum) = &layout.checksum {
        let is_behind = checksum.at < 0 && checksum.at.unsigned_abs() as usize <= layout.behind;
        reject_if!(
            !is_behind && !matches!(checksum.encoding, Encoding::Hex),
            Part::Checksum,
            "checksum: its bytes may be outside the content: write it in hex digits"
        );
    }
    let mut number = 0_usize;
    while let Some(terminator) = nth_terminator(layout, number) {
        reject_if!(
            begins_with_content(layout, terminator),
            Part::Content,
            "content: a terminator begins with a byte of the content, so its start cannot be found"
        );
        let mut other = 0_usize;
        while let Some(longer) = nth_terminator(layout, other) {
            reject_if!(
                number != other && begins_with(longer, terminator),
                Part::OtherTerminators,
                "other terminators: one begins with another one, which would end the frame first"
            );
            other = other.wrapping_add(1);
        }
        number = number.wrapping_add(1);
    }
    Ok(())
}

/// Returns the terminator with this number. The patterns of `terminator` come first, then the other terminators.
const fn nth_terminator<'a>(layout: &Layout<'a>, number: usize) -> Option<&'a [u8]> {
    let [other, another] = layout.other_terminators;
    let (mut number, mut all): (_, &[Patterns]) = (number, &[layout.terminator, other, another]);
    while let [patterns, behind @ ..] = all {
        let (mut rest, length) = (patterns.bytes, larger(patterns.length, 1));
        while let Some((terminator, others)) = rest.split_at_checked(length) {
            if number == 0 {
                return Some(terminator);
            }
            (number, rest) = (number.wrapping_sub(1), others);
        }
        all = behind;
    }
    None
}

/// Returns true if the first byte of a terminator is content.
const fn begins_with_content(layout: &Layout, terminator: &[u8]) -> bool {
    let mut rest = layout.content;
    while let ([(first, last), others @ ..], [byte, ..]) = (rest, terminator) {
        if *first <= *byte && *byte <= *last {
            return true;
        }
        rest = others;
    }
    false
}

const fn begins_with(longer: &[u8], beginning: &[u8]) -> bool {
    let (mut longer, mut beginning) = (longer, beginning);
    while let [wanted, rest @ ..] = beginning {
        match longer {
            [byte, others @ ..] if *byte == *wanted => (longer, beginning) = (others, rest),
            _ => return false,
        }
    }
    true
}
