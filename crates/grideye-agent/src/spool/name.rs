//! The names of the segments' files.

const SEGMENT_PREFIX: &str = "segment-";

pub(super) fn name_of(number: u64) -> String {
    format!("{SEGMENT_PREFIX}{number:016x}")
}

pub(super) fn number_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix(SEGMENT_PREFIX)?;
    let number = u64::from_str_radix(digits, 16).ok()?;
    (name_of(number) == name).then_some(number)
}
