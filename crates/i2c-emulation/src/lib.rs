#![doc = include_str!("../README.md")]

pub mod adapter;
pub mod avr;
mod guests;
pub mod ioctl;
pub mod program;
pub mod rack;
mod run;
pub mod socket;
pub mod syscalls;
pub mod usbip;
