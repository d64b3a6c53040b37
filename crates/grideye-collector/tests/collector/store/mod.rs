//! What every store must do.

mod books;
mod conformance;
mod file;
mod frames;
mod helpers;
mod location;
mod recordings;
mod segment;
