//! Faults by script: in time, by frame, by chance, from a file; and what a file can have wrong.

mod file;
mod properties;
mod rules;
mod support;
