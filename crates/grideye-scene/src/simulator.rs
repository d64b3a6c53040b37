//! Simulates the frames of one sensor, and their ground truth.

use crate::geometry::{Ellipsoid, Mesh, Pose};
use crate::model::{Agent, Body, Model, Print, Scene, SceneError, Sensor};
use crate::picture::{
    Accumulator, Backdrop, Facet, Filled, Image, ImagePlane, Mask, NOBODY, Physical, Resampler,
    SamplingGrid, ShadedPatch, Shown, Sight, StaticFacets,
};
use crate::radiometry::{Air, Glow, Surface};
use crate::sensor::{add_noise, measure, quantize};
use glam::DVec3;
use std::borrow::Cow;
use std::time::Duration;

/// One sensor of a scene, ready to make frames at any time; still bodies are projected only once.
#[derive(Debug, Clone)]
pub struct Simulator {
    sensor: Sensor,
    ambient_c: f64,
    air: Air,
    method: Method,
    /// The pixels with still bodies only.
    still_c: Vec<f64>,
    agents: Vec<Agent>,
    objects: Objects,
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

#[derive(Debug, Clone, Copy)]
struct BodySurface<'a> {
    surface: Surface,
    offsets_c: &'a [f64],
    owner: u32,
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

    fn glow(&self, air: &Air, face: usize) -> Glow {
        air.glow(self.of_face(face))
    }

    fn of_face(&self, face: usize) -> Surface {
        let offset_c = self.offsets_c.get(face).copied().unwrap_or(0.0);
        Surface {
            celsius: self.surface.celsius + offset_c,
            ..self.surface
        }
    }
}

#[derive(Debug, Clone)]
enum Method {
    Grid(Box<Grid>),
    Area {
        plane: ImagePlane,
        still: StaticFacets,
        relief: Relief,
    },
    Physical(Box<Physical>),
}

/// How round parts of people are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relief {
    Faces,
    Outline,
}

#[derive(Debug, Clone)]
struct Grid {
    view: SamplingGrid,
    resampler: Resampler,
    backdrop: Backdrop,
}

impl Simulator {
    /// A simulator for the sensor with this name, using the scene's model.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn new(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        Self::of(scene, sensor_name, None)
    }

    /// As [`Self::new`], but without a sampling grid: pixels are integrals, the limit of ever finer grids. The physical
    /// model never has a grid.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn without_grid(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        Self::of(scene, sensor_name, Some(Relief::Faces))
    }

    /// As [`Self::without_grid`], a dozen times as fast for a person made of segments: each is drawn as its outline in one
    /// plane. What a person adds is off by 1 to 3 % (root mean square). The physical model always draws outlines.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn of_outlines(scene: &Scene, sensor_name: &str) -> Result<Self, SceneError> {
        Self::of(scene, sensor_name, Some(Relief::Outline))
    }

    fn of(scene: &Scene, sensor_name: &str, gridless: Option<Relief>) -> Result<Self, SceneError> {
        let sensor = scene.sensor(sensor_name)?.clone();
        let ambient_c = scene.room.ambient_c;
        let air = Air::new(scene.law, ambient_c, sensor.operating_distance_m);
        let (method, still_c) = if scene.model == Model::Physical {
            let physical = Physical::new(scene, &sensor, |physical| {
                standing(scene, &sensor, |skin, sight| {
                    vec![shown(physical, skin, sight)]
                })
            });
            let still_c = physical.image(&[], 0).0;
            (Method::Physical(Box::new(physical)), still_c)
        } else if let Some(relief) = gridless {
            let plane = ImagePlane::new(&sensor);
            let still = standing(scene, &sensor, |skin, sight| {
                facets(&plane, &air, skin, sight)
            });
            let still = StaticFacets::new(still);
            let mut still_c = vec![ambient_c; sensor.columns * sensor.rows];
            still.add(&plane, &air, &mut still_c);
            let method = Method::Area {
                plane,
                still,
                relief,
            };
            (method, still_c)
        } else {
            let view = SamplingGrid::new(&sensor);
            let points = (view.columns(), view.rows());
            let resampler = Resampler::new(points, (sensor.columns, sensor.rows));
            let still = standing(scene, &sensor, |skin, sight| {
                shaded(&view, &air, skin, sight)
            });
            let backdrop = Backdrop::new(&view, &air, &still);
            let excess_c = backdrop.pixels_c(&resampler).into_iter();
            let still_c = excess_c.map(|excess| ambient_c + excess).collect();
            let grid = Grid {
                view,
                resampler,
                backdrop,
            };
            (Method::Grid(Box::new(grid)), still_c)
        };
        Ok(Self {
            sensor,
            ambient_c,
            air,
            method,
            still_c,
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

    /// Approximate memory of the sampling grid, bytes; 0 without one.
    #[must_use]
    pub fn grid_bytes(&self) -> usize {
        match &self.method {
            Method::Grid(_) => 2 * size_of::<f64>() * self.sensor.grid_points.element_product(),
            Method::Area { .. } | Method::Physical(_) => 0,
        }
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

    fn received(&self, time: Duration) -> Image {
        self.drawn(time, &self.agents, 0).0
    }

    /// The image at `time` if no agent were in the room.
    #[must_use]
    pub fn without_agents(&self, time: Duration) -> Image {
        self.detected(self.drawn(time, &[], 0).0)
    }

    /// What the sensor receives with these agents, and what each of the first so many fills of it.
    fn drawn(&self, time: Duration, present: &[Agent], agents: usize) -> (Image, Vec<Filled>) {
        let mut celsius = self.still_c.clone();
        let owners = (0..).take(agents);
        let zeros = || vec![0.0; self.still_c.len()];
        let shares = match &self.method {
            Method::Grid(grid) => {
                let patches = self.patches(grid, time, present);
                self.accumulator(grid, &grid.backdrop)
                    .add_excess(&patches, &mut celsius);
                let empty = (agents > 0).then(|| Backdrop::empty(&grid.view));
                let share = |patches: &[ShadedPatch], owner, backdrop| {
                    let mut share = zeros();
                    self.accumulator(grid, backdrop).add_share(
                        patches,
                        |of| of == owner,
                        &mut share,
                    );
                    share
                };
                let of_owner = |owner: u32| {
                    let own = patches.iter().filter(|patch| patch.owner == owner);
                    let own: Vec<ShadedPatch> = own.cloned().collect();
                    let empty = empty.as_ref().unwrap_or(&grid.backdrop);
                    [
                        share(&patches, owner, &grid.backdrop),
                        share(&own, owner, empty),
                    ]
                };
                owners.map(of_owner).collect()
            }
            Method::Area {
                plane,
                still,
                relief,
            } => {
                let moving = self.facets((plane, *relief), time, present);
                still.add_change(plane, &self.air, &moving, &mut celsius);
                let nothing = StaticFacets::new(Vec::new());
                let share = |facets: &[Facet], owner, still: &StaticFacets| {
                    let mut share = zeros();
                    still.add_share(plane, facets, |of| of == owner, &mut share);
                    share
                };
                let of_owner = |owner: u32| {
                    let own = moving.iter().filter(|facet| facet.owner == owner);
                    let own: Vec<Facet> = own.cloned().collect();
                    [share(&moving, owner, still), share(&own, owner, &nothing)]
                };
                owners.map(of_owner).collect()
            }
            Method::Physical(physical) => {
                let (image_c, shares) =
                    physical.image(&self.shown(physical, time, present), agents);
                celsius = image_c;
                shares
            }
        };
        let image = Image {
            columns: self.sensor.columns,
            rows: self.sensor.rows,
            celsius,
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

    fn detected(&self, mut image: Image) -> Image {
        for celsius in &mut image.celsius {
            *celsius = self.sensor.detected(*celsius);
        }
        image
    }

    /// [`Self::image`] and [`Self::noisy`] together, for little more than the cost of one.
    #[must_use]
    pub fn image_and_noisy(&self, time: Duration, seed: u64) -> (Image, Image) {
        self.both(self.received(time), time, seed)
    }

    /// [`Self::image`], [`Self::noisy`], and what each agent fills, in the order of [`Scene::agents`]; in the physical
    /// model for little more than the cost of one.
    #[must_use]
    pub fn labeled(&self, time: Duration, seed: u64) -> (Image, Image, Vec<Filled>) {
        let (received, filled) = self.drawn(time, &self.agents, self.agents.len());
        let (image, noisy) = self.both(received, time, seed);
        (image, noisy, filled)
    }

    fn both(&self, received: Image, time: Duration, seed: u64) -> (Image, Image) {
        let noisy = self.with_noise(received.clone(), time, seed);
        (self.detected(received), noisy)
    }

    fn with_noise(&self, mut image: Image, time: Duration, seed: u64) -> Image {
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
        let mut share = vec![0.0; self.still_c.len()];
        let counts = |owner| owner != NOBODY;
        match &self.method {
            Method::Grid(grid) => self.accumulator(grid, &grid.backdrop).add_share(
                &self.patches(grid, time, &self.agents),
                counts,
                &mut share,
            ),
            Method::Area {
                plane,
                still,
                relief,
            } => {
                still.add_share(
                    plane,
                    &self.facets((plane, *relief), time, &self.agents),
                    counts,
                    &mut share,
                );
            }
            Method::Physical(physical) => {
                share = physical.share(&self.shown(physical, time, &self.agents));
            }
        }
        self.mask(share)
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

    fn accumulator<'a>(&'a self, grid: &'a Grid, backdrop: &'a Backdrop) -> Accumulator<'a> {
        Accumulator::new(&grid.view, &self.air, backdrop, &grid.resampler)
    }

    fn patches(&self, grid: &Grid, time: Duration, agents: &[Agent]) -> Vec<ShadedPatch> {
        let pose = &self.sensor.pose;
        self.changing_by((time, agents), |skin, form| {
            shaded(&grid.view, &self.air, skin, &form.faces(pose))
        })
    }

    fn facets(
        &self,
        (plane, relief): (&ImagePlane, Relief),
        time: Duration,
        agents: &[Agent],
    ) -> Vec<Facet> {
        let (pose, air) = (&self.sensor.pose, &self.air);
        self.changing_by((time, agents), |skin, form| {
            let contour = match (form, relief) {
                (Form::Round(segment), Relief::Outline) => segment.contour(pose),
                _ => None,
            };
            match contour.and_then(|of| Some((of.outline()?, of.of_surface))) {
                Some((outline, depth)) => {
                    let made_of = (air, air.glow(skin.surface), skin.owner);
                    let facet = plane.facet(outline.into_iter(), depth, made_of);
                    facet.into_iter().collect()
                }
                None => facets(plane, air, skin, &form.faces(pose)),
            }
        })
    }

    fn shown(&self, physical: &Physical, time: Duration, agents: &[Agent]) -> Vec<Shown> {
        let pose = &self.sensor.pose;
        self.changing_by((time, agents), |skin, form| {
            Some(shown_form(physical, skin, form, pose))
        })
    }

    /// Applies `build` to everything that changes: each part of each of these agents, changing objects, and prints on objects.
    fn changing_by<T, B: IntoIterator<Item = T>>(
        &self,
        (time, agents): (Duration, &[Agent]),
        build: impl Fn(&BodySurface<'_>, &Form) -> B,
    ) -> Vec<T> {
        let (ambient_c, time_s) = (self.ambient_c, time.as_secs_f64());
        let mut built = Vec::new();
        let flat =
            |mesh: &Mesh, moved_m: DVec3| Form::Flat(Sight::new(&self.sensor.pose, mesh, moved_m));
        for object in self.objects.all.iter().filter(|object| is_changing(object)) {
            let skin = BodySurface::of(object, ambient_c, time_s, NOBODY);
            built.extend(build(&skin, &flat(&object.mesh, DVec3::ZERO)));
        }
        for print in &self.objects.prints {
            if let Some(surface) = print.surface(&self.objects.all, ambient_c, time_s) {
                let skin = BodySurface {
                    surface,
                    offsets_c: &[],
                    owner: NOBODY,
                };
                built.extend(build(&skin, &flat(&print.sheet, DVec3::ZERO)));
            }
        }
        let agents = agents.iter().enumerate();
        for (index, agent) in agents.filter(|(_, agent)| agent.is_here(time)) {
            let of_part = |part| BodySurface::of(part, ambient_c, time_s, number(index));
            if let Some(segments) = agent.segments_at(time) {
                for (part, segment) in agent.parts.iter().zip(&segments) {
                    built.extend(build(&of_part(part), &Form::Round(*segment)));
                }
                continue;
            }
            let moved_m = agent.position_m(time) - agent.start_m;
            let turn = agent.turn(time);
            for part in &agent.parts {
                let form = match turn {
                    None => flat(&part.mesh, moved_m),
                    Some(turn) => flat(&agent.turned(&part.mesh, turn), moved_m),
                };
                built.extend(build(&of_part(part), &form));
            }
        }
        built
    }
}

/// How a body that changes is given to a renderer.
enum Form {
    Flat(Sight),
    Round(Ellipsoid),
}

impl Form {
    /// Its faces, for a renderer of flat ones.
    fn faces(&self, pose: &Pose) -> Cow<'_, Sight> {
        match self {
            Self::Flat(sight) => Cow::Borrowed(sight),
            Self::Round(segment) => Cow::Owned(Sight::new(pose, &segment.mesh(), DVec3::ZERO)),
        }
    }
}

/// Applies `build` to everything that stands still and never changes.
fn standing<T>(
    scene: &Scene,
    sensor: &Sensor,
    build: impl Fn(&BodySurface<'_>, &Sight) -> Vec<T>,
) -> Vec<T> {
    let objects = scene.standing().filter(|object| !is_changing(object));
    let built = objects.flat_map(|object| {
        let sight = Sight::new(&sensor.pose, &object.mesh, DVec3::ZERO);
        let skin = BodySurface::of(object, scene.room.ambient_c, 0.0, NOBODY);
        build(&skin, &sight)
    });
    built.collect()
}

fn number(agent: usize) -> u32 {
    u32::try_from(agent).unwrap_or(NOBODY)
}

fn shaded(
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

fn shown(physical: &Physical, skin: &BodySurface<'_>, sight: &Sight) -> Shown {
    physical.shown(sight, skin.owner, |face| {
        face.map_or(skin.surface, |face| skin.of_face(face))
    })
}

fn shown_form(physical: &Physical, skin: &BodySurface<'_>, form: &Form, pose: &Pose) -> Shown {
    match form {
        Form::Flat(sight) => shown(physical, skin, sight),
        Form::Round(segment) => {
            physical.shown_round(segment.contour(pose), skin.owner, skin.surface)
        }
    }
}

fn facets(plane: &ImagePlane, air: &Air, skin: &BodySurface<'_>, sight: &Sight) -> Vec<Facet> {
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
