//! How many pixels the array has.

/// Rows of the array (AMG88 spec §4-5-1).
pub const ROWS: usize = 8;

/// Columns of the array (AMG88 spec §4-5-1).
pub const COLUMNS: usize = 8;

/// Pixels of the array.
pub const PIXELS: usize = ROWS * COLUMNS;
