#![doc = include_str!("../README.md")]

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
