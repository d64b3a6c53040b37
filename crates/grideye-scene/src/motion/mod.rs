//! Where a walker is at any time.

pub(crate) mod schedule;
pub(crate) mod trajectory;
