//! A scene with varying keys, and its draws.

use crate::acts;
use crate::asked::{self, Asked};
use crate::bare::bare;
use crate::chance::{NOISE, START, below, chosen, generator, share};
use crate::error::{Mistake, VariationError};
use crate::floor;
use crate::floor::Floor;
use crate::grammar;
use crate::grammar::{Choice, Piece};
use crate::stage;
use crate::stage::Actor;
use crate::target;
use crate::target::{Edit, Placed, edited};
use crate::varied::{Place, Varied, are_numbers, as_toml, check_time, people};
use crate::way::Way;
use glam::DVec3;
use grideye_scene::uncertain::Uncertain;
use grideye_scene::{Files, Loaded, Scene, Sensor};
use rand_chacha::rand_core::Rng as _;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::time::Duration;
use toml::Spanned;
use toml::de::DeTable;

/// Limit on placements tried per frame.
pub const TRIES_MAX: usize = 10_000;
/// Values of a frame that an error lists.
const TOLD_MAX: usize = 8;

/// The key for a frame's time; it is not part of the scene.
const TIME: &str = "time_s";
/// The key for how many of the agents are there.
const PEOPLE: &str = "people";

/// A scene and which of its values vary.
#[derive(Debug, Clone, Default)]
pub struct Recipe {
    text: String,
    origin: String,
    varied: Vec<Varied>,
    placed: Vec<Placed>,
    actors: Vec<Actor>,
    columns: Vec<Column>,
    agents: Vec<String>,
    asked: Vec<String>,
}

/// What a key writes: one that writes more comes later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Writes {
    Value,
    Place,
    Way,
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
    /// Which choice each person does.
    acts: Vec<usize>,
}

impl Recipe {
    /// Parses what varies: each of `asked` is `KEY=VALUES`, as in `agent.person.temperature_c=26..34`,
    /// `agent.anna.person.height_mm=1700+-100`, `sensor.ceiling.noise_sigma_c=0.1,0.2`, `object.table.present=on,off`,
    /// `agent.person.position=floor`, `agent.person.acts=enter sit leave` or `time_s=0..12`; or `KEY` alone for a number
    /// with an `[[uncertain]]` table. They add to the scene's `[[vary]]` tables, and replace those of the same key.
    /// scenes/VARIES.md has the whole grammar.
    ///
    /// # Errors
    /// If something cannot be parsed, or names what the scene lacks; [`Self::check`] checks the values.
    pub fn new(text: &str, origin: &str, asked: &[String]) -> Result<Self, VariationError> {
        let document = Scene::document(text, origin)?;
        let uncertain = Scene::uncertain_in(text, origin)?;
        let mut recipe = Self {
            text: bare(text),
            origin: origin.to_owned(),
            agents: target::agents(&document),
            ..Self::default()
        };
        for asked in asked::all((text, origin), &document, asked)? {
            if recipe.asked.last() != Some(&asked.said) {
                recipe.asked.push(asked.said.clone());
            }
            let added = recipe.add(&asked, (text, &document), &uncertain);
            added.map_err(|mistake| asked.mistaken(mistake))?;
        }
        recipe.check_pairs()?;
        let acts = recipe.actors.iter().map(|actor| Column {
            name: actor.asked.key.clone(),
            is_number: false,
        });
        recipe.columns.extend(acts);
        recipe.check_overlaps()?;
        recipe.check_additions()?;
        Ok(recipe)
    }

    fn add(
        &mut self,
        asked: &Asked,
        (text, document): (&str, &Spanned<DeTable<'_>>),
        uncertain: &[Uncertain],
    ) -> Result<(), Mistake> {
        let key = asked.key.as_str();
        if let (Some(agent), Some(values)) = (acting(key), &asked.values) {
            let choices = acts::choices(values)?;
            asked.check_weights(choices.len())?;
            let actor = Actor::new((text, document), (asked, agent), choices)?;
            self.actors.push(actor);
            return Ok(());
        }
        if let (Some(path), Some(values)) = (key.strip_suffix(".position"), &asked.values) {
            let agent = on_floor(path, values)?;
            self.placed.push(Placed {
                asked: asked.shown.clone(),
                edits: target::floor(text, document, &agent)?,
                agent,
            });
            return Ok(());
        }
        let place = match key {
            TIME => Place::Time,
            PEOPLE => {
                let agents = self.agents.iter();
                let edits = agents
                    .map(|agent| target::edit(text, document, &format!("agent.{agent}.present")));
                Place::People(edits.collect::<Result<_, _>>()?)
            }
            _ => Place::Key(target::edit(text, document, key)?),
        };
        let choices = match &asked.values {
            Some(values) => grammar::choices(values)?,
            None => law(uncertain, place.edits().first())?,
        };
        let choices = match place {
            Place::People(_) => people(choices, self.agents.len())?,
            _ => choices,
        };
        asked.check_weights(choices.len())?;
        self.columns.extend(columns(key, &choices));
        self.varied.push(Varied {
            asked: asked.clone(),
            choices,
            place,
            with: None,
        });
        Ok(())
    }

    /// Finds the keys that others go with.
    fn check_pairs(&mut self) -> Result<(), VariationError> {
        let middles: Vec<(String, Option<f64>)> = self
            .varied
            .iter()
            .map(|varied| (varied.asked.key.clone(), varied.middle()))
            .collect();
        for (place, varied) in self.varied.iter_mut().enumerate() {
            let Some((key, _)) = &varied.asked.with else {
                continue;
            };
            let refused = |key: &str| {
                varied.asked.mistaken(Mistake(format!(
                    "only numbers that vary by one range or normal law each can go together, and `{key}` does not\nhint: write values = \"18..26\" or \"22+-2\" for both, and list the key that `with` names before this one"
                )))
            };
            if middles[place].1.is_none() {
                return Err(refused(&varied.asked.key));
            }
            let other = middles[..place].iter().position(|(other, _)| other == key);
            let found = other.and_then(|other| Some((other, middles[other].1?)));
            varied.with = Some(found.ok_or_else(|| refused(key))?);
        }
        Ok(())
    }

    /// What varies, as options and tables say it.
    #[must_use]
    pub fn asked(&self) -> &[String] {
        &self.asked
    }

    /// The columns of a draw, in the order requested; what people do comes last.
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
        !self.placed.is_empty() || !self.actors.is_empty()
    }

    /// Tries every choice of every key, each law at its ends, while all other keys keep their values in the file.
    /// This also reads every file that a choice names.
    ///
    /// # Errors
    /// The first value that the scene refuses.
    pub fn check(&self, files: &dyn Files) -> Result<(), VariationError> {
        Scene::parse_without_variants(&self.text, &self.origin, files)?;
        for varied in &self.varied {
            for choice in &varied.choices {
                for share in [0.0, 1.0] {
                    let (mut value, numbers) = as_toml(choice, &mut || share);
                    if let Some(by) = self.moved(varied) {
                        // As far as the other key moves it.
                        value = format!("{:?}", numbers[0] + if share > 0.0 { by } else { -by });
                    }
                    let refused = |source| VariationError::Value {
                        asked: varied.asked.shown.clone(),
                        key: varied.asked.key.clone(),
                        value: value.clone(),
                        source: Box::new(source),
                    };
                    if matches!(varied.place, Place::Time) {
                        check_time(&varied.asked, &numbers)?;
                        continue;
                    }
                    let written = varied.place.written(&value, &numbers);
                    let edits = varied.place.edits().iter().zip(written);
                    let text = edited(&self.text, edits.collect());
                    Scene::parse_without_variants(&text, &self.origin, files).map_err(refused)?;
                }
            }
        }
        Ok(())
    }

    /// How far at most another key moves this one's law.
    fn moved(&self, varied: &Varied) -> Option<f64> {
        let ((other, middle), (_, slope)) = (varied.with?, varied.asked.with.as_ref()?);
        let [low, high] = self.varied[other].choices[0].bounds()?;
        Some(slope.abs() * (middle - low).max(high - middle))
    }

    /// Draws the values of frame `index` (from 0) for this seed.
    #[must_use]
    pub fn draw(&self, seed: u64, index: u64) -> Draw {
        let mut values = Vec::with_capacity(self.columns.len());
        let mut written = Vec::with_capacity(self.varied.len());
        let mut time_s = None;
        let mut drawn: Vec<f64> = Vec::with_capacity(self.varied.len());
        for varied in &self.varied {
            let mut generator = generator(seed, &varied.asked.key, index);
            let place = chosen(&mut generator, &varied.asked.weights, varied.choices.len());
            let choice = &varied.choices[place];
            let (mut text, mut numbers) = as_toml(choice, &mut || share(&mut generator));
            if let (Some((other, middle)), Some((_, slope))) = (varied.with, &varied.asked.with) {
                numbers[0] += slope * (drawn[other] - middle);
                text = format!("{:?}", numbers[0]);
            }
            drawn.push(numbers.first().copied().unwrap_or(0.0));
            if are_numbers(&varied.choices) {
                values.extend(numbers.iter().copied().map(Value::Number));
            } else {
                values.push(Value::Text(match choice.0.as_slice() {
                    [Piece::Text(content)] => content.clone(),
                    _ => text.clone(),
                }));
            }
            written.extend(varied.place.written(&text, &numbers));
            if matches!(varied.place, Place::Time) {
                time_s = numbers.first().copied();
            }
        }
        let acts = self.actors.iter().map(|actor| {
            let mut generator = generator(seed, &actor.asked.key, index);
            chosen(&mut generator, &actor.asked.weights, actor.choices.len())
        });
        let acts: Vec<usize> = acts.collect();
        let chosen = self.chosen(&acts);
        values.extend(chosen.map(|(_, choice)| Value::Text(choice.text.clone())));
        Draw {
            acts,
            text: edited(&self.text, self.drawn(&written)),
            values,
            noise_seed: generator(seed, NOISE, index).next_u64(),
            time_s,
            written,
        }
    }

    fn drawn(&self, written: &[String]) -> Vec<(&Edit, String)> {
        let edits = self.varied.iter().flat_map(|varied| varied.place.edits());
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
        let is_free = |name: &str| {
            self.is_placed(name) || self.actors.iter().any(|actor| actor.agent == name)
        };
        let parse = |text: &str| {
            Scene::parse_unplaced(text, &self.origin, files, &is_free).map_err(refused)
        };
        let placed = |places_m: &mut dyn Iterator<Item = DVec3>| {
            let mut edits = self.drawn(&draw.written);
            edits.extend(floor::edits(&self.placed, places_m));
            parse(&edited(&self.text, edits))
        };
        let mut loaded = match self.placed.is_empty() {
            true => parse(&draw.text)?,
            false => placed(&mut std::iter::repeat(DVec3::ZERO))?,
        };
        let ways = self.ways((seed, index), draw, &loaded.scene)?;
        let send = |scene: &mut Scene| {
            let mut ways = self.actors.iter().zip(&ways);
            ways.try_for_each(|(actor, way)| match way {
                Some(way) => scene.send(&actor.agent, &way.stops(), way.yaw_deg),
                None => Ok(()),
            })
        };
        send(&mut loaded.scene).map_err(refused)?;
        if self.placed.is_empty() {
            return Ok(loaded);
        }
        let mut floor = Floor::new(loaded.scene, &self.placed, (seed, index));
        for _ in 0..TRIES_MAX {
            let Some(misplaced) = floor.misplaced() else {
                let mut loaded = placed(&mut floor.places_m())?;
                send(&mut loaded.scene).map_err(refused)?;
                return Ok(loaded);
            };
            floor.draw(misplaced);
        }
        Err(VariationError::NoPlace {
            index,
            agent: self.placed[floor.most_tried()].agent.clone(),
            tries: TRIES_MAX,
        })
    }

    /// The ways of the people who do something; `None` for those who are not in the scene.
    fn ways(
        &self,
        (seed, index): (u64, u64),
        draw: &Draw,
        scene: &Scene,
    ) -> Result<Vec<Option<Way>>, VariationError> {
        if self.actors.is_empty() {
            return Ok(Vec::new());
        }
        let chosen: Vec<(&Actor, &acts::Choice)> = self.chosen(&draw.acts).collect();
        let is_placed = |name: &str| self.is_placed(name);
        let ways = stage::ways(scene, &chosen, &is_placed, (seed, index));
        ways.map_err(|stuck| VariationError::NoWay {
            index,
            agent: chosen[stuck].0.agent.clone(),
            acts: chosen[stuck].1.text.clone(),
            tries: stage::TRIES_MAX,
        })
    }

    fn chosen<'a>(
        &'a self,
        acts: &'a [usize],
    ) -> impl Iterator<Item = (&'a Actor, &'a acts::Choice)> {
        let chosen = self.actors.iter().zip(acts);
        chosen.map(|(actor, choice)| (actor, &actor.choices[*choice]))
    }

    fn is_placed(&self, agent: &str) -> bool {
        self.placed.iter().any(|placed| placed.agent == agent)
    }

    /// The times of `frames` consecutive frames of a draw, at the sensor's rate. They start at the drawn time; or, if
    /// people do something, at a random one by which they have still to do the rest; or else at the sensor's next sampling
    /// time, starting over at the scene's end.
    #[must_use]
    pub fn times(
        &self,
        (seed, index, frames): (u64, u64, u64),
        draw: &Draw,
        scene: &Scene,
        sensor: &Sensor,
    ) -> Vec<Duration> {
        let frame_time = |number: u64| sensor.frame_time(u32::try_from(number).unwrap_or(u32::MAX));
        if let Some(time_s) = draw.time_s {
            let start = Duration::try_from_secs_f64(time_s).unwrap_or_default();
            return (0..frames)
                .map(|number| start + frame_time(number))
                .collect();
        }
        let count = scene.frame_count(sensor);
        let first = if self.actors.is_empty() {
            (index * frames) % count
        } else {
            let starts = usize::try_from(count.saturating_sub(frames)).unwrap_or(0) + 1;
            let first = below(&mut generator(seed, START, index), starts);
            u64::try_from(first).unwrap_or(0)
        };
        (first..first + frames).map(frame_time).collect()
    }

    fn told(&self, draw: &Draw) -> String {
        let mut told = String::new();
        for (column, value) in self.columns.iter().zip(&draw.values).take(TOLD_MAX) {
            let comma = if told.is_empty() { "" } else { ", " };
            let value = match value {
                Value::Number(number) => number.to_string(),
                Value::Text(text) => text.clone(),
            };
            // Writing to a string cannot fail.
            let _ = write!(told, "{comma}{} = {value}", column.name);
        }
        if self.columns.len() > TOLD_MAX {
            told.push_str(" …");
        }
        if told.is_empty() {
            told.push_str("only places vary");
        }
        told
    }

    /// What each key writes into the text, and where.
    fn edits(&self) -> impl Iterator<Item = (&str, &Edit, Writes)> {
        let varied = self.varied.iter().flat_map(|varied| {
            let edits = varied.place.edits().iter();
            edits.map(|edit| (varied.asked.shown.as_str(), edit, Writes::Value))
        });
        let placed = self.placed.iter().flat_map(|placed| {
            let edits = placed.edits.iter();
            edits.map(|edit| (placed.asked.as_str(), edit, Writes::Place))
        });
        let actors = self.actors.iter().flat_map(|actor| {
            let edits = actor.replaces.iter();
            edits.map(|edit| (actor.asked.shown.as_str(), edit, Writes::Way))
        });
        varied.chain(placed).chain(actors)
    }

    fn check_overlaps(&self) -> Result<(), VariationError> {
        let twice = |asked: &str, other: &str| VariationError::Asked {
            asked: asked.to_owned(),
            mistake: Mistake(format!(
                "it overlaps with `{other}`\nhint: vary each key only once"
            )),
        };
        let mut keys = HashSet::new();
        for varied in &self.varied {
            if !keys.insert(&varied.asked.key) {
                return Err(twice(&varied.asked.shown, &varied.asked.key));
            }
        }
        let mut edits: Vec<(&str, &Edit, Writes)> = self.edits().collect();
        edits.sort_by_key(|(_, edit, writes)| (edit.range.start, edit.range.end, *writes));
        for pair in edits.windows(2) {
            let [(first, before, one), (second, after, other)] = pair else {
                continue;
            };
            let is_same_place = before == after;
            if before.range.end > after.range.start || is_same_place {
                let (why, hint) = match (*one).max(*other) {
                    Writes::Value if first == second => return Err(twice(second, first)),
                    Writes::Value => (
                        "both write the same part of the scene",
                        "vary a table or the keys in it, not both",
                    ),
                    Writes::Place => (
                        "position=floor places the agent",
                        "keep one of them: position=floor draws any free place, position_mm from what you write",
                    ),
                    Writes::Way => (
                        "acts place the person, and write its way and posture",
                        "leave the other out: the person is placed with its acts; without acts, position=floor places it at rest",
                    ),
                };
                let what = format!("it overlaps with `{first}`: {why}\nhint: {hint}");
                return Err(VariationError::Asked {
                    asked: (*second).to_owned(),
                    mistake: Mistake(what),
                });
            }
        }
        Ok(())
    }

    /// An added key must end up in its table, however that table is written.
    fn check_additions(&self) -> Result<(), VariationError> {
        for varied in &self.varied {
            let Place::Key(edit) = &varied.place else {
                continue;
            };
            if edit.before.is_empty() {
                continue;
            }
            let key = &varied.asked.key;
            let text = edited(&self.text, vec![(edit, "0".to_owned())]);
            let arrived =
                DeTable::parse(&text).is_ok_and(|document| target::has(&document, &text, key));
            if !arrived {
                return Err(varied.asked.mistaken(Mistake::not_addable(key)));
            }
        }
        Ok(())
    }
}

/// The agent whose acts a key names.
fn acting(key: &str) -> Option<&str> {
    key.strip_prefix("agent.")?.strip_suffix(".acts")
}

/// The law that the scene has for the number at this place.
fn law(uncertain: &[Uncertain], edit: Option<&Edit>) -> Result<Vec<Choice>, Mistake> {
    let place = edit.map(|edit| &edit.range);
    let mut uncertain = uncertain.iter();
    let found = uncertain.find(|one| place.is_some() && one.value_span.as_ref() == place);
    let no_equals = "missing `=`, and the scene has no [[uncertain]] table for this number\nhint: write KEY=VALUES, as in agent.person.temperature_c=26..34, or add the table";
    let found = found.ok_or_else(|| Mistake(no_equals.to_owned()))?;
    Ok(vec![Choice::of_law(found)])
}

fn on_floor(path: &str, values: &str) -> Result<String, Mistake> {
    if values != "floor" {
        let what = "`position` can only be floor\nhint: write agent.NAME.position=floor, or position_mm=[x, y, z] with numbers or ranges";
        return Err(Mistake(what.to_owned()));
    }
    path.strip_prefix("agent.")
        .map(str::to_owned)
        .ok_or_else(|| {
            let what = "only agents can be placed on the floor\nhint: write agent.person.position=floor; give objects a range, as in object.table.position_mm=[500..3500, 1200, 0]";
            Mistake(what.to_owned())
        })
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
