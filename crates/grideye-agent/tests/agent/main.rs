//! The agent from its public API: emulated sensors on one side, a small collector that misbehaves on the other.

mod acquisition;
mod check;
mod delivery;
mod faults;
mod files;
mod support;
