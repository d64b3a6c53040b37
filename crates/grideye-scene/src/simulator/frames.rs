//! Frames of one sensor, and what is true of them.

use crate::model::body::{Agent, Body};
use crate::model::error::SceneError;
use crate::model::print::Print;
use crate::model::scene::{Model, Scene};
use crate::model::sensor::Sensor;
use crate::picture::area::{Facet, ImagePlane, StaticFacets};
use crate::picture::grid::{Accumulator, Backdrop, NOBODY, ShadedPatch};
use crate::picture::image::{Image, Mask};
use crate::picture::physical::{Physical, Shown};
use crate::picture::projection::{SamplingGrid, Sight};
use crate::picture::resample::Resampler;
use crate::radiometry::perceived::{Air, Glow, Surface};
use glam::DVec3;
use std::time::Duration;

/// One sensor of a scene, ready to be asked for frames at any time, in any order, from any thread.
///
/// What stands still is cast once, when the simulator is made; a frame then costs the cells that the agents cover.
#[derive(Debug, Clone)]
pub struct Simulator {
    pub(super) sensor: Sensor,
    pub(super) ambient_c: f64,
    pub(super) air: Air,
    pub(super) method: Method,
    /// The pixels with nothing but what stands still.
    pub(super) still_c: Vec<f64>,
    pub(super) agents: Vec<Agent>,
    pub(super) objects: Objects,
}

/// The objects, as far as something of them changes in time.
#[derive(Debug, Clone)]
pub(super) struct Objects {
    /// All of them, if any warms up, cools down or has a print.
    all: Vec<Body>,
    prints: Vec<Print>,
}

impl Objects {
    pub(super) fn new(scene: &Scene) -> Self {
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

/// What a surface is made of: of one temperature, or of one for each face.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodySurface<'a> {
    pub(super) surface: Surface,
    pub(super) offsets_c: &'a [f64],
    pub(super) owner: u32,
}

impl<'a> BodySurface<'a> {
    fn of(body: &'a Body, ambient_c: f64, time_s: f64, owner: u32) -> Self {
        Self {
            surface: Surface {
                celsius: body.celsius(ambient_c, time_s),
                ..body.surface
            },
            offsets_c: &body.thermal.offsets_c,
            owner,
        }
    }

    /// What one face glows like.
    fn glow(&self, air: &Air, face: usize) -> Glow {
        air.glow(self.of_face(face))
    }

    /// What one face is made of.
    fn of_face(&self, face: usize) -> Surface {
        let offset_c = self.offsets_c.get(face).copied().unwrap_or(0.0);
        Surface {
            celsius: self.surface.celsius + offset_c,
            ..self.surface
        }
    }
}

/// How a frame is made, and what stands still in it.
#[derive(Debug, Clone)]
pub(super) enum Method {
    Grid(Box<Grid>),
    Area {
        plane: ImagePlane,
        still: StaticFacets,
    },
    Physical(Box<Physical>),
}

#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) view: SamplingGrid,
    pub(super) resampler: Resampler,
    pub(super) backdrop: Backdrop,
}

impl Simulator {
    /// A simulator for the sensor of that name, by the scene's model.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn new(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        let sensor = scene.sensor(sensor_name)?.clone();
        if scene.model == Model::Physical {
            return Ok(Self::physical(scene, sensor));
        }
        let ambient_c = scene.room.ambient_c;
        let air = Air::new(scene.law, ambient_c, sensor.operating_distance_m);
        let view = SamplingGrid::new(&sensor);
        let resampler =
            Resampler::new((view.columns(), view.rows()), (sensor.columns, sensor.rows));
        let standing: Vec<ShadedPatch> = scene
            .standing()
            .filter(|object| !is_changing(object))
            .flat_map(|object| {
                let sight = Sight::new(&sensor.pose, &object.mesh, DVec3::ZERO);
                shaded(
                    &view,
                    &air,
                    &BodySurface::of(object, ambient_c, 0.0, NOBODY),
                    &sight,
                )
            })
            .collect();
        let backdrop = Backdrop::new(&view, &air, &standing);
        let still_c = backdrop
            .pixels_c(&resampler)
            .iter()
            .map(|excess| ambient_c + excess)
            .collect();
        Ok(Self {
            sensor,
            ambient_c,
            air,
            method: Method::Grid(Box::new(Grid {
                view,
                resampler,
                backdrop,
            })),
            still_c,
            agents: scene.agents.clone(),
            objects: Objects::new(scene),
        })
    }

    /// The same without a sampling grid: each pixel is the integral of what is seen, weighted by its response, which
    /// is what the grid tends to as it gets finer. It needs neither the memory nor the aliasing of a grid. The physical
    /// model has no grid, and is the same either way.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn without_grid(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        let sensor = scene.sensor(sensor_name)?.clone();
        if scene.model == Model::Physical {
            return Ok(Self::physical(scene, sensor));
        }
        let ambient_c = scene.room.ambient_c;
        let air = Air::new(scene.law, ambient_c, sensor.operating_distance_m);
        let plane = ImagePlane::new(&sensor);
        let standing = scene
            .standing()
            .filter(|object| !is_changing(object))
            .flat_map(|object| {
                let sight = Sight::new(&sensor.pose, &object.mesh, DVec3::ZERO);
                facets(
                    &plane,
                    &air,
                    &BodySurface::of(object, ambient_c, 0.0, NOBODY),
                    &sight,
                )
            })
            .collect();
        let still = StaticFacets::new(standing);
        let mut still_c = vec![ambient_c; sensor.columns * sensor.rows];
        still.add(&plane, &air, &mut still_c);
        Ok(Self {
            sensor,
            ambient_c,
            air,
            method: Method::Area { plane, still },
            still_c,
            agents: scene.agents.clone(),
            objects: Objects::new(scene),
        })
    }

    /// Puts others in the place of the agents, and hands those back.
    pub fn replace_agents(&mut self, agents: Vec<Agent>) -> Vec<Agent> {
        std::mem::replace(&mut self.agents, agents)
    }

    fn physical(scene: &Scene, sensor: Sensor) -> Self {
        let ambient_c = scene.room.ambient_c;
        let standing = |physical: &Physical| {
            let objects = scene.standing().filter(|object| !is_changing(object));
            let shown = objects.map(|object| {
                let sight = Sight::new(&sensor.pose, &object.mesh, DVec3::ZERO);
                shown(
                    physical,
                    &BodySurface::of(object, ambient_c, 0.0, NOBODY),
                    &sight,
                )
            });
            shown.collect()
        };
        let physical = Physical::new(scene, &sensor, standing);
        Self {
            air: Air::new(scene.law, ambient_c, sensor.operating_distance_m),
            still_c: physical.celsius(&[]),
            method: Method::Physical(Box::new(physical)),
            ambient_c,
            agents: scene.agents.clone(),
            objects: Objects::new(scene),
            sensor,
        }
    }

    /// The sensor that is simulated.
    #[must_use]
    pub const fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// The temperature of the room, °C.
    #[must_use]
    pub const fn ambient_c(&self) -> f64 {
        self.ambient_c
    }

    /// What the sensor would report at `time` if it had no noise.
    #[must_use]
    pub fn image(&self, time: Duration) -> Image {
        self.detected(self.received(time))
    }

    /// The image before the sensor's range is taken into account.
    pub(super) fn received(&self, time: Duration) -> Image {
        let mut celsius = self.still_c.clone();
        match &self.method {
            Method::Grid(grid) => {
                let patches = self.changing_by(time, |skin, sight| {
                    shaded(&grid.view, &self.air, skin, sight)
                });
                grid.accumulator(&self.air)
                    .add_excess(&patches, &mut celsius);
            }
            Method::Area { plane, still } => {
                let moving =
                    self.changing_by(time, |skin, sight| facets(plane, &self.air, skin, sight));
                still.add_change(plane, &self.air, &moving, &mut celsius);
            }
            Method::Physical(physical) => {
                celsius = physical.celsius(&self.shown(physical, time));
            }
        }
        Image {
            columns: self.sensor.columns,
            rows: self.sensor.rows,
            celsius,
        }
    }

    /// What the sensor reports at `time`: the image and one draw of N(0, [`Sensor::noise_sigma`]) on each pixel; or
    /// what its [`Profile`](crate::profile::Profile) makes of it, if it has one. Then the nearest multiple of
    /// [`Sensor::step_c`].
    ///
    /// A profile's unit is that of the seed, its ticks are tenths of a second from the scene's beginning, and a
    /// frame of a slower sensor is the mean of as many ticks as it takes, up to ten, from its own on.
    ///
    /// The noise depends on the seed, the sensor's name and the time, and on nothing else; frames of other times or
    /// other sensors are independent of it. It is drawn by ChaCha with 12 rounds: bytes 0 to 7 of the key are the
    /// seed, 8 to 15 the FNV-1a hash of the name, 16 to 23 the high half of the time in nanoseconds, 24 to 31 the
    /// tag `grideye1`; the low half of the time is the stream; numbers are little-endian.
    #[must_use]
    pub fn noisy(&self, time: Duration, seed: u64) -> Image {
        self.with_noise(self.received(time), time, seed)
    }

    pub(super) fn detected(&self, mut image: Image) -> Image {
        for celsius in &mut image.celsius {
            *celsius = self.sensor.detected(*celsius);
        }
        image
    }

    /// How much of each pixel is an agent at `time`, whichever.
    #[must_use]
    pub fn truth(&self, time: Duration) -> Mask {
        self.mask(time, |owner| owner != NOBODY)
    }

    /// How much of each pixel is the agent with this place in [`Scene::agents`] at `time`; nothing if there is none.
    #[must_use]
    pub fn truth_of(&self, agent: usize, time: Duration) -> Mask {
        self.mask(time, |owner| owner == number(agent))
    }

    fn mask(&self, time: Duration, counts: impl Fn(u32) -> bool) -> Mask {
        let mut share = vec![0.0; self.still_c.len()];
        match &self.method {
            Method::Grid(grid) => {
                let patches = self.changing_by(time, |skin, sight| {
                    shaded(&grid.view, &self.air, skin, sight)
                });
                grid.accumulator(&self.air)
                    .add_share(&patches, counts, &mut share);
            }
            Method::Area { plane, still } => {
                let moving =
                    self.changing_by(time, |skin, sight| facets(plane, &self.air, skin, sight));
                still.add_share(plane, &moving, counts, &mut share);
            }
            Method::Physical(physical) => {
                share = physical.share(&self.shown(physical, time), counts);
            }
        }
        self.mask_of(share)
    }

    pub(super) fn mask_of(&self, mut share: Vec<f64>) -> Mask {
        // The weights of a whole pixel sum to 1 but for rounding.
        share
            .iter_mut()
            .for_each(|share| *share = share.clamp(0.0, 1.0));
        Mask {
            columns: self.sensor.columns,
            rows: self.sensor.rows,
            share,
        }
    }

    /// All that is not as it is in the backdrop at `time`, for the physical model.
    fn shown(&self, physical: &Physical, time: Duration) -> Vec<Shown> {
        self.changing_by(time, |skin, sight| vec![shown(physical, skin, sight)])
    }

    /// What `build` makes of all that is not as it is in the backdrop at `time`: each part of each agent where it is,
    /// objects that change, and prints on objects.
    pub(super) fn changing_by<T>(
        &self,
        time: Duration,
        build: impl Fn(&BodySurface<'_>, &Sight) -> Vec<T>,
    ) -> Vec<T> {
        let (ambient_c, time_s) = (self.ambient_c, time.as_secs_f64());
        let mut built = Vec::new();
        for object in self.objects.all.iter().filter(|object| is_changing(object)) {
            let sight = Sight::new(&self.sensor.pose, &object.mesh, DVec3::ZERO);
            built.extend(build(
                &BodySurface::of(object, ambient_c, time_s, NOBODY),
                &sight,
            ));
        }
        for print in &self.objects.prints {
            if let Some(surface) = print.surface(&self.objects.all, ambient_c, time_s) {
                let sight = Sight::new(&self.sensor.pose, print.sheet(), DVec3::ZERO);
                let skin = BodySurface {
                    surface,
                    offsets_c: &[],
                    owner: NOBODY,
                };
                built.extend(build(&skin, &sight));
            }
        }
        for (index, agent) in self.agents.iter().enumerate() {
            let moved_m = agent.position_m(time) - agent.start_m;
            let turn = agent.turn(time);
            for part in &agent.parts {
                let sight = match turn {
                    None => Sight::new(&self.sensor.pose, &part.mesh, moved_m),
                    Some(turn) => {
                        Sight::new(&self.sensor.pose, &agent.turned(&part.mesh, turn), moved_m)
                    }
                };
                let skin = BodySurface::of(part, ambient_c, time_s, number(index));
                built.extend(build(&skin, &sight));
            }
        }
        built
    }
}

impl Grid {
    fn accumulator<'a>(&'a self, air: &'a Air) -> Accumulator<'a> {
        Accumulator::new(&self.view, air, &self.backdrop, &self.resampler)
    }
}

/// The number that cells know an agent by.
pub(super) fn number(agent: usize) -> u32 {
    u32::try_from(agent).unwrap_or(NOBODY)
}

/// The faces of a body that are seen, for the sampling grid.
pub(super) fn shaded(
    view: &SamplingGrid,
    air: &Air,
    skin: &BodySurface<'_>,
    sight: &Sight,
) -> Vec<ShadedPatch> {
    let whole = air.glow(skin.surface);
    let patches = view.patches(sight).into_iter();
    patches
        .map(|patch| {
            let glow = if skin.offsets_c.is_empty() {
                whole
            } else {
                skin.glow(air, patch.face())
            };
            ShadedPatch {
                root: air.root(&glow, patch.distances_m()),
                patch,
                glow,
                owner: skin.owner,
            }
        })
        .collect()
}

/// What the physical model is to show of a body.
pub(super) fn shown(physical: &Physical, skin: &BodySurface<'_>, sight: &Sight) -> Shown {
    physical.shown(sight, skin.owner, |face| {
        face.map_or(skin.surface, |face| skin.of_face(face))
    })
}

/// The faces of a body that are seen, in the picture plane.
pub(super) fn facets(
    plane: &ImagePlane,
    air: &Air,
    skin: &BodySurface<'_>,
    sight: &Sight,
) -> Vec<Facet> {
    match sight {
        Sight::Inside(touching) => plane
            .facet_all_around(touching, (air, air.glow(skin.surface), skin.owner))
            .into_iter()
            .collect(),
        Sight::Outside(faces) => faces
            .iter()
            .filter_map(|face| {
                let made_of = (air, skin.glow(air, face.face), skin.owner);
                plane.facet(face.corners.iter().copied(), face.inverse_depth, made_of)
            })
            .collect(),
    }
}
