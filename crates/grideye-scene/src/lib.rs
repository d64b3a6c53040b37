//! Turns scene files into thermal frames: what a low-resolution infrared sensor sees in a room at any time.
//!
//! [`Scene::parse`] reads a scene (`scenes/README.md`). A [`Simulator`] makes noise-free images, noisy frames and
//! ground truth for one sensor: by the paper's [`perceived`] temperature or by [`physical`] radiance. The library opens
//! no file, reads no clock and has no randomness of its own: trajectories come from [`Files`], time and seed are
//! arguments.
//!
//! A frame is a pure function of (scene, time, seed). Temperatures depend only on additions, multiplications,
//! divisions, square roots and the portable functions of `libm`, so bytes are the same on every machine with IEEE
//! double precision (x86-64 and ARM; not the x87 unit of 32-bit x86). A test pins the bits of one frame.
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
