//! `grideye compare`: what it prints and writes, what it refuses, and how much memory a long recording takes.

mod bad_input;
mod long;
mod outputs;
