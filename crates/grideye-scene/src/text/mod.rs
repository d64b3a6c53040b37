//! What every reader of a file needs to answer its author: places, rules and excerpts, lengths.

pub(crate) mod lengths;
pub(crate) mod place;
pub(crate) mod refusal;
