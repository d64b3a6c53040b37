#![doc = include_str!("../README.md")]

pub mod adapter;
pub mod fuse;
pub mod ioctl;
pub mod rack;
