//! How warm a body is: over its faces, and in time.

pub(crate) mod thermal;
pub(crate) mod transient;
