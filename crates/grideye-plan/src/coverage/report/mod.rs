//! Writes a survey's results: as text, JSON, CSV, tables of a scene file, and as a drawing.

mod found;
mod table;
mod written;

pub use found::Report;
