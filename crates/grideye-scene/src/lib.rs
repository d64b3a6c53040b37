//! Scene files in, thermal frames out: what a low-resolution infrared sensor sees in a room, at any moment.
//!
//! ```text
//!  scene file (TOML) ──parse──▶ Scene ──Simulator::new(sensor)──▶ image(t)     noise-free degrees
//!  trajectories (CSV) ───┘     room                               noisy(t, seed)  one sensor frame
//!                              objects    sampling grid           truth(t)     share of each pixel on the agent
//!                              agent      nearest surface wins
//!                              sensors    perceived temperature ─▶ resample to the sensor's pixels ─▶ noise
//! ```
//!
//! | module | subject | source |
//! |---|---|---|
//! | [`Scene`], [`Sensor`], [`Pose`] | the file and its geometry | `scenes/README.md` |
//! | [`perceived`] | what a surface looks like from a distance | PeerJ CS 11:e3124, "Perceived temperature calculation" |
//! | [`resample`] | sampling grid to pixels, as MATLAB's `imresize` does | the same, "Interpolation" |
//! | [`physical`] | the other model: radiance averaged over each pixel's response | Planck, Stefan and Boltzmann; the AMG88's specification |
//! | [`fusion`] | several sensors as one of more pixels | the same, "Scenario A" |
//! | [`separation`] | situations told apart above the noise | the same, "Scenario B" |
//! | [`coverage`] | where to put sensors | the paper's title; its tool does not do it |
//! | [`variation`] | the same scene with other values in each frame | `scenes/README.md` |
//! | [`fit`] | numbers of the file that a recording is to tell | `scenes/README.md` |
//! | [`drawing`] | the view of the environment | the same, Figures 3, 11, 12, 14, 24 |
//! | [`Simulator`], [`Image`], [`Mask`] | frames and their truth | the same, "Sensor model implementation" |
//!
//! The library opens no file, reads no clock and owns no randomness: a scene asks for its trajectories through
//! [`Files`], time and seed are arguments.
//!
//! # What is guaranteed to repeat
//! A frame is a pure function of (scene, time, seed): the same bytes on any number of threads and in any order of
//! calls. Only additions, multiplications, divisions and square roots, which IEEE 754 fixes to the last bit, and the
//! portable functions of the `libm` crate touch a temperature, so that the bytes are the same on every machine with
//! IEEE double precision (x86-64 and ARM; not the x87 unit of 32-bit x86). A test pins the bits of one frame.
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

mod angle;
mod area;
mod body;
mod canvas;
mod check;
mod clothes;
mod collision;
mod count;
pub mod coverage;
mod cuboid;
mod document;
pub mod drawing;
mod error;
mod files;
pub mod fit;
pub mod fusion;
pub mod ground;
mod heat;
mod mosaic;
mod motion;
mod noise;
mod obj;
pub mod perceived;
pub mod physical;
mod plan;
mod pose;
pub mod profile;
pub mod resample;
mod residual;
mod room;
mod rule;
mod scene;
pub mod separation;
pub mod simulator;
mod solid;
mod source;
mod specimen;
mod trajectory;
pub mod variation;
mod view;
mod warmth;
mod way;

pub use collision::Contact;
pub use cuboid::Cuboid;
pub use error::{Place, SceneError, Warning};
pub use files::Files;
pub use pose::Pose;
pub use room::Room;
pub use scene::{Agent, Body, Loaded, Model, Scene, Sensor, limits};
pub use simulator::{Image, Mask, Simulator};
pub use solid::{Solid, SolidError};
pub use trajectory::Trajectory;
