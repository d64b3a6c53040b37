//! TOML files by rows of keys: a row says what a key is, and everything else follows from the rows.
//!
//! ```text
//!  rows ──┬─▶ check: spelling, types, ranges, what belongs together ──▶ refusal: place, what was found, hint
//!         ├─▶ table: the values of a checked text, by key
//!         └─▶ the table of keys for a document
//! ```
//!
//! ```
//! use grideye_text::{Kind, Number, Rows, Source, Style, rows};
//!
//! static ROOM: Rows = Rows {
//!     rows: &[rows! {
//!         "ambient_c" Kind::Number(Number::Within(-20.0, 50.0)), "°C", "", "the temperature of the walls";
//!     }],
//!     required: &["ambient_c"],
//!     ..Rows::EMPTY
//! };
//!
//! let source = Source { origin: "room.toml", text: "ambient_c = 21\n", style: &Style::EMPTY };
//! let document = source.document()?;
//! assert_eq!(source.table(&ROOM, &document)?.number("ambient_c"), Some(21.0));
//!
//! let source = Source { text: "ambient_c = 300\n", ..source };
//! let document = source.document()?;
//! let refusal = source.table(&ROOM, &document).unwrap_err();
//! assert_eq!(
//!     refusal.to_string(),
//!     "room.toml:1:13: `ambient_c` is 300, expected -20 to 50 °C\nhint: the temperature of the walls"
//! );
//! # Ok::<(), grideye_text::Refusal>(())
//! ```
//!
//! The crate must not know files, scenes, sensors or recordings: whoever has a text hands it in with its name.

mod check;
mod place;
mod row;
mod source;
mod table;

pub use check::read;
pub use place::{Place, Refusal, excerpt};
pub use row::{Kind, Number, Row, Rows, Rule};
pub use source::{Source, Style};
pub use table::{Table, Value};

/// Rows, each `"key" kind, "unit", "expected", "doc";`.
#[macro_export]
macro_rules! rows {
    ($($key:literal $kind:expr, $unit:literal, $told:expr, $doc:expr;)*) => {
        &[$($crate::Row {
            key: $key,
            name_at: const { $crate::Row::name_at($key) },
            kind: $kind,
            unit: $unit,
            told: $told,
            doc: $doc,
        }),*]
    };
}
