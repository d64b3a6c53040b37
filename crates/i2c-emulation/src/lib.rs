#![doc = include_str!("../README.md")]

pub mod adapter;
mod ended;
pub mod fuse;
pub mod ioctl;
pub mod preload;
pub mod program;
pub mod rack;
pub mod socket;
mod sys;
pub mod usbip;
