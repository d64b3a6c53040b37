//! Counts people in the frames of an AMG8833: how many, where, and who goes over a line.
//!
//! ```
//! use grideye_count::{Counter, Network};
//!
//! let (network, mut counter) = (Network::default(), Counter::with_background([22.0; 64]));
//! let mut frame = [22.0; 64];
//! assert_eq!(counter.see(&network, 0.0, &frame).unwrap().people, 0);
//! for pixel in [27, 28, 35, 36] {
//!     frame[pixel] = 25.0;
//! }
//! let counts = (1..20).map(|tenth| counter.see(&network, f64::from(tenth) / 10.0, &frame).unwrap());
//! let last = counts.last().unwrap();
//! assert_eq!((last.people, last.pixels >> 27 & 1), (1, 1));
//! ```
//!
//! A frame goes through the empty room ([`Counter`] learns it), a network of integers trained on simulated frames
//! alone ([`Network`]), and a filter over time. Without `std` and without allocation.

#![no_std]
mod background;
mod counter;
pub mod judge;
mod line;
mod network;
mod numbers;
mod places;

pub use background::Room;
pub use counter::{Count, Counter, celsius};
pub use line::{Gate, Line, NoLine};
pub use network::{CLASSES, Network, UNITS_PER_DEGREE, WIDTH_MAX, WeightsError};
pub use places::{PLACES_MAX, Place, Places};
