//! What a person can do about a failure: the hint behind its message.

pub mod network;
pub mod sensor;
