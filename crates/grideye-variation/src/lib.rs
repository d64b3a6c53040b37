//! Which values of a scene vary, and what they are in one draw.
//!
//! The laws of `[[uncertain]]` tables, and the places of their numbers, are those of `grideye-scene`; a calibration and
//! the verdict use the same.
//!
//! ```text
//!  scene file ──┐
//!  what varies ─┴─▶ Recipe ──(seed, index)──▶ Draw: the scene's text with other values, noise seed, time
//!                                              │
//!                                              └──▶ Scene, with agents placed on the free floor
//! ```
//!
//! A draw is a function of the recipe, the seed and the frame's number, and every key has its own random numbers: a
//! frame depends neither on other frames nor on other keys that vary.
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
//! assert_ne!(loaded.scene.agents()[0].start_m, recipe.scene(1, 18, &recipe.draw(1, 18), &no_files)?.scene.agents()[0].start_m);
//! # Ok::<(), grideye_variation::VariationError>(())
//! ```

mod acts;
mod asked;
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
