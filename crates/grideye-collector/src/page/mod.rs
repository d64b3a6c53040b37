//! The live page: its files, and how one signs in to it.

pub(crate) mod assets;
pub(crate) mod login;
