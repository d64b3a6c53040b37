//! Recordings beside scenes: what is aligned, which faults are found, and what is said of a long one.

mod alignment;
mod faults;
mod long;
