//! Simulates the frames of one sensor, and their ground truth.

use crate::geometry::{Enclosure, Mesh};
use crate::model::{Agent, Body, Model, Print, Scene, SceneError, Sensor};
use crate::picture::{
    Area, Filled, Form, Grid, Image, Lines, Mask, NOBODY, Physical, SeenFace, Subject,
};
use crate::radiometry::Air;
use crate::sensor::{add_noise, measure, quantize, spilled};
use glam::DVec3;
use std::time::Duration;

/// One sensor of a scene, ready to make frames at any time; still bodies are drawn only once.
#[derive(Debug, Clone)]
pub struct Simulator {
    sensor: Sensor,
    ambient_c: f64,
    renderer: Renderer,
    agents: Vec<Agent>,
    objects: Objects,
}

#[derive(Debug, Clone)]
enum Renderer {
    Area(Box<Area>),
    Grid(Box<Grid>),
    Physical(Box<Physical>),
}

#[derive(Debug, Clone)]
struct Objects {
    /// All objects if any warms up, cools down or has a print; otherwise empty.
    all: Vec<Body>,
    prints: Vec<Print>,
}

impl Objects {
    fn new(scene: &Scene) -> Self {
        let changes = !scene.prints.is_empty() || scene.objects.iter().any(is_changing);
        Self {
            all: if changes {
                scene.objects.clone()
            } else {
                Vec::new()
            },
            prints: scene.prints.clone(),
        }
    }
}

fn is_changing(object: &Body) -> bool {
    object.thermal.transient.is_some()
}

impl Simulator {
    /// A simulator for the sensor with this name, using the scene's model.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn new(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        Self::with_lines(scene, sensor_name, Lines::Fine)
    }

    /// The same for many frames: the physical model has a third fewer lines, and pixels that differ by thousandths of a
    /// degree.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn coarse(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        Self::with_lines(scene, sensor_name, Lines::Coarse)
    }

    fn with_lines(scene: &Scene, sensor_name: &str, lines: Lines) -> Result<Self, SceneError> {
        let sensor = scene.sensor(sensor_name)?.clone();
        let ambient_c = scene.room.ambient_c;
        let air = Air::new(scene.law, ambient_c, sensor.operating_distance_m);
        let still = scene.standing().filter(|object| !is_changing(object));
        let still = still.map(|object| {
            let faces = SeenFace::all(&sensor.pose, &object.mesh, DVec3::ZERO);
            Subject::new((object, NOBODY), Form::Flat(faces), (ambient_c, 0.0))
        });
        let still: Vec<Subject<'_>> = still.collect();
        let renderer = match scene.model {
            Model::Paper => Renderer::Area(Box::new(Area::new(air, &sensor, &still))),
            Model::PaperGrid => Renderer::Grid(Box::new(Grid::new(air, &sensor, &still))),
            Model::Physical => {
                Renderer::Physical(Box::new(Physical::new((scene, &sensor), &still, lines)))
            }
        };
        Ok(Self {
            sensor,
            ambient_c,
            renderer,
            agents: scene.agents.clone(),
            objects: Objects::new(scene),
        })
    }

    /// Switches to a scene that [differs only in its agents](Scene::has_the_room_of).
    pub fn set_agents(&mut self, scene: &Scene) {
        self.agents.clone_from(&scene.agents);
        self.objects = Objects::new(scene);
    }

    /// Replaces the agents and returns the old ones.
    pub fn replace_agents(&mut self, agents: Vec<Agent>) -> Vec<Agent> {
        std::mem::replace(&mut self.agents, agents)
    }

    /// The simulated sensor.
    #[must_use]
    pub const fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// The temperature of the room, °C.
    #[must_use]
    pub const fn ambient_c(&self) -> f64 {
        self.ambient_c
    }

    /// What the sensor would report at `time` without noise.
    #[must_use]
    pub fn image(&self, time: Duration) -> Image {
        self.detected(self.received(time))
    }

    pub(crate) fn received(&self, time: Duration) -> Image {
        self.drawn(time, &self.agents, 0).0
    }

    /// The image at `time` if no agent were in the room.
    #[must_use]
    pub fn without_agents(&self, time: Duration) -> Image {
        self.detected(self.drawn(time, &[], 0).0)
    }

    /// What the sensor receives with these agents, and what each of the first so many fills of it.
    fn drawn(&self, time: Duration, present: &[Agent], agents: usize) -> (Image, Vec<Filled>) {
        self.render(&self.moving(time, present), agents)
    }

    fn render(&self, moving: &[Subject<'_>], agents: usize) -> (Image, Vec<Filled>) {
        let (celsius, shares) = match &self.renderer {
            Renderer::Area(area) => area.image(moving, agents),
            Renderer::Grid(grid) => grid.image(moving, agents),
            Renderer::Physical(physical) => physical.image(moving, agents),
        };
        let image = Image {
            columns: self.sensor.columns,
            rows: self.sensor.rows,
            celsius: spilled(celsius, &self.sensor),
        };
        let filled = shares.into_iter().map(|[seen, unhidden]| Filled {
            seen: self.mask(seen),
            unhidden: self.mask(unhidden),
        });
        (image, filled.collect())
    }

    /// What the sensor reports at `time`: the image with a draw of N(0, [`Sensor::noise_sigma`]) added to each pixel,
    /// or with its [`Profile`](crate::profile::Profile) applied, then rounded to multiples of [`Sensor::step_c`].
    ///
    /// The noise depends only on seed, sensor name and time. A profile's ticks are tenths of a second from the scene's
    /// start; a frame of a slower sensor is the mean of up to ten ticks starting with its own.
    #[must_use]
    pub fn noisy(&self, time: Duration, seed: u64) -> Image {
        self.with_noise(self.received(time), time, seed)
    }

    pub(crate) fn detected(&self, mut image: Image) -> Image {
        for celsius in &mut image.celsius {
            *celsius = self.sensor.detected(*celsius);
        }
        image
    }

    /// [`Self::image`], [`Self::noisy`], and what each agent fills, in the order of [`Scene::agents`]; in the physical
    /// model for little more than the cost of one.
    #[must_use]
    pub fn labeled(&self, time: Duration, seed: u64) -> (Image, Image, Vec<Filled>) {
        let (received, filled) = self.drawn(time, &self.agents, self.agents.len());
        let noisy = self.with_noise(received.clone(), time, seed);
        (self.detected(received), noisy, filled)
    }

    /// What stays in the frames of this seed's unit in the `empty` room: the image with the unit's pattern, rounded to
    /// multiples of [`Sensor::step_c`] as the median of many frames is.
    #[must_use]
    pub fn background(&self, empty: &Image, seed: u64) -> Image {
        let mut image = empty.clone();
        if let Some(profile) = &self.sensor.profile {
            let pattern_c = profile.fixed_pattern.of_unit(seed);
            for (celsius, offset_c) in image.celsius.iter_mut().zip(pattern_c) {
                *celsius += offset_c;
            }
        }
        quantize(&mut image.celsius, self.sensor.step_c);
        self.detected(image)
    }

    pub(crate) fn with_noise(&self, mut image: Image, time: Duration, seed: u64) -> Image {
        let sensor = &self.sensor;
        match &sensor.profile {
            Some(profile) => measure(profile, sensor, &mut image, (time, seed)),
            None => add_noise(&mut image.celsius, sensor, (time, seed)),
        }
        quantize(&mut image.celsius, sensor.step_c);
        self.detected(image)
    }

    /// The share of each pixel that shows any agent at `time`.
    #[must_use]
    pub fn truth(&self, time: Duration) -> Mask {
        let mut moving = self.moving(time, &self.agents);
        // All agents as one.
        for subject in &mut moving {
            subject.owner = if subject.owner == NOBODY { NOBODY } else { 0 };
        }
        self.render(&moving, 1).1.remove(0).seen
    }

    fn mask(&self, mut share: Vec<f64>) -> Mask {
        // A whole pixel's weights sum to 1 except for rounding.
        for share in &mut share {
            *share = share.clamp(0.0, 1.0);
        }
        Mask {
            columns: self.sensor.columns,
            rows: self.sensor.rows,
            share,
        }
    }

    /// Everything that changes: each part of each of these agents, changing objects, and prints on objects.
    fn moving<'a>(&'a self, time: Duration, agents: &'a [Agent]) -> Vec<Subject<'a>> {
        let at = (self.ambient_c, time.as_secs_f64());
        let flat = |mesh: &Mesh, moved_m: DVec3| {
            let faces = SeenFace::all(&self.sensor.pose, mesh, moved_m);
            match mesh.enclosure() {
                Enclosure::Convex => Form::Convex(faces),
                _ => Form::Flat(faces),
            }
        };
        let mut moving = Vec::new();
        for object in self.objects.all.iter().filter(|object| is_changing(object)) {
            let form = flat(&object.mesh, DVec3::ZERO);
            moving.push(Subject::new((object, NOBODY), form, at));
        }
        for print in &self.objects.prints {
            let surface = print.surface(&self.objects.all, at.0, at.1);
            moving.extend(surface.map(|surface| Subject {
                form: flat(&print.sheet, DVec3::ZERO),
                surface,
                offsets_c: &[],
                owner: NOBODY,
            }));
        }
        let agents = agents.iter().enumerate();
        for (index, agent) in agents.filter(|(_, agent)| agent.is_here(time)) {
            let owner = u32::try_from(index).unwrap_or(NOBODY);
            let segments = agent.segments_at(time);
            let mut segments = segments.into_iter().flatten();
            let moved_m = agent.position_m(time) - agent.start_m;
            let turn = agent.turn(time);
            for part in &agent.parts {
                let form = match (segments.next(), turn) {
                    (Some(segment), _) => Form::Round(segment),
                    (None, None) => flat(&part.mesh, moved_m),
                    (None, Some(turn)) => flat(&agent.turned(&part.mesh, turn), moved_m),
                };
                moving.push(Subject::new((part, owner), form, at));
            }
        }
        moving
    }
}
