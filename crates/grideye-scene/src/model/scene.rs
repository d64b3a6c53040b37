//! The whole scene: a room with its contents, and the warnings from reading its file.

use crate::geometry::count::single;
use crate::geometry::rotation_z_deg;
use crate::model::body::{Agent, Body};
use crate::model::calibrated::Calibrated;
use crate::model::error::{SceneError, Warning};
use crate::model::person::{PAPER, Person, SEGMENTS};
use crate::model::print::Print;
use crate::model::room::Room;
use crate::model::sensor::Sensor;
use crate::model::uncertain::Uncertain;
use crate::radiometry::{Band, Law, Surface};
use crate::text::Utc;
use glam::DVec3;
use grideye_frame::Celsius;
use std::sync::Arc;
use std::time::Duration;

/// How frames are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// As in the paper: perceived temperatures that tend to ambient with distance, weighted as by its resampling.
    #[default]
    Paper,
    /// The same on the paper's grid of points, resampled: slow, the reference for the other.
    PaperGrid,
    /// As for a thermopile behind a lens: radiance averaged over each pixel's response.
    Physical,
}

impl Model {
    /// How a person's segments look in a room of this temperature.
    pub(crate) fn surfaces(self, person: &Person, ambient_c: f64) -> [Surface; SEGMENTS] {
        match self {
            Self::Physical => person.surfaces(ambient_c),
            Self::Paper | Self::PaperGrid => [PAPER; SEGMENTS],
        }
    }
}

/// A room with its contents, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub(crate) room: Room,
    pub(crate) screen: Option<Body>,
    pub(crate) objects: Vec<Body>,
    pub(crate) agents: Vec<Agent>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) model: Model,
    pub(crate) law: Law,
    /// The wavelengths and the reflected temperature (°C) of the physical model.
    pub(crate) band: Band,
    pub(crate) reflected_c: f64,
    pub(crate) duration_s: f64,
    pub(crate) starts_utc: Option<Utc>,
    pub(crate) paper_experiment: Option<u8>,
    pub(crate) prints: Vec<Print>,
    pub(crate) calibrated: Vec<Calibrated>,
    pub(crate) uncertain: Vec<Uncertain>,
    pub(crate) variants: Vec<Variant>,
}

/// The scene with one uncertain number a standard deviation off its mean each way, cut at its bounds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Variant {
    /// The number's key, as in [`Scene::uncertain`].
    pub key: String,
    /// The scene with the lower number; it has the laws of the whole scene, and no variants.
    pub below: Arc<Scene>,
    /// The same with the higher number.
    pub above: Arc<Scene>,
}

/// A scene with its warnings.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Warnings for the user, in the order of the file.
    pub warnings: Vec<Warning>,
}

impl Scene {
    /// The model of its frames.
    #[must_use]
    pub const fn model(&self) -> Model {
        self.model
    }

    /// The room.
    #[must_use]
    pub const fn room(&self) -> &Room {
        &self.room
    }

    /// The paper's experiment, 1 to 4, that the scene reproduces (PeerJ CS 11:e3124, Tables 1 to 4).
    #[must_use]
    pub const fn paper_experiment(&self) -> Option<u8> {
        self.paper_experiment
    }

    /// The temperature of the room.
    #[must_use]
    pub const fn ambient(&self) -> Celsius {
        Celsius::new(single(self.room.ambient_c))
    }

    /// The objects in the room, without removed ones.
    #[must_use]
    pub fn objects(&self) -> &[Body] {
        &self.objects
    }

    /// Everything that stands still and may hide something: the objects, and the walls that jut into the room.
    pub(crate) fn standing(&self) -> impl Iterator<Item = &Body> {
        self.objects.iter().chain(&self.screen)
    }

    /// The walls that jut into the room, as a body that hides what is behind them.
    #[must_use]
    pub const fn screen(&self) -> Option<&Body> {
        self.screen.as_ref()
    }

    /// The agents, in the order of the file.
    #[must_use]
    pub fn agents(&self) -> &[Agent] {
        &self.agents
    }

    /// The sensors, in the order of the file.
    #[must_use]
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// The sensor with this name.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`], which lists the known names.
    pub fn sensor(&self, name: &str) -> Result<&Sensor, SceneError> {
        let sensors = || self.sensors.iter();
        let found = sensors().find(|sensor| sensor.name == name);
        found.ok_or_else(|| SceneError::UnknownSensor {
            name: name.to_owned(),
            known: sensors().map(|sensor| sensor.name.clone()).collect(),
        })
    }

    /// The calibrations that its numbers come from.
    #[must_use]
    pub fn calibrated(&self) -> &[Calibrated] {
        &self.calibrated
    }

    /// A variant for each number of the file with a normal law, in the order of the file. Only [`Self::parse`] and
    /// [`Self::parse_as`] make them.
    #[must_use]
    pub fn variants(&self) -> &[Variant] {
        &self.variants
    }

    /// The interpretation of the paper's formula.
    #[must_use]
    pub const fn law(&self) -> Law {
        self.law
    }

    /// Gives its people the strides of another scene's, agent by agent. After some meters nobody knows where in its stride
    /// a person is: whoever compares scenes with people of other heights can keep that from deciding.
    pub fn keep_strides_of(&mut self, other: &Self) {
        for (agent, other) in self.agents.iter_mut().zip(&other.agents) {
            if let (Some(person), Some(other)) = (&mut agent.person, &other.person) {
                person.stride_m = other.stride_m;
            }
        }
    }

    /// Whether another scene differs only in its agents and their durations.
    #[must_use]
    pub fn has_the_room_of(&self, other: &Self) -> bool {
        self.room == other.room
            && self.screen == other.screen
            && self.model == other.model
            && self.law == other.law
            && self.band == other.band
            && self.reflected_c == other.reflected_c
            && self.sensors == other.sensors
            && self.objects == other.objects
    }

    /// Whether nothing moves or changes.
    #[must_use]
    pub fn is_static(&self) -> bool {
        self.duration().is_zero()
    }

    /// The longest duration of an agent, or the file's if longer; zero if nothing moves or changes.
    #[must_use]
    pub fn duration(&self) -> Duration {
        let given = Duration::try_from_secs_f64(self.duration_s).unwrap_or_default();
        let ways = self.agents.iter().map(Agent::duration).max();
        ways.unwrap_or_default().max(given)
    }

    /// When the scene starts: the earliest UTC stamp of its trajectories; `None` if they have none.
    #[must_use]
    pub const fn starts_utc(&self) -> Option<Utc> {
        self.starts_utc
    }

    /// The scene without agents, their prints and variants, as in an empty part of a recording.
    #[must_use]
    pub fn without_agents(&self) -> Self {
        Self {
            agents: Vec::new(),
            prints: Vec::new(),
            variants: Vec::new(),
            ..self.clone()
        }
    }

    /// The scene without one of its agents, by number.
    #[must_use]
    pub fn without_agent(&self, number: usize) -> Self {
        let mut scene = self.clone();
        scene.agents.remove(number);
        scene
    }

    /// A person of this room at rest on the origin, who faces `yaw_deg` from +x. Moving its
    /// [start](Agent::start_m) moves its segments.
    #[must_use]
    pub fn person(&self, name: &str, mut person: Person, yaw_deg: f64) -> Agent {
        person.facing = rotation_z_deg(yaw_deg);
        let surfaces = self.model.surfaces(&person, self.room.ambient_c);
        let parts = Body::segments_of(&person, DVec3::ZERO, surfaces, None);
        Agent {
            person: Some(person),
            ..Agent::at_rest(name, parts, DVec3::ZERO)
        }
    }

    /// The scene in the paper's model, on its sampling grid.
    #[must_use]
    pub fn on_grid(&self) -> Self {
        Self {
            model: Model::PaperGrid,
            ..self.clone()
        }
    }

    /// The scene with these sensors instead, also in its variants; those of a sensor's number are dropped.
    #[must_use]
    pub fn with_sensors(&self, sensors: Vec<Sensor>) -> Self {
        let kept = self.variants.iter();
        let kept = kept.filter(|variant| !variant.key.starts_with("sensor."));
        let with = |scene: &Self| Arc::new(scene.with_sensors(sensors.clone()));
        let variants = kept.map(|variant| Variant {
            key: variant.key.clone(),
            below: with(&variant.below),
            above: with(&variant.above),
        });
        Self {
            variants: variants.collect(),
            sensors,
            ..self.clone()
        }
    }

    /// The scene with these objects or agents instead, without variants.
    #[must_use]
    pub fn with_bodies(&self, objects: Vec<Body>, agents: Vec<Agent>) -> Self {
        Self {
            objects,
            agents,
            variants: Vec::new(),
            ..self.clone()
        }
    }

    /// The scene in a room this much warmer, without variants: what is as warm as the room stays so, and people wear what they
    /// wear.
    #[must_use]
    pub fn in_warmer_room(&self, by_c: f64) -> Self {
        let before_c = self.room.ambient_c;
        let ambient_c = before_c + by_c;
        let warmed = |celsius: &mut f64| {
            if *celsius == before_c {
                *celsius = ambient_c;
            }
        };
        let mut scene = self.with_bodies(self.objects.clone(), self.agents.clone());
        scene.room.ambient_c = ambient_c;
        warmed(&mut scene.reflected_c);
        let objects = scene.objects.iter_mut().chain(&mut scene.screen);
        objects.for_each(|object| warmed(&mut object.surface.celsius));
        for agent in &mut scene.agents {
            if let Some(person) = &agent.person {
                let surfaces = scene.model.surfaces(person, ambient_c);
                let parts = agent.parts.iter_mut().zip(surfaces);
                parts.for_each(|(part, surface)| part.surface = surface);
            }
        }
        scene
    }

    /// How many frames the sensor takes within the scene's duration, counting the first at its start: 1 if nothing
    /// moves.
    #[must_use]
    pub fn frame_count(&self, sensor: &Sensor) -> u64 {
        // A small margin keeps the last frame if only rounding puts it past the end.
        let last = (self.duration().as_secs_f64() * sensor.sampling_hz + 1e-6).floor();
        u64::try_from(crate::geometry::count::floor(last))
            .map_or(u64::MAX, |last| last.saturating_add(1))
    }
}
