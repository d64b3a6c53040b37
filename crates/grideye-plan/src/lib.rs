//! Answers questions about scenes as text, JSON, CSV or SVG: where to put sensors, what several see together or tell apart,
//! and how a room looks.
//!
//! ```text
//!           scene ──┬─ ground ── what a sensor has in view of the room
//!                   │    │
//!                   ├─ drawing ─ bodies as faces and ellipsoids, ordered for any eye ─┬─ SVG: simulate --view
//!                   │    │                                                            └─ JSON: the pages' 3-D view
//!                   ├─ coverage ─ floor and person ─ survey (looks) ─ search ─ report: text, JSON, CSV, SVG
//!                   ├─ fusion ── several sensors as one with more pixels
//!                   └─ separation ─ how different two situations look
//! ```
//!
//! | module | answers |
//! |---|---|
//! | [`coverage`] | where sensors detect a person, and which poses detect one at most places |
//! | [`drawing`] | how a room looks: one set of polygons, sorted by depth, for paper and page |
//! | [`fusion`] | what several adjacent sensors see as one (PeerJ CS 11:e3124, "Scenario A") |
//! | [`ground`] | outlines from above, and what a sensor has in view of floor and walls |
//! | [`separation`] | whether sensors tell situations apart (the same paper, "Scenario B") |
//!
//! ```
//! use grideye_plan::drawing::{Drawing, json, svg};
//! use grideye_scene::Scene;
//! use std::time::Duration;
//!
//! let text = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n\
//!     [[object]]\nname = \"box\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [500, 500, 500]\ntemperature_c = 30\n";
//! let nothing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
//! let scene = Scene::parse(text, "room.toml", &nothing)?.scene;
//! assert!(svg(&scene, &Drawing::new("a box")).contains("box, 30 °C"));
//! let json = json(&scene, Duration::ZERO, 1000);
//! assert_eq!(json["shapes"][1]["name"], "box");
//! # Ok::<(), grideye_scene::SceneError>(())
//! ```
//!
//! The crate must not know files, clocks, registers or HTTP, and has no randomness of its own.

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
mod plane;
pub mod separation;
