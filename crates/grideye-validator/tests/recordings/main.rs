//! Tests of recordings compared with scenes: alignment, faults, and long recordings.

mod alignment;
mod faults;
mod long;
