//! The emulated bus: what a frame costs on it, and what programs of other authors read from it.

mod cost;
mod foreign_drivers;
mod hardware;
mod i2c_tools;
mod node;
