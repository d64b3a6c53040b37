//! What varies from frame to frame of a dataset.

use grideye_text::Place;

/// One `[[vary]]` table: a key and its values, in the grammar of `grideye-variation`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Vary {
    /// The key; `*` in place of a name stands for all of them.
    pub key: String,
    /// `None` draws by the key's `[[uncertain]]` table.
    pub values: Option<String>,
    /// How often each choice is taken, in proportion; empty: all equally.
    pub weights: Vec<f64>,
    /// Another key, and what is added for each unit that it is off the middle of its law.
    pub with: Option<(String, f64)>,
    /// Where the table's key stands.
    pub place: Place,
}
