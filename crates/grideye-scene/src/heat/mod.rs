//! How warm a body is: over its faces, and in time.

pub(crate) mod cooling;
pub(crate) mod warmth;
