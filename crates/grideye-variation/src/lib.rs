#![doc = include_str!("../README.md")]

mod acts;
mod asked;
mod bare;
mod chance;
mod error;
mod floor;
mod grammar;
mod recipe;
mod stage;
mod target;
mod varied;
mod way;

pub use error::{Mistake, VariationError};
pub use recipe::{Column, Draw, Recipe, TRIES_MAX, Value};
