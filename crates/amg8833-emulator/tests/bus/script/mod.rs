//! Fault scripts: by time, by frame, by chance, from a file, and errors in files.

mod file;
mod properties;
mod rules;
mod support;
