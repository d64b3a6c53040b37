//! Why a scene could not be calibrated.

use grideye_scene::SceneError;

/// Why a scene could not be calibrated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The scene, or a value between its bounds, is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A bound that the key may not have.
    #[error("the {which} bound {value} of `{key}` is no value that the scene may have: {source}")]
    Bound {
        /// The unknown.
        key: String,
        /// `lower` or `upper`.
        which: &'static str,
        /// The bound.
        value: f64,
        /// What the scene says of it.
        source: Box<SceneError>,
    },
    /// Nothing is marked.
    #[error(
        "{origin} marks no unknown\nhint: add a [[fit]] table, key = \"room.ambient_c\" and bounds = [15, 30] for example; scenes/README.md describes them"
    )]
    NoUnknowns {
        /// The scene's file.
        origin: String,
    },
    /// A sensor that makes no 8 x 8 frames.
    #[error(
        "sensor `{sensor}` has {columns} x {rows} pixels, and recordings have 8 x 8\nhint: choose another sensor of the scene"
    )]
    Resolution {
        /// The sensor.
        sensor: String,
        /// Its pixels in a row.
        columns: usize,
        /// Its pixels in a column.
        rows: usize,
    },
    /// Too little to say anything.
    #[error(
        "{found} frames of the recording lie in the time of the scene, expected at least {needed}\nhint: record longer, or let recording.start_s say when the recording begins"
    )]
    TooFewFrames {
        /// Frames that can be used.
        found: usize,
        /// The fewest, [`FRAMES_MIN`](super::FRAMES_MIN).
        needed: usize,
    },
    /// A clock that went backwards.
    #[error(
        "the clock of the recording runs backwards at frame {seq}\nhint: keep the rows before or after it"
    )]
    TimeRunsBackwards {
        /// The frame's sequence number.
        seq: u64,
    },
    /// More frames asked for than are taken.
    #[error(
        "{found} frames were asked for, expected {least} to {most}\nhint: a few hundred hold all that there is to learn"
    )]
    Frames {
        /// The number asked for.
        found: usize,
        /// [`FRAMES_MIN`](super::FRAMES_MIN).
        least: usize,
        /// [`FRAMES_MAX`](super::FRAMES_MAX).
        most: usize,
    },
}
