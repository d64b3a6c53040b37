//! The emulated bus: the cost of a frame, and reads by third-party programs.

mod cost;
mod firmware;
mod foreign_drivers;
mod hardware;
mod i2c_tools;
mod node;
