//! What one person adds to the pictures: where the scene has it, and anywhere else.

use crate::decision::constants::{COARSE_M, SPACING_M};
use crate::decision::image::{Image, image, less, moment};
use crate::numbers::{count, index, single, whole};
use glam::{DMat3, DVec3};
use grideye_frame::PIXELS;
use grideye_scene::{Agent, Simulator};
use std::f64::consts::TAU;
use std::time::Duration;

/// Directions that a person is rendered in.
const DIRECTIONS: u8 = 4;
/// Beyond its way a person is rendered this far, meters: half a meter aside, a sensor moved by 1.7 m, one more at 2.8 m.
const MARGIN_M: f64 = 3.0;
/// Nodes of a grid in a row at most.
const NODES_MOST: f64 = 1_000.0;
/// Images that are kept for the next recording: 15 megabytes, a path of some 250 meters.
const IMAGES_MAX: usize = 50_000;

/// One person of a scene.
pub(crate) struct Person {
    pub(crate) name: String,
    /// What it adds to each picture where the scene has it.
    pub(crate) adds: Vec<Image>,
    /// Where it is, and in which of the rendered directions it faces.
    pub(crate) places: Vec<(f64, f64, u8)>,
    pub(crate) moves: bool,
    /// What it adds beyond a standing person in the same place: the moment of its stride.
    strides: Vec<Option<Image>>,
    standing: Standing,
}

/// The person as it stands at the nodes of a grid, each rendered when first asked for.
struct Standing {
    simulator: Simulator,
    agent: Agent,
    room: Image,
    spacing_m: f64,
    /// How many times its contrast.
    times: f32,
    nodes: Nodes,
}

/// The images of a grid.
#[derive(Default)]
pub(crate) struct Nodes {
    /// The node nearest to the origin, and how many there are along x and y.
    first: [f64; 2],
    size: [usize; 2],
    /// By direction, y and x: the number of the image, from 1; 0 if it is not rendered yet.
    numbers: Vec<u32>,
    images: Vec<Image>,
}

impl Person {
    /// `room` is a simulator of the scene without people; `nodes` are those of an earlier film of the same person.
    pub(crate) fn new(
        agent: &Agent,
        adds: Vec<Image>,
        times_s: &[f64],
        room: &Simulator,
        nodes: Option<Nodes>,
    ) -> Self {
        let spacing_m = match agent.person {
            Some(_) => SPACING_M,
            None => COARSE_M,
        };
        Self {
            name: agent.name.clone(),
            places: times_s.iter().map(|time_s| place(agent, *time_s)).collect(),
            moves: !agent.duration().is_zero(),
            strides: vec![None; adds.len()],
            adds,
            standing: Standing {
                room: image(&room.image(Duration::ZERO).celsius),
                simulator: room.clone(),
                agent: agent.clone(),
                spacing_m,
                times: 1.0,
                nodes: nodes.unwrap_or_else(|| Nodes::about(agent, spacing_m)),
            },
        }
    }

    /// What was rendered of it, for the next film.
    pub(crate) fn into_nodes(self) -> Nodes {
        let mut nodes = self.standing.nodes;
        if nodes.images.len() > IMAGES_MAX {
            nodes.images.clear();
            nodes.numbers.fill(0);
        }
        nodes
    }

    /// With so many times the contrast.
    pub(crate) fn scale(&mut self, times: f32) {
        for adds in &mut self.adds {
            *adds = adds.map(|celsius| times * celsius);
        }
        self.standing.times = times;
    }

    /// What the person adds to a picture if it is `aside_m` from where the scene has it then.
    pub(crate) fn aside(&mut self, index: usize, aside_m: [f64; 2]) -> Image {
        if aside_m == [0.0; 2] {
            return self.adds[index];
        }
        let (x, y, direction) = self.places[index];
        let mut adds = match self.strides[index] {
            Some(stride) => stride,
            None => {
                let stride = less(&self.adds[index], &self.standing.at([x, y], direction));
                *self.strides[index].insert(stride)
            }
        };
        let place_m = [x + aside_m[0], y + aside_m[1]];
        self.standing.add_at(&mut adds, place_m, direction);
        adds
    }

    /// What the person adds if it stands at a place.
    pub(crate) fn standing(&mut self, place_m: [f64; 2]) -> Image {
        self.standing.at(place_m, 0)
    }

    /// Sum of what it adds, by picture, °C.
    pub(crate) fn warmth(&self) -> Vec<f64> {
        let sum = |image: &Image| f64::from(image.iter().sum::<f32>());
        self.adds.iter().map(sum).collect()
    }
}

impl Standing {
    fn at(&mut self, place_m: [f64; 2], direction: u8) -> Image {
        let mut image = [0.0; PIXELS];
        self.add_at(&mut image, place_m, direction);
        image
    }

    /// Between the four nodes around this place.
    fn add_at(&mut self, all: &mut Image, place_m: [f64; 2], direction: u8) {
        let [x, y] = [0, 1].map(|axis| {
            let last = count(self.nodes.size[axis]) - 1.0;
            (place_m[axis] / self.spacing_m - self.nodes.first[axis]).clamp(0.0, last - 1e-6)
        });
        let (left, below) = (x.floor(), y.floor());
        let (right, above) = (single(x - left), single(y - below));
        let (left, below) = (index(left), index(below));
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let [a, b, c, d] = corners.map(|(x, y)| self.image([left + x, below + y], direction));
        let images = &self.nodes.images;
        let (a, b, c, d) = (&images[a], &images[b], &images[c], &images[d]);
        let (in_a, in_b) = ((1.0 - right) * (1.0 - above), right * (1.0 - above));
        let (in_c, in_d) = ((1.0 - right) * above, right * above);
        for pixel in 0..PIXELS {
            all[pixel] += in_a * a[pixel] + in_b * b[pixel] + in_c * c[pixel] + in_d * d[pixel];
        }
    }

    /// The number of a node's image.
    fn image(&mut self, [x, y]: [usize; 2], direction: u8) -> usize {
        let [columns, rows] = self.nodes.size;
        let node = (usize::from(direction) * rows + y) * columns + x;
        let known = usize::try_from(self.nodes.numbers[node]).unwrap_or(0);
        if known > 0 {
            return known - 1;
        }
        let [at_x, at_y] = [(x, 0), (y, 1)]
            .map(|(place, axis)| self.spacing_m * (self.nodes.first[axis] + count(place)));
        let angle = TAU * f64::from(direction) / f64::from(DIRECTIONS);
        let place_m = DVec3::new(at_x, at_y, self.agent.start_m.z);
        let turn = DMat3::from_rotation_z(angle);
        self.simulator
            .replace_agents(vec![self.agent.standing_at(place_m, turn)]);
        let with = image(&self.simulator.image(Duration::ZERO).celsius);
        let adds = less(&with, &self.room).map(|celsius| self.times * celsius);
        self.nodes.images.push(adds);
        self.nodes.numbers[node] = u32::try_from(self.nodes.images.len()).unwrap_or(0);
        self.nodes.images.len() - 1
    }
}

impl Nodes {
    /// About all of an agent's way.
    fn about(agent: &Agent, spacing_m: f64) -> Self {
        /// Moments at which the way is looked at.
        const MOMENTS_MOST: f64 = 20_000.0;
        let end_s = agent.duration().as_secs_f64();
        let step_s = (end_s / MOMENTS_MOST).max(0.5);
        let moments = 0..=whole(end_s / step_s) + 1;
        let way_m = moments.map(|step| agent.position_m(moment(f64::from(step) * step_s)));
        let (low, high) = way_m.fold((agent.start_m, agent.start_m), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        let first = [low.x, low.y].map(|m| ((m - MARGIN_M) / spacing_m).floor());
        let last = [high.x, high.y].map(|m| ((m + MARGIN_M) / spacing_m).ceil());
        let size = [0, 1].map(|axis| index((last[axis] - first[axis] + 1.0).min(NODES_MOST)));
        Self {
            first,
            size,
            numbers: vec![0; size[0] * size[1] * usize::from(DIRECTIONS)],
            images: Vec::new(),
        }
    }
}

fn place(agent: &Agent, time_s: f64) -> (f64, f64, u8) {
    let time = moment(time_s);
    let at_m = agent.position_m(time);
    let turn = agent.facing(time).or_else(|| agent.turn(time));
    (at_m.x, at_m.y, direction(turn.unwrap_or(DMat3::IDENTITY)))
}

/// The rendered direction nearest to a rotation about the vertical.
fn direction(turn: DMat3) -> u8 {
    let angle = turn.x_axis.y.atan2(turn.x_axis.x) / TAU;
    let number = (angle * f64::from(DIRECTIONS)).round();
    u8::try_from(whole(number.rem_euclid(f64::from(DIRECTIONS)))).unwrap_or(0)
}
