//! Turns scene files into thermal frames: what a low-resolution infrared sensor sees in a room at any time.
//!
//! ```text
//!  scene file (TOML) ──parse──▶ Scene ──Simulator::new(sensor)──▶ image(t)        noise-free degrees
//!  trajectories (CSV) ───┘     room                               noisy(t, seed)  one sensor frame
//!                              objects    nearest surface wins    truth(t)        share of each pixel on the agent
//!                              agents     perceived temperature, or radiance
//!                              sensors    each pixel's mean over its response ─▶ noise
//! ```
//!
//! `scenes/README.md` describes the scene format, the conventions for poses and images, and the formulas: the paper's
//! [`perceived`] temperature, or [`physical`] radiance. `crates/README.md` names the folders of this crate.
//!
//! A frame is a pure function of (scene, time, seed): the same bytes on any number of threads, in any order of calls, and
//! on every machine with IEEE double precision (x86-64 and ARM; not the x87 unit of 32-bit x86). Temperatures depend only
//! on additions, multiplications, divisions, square roots and the portable functions of `libm`; a test pins the bits of
//! one frame.
//!
//! | word | meaning |
//! |---|---|
//! | body, mesh, cuboid | something with a place and a temperature; its surface; the box most surfaces start from |
//! | room, floor plan | what is simulated; one way to write it down |
//! | trajectory, motion, waypoint | where someone is at each time; how speed is spread over it; a point in the file |
//! | thermal, transient, print | properties beyond one temperature; warming or cooling; warmth left on other bodies |
//! | profile, unit | the file that describes a sensor; the sensor |
//!
//! The crate must not know files, clocks, registers or HTTP, and has no randomness of its own: trajectories come through
//! [`Files`], time and seed are arguments.
//!
//! ```
//! use grideye_scene::{Scene, Simulator};
//! use std::time::Duration;
//!
//! let text = r#"
//!     [room]
//!     size_mm = [4000, 6000, 2700]
//!     ambient_c = 20
//!
//!     [[agent]]
//!     name = "person"
//!     size_mm = [200, 500, 1750]
//!     temperature_c = 31
//!     trajectory = "walk.csv"
//!     speed_mm_per_s = 800
//!
//!     [[sensor]]
//!     name = "ceiling"
//!     preset = "grid-eye"
//!     position_mm = [2000, 3000, 2700]
//!     elevation_deg = 90
//!     azimuth_deg = -90
//! "#;
//! let files = |_: &str| Ok("x_mm,y_mm,z_mm\n1000,3000,0\n3000,3000,0\n".to_owned());
//! let loaded = Scene::parse(text, "room.toml", &files)?;
//! assert!(loaded.warnings.is_empty());
//!
//! let simulator = Simulator::new(&loaded.scene, "ceiling")?;
//! let image = simulator.image(Duration::from_millis(1250));
//! assert_eq!((image.columns, image.rows), (8, 8));
//! assert!(image.at(3, 3) > 22.0, "the person stands below the sensor");
//! assert_eq!(image.at(0, 0), 20.0, "nothing but the room in the corner");
//! # Ok::<(), grideye_scene::SceneError>(())
//! ```
//!
//! `cargo bench -p grideye-scene` prints the cost of a frame.

mod file;
mod film;
mod geometry;
mod heat;
mod model;
mod motion;
mod picture;
pub mod profile;
mod radiometry;
mod sensor;
mod simulator;
mod text;
mod unseen;

pub use file::{Files, key, keys};
pub use film::Film;
pub use geometry::{Cuboid, Mesh, Pose, count, polygon};
pub use grideye_text::{Place, Refusal};
pub use model::{
    Agent, AgentLaws, Body, Calibrated, Clothing, Contact, Doing, FreeSpace, Laws, Loaded, Model,
    Person, Posture, Room, Scene, SceneError, Sensor, Stop, Variant, Vary, Warning, limits,
    uncertain,
};
pub use motion::Trajectory;
pub use picture::{Filled, Image, Mask, physical};
pub use radiometry::perceived;
pub use sensor::fnv1a;
pub use simulator::Simulator;
pub use text::Utc;
pub use unseen::{Unseen, Why};
