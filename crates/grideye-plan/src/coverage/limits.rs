//! Limits of a survey; each has a test that reaches it.

/// Cells of the floor, including those outside the room.
pub const CELLS_MAX: usize = 40_000;
/// Candidate poses.
pub const CANDIDATES_MAX: usize = 20_000;
/// Poses times cells; about a minute of one processor.
pub const PAIRS_MAX: usize = 20_000_000;
/// Turns of a person at each place.
pub const TURNS_MAX: usize = 36;
/// Picked poses.
pub const PICKED_MAX: usize = 100;
/// Threads.
pub const THREADS_MAX: usize = 256;
