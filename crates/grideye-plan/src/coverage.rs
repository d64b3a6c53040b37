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
//! `with` and `without` are noise-free pictures of [`Simulator::without_grid`](grideye_scene::Simulator::without_grid) with the
//! person there and with nobody; `sigma` is the sensor's noise, divided by the root of the frames that are averaged. A
//! matched filter knows what it looks for: whoever does not, does worse, and the peak says how much at most.
//! The scene's own agents are taken out, and objects are as they are at its start.
//!
//! ```
//! use grideye_plan::coverage::{Figure, Grain, Map, Survey, Wish};
//! use grideye_scene::Scene;
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
mod error;
mod figure;
mod floor;
pub mod limits;
mod map;
mod pick;
mod picture;
mod rays;
mod report;
mod survey;

pub use candidates::{Candidate, Mount, Mounts, candidates, preset};
pub use error::CoverageError;
pub use figure::{Figure, Posture};
pub use floor::{Cell, Floor, Grain, Kind};
pub use map::{Blind, Map, Spot, Totals};
pub use pick::{Pick, Rule, Step, Wish, pick};
pub use picture::MapDrawing;
pub use report::Report;
pub use survey::{InSight, Look, Seen, Survey};
