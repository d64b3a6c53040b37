#![doc = include_str!("../README.md")]

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
mod plane;
pub mod separation;
