//! A scene with varying keys, and its draws.

use crate::chance::{NOISE, below, generator, share};
use crate::error::{Mistake, VariationError};
use crate::floor;
use crate::floor::Floor;
use crate::grammar;
use crate::grammar::{Choice, Piece};
use crate::target;
use crate::target::{Edit, Placed, edited};
use glam::DVec3;
use grideye_scene::uncertain::Uncertain;
use grideye_scene::{Files, Loaded, Scene, Sensor, limits};
use rand_chacha::rand_core::Rng as _;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::time::Duration;
use toml::de::DeTable;

/// Limit on placements tried per frame.
pub const TRIES_MAX: usize = 10_000;

/// The key for a frame's time; it is not part of the scene.
const TIME: &str = "time_s";

/// A scene and which of its values vary.
#[derive(Debug, Clone)]
pub struct Recipe {
    text: String,
    origin: String,
    varied: Vec<Varied>,
    placed: Vec<Placed>,
    columns: Vec<Column>,
    agents: Vec<String>,
}

/// A key and its possible values.
#[derive(Debug, Clone)]
struct Varied {
    asked: String,
    key: String,
    choices: Vec<Choice>,
    /// Where it is in the text; `None` for the frame's time.
    edit: Option<Edit>,
}

/// One number or text per draw.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// The requested key, with the index if it is a list: `sensor.ceiling.position_mm[2]`.
    pub name: String,
    /// Whether it is a number; true and false count as 1 and 0.
    pub is_number: bool,
}

/// The value of a [`Column`] in one draw.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// Text, or any other non-number as TOML.
    Text(String),
}

/// The values of one frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Draw {
    /// The scene with the drawn values, but without agents placed on the floor.
    pub text: String,
    /// The drawn values, in the order of [`Recipe::columns`].
    pub values: Vec<Value>,
    /// The seed for [`Simulator::noisy`](grideye_scene::Simulator::noisy), different in each frame.
    pub noise_seed: u64,
    /// The frame's time in seconds, if it varies.
    pub time_s: Option<f64>,
    /// The drawn values as written into the text, in the order of the edits.
    written: Vec<String>,
}

impl Recipe {
    /// Parses what varies: each of `asked` is `KEY=VALUES`, as in `agent.person.temperature_c=26..34`,
    /// `agent.anna.person.height_mm=1700+-100`, `sensor.ceiling.noise_sigma_c=0.1,0.2`, `object.table.present=on,off`, `agent.person.position=floor` or
    /// `time_s=0..12`; or `KEY` alone for a number with an `[[uncertain]]` table. scenes/README.md has the whole grammar.
    ///
    /// # Errors
    /// If something cannot be parsed, or names what the scene lacks; [`Self::check`] checks the values.
    pub fn new(text: &str, origin: &str, asked: &[String]) -> Result<Self, VariationError> {
        let document = Scene::document(text, origin)?;
        let uncertain = Scene::uncertain_in(text, origin)?;
        let mut recipe = Self {
            text: text.to_owned(),
            origin: origin.to_owned(),
            varied: Vec::new(),
            placed: Vec::new(),
            columns: Vec::new(),
            agents: target::agents(&document),
        };
        for asked in asked {
            let mistaken = |mistake| VariationError::Asked {
                asked: asked.clone(),
                mistake,
            };
            let (key, values) = match asked.split_once('=') {
                Some((key, values)) => (key.trim(), Some(values.trim())),
                None => (asked.trim(), None),
            };
            match (key.strip_suffix(".position"), values) {
                (Some(path), Some(values)) => recipe.placed.push(Placed {
                    asked: asked.clone(),
                    agent: on_floor(path, values).map_err(mistaken)?,
                    edits: on_floor(path, values)
                        .and_then(|agent| target::floor(text, &document, &agent))
                        .map_err(mistaken)?,
                }),
                (_, values) => {
                    let edit = (key != TIME)
                        .then(|| target::edit(text, &document, key))
                        .transpose()
                        .map_err(mistaken)?;
                    let choices = match values {
                        Some(values) => grammar::choices(values),
                        None => law(&uncertain, edit.as_ref()),
                    };
                    let choices = choices.map_err(mistaken)?;
                    recipe.columns.extend(columns(key, &choices));
                    recipe.varied.push(Varied {
                        asked: asked.clone(),
                        key: key.to_owned(),
                        choices,
                        edit,
                    });
                }
            }
        }
        recipe.check_overlaps()?;
        recipe.check_additions()?;
        Ok(recipe)
    }

    /// The columns of a draw, in the order requested.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Names of all agents in the file, including absent ones.
    #[must_use]
    pub fn agents(&self) -> &[String] {
        &self.agents
    }

    /// Whether [`Self::scene`] depends on more than the draw's text.
    #[must_use]
    pub fn places_agents(&self) -> bool {
        !self.placed.is_empty()
    }

    /// Tries every choice of every key, each law at its ends, while all other keys keep their values in the file.
    /// This also reads every file that a choice names.
    ///
    /// # Errors
    /// The first value that the scene refuses.
    pub fn check(&self, files: &dyn Files) -> Result<(), VariationError> {
        Scene::parse(&self.text, &self.origin, files)?;
        for varied in &self.varied {
            for choice in &varied.choices {
                for share in [0.0, 1.0] {
                    let (value, numbers) = as_toml(choice, &mut || share);
                    let refused = |source| VariationError::Value {
                        asked: varied.asked.clone(),
                        key: varied.key.clone(),
                        value: value.clone(),
                        source: Box::new(source),
                    };
                    let Some(edit) = &varied.edit else {
                        check_time(&varied.asked, &numbers)?;
                        continue;
                    };
                    let text = edited(&self.text, vec![(edit, value.clone())]);
                    Scene::parse(&text, &self.origin, files).map_err(refused)?;
                }
            }
        }
        Ok(())
    }

    /// Draws the values of frame `index` (from 0) for this seed.
    #[must_use]
    pub fn draw(&self, seed: u64, index: u64) -> Draw {
        let mut values = Vec::with_capacity(self.columns.len());
        let mut written = Vec::with_capacity(self.varied.len());
        let mut time_s = None;
        for varied in &self.varied {
            let mut generator = generator(seed, &varied.key, index);
            let chosen = below(&mut generator, varied.choices.len());
            let choice = &varied.choices[chosen];
            let (text, numbers) = as_toml(choice, &mut || share(&mut generator));
            if are_numbers(&varied.choices) {
                values.extend(numbers.iter().copied().map(Value::Number));
            } else {
                values.push(Value::Text(match choice.0.as_slice() {
                    [Piece::Text(content)] => content.clone(),
                    _ => text.clone(),
                }));
            }
            match &varied.edit {
                Some(_) => written.push(text),
                None => time_s = numbers.first().copied(),
            }
        }
        Draw {
            text: edited(&self.text, self.drawn(&written)),
            values,
            noise_seed: generator(seed, NOISE, index).next_u64(),
            time_s,
            written,
        }
    }

    fn drawn(&self, written: &[String]) -> Vec<(&Edit, String)> {
        let edits = self.varied.iter().filter_map(|varied| varied.edit.as_ref());
        edits.zip(written.iter().cloned()).collect()
    }

    /// The scene of a draw. Agents placed on the floor are inside the room and collide neither with objects nor with
    /// other agents, standing or walking; random places are tried until this holds.
    ///
    /// # Errors
    /// [`VariationError::Frame`] if the values conflict; [`VariationError::NoPlace`].
    pub fn scene(
        &self,
        seed: u64,
        index: u64,
        draw: &Draw,
        files: &dyn Files,
    ) -> Result<Loaded, VariationError> {
        let refused = |source| VariationError::Frame {
            index,
            values: self.told(draw),
            source: Box::new(source),
        };
        if self.placed.is_empty() {
            return Scene::parse(&draw.text, &self.origin, files).map_err(refused);
        }
        let text = |places_m: &mut dyn Iterator<Item = DVec3>| {
            let mut edits = self.drawn(&draw.written);
            edits.extend(floor::edits(&self.placed, places_m));
            edited(&self.text, edits)
        };
        let anywhere = text(&mut std::iter::repeat(DVec3::ZERO));
        let anywhere = Scene::parse_anywhere(&anywhere, &self.origin, files).map_err(refused)?;
        let mut floor = Floor::new(anywhere.scene, &self.placed, (seed, index));
        for _ in 0..TRIES_MAX {
            let Some(misplaced) = floor.misplaced() else {
                let text = text(&mut floor.places_m());
                // Those placed need no second check, only those that walk or stand where the file says.
                let parse = match floor.has_all() {
                    true => Scene::parse_anywhere,
                    false => Scene::parse,
                };
                return parse(&text, &self.origin, files).map_err(refused);
            };
            floor.draw(misplaced);
        }
        Err(VariationError::NoPlace {
            index,
            agent: self.placed[floor.most_tried()].agent.clone(),
            tries: TRIES_MAX,
        })
    }

    /// A frame's time: as drawn, or the sensor's next sampling time, starting over at the scene's end.
    #[must_use]
    pub fn time(&self, index: u64, draw: &Draw, scene: &Scene, sensor: &Sensor) -> Duration {
        if let Some(time_s) = draw.time_s {
            return Duration::try_from_secs_f64(time_s).unwrap_or_default();
        }
        let in_turn = index % scene.frame_count(sensor);
        sensor.frame_time(u32::try_from(in_turn).unwrap_or(u32::MAX))
    }

    fn told(&self, draw: &Draw) -> String {
        let mut told = String::new();
        for (column, value) in self.columns.iter().zip(&draw.values) {
            let comma = if told.is_empty() { "" } else { ", " };
            let value = match value {
                Value::Number(number) => number.to_string(),
                Value::Text(text) => text.clone(),
            };
            // Writing to a string cannot fail.
            let _ = write!(told, "{comma}{} = {value}", column.name);
        }
        if told.is_empty() {
            told.push_str("only places vary");
        }
        told
    }

    fn edits(&self) -> impl Iterator<Item = (&str, &Edit)> {
        let varied = self
            .varied
            .iter()
            .filter_map(|varied| Some((varied.asked.as_str(), varied.edit.as_ref()?)));
        let placed = self.placed.iter().flat_map(|placed| {
            let edits = placed.edits.iter();
            edits.map(|edit| (placed.asked.as_str(), edit))
        });
        varied.chain(placed)
    }

    fn check_overlaps(&self) -> Result<(), VariationError> {
        let twice = |asked: &str, other: &str| VariationError::Asked {
            asked: asked.to_owned(),
            mistake: Mistake::Twice(other.to_owned()),
        };
        let mut keys = HashSet::new();
        for varied in &self.varied {
            if !keys.insert(&varied.key) {
                return Err(twice(&varied.asked, &varied.key));
            }
        }
        let mut edits: Vec<(&str, &Edit)> = self.edits().collect();
        edits.sort_by_key(|(_, edit)| (edit.range.start, edit.range.end));
        for pair in edits.windows(2) {
            let [(first, before), (second, after)] = pair else {
                continue;
            };
            let is_same_place = before == after;
            if before.range.end > after.range.start || is_same_place {
                return Err(twice(second, first));
            }
        }
        Ok(())
    }

    /// An added key must end up in its table, however that table is written.
    fn check_additions(&self) -> Result<(), VariationError> {
        for varied in &self.varied {
            let Some(edit) = varied.edit.as_ref().filter(|edit| !edit.before.is_empty()) else {
                continue;
            };
            let text = edited(&self.text, vec![(edit, "0".to_owned())]);
            let arrived = DeTable::parse(&text)
                .is_ok_and(|document| target::has(&document, &text, &varied.key));
            if !arrived {
                return Err(VariationError::Asked {
                    asked: varied.asked.clone(),
                    mistake: Mistake::NotAddable(varied.key.clone()),
                });
            }
        }
        Ok(())
    }
}

/// The law that the scene has for the number at this place.
fn law(uncertain: &[Uncertain], edit: Option<&Edit>) -> Result<Vec<Choice>, Mistake> {
    let place = edit.map(|edit| &edit.range);
    let mut uncertain = uncertain.iter();
    let found = uncertain.find(|one| place.is_some() && one.value_span.as_ref() == place);
    let found = found.ok_or(Mistake::NoEquals)?;
    Ok(vec![Choice::of_law(found)])
}

fn on_floor(path: &str, values: &str) -> Result<String, Mistake> {
    if values != "floor" {
        return Err(Mistake::OnlyFloor);
    }
    path.strip_prefix("agent.")
        .map(str::to_owned)
        .ok_or(Mistake::FloorForAgents)
}

fn check_time(asked: &str, numbers: &[f64]) -> Result<(), VariationError> {
    match numbers {
        [time_s] if (0.0..=limits::TIME_MAX_S).contains(time_s) => Ok(()),
        _ => Err(VariationError::Asked {
            asked: asked.to_owned(),
            mistake: Mistake::NoTime,
        }),
    }
}

fn are_numbers(choices: &[Choice]) -> bool {
    let first = choices.first().and_then(Choice::numbers);
    first.is_some() && choices.iter().all(|choice| choice.numbers() == first)
}

fn columns(key: &str, choices: &[Choice]) -> Vec<Column> {
    let is_number = are_numbers(choices);
    let column = |name| Column { name, is_number };
    match choices.first().and_then(Choice::numbers) {
        Some(Some(length)) if is_number => {
            let names = (0..length).map(|index| format!("{key}[{index}]"));
            names.map(column).collect()
        }
        _ => vec![column(key.to_owned())],
    }
}

/// A choice as TOML, with a number drawn from each law, and its numbers.
fn as_toml(choice: &Choice, share: &mut dyn FnMut() -> f64) -> (String, Vec<f64>) {
    let (mut text, mut numbers) = (String::new(), Vec::new());
    for piece in &choice.0 {
        let mut drawn = None;
        match piece {
            Piece::Mark(mark) if mark == "," => text.push_str(", "),
            Piece::Mark(mark) => text.push_str(mark),
            Piece::Text(content) => text.push_str(&toml::Value::from(content.as_str()).to_string()),
            Piece::Flag(flag) => {
                text.push_str(if *flag { "true" } else { "false" });
                numbers.push(f64::from(u8::from(*flag)));
            }
            Piece::Number(written, number) => {
                text.push_str(written);
                numbers.push(*number);
            }
            Piece::Range(low, high) => {
                drawn = Some((low + (high - low) * share()).clamp(*low, *high));
            }
            Piece::Normal(law, bounds) => drawn = Some(law.quantile(*bounds, share())),
        }
        if let Some(number) = drawn {
            text.push_str(&format!("{number:?}"));
            numbers.push(number);
        }
    }
    (text, numbers)
}
