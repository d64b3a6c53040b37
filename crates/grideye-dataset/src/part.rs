//! The frames of one part as arrays.

use crate::error::DatasetError;
use crate::frames::{Frames, Labeled, Set};
use crate::labels::{CountsFrom, Label};
use crate::manifest::Manifest;
use grideye_scene::count::single;
use grideye_scene::{Scene, Simulator};
use grideye_variation::Value;

/// The labeled frames of a part.
#[derive(Debug, Default)]
pub struct Part {
    /// The part's number, from 0.
    pub number: u64,
    /// Columns and rows of a frame.
    pub size: (usize, usize),
    /// Frame numbers, from 0.
    pub frame: Vec<u64>,
    /// Clip numbers, from 0.
    pub clip: Vec<u64>,
    /// Frame times, seconds.
    pub time_s: Vec<f64>,
    /// Noise seeds.
    pub noise_seed: Vec<u64>,
    /// What the sensor measures, frame by frame, °C.
    pub celsius: Vec<f32>,
    /// What it would measure without noise, °C.
    pub truth_c: Vec<f32>,
    /// The same with nobody in the room, °C.
    pub empty_c: Vec<f32>,
    /// What it measures less what the unit shows of the empty room, on the sensor's steps, °C.
    pub excess_c: Vec<f32>,
    /// Whether no agent fills from one pixel up to those that count: people may say either of such a frame.
    pub clear: Vec<bool>,
    /// How many agents count as in view.
    pub people: Vec<u64>,
    /// Labels of each agent.
    pub agents: Vec<AgentLabels>,
    /// Values of what varies.
    pub varied: Vec<VariedColumn>,
    /// Draws that were left out because their values conflict.
    pub conflicts: u64,
}

/// The labels of one agent, frame by frame.
#[derive(Debug)]
pub struct AgentLabels {
    /// The agent's name.
    pub name: String,
    /// Its labels; `None` while it is absent.
    pub labels: Vec<Option<Label>>,
}

/// One varying key, frame by frame.
#[derive(Debug)]
pub struct VariedColumn {
    /// The column's name.
    pub name: String,
    /// The column's values.
    pub values: Scalars,
}

/// Values of one kind.
#[derive(Debug)]
pub enum Scalars {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Texts.
    Texts(Vec<String>),
}

impl Part {
    pub(crate) fn new(frames: &Frames, manifest: &Manifest, number: u64) -> Self {
        let varied = frames
            .subject
            .recipe
            .columns()
            .iter()
            .map(|column| VariedColumn {
                name: column.name.clone(),
                values: if column.is_number {
                    Scalars::Numbers(Vec::new())
                } else {
                    Scalars::Texts(Vec::new())
                },
            });
        let size = (manifest.columns, manifest.rows);
        Self {
            number,
            ..Self::of(size, frames.agents(), varied.collect())
        }
    }

    /// The first frames of a scene that does not vary, as `grideye simulate` makes them with this seed; fewer if `goes_on`
    /// says so.
    ///
    /// # Errors
    /// [`DatasetError`] if the scene has no such sensor.
    pub fn of_scene(
        scene: &Scene,
        sensor: &str,
        (frames, seed): (u32, u64),
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Self, DatasetError> {
        let set = Set {
            scene: scene.clone(),
            simulator: Simulator::new(scene, sensor)?,
        };
        let sensor = set.simulator.sensor();
        let agents = scene.agents().iter().map(|agent| agent.name.clone());
        let agents: Vec<String> = agents.collect();
        let mut part = Self::of((sensor.columns, sensor.rows), &agents, Vec::new());
        for index in (0..frames).take_while(|_| goes_on()) {
            let moment = (index.into(), sensor.frame_time(index), seed);
            part.add(set.labeled(&agents, moment, CountsFrom::default()));
        }
        Ok(part)
    }

    /// No frames yet.
    fn of(size: (usize, usize), agents: &[String], varied: Vec<VariedColumn>) -> Self {
        let agents = agents.iter().map(|name| AgentLabels {
            name: name.clone(),
            labels: Vec::new(),
        });
        Self {
            size,
            agents: agents.collect(),
            varied,
            ..Self::default()
        }
    }

    pub(crate) fn add(&mut self, labeled: Labeled) {
        self.frame.push(labeled.index);
        self.clip.push(labeled.clip);
        self.people.push(labeled.people());
        self.time_s.push(labeled.time.as_secs_f64());
        self.noise_seed.push(labeled.noise_seed);
        self.clear.push(labeled.clear);
        self.conflicts += labeled.conflicts;
        for (all, image) in [
            (&mut self.celsius, &labeled.celsius),
            (&mut self.truth_c, &labeled.truth_c),
            (&mut self.empty_c, &labeled.empty_c),
            (&mut self.excess_c, &labeled.excess_c),
        ] {
            all.extend(image.iter().copied().map(single));
        }
        for (agent, label) in self.agents.iter_mut().zip(labeled.agents) {
            agent.labels.push(label);
        }
        for (varied, value) in self.varied.iter_mut().zip(&labeled.varied) {
            match (&mut varied.values, value) {
                (Scalars::Numbers(numbers), Value::Number(number)) => numbers.push(*number),
                (Scalars::Texts(texts), Value::Text(text)) => texts.push(text.clone()),
                (Scalars::Texts(texts), Value::Number(number)) => texts.push(number.to_string()),
                (Scalars::Numbers(numbers), Value::Text(_)) => numbers.push(f64::NAN),
            }
        }
    }
}
