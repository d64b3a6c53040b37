//! The comparison as a page, a table for a terminal, JSON and JUnit, all with the same figures.

mod assumptions;
mod characterization;
mod criteria;
mod html;
mod image;
mod json;
mod junit;
pub mod paper;
pub(crate) mod plots;
mod scores;
pub(crate) mod text;

pub use html::{html, key_colors};
pub use json::{json, summary};
pub use junit::junit;
pub use scores::{scores_line, table};
pub use text::{Context, Input};
