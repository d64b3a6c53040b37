//! The live page: its files and its sign-in.

pub(crate) mod assets;
pub(crate) mod login;
