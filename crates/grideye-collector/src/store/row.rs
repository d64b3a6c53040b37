//! Converts numbers to columns and back, for all engines.

use crate::store::error::{Result, StoreError};
use grideye_recording::COUNT_MAX;

/// The wire already enforces this limit; this check covers batches that come another way.
pub(super) fn fitting(field: &'static str, value: u64) -> Result<i64> {
    i64::try_from(value).map_err(|_too_large| StoreError::NumberTooLarge {
        field,
        value,
        max: COUNT_MAX,
    })
}

/// For a column that is never negative.
pub(super) fn unsigned(column: &str, value: i64) -> Result<u64> {
    u64::try_from(value).map_err(|_negative| damaged(&format!("{value} as {column}")))
}

pub(super) fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn damaged(what: &str) -> StoreError {
    StoreError::Failed(format!("the store holds {what}"))
}
