#![doc = include_str!("../README.md")]

mod error;
mod exports;
mod fault;
mod memory;
mod scene;
mod source;

pub use error::Error;
pub use exports::*;
pub use fault::Fault;
pub use memory::{BUS_WORDS, Memory};
pub use scene::{File, Scene};
pub use source::{Callback, FrameC};
