//! The comparison as a page for people, as a table for a terminal and as JSON for programs. All hold the same figures.

mod alignment;
mod assumptions;
mod characterization;
mod context;
mod criteria;
mod graph;
mod html;
mod image;
mod json;
mod junit;
mod maps;
pub mod paper;
mod ruler;
mod scores;
mod scores_line;
mod table;
mod text;
mod timeline;

pub use context::{Context, Input};
pub use html::html;
pub use json::{json, summary};
pub use junit::junit;
pub use scores_line::scores_line;
pub use table::table;
