//! What a drawing shows at most: each bound has a test that reaches it.

/// Faces of one body; one that has more is drawn as the box around it.
pub const FACES_OF_BODY_MAX: usize = 5_000;
/// Faces of all bodies; those of the file that come after it are drawn as boxes.
pub const FACES_MAX: usize = 30_000;
/// Circles on one agent's way; of a longer one every second, third … is drawn.
pub const CIRCLES_MAX: usize = 400;
/// Names in one view; those for which there is no room are left out as well.
pub const LABELS_MAX: usize = 40;
