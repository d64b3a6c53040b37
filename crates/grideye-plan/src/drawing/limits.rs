//! Limits of a drawing; each has a test that reaches it.

/// Faces of all bodies; bodies beyond this, in file order, are drawn as boxes.
pub const FACES_MAX: usize = 10_000;
/// Circles on one agent's path; on a longer path only every second, third … is drawn.
pub const CIRCLES_MAX: usize = 400;
/// Names in one view; names without room are omitted, too.
pub const LABELS_MAX: usize = 40;
/// Pixels of a sensor whose footprints are drawn.
pub const FOOTPRINT_PIXELS_MAX: usize = 1_024;
