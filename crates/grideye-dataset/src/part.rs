//! The frames of one part as arrays.

use crate::error::DatasetError;
use crate::frames::{Frames, Labeled, Set};
use crate::labels::CountsFrom;
use crate::manifest::Manifest;
use grideye_scene::count::single;
use grideye_scene::{Scene, Simulator};
use grideye_variation::Value;

/// The labeled frames of a part.
#[derive(Debug)]
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
    /// How many agents count as in view.
    pub people: Vec<u64>,
    /// Labels of each agent.
    pub agents: Vec<AgentLabels>,
    /// Values of what varies.
    pub varied: Vec<VariedColumn>,
}

/// The labels of one agent, frame by frame.
#[derive(Debug)]
pub struct AgentLabels {
    /// The agent's name.
    pub name: String,
    /// Position on each axis, meters; `None` while absent.
    pub position_m: [Vec<Option<f64>>; 3],
    /// Whether the agent is present.
    pub present: Vec<bool>,
    /// Visible share of the agent, 0 to 1.
    pub visibility: Vec<Option<f64>>,
    /// How many pixels the agent would fill if nothing hid it.
    pub pixels: Vec<Option<f64>>,
    /// What the agent changes in the pixel where it changes most, °C.
    pub contrast_c: Vec<Option<f64>>,
    /// Whether the agent counts as in view.
    pub counts: Vec<bool>,
    /// Column and row of its middle, from the middle of the first pixel; `None` out of view.
    pub center_px: [Vec<Option<f64>>; 2],
    /// Left, top, right and bottom edge of its box, pixels; `None` out of view.
    pub box_px: [Vec<Option<f64>>; 4],
    /// A person's posture.
    pub posture: Vec<Option<&'static str>>,
    /// What a person does.
    pub doing: Vec<Option<&'static str>>,
    /// The agent's share of each pixel, frame by frame.
    pub mask: Vec<f32>,
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
    /// [`DatasetError::Scene`] if the scene has no such sensor.
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
            part.add(&set.labeled(&agents, moment, CountsFrom::default()));
        }
        Ok(part)
    }

    /// No frames yet.
    fn of(size: (usize, usize), agents: &[String], varied: Vec<VariedColumn>) -> Self {
        let agents = agents.iter().map(|name| AgentLabels::new(name.clone()));
        Self {
            number: 0,
            size,
            frame: Vec::new(),
            clip: Vec::new(),
            time_s: Vec::new(),
            noise_seed: Vec::new(),
            celsius: Vec::new(),
            truth_c: Vec::new(),
            people: Vec::new(),
            agents: agents.collect(),
            varied,
        }
    }

    pub(crate) fn add(&mut self, labeled: &Labeled) {
        self.frame.push(labeled.index);
        self.clip.push(labeled.clip);
        self.people.push(labeled.people());
        self.time_s.push(labeled.time.as_secs_f64());
        self.noise_seed.push(labeled.noise_seed);
        self.celsius
            .extend(labeled.celsius.iter().copied().map(single));
        self.truth_c
            .extend(labeled.truth_c.iter().copied().map(single));
        let pixels = self.size.0 * self.size.1;
        for (agent, label) in self.agents.iter_mut().zip(&labeled.agents) {
            let label = label.as_ref();
            agent.present.push(label.is_some());
            for (axis, values) in agent.position_m.iter_mut().enumerate() {
                values.push(label.map(|label| label.position_m[axis]));
            }
            agent.visibility.push(label.map(|label| label.visibility));
            agent.pixels.push(label.map(|label| label.pixels));
            agent.contrast_c.push(label.map(|label| label.contrast_c));
            agent.counts.push(label.is_some_and(|label| label.counts));
            for (axis, values) in agent.center_px.iter_mut().enumerate() {
                values.push(label.and_then(|label| label.center_px).map(|at| at[axis]));
            }
            for (edge, values) in agent.box_px.iter_mut().enumerate() {
                values.push(
                    label
                        .and_then(|label| label.box_px)
                        .map(|edges| edges[edge]),
                );
            }
            agent.posture.push(label.and_then(|label| label.posture));
            agent.doing.push(label.and_then(|label| label.doing));
            match label {
                Some(label) => agent.mask.extend(label.mask.iter().copied().map(single)),
                None => agent.mask.resize(agent.mask.len() + pixels, 0.0),
            }
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

impl AgentLabels {
    const fn new(name: String) -> Self {
        Self {
            name,
            position_m: [Vec::new(), Vec::new(), Vec::new()],
            present: Vec::new(),
            visibility: Vec::new(),
            pixels: Vec::new(),
            contrast_c: Vec::new(),
            counts: Vec::new(),
            center_px: [const { Vec::new() }; 2],
            box_px: [const { Vec::new() }; 4],
            posture: Vec::new(),
            doing: Vec::new(),
            mask: Vec::new(),
        }
    }
}
