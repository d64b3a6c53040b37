//! Says which values of a scene vary, and what they are in one draw.
//!
//! ```text
//!  scene file ──┐
//!  what varies ─┴─▶ Recipe ──(seed, index)──▶ Draw: the scene's text with other values, noise seed, time
//!                                              │
//!                                              └──▶ Scene, with agents placed on the free floor
//! ```
//!
//! A draw is a function of the recipe, the seed and the frame's number, and every key has its own random numbers: a frame
//! depends neither on other frames nor on other keys that vary. The laws of `[[uncertain]]` tables are those of
//! `grideye-scene`; calibration and verdict use the same.
//!
//! ```
//! use grideye_variation::Recipe;
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
//!     position_mm = [2000, 3000, 0]
//! "#;
//! let no_files = std::collections::HashMap::<String, String>::new();
//! let asked = ["room.ambient_c=18..26", "agent.person.position=floor"].map(String::from);
//! let recipe = Recipe::new(text, "room.toml", &asked)?;
//! recipe.check(&no_files)?;
//!
//! let draw = recipe.draw(1, 17);
//! assert_eq!(draw, recipe.draw(1, 17));
//! let loaded = recipe.scene(1, 17, &draw, &no_files)?;
//! assert!((18.0..26.0).contains(&loaded.scene.room().ambient_c));
//! let next = recipe.scene(1, 18, &recipe.draw(1, 18), &no_files)?;
//! assert_ne!(loaded.scene.agents()[0].start_m, next.scene.agents()[0].start_m);
//! # Ok::<(), grideye_variation::VariationError>(())
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `grammar`, `asked`, `chance` | what `--vary KEY=…` and `[[vary]]` say (`scenes/VARIES.md`), and the laws that values are drawn from |
//! | `target`, `varied`, `floor`, `way`, `acts` | what a key means in a scene: a number, a place on the free floor, a way, what somebody does |
//! | `stage`, `recipe` | the scene's text with other values; a draw |
//!
//! The crate must not know frames, datasets, registers, clocks, files or HTTP: the caller hands in what the scene names.

mod acts;
mod asked;
mod bare;
mod chance;
mod error;
mod floor;
mod grammar;
mod recipe;
mod stage;
mod target;
mod varied;
mod way;

pub use error::{Mistake, VariationError};
pub use recipe::{Column, Draw, Recipe, TRIES_MAX, Value};
