//! What a scene shows at the times of a recording's frames, and what each of its people adds at any place.

use glam::{DMat3, DVec3};
use grideye_frame::PIXELS;
use grideye_scene::{Agent, Scene, SceneError, Simulator};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::time::Duration;

/// One image, row by row, °C.
pub(crate) type Image = [f32; PIXELS];

/// Spacing of the places that a person is rendered at, meters: half a pixel's width at a head below a ceiling.
const SPACING_M: f64 = 0.06;
/// Directions that a person is rendered in.
const DIRECTIONS: u8 = 8;

/// A scene at the times of a recording's frames, without noise.
pub(crate) struct Film {
    pub(crate) times_s: Vec<f64>,
    /// The scene without its people.
    pub(crate) empty: Vec<Image>,
    pub(crate) people: Vec<Walker>,
}

/// One person of a scene.
pub(crate) struct Walker {
    /// What it adds to each frame where the scene has it.
    pub(crate) adds: Vec<Image>,
    /// Where it is, and in which of the rendered directions it faces.
    pub(crate) places: Vec<(f64, f64, u8)>,
    pub(crate) moves: bool,
    atlas: Atlas,
}

/// What a person adds where it stands, rendered when first asked for.
struct Atlas {
    simulator: Simulator,
    agent: Agent,
    empty: Vec<f64>,
    height_m: f64,
    seen: HashMap<(i32, i32, u8), Box<Image>>,
}

impl Film {
    /// Renders the scene at these times.
    pub(crate) fn new(scene: &Scene, sensor: &str, times_s: &[f64]) -> Result<Self, SceneError> {
        let room = scene.without_agents();
        let mut simulator = Simulator::without_grid(&room, sensor)?;
        let times: Vec<Duration> = times_s
            .iter()
            .map(|time_s| Duration::try_from_secs_f64(time_s.max(0.0)).unwrap_or_default())
            .collect();
        let empty: Vec<Vec<f64>> = times
            .iter()
            .map(|time| simulator.image(*time).celsius)
            .collect();
        let mut people = Vec::with_capacity(scene.agents().len());
        for (number, agent) in scene.agents().iter().enumerate() {
            // With the others in the room, who may hide it.
            let mut others = scene.agents().to_vec();
            let one = others.remove(number);
            simulator.replace_agents(others.clone());
            let without: Vec<Vec<f64>> = times
                .iter()
                .map(|time| simulator.image(*time).celsius)
                .collect();
            simulator.replace_agents(scene.agents().to_vec());
            let adds = times.iter().zip(&without);
            let adds = adds.map(|(time, without)| less(&simulator.image(*time).celsius, without));
            let adds = adds.collect();
            simulator.replace_agents(Vec::new());
            let place = |time: &Duration| {
                let at_m = one.position_m(*time);
                (at_m.x, at_m.y, direction(one.facing(*time).or_else(|| one.turn(*time)).unwrap_or(DMat3::IDENTITY)))
            };
            people.push(Walker {
                adds,
                places: times.iter().map(place).collect(),
                moves: !one.duration().is_zero(),
                atlas: Atlas {
                    simulator: simulator.clone(),
                    empty: simulator.image(Duration::ZERO).celsius,
                    height_m: one.start_m.z,
                    agent: agent.clone(),
                    seen: HashMap::new(),
                },
            });
        }
        Ok(Self {
            times_s: times_s.to_vec(),
            empty: empty.iter().map(|celsius| image(celsius)).collect(),
            people,
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.times_s.len()
    }

    /// The index of the frame nearest to a time, the first or last beyond the ends.
    pub(crate) fn near(&self, time_s: f64) -> usize {
        let after = self.times_s.partition_point(|other| *other < time_s);
        let before = after.saturating_sub(1);
        let after = after.min(self.len().saturating_sub(1));
        if time_s - self.times_s[before] <= self.times_s[after] - time_s {
            before
        } else {
            after
        }
    }
}

impl Walker {
    /// What the person adds to a frame if it is `aside_m` from where the scene has it then.
    pub(crate) fn aside(&mut self, frame: usize, aside_m: [f64; 2]) -> Image {
        let (x, y, direction) = self.places[frame];
        let mut adds = self.adds[frame];
        if aside_m == [0.0; 2] {
            return adds;
        }
        // The difference of two standing images carries the moment of the stride along.
        let there = self.atlas.at([x + aside_m[0], y + aside_m[1]], direction);
        let here = self.atlas.at([x, y], direction);
        for (adds, (there, here)) in adds.iter_mut().zip(there.iter().zip(here)) {
            *adds += there - here;
        }
        adds
    }

    /// What the person adds if it stands at a place.
    pub(crate) fn standing(&mut self, place_m: [f64; 2], direction: u8) -> Image {
        self.atlas.at(place_m, direction)
    }
}

impl Atlas {
    /// Between the four rendered places around this one.
    fn at(&mut self, place_m: [f64; 2], direction: u8) -> Image {
        let [x, y] = place_m.map(|place_m| place_m / SPACING_M);
        let (left, below) = (x.floor(), y.floor());
        let (right, above) = ((x - left) as f32, (y - below) as f32);
        let mut all = [0.0; PIXELS];
        for (step_x, share_x) in [(0, 1.0 - right), (1, right)] {
            for (step_y, share_y) in [(0, 1.0 - above), (1, above)] {
                let share = share_x * share_y;
                if share > 0.0 {
                    let image = self.rendered((left as i32 + step_x, below as i32 + step_y, direction));
                    for (all, image) in all.iter_mut().zip(image) {
                        *all += share * image;
                    }
                }
            }
        }
        all
    }

    fn rendered(&mut self, key: (i32, i32, u8)) -> &Image {
        let Self {
            simulator,
            agent,
            empty,
            height_m,
            seen,
        } = self;
        seen.entry(key).or_insert_with(|| {
            let (x, y, direction) = key;
            let place_m = DVec3::new(
                SPACING_M * f64::from(x),
                SPACING_M * f64::from(y),
                *height_m,
            );
            let angle = TAU * f64::from(direction) / f64::from(DIRECTIONS);
            let turn = DMat3::from_rotation_z(angle);
            simulator.replace_agents(vec![agent.standing_at(place_m, turn)]);
            Box::new(less(&simulator.image(Duration::ZERO).celsius, empty))
        })
    }
}

/// The rendered direction nearest to a rotation about the vertical.
fn direction(turn: DMat3) -> u8 {
    let angle = turn.x_axis.y.atan2(turn.x_axis.x) / TAU;
    let number = (angle * f64::from(DIRECTIONS)).round();
    number.rem_euclid(f64::from(DIRECTIONS)) as u8
}

pub(super) fn image(celsius: &[f64]) -> Image {
    std::array::from_fn(|pixel| celsius.get(pixel).copied().unwrap_or_default() as f32)
}

fn less(with: &[f64], without: &[f64]) -> Image {
    let difference: Vec<f64> = with.iter().zip(without).map(|(with, without)| with - without).collect();
    image(&difference)
}
