use crate::check;
use crate::error::{SceneError, Warning};
use crate::files::Files;
use crate::fit::Fit;
use crate::perceived::{Law, Surface};
use crate::physical::{Band, Optics};
use crate::pose::Pose;
use crate::profile::Profile;
use crate::residual::Print;
use crate::room::Room;
use crate::solid::Solid;
use crate::trajectory::Trajectory;
use crate::warmth::Warmth;
use glam::{DMat3, DVec2, DVec3, USizeVec2};
use grideye_frame::Celsius;
use std::time::Duration;

/// What a scene may have at most: each bound has a test that reaches it.
pub mod limits {
    /// Bytes of a scene file, or of a trajectory.
    pub const TEXT_BYTES_MAX: usize = 16 * 1024 * 1024;
    /// Characters of a name.
    pub const NAME_CHARACTERS_MAX: usize = 100;
    /// Objects of a scene; the paper's largest has 1,056.
    pub const OBJECTS_MAX: usize = 10_000;
    /// Sensors of a scene.
    pub const SENSORS_MAX: usize = 1_000;
    /// Moving agents of a scene.
    pub const AGENTS_MAX: usize = 100;
    /// Parts of an agent.
    pub const PARTS_MAX: usize = 100;
    /// Vertices, and faces, of one polyhedron.
    pub const VERTICES_MAX: usize = 100_000;
    /// Contacts that are told of.
    pub const CONTACTS_MAX: usize = 100;
    /// Cells of a texture, after cells that are interpolated were divided.
    pub const TEXTURE_CELLS_MAX: usize = 10_000;
    /// Warm prints on objects: one for each part, each stop and each face.
    pub const PRINTS_MAX: usize = 10_000;
    /// Corners of a room's floor plan, and faces of a room given as a mesh.
    pub const ROOM_CORNERS_MAX: usize = 1_000;
    /// Way-points of a trajectory.
    pub const WAY_POINTS_MAX: usize = 100_000;
    /// Points of a sensor's sampling grid on one axis: field of view times points a degree.
    pub const GRID_POINTS_MAX: usize = 2_048;
    /// Pixels of a sensor on one axis.
    pub const PIXELS_PER_AXIS_MAX: usize = 1_024;
    /// Days that an agent may be on its way.
    pub const WALK_DAYS_MAX: u64 = 366;
}

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
    /// What of the room hides something: walls that jut into it.
    pub(crate) screen: Option<Body>,
    pub(crate) objects: Vec<Body>,
    pub(crate) agents: Vec<Agent>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) model: Model,
    pub(crate) law: Law,
    /// What the physical model takes in of the light, and what temperature is reflected, °C.
    pub(crate) band: Band,
    pub(crate) reflected_c: f64,
    /// The time that the scene is to take at least.
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

/// A thing, standing or at the start of its way; of one temperature, if its keys say nothing else.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Its name in the file.
    pub name: String,
    /// Its place in the room: what the file calls its position, metres.
    pub base_m: DVec3,
    /// Its surface, where it stands.
    pub solid: Solid,
    /// Its temperature at the start and on the whole, and its emissivity.
    pub surface: Surface,
    /// How its temperature is spread over its faces, and how it changes.
    pub(crate) warmth: Warmth,
    /// Its colour in drawings of the room: red, green, blue.
    pub color: Option<[u8; 3]>,
}

/// Somebody who may move: one or several bodies that keep their places to one another.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Agent {
    /// Its name in the file.
    pub name: String,
    /// Its bodies, where they are at the start of its way; one at least.
    pub parts: Vec<Body>,
    /// Where it starts, metres.
    pub start_m: DVec3,
    /// Its way, or `None` if it stands still.
    pub trajectory: Option<Trajectory>,
    /// How it is turned on its way to each way-point; `None` if it does not turn.
    pub(crate) turns: Option<Vec<DMat3>>,
    /// The objects and agents that it may touch without running into them.
    pub(crate) touches: Vec<String>,
}

/// A sensor: what it is and how it is mounted.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sensor {
    /// Its name in the file.
    pub name: String,
    /// Pixels in a row.
    pub columns: usize,
    /// Pixels in a column.
    pub rows: usize,
    /// Full angle of view on each axis, radians, below π.
    pub field_of_view_rad: DVec2,
    /// Points of the sampling grid on each axis: field of view times points a degree, at least 1.
    pub grid_points: USizeVec2,
    /// Standard deviation of the noise of one pixel in one frame, °C.
    pub noise_sigma: f64,
    /// Frames a second.
    pub sampling_hz: f64,
    /// Distance up to which the sensor is meant to work, metres; the law's linear branch needs it.
    pub operating_distance_m: f64,
    /// The lowest and the highest temperature that it reports, °C; `None` if there is no limit.
    pub detectable_range_c: Option<(f64, f64)>,
    /// Where it is and which way it looks.
    pub pose: Pose,
    /// Where the directions of its pixels come from, in the physical model.
    pub optics: Optics,
    /// Full width at half response of every pixel on each axis, radians, if it is not what the optics have; in the
    /// physical model.
    pub pixel_width_rad: Option<DVec2>,
    /// Full width at half height of its point spread on each axis, radians, 0 for a sharp one; in the physical model.
    pub blur_rad: DVec2,
    /// Which specimen it is, if it is one: what [`Simulator::noisy`](crate::Simulator::noisy) then adds.
    pub profile: Option<Profile>,
    /// Noisy temperatures are multiples of this, °C; 0 for any.
    pub step_c: f64,
}

impl Scene {
    /// Reads a scene; `origin` is the file's name in messages, `files` hands over the trajectories it names.
    ///
    /// # Errors
    /// What makes the scene unfit to be simulated, with its place and a hint.
    pub fn parse(text: &str, origin: &str, files: &dyn Files) -> Result<Loaded, SceneError> {
        check::parse(None, text, origin, files)
    }

    /// The same, made by the given model whatever the file says; `None` leaves it to the file.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_as(
        model: Option<Model>,
        text: &str,
        origin: &str,
        files: &dyn Files,
    ) -> Result<Loaded, SceneError> {
        check::parse(model, text, origin, files)
    }

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
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "single precision is what the vocabulary has, 2 µK at 20 °C"
    )]
    pub const fn ambient(&self) -> Celsius {
        Celsius::new(self.room.ambient_c as f32)
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
        self.sensors
            .iter()
            .find(|sensor| sensor.name == name)
            .ok_or_else(|| SceneError::UnknownSensor {
                name: name.to_owned(),
                known: self
                    .sensors
                    .iter()
                    .map(|sensor| sensor.name.clone())
                    .collect(),
            })
    }

    /// The reading of the paper's formula that the scene asks for.
    #[must_use]
    pub const fn law(&self) -> Law {
        self.law
    }

    /// Whether another scene has the same room, objects, sensors and law: whether they differ in nothing but their
    /// agents, and in the time they take.
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

    /// The time that the agents take for their ways, or the one that the file gives if that is longer: zero if nothing
    /// moves or changes.
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

    /// How many frames the sensor takes while an agent is on its way, the first at its start: 1 if nothing moves.
    #[must_use]
    pub fn frame_count(&self, sensor: &Sensor) -> u64 {
        // A hair's breadth keeps the last frame in, if the way ends on it but for rounding.
        let last = (self.duration().as_secs_f64() * sensor.sampling_hz + 1e-6).floor();
        u64::try_from(crate::count::floor(last)).map_or(u64::MAX, |last| last.saturating_add(1))
    }
}

impl Body {
    /// Its temperature on the whole after `time_s`.
    pub(crate) fn celsius(&self, ambient_c: f64, time_s: f64) -> f64 {
        match &self.warmth.heat {
            None => self.surface.celsius,
            Some(heat) => heat.celsius(self.surface.celsius, ambient_c, time_s),
        }
    }
}

impl Agent {
    /// Where the agent is at `time`: the middle of its underside, metres.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        self.trajectory
            .as_ref()
            .map_or(self.start_m, |trajectory| trajectory.position_m(time))
    }

    /// How it is turned about the vertical at `time`, from how its parts are given: with its way, if the file says so.
    #[must_use]
    pub fn turn(&self, time: Duration) -> Option<DMat3> {
        let turns = self.turns.as_ref()?;
        let heads_for = self.trajectory.as_ref()?.heads_for(time.as_secs_f64());
        turns.get(heads_for).copied()
    }

    /// Its bodies where they are at `time`.
    #[must_use]
    pub fn bodies_at(&self, time: Duration) -> Vec<Body> {
        let turn = self.turn(time).unwrap_or(DMat3::IDENTITY);
        let at_m = self.position_m(time);
        let parts = self.parts.iter().map(|part| Body {
            base_m: at_m + turn * (part.base_m - self.start_m),
            solid: self.standing(&part.solid, time.as_secs_f64()),
            ..part.clone()
        });
        parts.collect()
    }

    /// One of its parts where it is after `time_s`.
    pub(crate) fn standing(&self, part: &Solid, time_s: f64) -> Solid {
        let time = Duration::try_from_secs_f64(time_s).unwrap_or(Duration::MAX);
        let turned = self.turned(part, self.turn(time).unwrap_or(DMat3::IDENTITY));
        turned.placed(DMat3::IDENTITY, self.position_m(time) - self.start_m)
    }

    /// One of its parts, turned about the vertical through its start.
    pub(crate) fn turned(&self, part: &Solid, turn: DMat3) -> Solid {
        part.clone()
            .placed(turn, self.start_m - turn * self.start_m)
    }

    /// The time it takes for its way: zero if it stands still.
    #[must_use]
    pub fn duration(&self) -> Duration {
        self.trajectory
            .as_ref()
            .map_or(Duration::ZERO, Trajectory::duration)
    }
}

impl Sensor {
    /// What it reports of a temperature: the nearest that it can.
    #[must_use]
    pub fn detected(&self, celsius: f64) -> f64 {
        self.detectable_range_c
            .map_or(celsius, |(low, high)| celsius.max(low).min(high))
    }

    /// The moment of frame `index`, the first being 0: `index / sampling_hz`, to the nearest nanosecond.
    #[must_use]
    pub fn frame_time(&self, index: u32) -> Duration {
        Duration::try_from_secs_f64(f64::from(index) / self.sampling_hz).unwrap_or(Duration::MAX)
    }
}
