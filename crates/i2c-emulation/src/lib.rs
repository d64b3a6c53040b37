#![doc = include_str!("../README.md")]

pub mod adapter;
pub mod avr;
pub mod fuse;
mod guests;
pub mod ioctl;
pub mod preload;
pub mod program;
pub mod rack;
mod run;
pub mod socket;
pub mod usbip;
