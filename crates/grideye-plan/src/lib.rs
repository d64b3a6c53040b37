#![doc = include_str!("../README.md")]

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
pub mod separation;
