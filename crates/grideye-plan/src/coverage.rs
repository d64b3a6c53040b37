//! Where to put sensors: what each pose sees of the floor and of a person at each place, and which few poses see most.
//!
//! [`Floor`] and [`Figure`] make a [`Survey`], which takes a [`Look`] from a pose; [`search()`] finds the best poses, and
//! [`Map`] combines looks. A cell is seen if nothing hides the center of its ground. It is a place if the
//! person fits there in at least one turn.
//!
//! Contrast is `sqrt(Σ (with - without)²) / sigma` over the pixels, the d' of [`crate::separation`], for the worst turn
//! that fits. It compares noise-free images of
//! [`Simulator::new`](grideye_scene::Simulator::new) with and without the person, at the scene's
//! start and without its agents. `sigma` is the sensor's noise over the root of the averaged frames.
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
mod picture;
mod rays;
mod report;
mod search;
mod survey;
mod wish;

pub use candidates::{Candidate, Mount, Mounts, candidates, preset};
pub use error::CoverageError;
pub use figure::Figure;
pub use floor::{Cell, Floor, Grain, Kind};
pub use map::{Map, Spot, Totals};
pub use report::Report;
pub use search::{Choice, Step, search};
pub use survey::{InSight, Look, Seen, Survey};
pub use wish::{Rule, Wish};
