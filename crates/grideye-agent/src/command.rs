//! One file for each verb of the program, and what they share.

pub(crate) mod check;
mod collector;
mod config;
pub(crate) mod exit;
pub(crate) mod join;
pub(crate) mod run;
