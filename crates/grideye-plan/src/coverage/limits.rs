//! What a survey may have at most: each bound has a test that reaches it.

/// Cells of the floor, those outside the room included.
pub const CELLS_MAX: usize = 40_000;
/// Poses that are tried.
pub const CANDIDATES_MAX: usize = 20_000;
/// Poses times cells.
pub const PAIRS_MAX: usize = 5_000_000;
/// Turns in which a person is tried at each place.
pub const TURNS_MAX: usize = 36;
/// Poses that are picked.
pub const PICKED_MAX: usize = 100;
/// Threads that look.
pub const THREADS_MAX: usize = 256;
