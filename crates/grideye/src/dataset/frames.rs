//! One labelled frame after the other: the scene of the frame, what its sensor measures, and what is true of it.

use crate::cli::{Dataset, Method};
use crate::exit::bad_input;
use crate::files;
use anyhow::{Result, anyhow};
use grideye_scene::variation::{Draw, Recipe, Value, VariationError};
use grideye_scene::{Files, Loaded, Scene, Simulator, simulator};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io;
use std::path::Path;
use std::rc::Rc;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Simulators that are kept for frames of the same values: as many as a few keys of a few choices have.
const KEPT_MAX: usize = 32;
/// What the simulators that are kept take up in memory at most, if it is more than one.
const KEPT_BYTES: usize = 64 << 20;

/// What all frames have in common.
pub(super) struct Studio {
    /// The scene's name, and its text.
    pub(super) title: String,
    pub(super) text: String,
    /// The files that the scene, or one of its variants, names.
    pub(super) files: BTreeMap<String, String>,
    pub(super) recipe: Recipe,
    pub(super) sensor: String,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The agents of the file, in its order; each may be absent from a frame.
    pub(super) agents: Vec<String>,
    method: Method,
    seed: u64,
}

/// A frame with its labels.
#[derive(Debug)]
pub(super) struct Labelled {
    pub(super) index: u64,
    pub(super) time: Duration,
    pub(super) noise_seed: u64,
    /// What the sensor measures, and what it would measure without noise, °C.
    pub(super) celsius: Vec<f64>,
    pub(super) truth_c: Vec<f64>,
    /// Of each agent; `None` where it is absent.
    pub(super) agents: Vec<Option<Label>>,
    /// What varies, in the order of the recipe.
    pub(super) varied: Vec<Value>,
}

/// What is true of an agent in a frame.
#[derive(Debug)]
pub(super) struct Label {
    /// Metres.
    pub(super) position_m: [f64; 3],
    /// The share of it that is seen, 0 to 1.
    pub(super) visibility: f64,
    /// How many pixels it would fill if nothing hid it.
    pub(super) pixels: f64,
    /// The share of each pixel that is it, 0 to 1.
    pub(super) mask: Vec<f64>,
}

impl Studio {
    /// Reads the scene, and tries every value that was asked for.
    pub(super) fn new(options: &Dataset) -> Result<Self> {
        let origin = options.scene.display().to_string();
        let text = files::scene_text(&options.scene)?;
        let beside = Remembered::new(options.scene.parent().unwrap_or(Path::new("")));
        let Loaded {
            scene, warnings, ..
        } = Scene::parse(&text, &origin, &beside).map_err(bad_input)?;
        for warning in warnings {
            eprintln!("warning: {warning}");
        }
        let recipe = Recipe::new(&text, &origin, &options.varied).map_err(asked)?;
        recipe.check(&beside).map_err(asked)?;
        let sensor = files::sensor_name(&scene, options.sensor.as_deref())?;
        let found = scene.sensor(&sensor).map_err(bad_input)?;
        let (columns, rows) = (found.columns, found.rows);
        let title = options.scene.file_stem().unwrap_or_default();
        Ok(Self {
            title: title.to_string_lossy().into_owned(),
            text,
            files: beside.into_texts(),
            sensor,
            columns,
            rows,
            agents: recipe.agents().to_vec(),
            recipe,
            method: options.method,
            seed: options.seed,
        })
    }

    /// What a frame with its labels takes up, about.
    pub(super) fn bytes_of_frame(&self) -> u64 {
        let pixels = u64::try_from(self.columns * self.rows).unwrap_or(u64::MAX);
        let agents = u64::try_from(self.agents.len()).unwrap_or(u64::MAX);
        pixels
            .saturating_mul(4)
            .saturating_mul(agents.saturating_add(2))
    }

    /// Somebody who makes frames, one after the other.
    pub(super) const fn camera(&self) -> Camera<'_> {
        Camera {
            studio: self,
            kept: VecDeque::new(),
        }
    }

    /// A scene with its simulator.
    fn set(&self, scene: Scene, index: u64) -> Result<Set> {
        let simulator = match self.method {
            Method::Grid => Simulator::new(&scene, &self.sensor),
            Method::Area => Simulator::without_grid(&scene, &self.sensor),
        }
        .map_err(bad_input)?;
        let sensor = simulator.sensor();
        if (sensor.columns, sensor.rows) != (self.columns, self.rows) {
            return Err(bad_input(anyhow!(
                "frame {index} has {} x {} pixels, and the scene's sensor {} x {}\nhint: all frames of a dataset have one size; make one dataset for each resolution",
                sensor.columns,
                sensor.rows,
                self.columns,
                self.rows
            )));
        }
        Ok(Set { scene, simulator })
    }
}

/// Makes frames, and remembers what it made them with.
pub(super) struct Camera<'a> {
    studio: &'a Studio,
    /// By the scene's text, the latest first.
    kept: VecDeque<(String, Rc<Set>)>,
}

struct Set {
    scene: Scene,
    simulator: Simulator,
}

impl Camera<'_> {
    /// The frame of that number.
    pub(super) fn frame(&mut self, index: u64) -> Result<Labelled> {
        let studio = self.studio;
        let draw = studio.recipe.draw(studio.seed, index);
        let set = match self.kept(&draw.text) {
            Some(set) => set,
            None => self.build(index, &draw)?,
        };
        let Set { scene, simulator } = set.as_ref();
        let time = studio.recipe.time(index, &draw, scene, simulator.sensor());
        let labels = studio.agents.iter().map(|name| {
            let number = scene
                .agents()
                .iter()
                .position(|agent| agent.name == *name)?;
            Some(label(scene, simulator, number, time))
        });
        let (image, noisy) = simulator.image_and_noisy(time, draw.noise_seed);
        Ok(Labelled {
            index,
            time,
            noise_seed: draw.noise_seed,
            truth_c: image.celsius,
            celsius: noisy.celsius,
            agents: labels.collect(),
            varied: draw.values,
        })
    }

    fn kept(&mut self, text: &str) -> Option<Rc<Set>> {
        if self.studio.recipe.places_agents() {
            return None;
        }
        let at = self.kept.iter().position(|(kept, _)| kept == text)?;
        let found = self.kept.remove(at)?;
        let set = Rc::clone(&found.1);
        self.kept.push_front(found);
        Some(set)
    }

    fn build(&mut self, index: u64, draw: &Draw) -> Result<Rc<Set>> {
        let studio = self.studio;
        let scene = studio
            .recipe
            .scene(studio.seed, index, draw, &studio.files)
            .map_err(bad_input)?
            .scene;
        let set = Rc::new(match self.of_the_same_room(&scene) {
            Some(mut set) => {
                set.simulator.set_agents(&scene);
                Set { scene, ..set }
            }
            None => studio.set(scene, index)?,
        });
        let fitting = KEPT_BYTES / set.simulator.grid_bytes().max(1);
        self.kept.truncate(fitting.clamp(1, KEPT_MAX) - 1);
        self.kept.push_front((draw.text.clone(), Rc::clone(&set)));
        Ok(set)
    }

    /// Takes a set back in which nothing but the agents is another.
    fn of_the_same_room(&mut self, scene: &Scene) -> Option<Set> {
        let at = self
            .kept
            .iter()
            .position(|(_, set)| set.scene.has_the_room_of(scene))?;
        let (_, set) = self.kept.remove(at)?;
        Rc::into_inner(set)
    }
}

fn label(scene: &Scene, simulator: &Simulator, agent: usize, time: Duration) -> Label {
    let (seen, whole) = (
        simulator.truth_of(agent, time),
        simulator.unhidden(agent, time),
    );
    Label {
        position_m: scene.agents()[agent].position_m(time).to_array(),
        visibility: simulator::visibility(&seen, &whole),
        pixels: whole.pixels(),
        mask: seen.share,
    }
}

/// What was wrong with `--vary`.
fn asked(error: VariationError) -> anyhow::Error {
    bad_input(anyhow::Error::new(error).context("--vary"))
}

/// Files beside the scene, each read once.
struct Remembered<'a> {
    folder: &'a Path,
    texts: Mutex<BTreeMap<String, String>>,
}

impl<'a> Remembered<'a> {
    const fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            texts: Mutex::new(BTreeMap::new()),
        }
    }

    fn into_texts(self) -> BTreeMap<String, String> {
        self.texts
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Files for Remembered<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        let mut texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(text) = texts.get(relative) {
            return Ok(text.clone());
        }
        let text = files::read_text(File::open(self.folder.join(relative))?)?;
        texts.insert(relative.to_owned(), text.clone());
        Ok(text)
    }
}
