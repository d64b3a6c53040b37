#![doc = include_str!("../README.md")]
#![no_std]
mod background;
mod counter;
pub mod evaluation;
mod line;
mod network;
mod numbers;
mod places;

pub use background::Room;
pub use counter::{Count, Counter, celsius};
pub use line::{Gate, Line, NoLine};
pub use network::{CLASSES, Network, UNITS_PER_DEGREE, WIDTH_MAX, WeightsError};
pub use places::{PLACES_MAX, Place, Places};
