//! Driver of the Panasonic Grid-EYE AMG8833, an array of 8 x 8 thermopiles on I2C.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod word;
