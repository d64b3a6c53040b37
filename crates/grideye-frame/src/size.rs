//! How many pixels the array has, and how often it measures them.

use core::time::Duration;

/// Rows of the array (AMG88 spec §4-5-1).
pub const ROWS: usize = 8;

/// Columns of the array (AMG88 spec §4-5-1).
pub const COLUMNS: usize = 8;

/// Pixels of the array.
pub const PIXELS: usize = ROWS * COLUMNS;

/// From one measurement of the array to the next, nominal: ten a second at either frame rate, of which the slow one is
/// the mean (AMG88 spec §4-11-3).
pub const TICK: Duration = Duration::from_millis(100);
