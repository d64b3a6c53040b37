//! A room with what is in it: the whole scene, and what the reader of its file is told.

use crate::geometry::count::single;
use crate::model::body::{Agent, Body};
use crate::model::error::{SceneError, Warning};
use crate::model::fit::Fit;
use crate::model::print::Print;
use crate::model::room::Room;
use crate::model::sensor::Sensor;
use crate::radiometry::{Band, Law};
use grideye_frame::Celsius;
use std::time::Duration;

/// How frames are made of what is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Model {
    /// As the paper does: a perceived temperature that tends to ambient with distance, on a grid of points, resampled.
    #[default]
    Paper,
    /// As a thermopile behind a lens does: radiance, averaged over each pixel's response.
    Physical,
}

/// A room with what is in it, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub(crate) room: Room,
    pub(crate) screen: Option<Body>,
    pub(crate) objects: Vec<Body>,
    pub(crate) agents: Vec<Agent>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) model: Model,
    pub(crate) law: Law,
    /// What the physical model takes in of the light, and what temperature is reflected, °C.
    pub(crate) band: Band,
    pub(crate) reflected_c: f64,
    pub(crate) duration_s: f64,
    pub(crate) paper_experiment: Option<u8>,
    pub(crate) prints: Vec<Print>,
}

/// A scene, and what was changed or deserves a look.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What the reader should be told, in the order of the file.
    pub warnings: Vec<Warning>,
    /// The unknowns that the file marks, in its order; nothing but a calibration looks at them.
    pub fits: Vec<Fit>,
}

impl Scene {
    /// The model that its frames are made by.
    #[must_use]
    pub const fn model(&self) -> Model {
        self.model
    }

    /// The room.
    #[must_use]
    pub const fn room(&self) -> &Room {
        &self.room
    }

    /// The experiment of the paper, 1 to 4, that the scene says it stands for (PeerJ CS 11:e3124, Tables 1 to 4).
    #[must_use]
    pub const fn paper_experiment(&self) -> Option<u8> {
        self.paper_experiment
    }

    /// The temperature of the room.
    #[must_use]
    pub const fn ambient(&self) -> Celsius {
        Celsius::new(single(self.room.ambient_c))
    }

    /// The objects that stand in the room, without those that were removed.
    #[must_use]
    pub fn objects(&self) -> &[Body] {
        &self.objects
    }

    /// The objects, and the walls that jut into the room: all that stands still and may be before something.
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

    /// The sensor of that name.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`], which lists the names there are.
    pub fn sensor(&self, name: &str) -> Result<&Sensor, SceneError> {
        let sensors = || self.sensors.iter();
        let found = sensors().find(|sensor| sensor.name == name);
        found.ok_or_else(|| SceneError::UnknownSensor {
            name: name.to_owned(),
            known: sensors().map(|sensor| sensor.name.clone()).collect(),
        })
    }

    /// The reading of the paper's formula that the scene asks for.
    #[must_use]
    pub const fn law(&self) -> Law {
        self.law
    }

    /// Whether another scene differs in nothing but its agents and the time they take.
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

    /// Whether nothing moves.
    #[must_use]
    pub fn is_static(&self) -> bool {
        self.duration().is_zero()
    }

    /// The time that the agents take, or the file's if that is longer; zero if nothing moves or changes.
    #[must_use]
    pub fn duration(&self) -> Duration {
        let given = Duration::try_from_secs_f64(self.duration_s).unwrap_or_default();
        let ways = self.agents.iter().map(Agent::duration).max();
        ways.unwrap_or_default().max(given)
    }

    /// The same room without its agents and the prints that they leave: what an empty stretch of a recording shows.
    #[must_use]
    pub fn without_agents(&self) -> Self {
        Self {
            agents: Vec::new(),
            prints: Vec::new(),
            ..self.clone()
        }
    }

    /// The same scene, looked at by these sensors.
    #[must_use]
    pub fn with_sensors(&self, sensors: Vec<Sensor>) -> Self {
        Self {
            sensors,
            ..self.clone()
        }
    }

    /// How many frames the sensor takes while an agent is on its way, the first at its start: 1 if nothing moves.
    #[must_use]
    pub fn frame_count(&self, sensor: &Sensor) -> u64 {
        // A hair's breadth keeps the last frame in, if the way ends on it but for rounding.
        let last = (self.duration().as_secs_f64() * sensor.sampling_hz + 1e-6).floor();
        u64::try_from(crate::geometry::count::floor(last))
            .map_or(u64::MAX, |last| last.saturating_add(1))
    }
}
