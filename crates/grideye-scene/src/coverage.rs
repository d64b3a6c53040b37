//! Where to put sensors: what each of many poses sees of the floor, how well it sees a person at every place, and which
//! few of them see the most together. The title of PeerJ CS 11:e3124 promises placement, its tool leaves it to the eye.
//!
//! ```text
//!  scene ──▶ Floor: cells, furniture, places where a person fits ─┐
//!  person ──▶ Figure: standing, sitting or lying ─────────────────┼─▶ Survey ──look──▶ Look: each cell of one pose
//!  candidates: ceiling, walls, corners, or the scene's sensors ───┘                        │
//!                                                                    pick ◀────────────────┤ best few, greedily
//!                                                                    Map  ◀────────────────┘ all cells of some poses
//! ```
//!
//! | word | means |
//! |---|---|
//! | ground | the floor of a cell, or for those who sit or lie the top of a low thing on it |
//! | seen | the middle of the cell's ground is in the field of view, and nothing stands between it and the sensor |
//! | hidden, out of view | a blind spot behind furniture or a wall; one beside the field of view |
//! | place | a cell with room for the person, in at least one of the turns that are tried |
//! | contrast | `sqrt(Σ (with - without)²) / sigma` over the pixels: the signal-to-noise ratio of a matched filter, which is d' of [`crate::separation`]. Of the turns that fit the worst counts |
//! | peak | `max abs(with - without) / sigma`: what a threshold on single pixels has |
//!
//! `with` and `without` are noise-free pictures of [`Simulator::without_grid`](crate::Simulator::without_grid) with the
//! person there and with nobody; `sigma` is the sensor's noise, divided by the root of the frames that are averaged. A
//! matched filter knows what it looks for: whoever does not, does worse, and the peak says how much at most.
//! The scene's own agents are taken out, and objects are as they are at its start.
//!
//! ```
//! use grideye_scene::{Scene, coverage::{Figure, Grain, Map, Survey, Wish}};
//! let text = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n\
//!     [[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\n\
//!     elevation_deg = 90\nazimuth_deg = -90\n";
//! let nothing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
//! let scene = Scene::parse(text, "room.toml", &nothing)?.scene;
//! let survey = Survey::new(&scene, &Figure::standing(), &Grain::default())?;
//! let looks = survey.look_all(scene.sensors(), 1, &|| ())?;
//! let map = Map::new(survey.floor(), &[&looks[0]], &Wish::default());
//! // 2 · 2.7 m · tan 30° = 3.118 m of 4 m on either axis: 16 of 20 cells of 0.2 m.
//! assert_eq!(map.totals.seen, 16 * 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod candidates;
mod figure;
mod floor;
mod map;
mod pick;
mod picture;
mod rays;
mod sketch;
mod survey;

pub use candidates::{Candidate, Mount, Mounts, candidates, preset};
pub use figure::{Figure, Posture};
pub use floor::{Cell, Floor, Grain, Kind};
pub use map::{Blind, Map, Spot, Totals};
pub use pick::{Pick, Rule, Step, Wish, pick};
pub use picture::Picture;
pub use sketch::{Anchor, Shape, Sketch};
pub use survey::{InSight, Look, Seen, Survey};

use crate::error::SceneError;

/// What a survey may have at most: each bound has a test that reaches it.
pub mod limits {
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
}

/// Why there is no survey.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// Cells too fine for the room.
    #[error(
        "{found} cells of the floor, expected at most {}\nhint: choose larger cells",
        limits::CELLS_MAX
    )]
    TooManyCells {
        /// How many there would be.
        found: usize,
    },
    /// Too many poses.
    #[error(
        "{found} candidate poses, expected at most {}\nhint: choose a wider spacing, or fewer tilts, headings and heights",
        limits::CANDIDATES_MAX
    )]
    TooManyCandidates {
        /// How many there would be.
        found: usize,
    },
    /// Too many pairs of a pose and a cell.
    #[error(
        "{poses} poses times {cells} cells are {} pairs, expected at most {}\nhint: choose a wider spacing of the poses, or larger cells",
        poses.saturating_mul(*cells),
        limits::PAIRS_MAX
    )]
    TooManyPairs {
        /// Poses.
        poses: usize,
        /// Cells of the floor in the room.
        cells: usize,
    },
    /// No pose at all.
    #[error(
        "no candidate pose is in the room\nhint: choose a narrower spacing, or heights below the ceiling"
    )]
    NoCandidates,
    /// Nothing to look at: furniture everywhere.
    #[error(
        "there is no place for {figure}: furniture or walls are everywhere\nhint: choose smaller cells or a smaller person"
    )]
    NoPlace {
        /// Who has no place.
        figure: String,
    },
    /// A length, an angle or a count that makes no sense.
    #[error("{what} is {found}, expected {expected}\nhint: {hint}")]
    Value {
        /// What.
        what: &'static str,
        /// Its value.
        found: String,
        /// The values there may be.
        expected: String,
        /// What to do.
        hint: &'static str,
    },
    /// A sensor without noise sees everything.
    #[error(
        "sensor `{sensor}` has no noise to compare with\nhint: give it a noise_sigma_c above 0"
    )]
    NoNoise {
        /// The sensor.
        sensor: String,
    },
    /// A scene, a preset or a sensor that cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
