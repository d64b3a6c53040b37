//! Makes labeled frames: the scene of a frame, what its sensor measures, and the ground truth.

use crate::error::{DatasetError, TRIES_MAX};
use crate::labels::{CountsFrom, Label, labels};
use grideye_scene::{Files, Scene, Simulator, Unseen};
use grideye_variation::{Draw, Recipe, Value, VariationError};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::rc::Rc;
use std::time::Duration;

/// Limit on cached simulators: as many as a few keys with a few choices need.
const KEPT_MAX: usize = 32;

/// So many draws at most are looked at for what no frame shows.
pub const DRAWS_MAX: u64 = 100;
/// Other draws for a frame have numbers from here on, beyond those of all frames; those in place of a draw whose values
/// conflict, beyond [`TRIES_MAX`] of these.
const AGAIN_BITS: u32 = 40;
const CONFLICT_BITS: u32 = 52;
/// So many draws in a row may conflict.
const CONFLICTS_MAX: u64 = 20;
/// 2^64 over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// What a dataset shows.
#[derive(Debug)]
pub struct Subject {
    /// The scene's name.
    pub title: String,
    /// The scene's text.
    pub text: String,
    /// The files that the scene or one of its variants names.
    pub files: BTreeMap<String, String>,
    /// Whether the program holds the scene.
    pub is_built_in: bool,
    /// The options that say what varies besides the scene's tables.
    pub vary: Vec<String>,
    /// The option that gave the sensor's profile, and its file; empty for the scene's own.
    pub given: Vec<String>,
    /// What varies, parsed.
    pub recipe: Recipe,
    /// The sensor's name.
    pub sensor: String,
    /// The seed of everything that varies and of the noise.
    pub seed: u64,
    /// Consecutive frames of one situation; at least 1.
    pub clip: u64,
    /// From when on an agent counts as in view.
    pub counts_from: CountsFrom,
    /// How often 0, 1, 2 and more people are in view, in proportion; empty for as the scene has it.
    pub in_view: Vec<f64>,
}

/// What all frames have in common.
#[derive(Debug)]
pub struct Frames {
    pub(crate) subject: Subject,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

#[derive(Debug)]
pub(crate) struct Labeled {
    pub(crate) index: u64,
    pub(crate) clip: u64,
    pub(crate) time: Duration,
    pub(crate) noise_seed: u64,
    /// What the sensor measures, and what it would measure without noise, °C; the latter also with nobody in the room.
    pub(crate) celsius: Vec<f64>,
    pub(crate) truth_c: Vec<f64>,
    pub(crate) empty_c: Vec<f64>,
    /// Measured less what the unit shows of the empty room, °C.
    pub(crate) excess_c: Vec<f64>,
    /// Whether people agree on who is in view.
    pub(crate) clear: bool,
    pub(crate) agents: Vec<Option<Label>>,
    /// Values of what varies, in the recipe's order.
    pub(crate) varied: Vec<Value>,
    /// Draws before this one whose values conflict; of a clip, told by its first frame.
    pub(crate) conflicts: u64,
}

impl Labeled {
    /// How many agents count as in view.
    pub(crate) fn people(&self) -> u64 {
        let counted = self.agents.iter().flatten();
        counted.map(|label| u64::from(label.counts)).sum()
    }
}

impl Frames {
    /// The frames of a subject; `scene` is its unchanged scene.
    ///
    /// # Errors
    /// [`DatasetError`] if the scene has no such sensor, and for invalid weights.
    pub fn new(mut subject: Subject, scene: &Scene) -> Result<Self, DatasetError> {
        subject.clip = subject.clip.max(1);
        check_in_view(&subject)?;
        let sensor = scene.sensor(&subject.sensor)?;
        Ok(Self {
            columns: sensor.columns,
            rows: sensor.rows,
            subject,
        })
    }

    /// Columns and rows of a frame.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// What the sensor never sees in any of the first draws, at most [`DRAWS_MAX`] and `count`.
    ///
    /// # Errors
    /// As [`make`](crate::make), for these draws.
    pub fn unseen(&self, count: u64) -> Result<Vec<Unseen>, DatasetError> {
        let Subject {
            recipe,
            seed,
            files,
            sensor,
            ..
        } = &self.subject;
        let mut found: Vec<Unseen> = Vec::new();
        let mut seen: BTreeSet<String> = BTreeSet::new();
        for number in 0..count.min(DRAWS_MAX) {
            let draw = recipe.draw(*seed, number);
            let scene = match recipe.scene(*seed, number, &draw, files) {
                Err(VariationError::Frame { .. }) => continue,
                drawn => drawn?.scene,
            };
            let unseen = scene.unseen(Some(sensor));
            let agents = scene.agents().iter().map(|agent| &agent.name);
            let names = agents.chain(scene.objects().iter().map(|object| &object.name));
            let is_unseen = |name: &&String| unseen.iter().any(|one| one.name == **name);
            seen.extend(
                names
                    .chain([sensor])
                    .filter(|name| !is_unseen(name))
                    .cloned(),
            );
            found.extend(unseen.into_iter().filter(|one| !seen.contains(&one.name)));
            found.retain(|one| !seen.contains(&one.name));
            found.dedup();
            if found.is_empty() && recipe.agents().iter().all(|agent| seen.contains(agent)) {
                break;
            }
        }
        let mut names = BTreeSet::new();
        found.retain(|one| names.insert(one.name.clone()));
        Ok(found)
    }

    /// How many people must be in view in this frame; `None` if it does not matter.
    fn wanted(&self, index: u64) -> Option<u64> {
        let weights = &self.subject.in_view;
        let whole: f64 = weights.iter().sum();
        if weights.is_empty() {
            return None;
        }
        // Multiples of the golden ratio are spread evenly: every stretch of frames has the classes in proportion.
        let turn = index.wrapping_add(self.subject.seed).wrapping_mul(GOLDEN);
        let share = f64::from(u32::try_from(turn >> 32).unwrap_or_default()) / f64::from(u32::MAX);
        let mut left = share * whole;
        let last = weights.iter().rposition(|weight| *weight > 0.0);
        let found = weights.iter().position(|weight| {
            left -= weight;
            left < 0.0
        });
        u64::try_from(found.or(last)?).ok()
    }

    pub(crate) fn agents(&self) -> &[String] {
        self.subject.recipe.agents()
    }

    pub(crate) fn bytes_of_frame(&self) -> u64 {
        let pixels = u64::try_from(self.columns * self.rows).unwrap_or(u64::MAX);
        let agents = u64::try_from(self.agents().len()).unwrap_or(u64::MAX);
        pixels
            .saturating_mul(4)
            .saturating_mul(agents.saturating_add(4))
    }

    pub(crate) const fn maker(&self) -> Maker<'_> {
        Maker {
            frames: self,
            clip: None,
            kept: VecDeque::new(),
        }
    }

    fn set(&self, scene: Scene, index: u64) -> Result<Set, DatasetError> {
        let simulator = Simulator::coarse(&scene, &self.subject.sensor)?;
        let sensor = simulator.sensor();
        let (found, expected) = ((sensor.columns, sensor.rows), (self.columns, self.rows));
        if found != expected {
            return Err(DatasetError::Refused(format!(
                "frame {index} has {} x {} pixels, but the scene's sensor has {} x {}\nhint: all frames of a dataset have one size; make one dataset per resolution",
                found.0, found.1, expected.0, expected.1
            )));
        }
        Ok(Set { scene, simulator })
    }
}

fn check_in_view(subject: &Subject) -> Result<(), DatasetError> {
    let weights = &subject.in_view;
    let agents = subject.recipe.agents().len();
    let is_right = |weight: &f64| weight.is_finite() && *weight >= 0.0;
    let is_balanced = weights.iter().all(is_right) && weights.iter().any(|weight| *weight > 0.0);
    match weights.is_empty() || (is_balanced && weights.len() <= agents + 1 && subject.clip == 1) {
        true => Ok(()),
        false => Err(DatasetError::Refused(format!(
            "{} weights of people in view, for {agents} agents and clips of {} frames\nhint: give up to {} weights from 0 on, not all 0, for 0, 1, 2 and more people, as in --in-view 1,1,1, and no --clip",
            weights.len(),
            subject.clip,
            agents + 1
        ))),
    }
}

/// Makes frames and caches their simulators.
pub(crate) struct Maker<'a> {
    frames: &'a Frames,
    clip: Option<Clip>,
    /// By the scene's text, most recently used first.
    kept: VecDeque<(String, Rc<Set>)>,
}

pub(crate) struct Set {
    pub(crate) scene: Scene,
    pub(crate) simulator: Simulator,
}

impl Set {
    /// A frame with its labels, in the order of `agents`.
    pub(crate) fn labeled(
        &self,
        agents: &[String],
        (index, time, noise_seed): (u64, Duration, u64),
        counts_from: CountsFrom,
    ) -> Labeled {
        let Self { scene, simulator } = self;
        let (image, noisy, filled) = simulator.labeled(time, noise_seed);
        let empty = simulator.without_agents(time);
        let background = simulator.background(&empty, noise_seed);
        let labels = labels(scene.agents(), time, filled, (&image, &empty), counts_from);
        let clear = labels.iter().flatten().all(|label| label.clear);
        let mut labels = scene.agents().iter().zip(labels).peekable();
        let labels = agents.iter().map(|name| {
            // Absent agents are missing in the scene, which has the others in the same order.
            labels.next_if(|(agent, _)| agent.name == *name)?.1
        });
        Labeled {
            index,
            clip: 0,
            time,
            noise_seed,
            agents: labels.collect(),
            truth_c: image.celsius,
            excess_c: noisy
                .celsius
                .iter()
                .zip(background.celsius)
                .map(|(of, less)| of - less)
                .collect(),
            celsius: noisy.celsius,
            empty_c: empty.celsius,
            clear,
            varied: Vec::new(),
            conflicts: 0,
        }
    }
}

/// Consecutive frames of one draw.
struct Clip {
    number: u64,
    draw: Draw,
    set: Rc<Set>,
    times: Vec<Duration>,
    conflicts: u64,
}

impl Maker<'_> {
    pub(crate) fn frame(&mut self, index: u64) -> Result<Labeled, DatasetError> {
        let Some(people) = self.frames.wanted(index) else {
            return self.drawn(index, 0);
        };
        for again in 0..TRIES_MAX {
            let labeled = self.drawn(index, again)?;
            if labeled.people() == people {
                return Ok(labeled);
            }
            self.clip = None;
        }
        Err(DatasetError::Refused(format!(
            "frame {index}: none of {TRIES_MAX} draws has {people} in view\nhint: give {people} the weight 0 in --in-view, let more people be there, or make the room about as small as what the sensor sees"
        )))
    }

    /// The frame by its draw, or by another one for the same frame.
    fn drawn(&mut self, index: u64, again: u64) -> Result<Labeled, DatasetError> {
        let frames = self.frames;
        let Subject {
            clip, counts_from, ..
        } = frames.subject;
        let found = self
            .clip
            .take()
            .filter(|found| found.number == index / clip);
        let mut found = match found {
            Some(found) => found,
            None => self.possible(index / clip, again << AGAIN_BITS)?,
        };
        let within = usize::try_from(index % clip).unwrap_or(usize::MAX);
        let time = found.times.get(within).copied().unwrap_or_default();
        let moment = (index, time, found.draw.noise_seed);
        let labeled = Labeled {
            clip: found.number,
            varied: found.draw.values.clone(),
            conflicts: std::mem::take(&mut found.conflicts),
            ..found.set.labeled(frames.agents(), moment, counts_from)
        };
        self.clip = Some(found);
        Ok(labeled)
    }

    /// The first draw whose values do not conflict: each may be valid with the file's others.
    fn possible(&mut self, clip_number: u64, again: u64) -> Result<Clip, DatasetError> {
        let conflicts = |clip: &_| {
            matches!(
                clip,
                Err(DatasetError::Variation(VariationError::Frame { .. }))
            )
        };
        let first = self.clip_of(clip_number, again);
        for tried in 1..CONFLICTS_MAX {
            if !conflicts(&first) {
                break;
            }
            let next = self.clip_of(clip_number, again + (tried << CONFLICT_BITS));
            if !conflicts(&next) {
                return next.map(|clip| Clip {
                    conflicts: tried,
                    ..clip
                });
            }
        }
        first
    }

    fn clip_of(&mut self, clip_number: u64, again: u64) -> Result<Clip, DatasetError> {
        let number = clip_number + again;
        let Subject {
            recipe, seed, clip, ..
        } = &self.frames.subject;
        let draw = recipe.draw(*seed, number);
        let set = match self.kept(&draw.text) {
            Some(set) => set,
            None => self.build(number, &draw)?,
        };
        let sensor = set.simulator.sensor();
        let times = recipe.times((*seed, number, *clip), &draw, &set.scene, sensor);
        Ok(Clip {
            number: clip_number,
            draw,
            set,
            times,
            conflicts: 0,
        })
    }

    fn kept(&mut self, text: &str) -> Option<Rc<Set>> {
        if self.frames.subject.recipe.places_agents() {
            return None;
        }
        let at = self.kept.iter().position(|(kept, _)| kept == text)?;
        let found = self.kept.remove(at)?;
        let set = Rc::clone(&found.1);
        self.kept.push_front(found);
        Some(set)
    }

    fn build(&mut self, index: u64, draw: &Draw) -> Result<Rc<Set>, DatasetError> {
        let Subject {
            recipe,
            seed,
            files,
            ..
        } = &self.frames.subject;
        let drawn = recipe.scene(*seed, index, draw, files);
        let frame = (index & ((1 << AGAIN_BITS) - 1)) * self.frames.subject.clip;
        let scene = drawn.map_err(|error| error.of_frame(frame))?.scene;
        let set = Rc::new(match self.of_the_same_room(&scene) {
            Some(mut set) => {
                set.simulator.set_agents(&scene);
                Set { scene, ..set }
            }
            None => self.frames.set(scene, index)?,
        });
        self.kept.truncate(KEPT_MAX - 1);
        self.kept.push_front((draw.text.clone(), Rc::clone(&set)));
        Ok(set)
    }

    /// Takes a cached set that differs only in its agents.
    fn of_the_same_room(&mut self, scene: &Scene) -> Option<Set> {
        let mut kept = self.kept.iter();
        let at = kept.position(|(_, set)| set.scene.has_the_room_of(scene))?;
        let (_, set) = self.kept.remove(at)?;
        Rc::into_inner(set)
    }
}

/// A cache of the files beside the scene: each is read once.
pub struct Remembered<'a> {
    files: &'a dyn Files,
    texts: RefCell<BTreeMap<String, String>>,
}

impl<'a> Remembered<'a> {
    /// Starts with an empty cache.
    #[must_use]
    pub fn new(files: &'a dyn Files) -> Self {
        Self {
            files,
            texts: RefCell::default(),
        }
    }

    /// The files read so far, by name.
    #[must_use]
    pub fn into_texts(self) -> BTreeMap<String, String> {
        self.texts.into_inner()
    }
}

impl Files for Remembered<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        if let Some(text) = self.texts.borrow().get(relative) {
            return Ok(text.clone());
        }
        let text = self.files.read(relative)?;
        let mut texts = self.texts.borrow_mut();
        texts.insert(relative.to_owned(), text.clone());
        Ok(text)
    }
}
