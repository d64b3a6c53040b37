//! What a survey found, written down: as text, JSON, CSV, tables of a scene file, and as a drawing.

mod csv;
mod found;
mod json;
mod sketch;
mod table;

pub use found::Report;
