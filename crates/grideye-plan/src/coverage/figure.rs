//! The person that a survey looks for: standing, sitting or lying.

use glam::DVec3;
use grideye_scene::{Agent, Body, Cuboid, Mesh, perceived::Surface};

/// A person's posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Posture {
    /// Upright on the floor: the paper's body.
    Standing,
    /// On the floor or on a seat up to 0.6 m high, legs forward.
    Sitting,
    /// On the floor or in a bed up to 0.8 m high.
    Lying,
}

/// The person to look for: a body standing on the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    name: String,
    parts: Vec<Body>,
    height_m: f64,
    climbs_m: f64,
}

/// The paper's agent (PeerJ CS 11:e3124, "Experiment setup"): depth, shoulder width, height, meters.
const PAPER_SIZE_M: DVec3 = DVec3::new(0.2, 0.5, 1.75);
/// The same paper, Table 1: 28 °C with clothes on; emissivity of fabrics.
const PAPER_SURFACE: Surface = Surface {
    celsius: 28.0,
    emissivity: 0.8,
};
/// Sitting height and thigh length, relative to stature (Drillis and Contini 1966).
const SITTING: f64 = 0.52;
const THIGH: f64 = 0.245;

impl Figure {
    /// The paper's person, standing: 200 x 500 x 1750 mm at 28 °C.
    #[must_use]
    pub fn standing() -> Self {
        Self::new(Posture::Standing, PAPER_SIZE_M, PAPER_SURFACE)
    }

    /// A person in a posture, as one or two cuboids; `size_m` is depth, width and height when standing, meters.
    #[must_use]
    pub fn new(posture: Posture, size_m: DVec3, surface: Surface) -> Self {
        let DVec3 {
            x: depth,
            y: width,
            z: height,
        } = size_m;
        let (name, climbs_m, boxes) = match posture {
            Posture::Standing => ("a person standing", 0.0, vec![(DVec3::ZERO, size_m)]),
            Posture::Lying => (
                "a person lying",
                0.8,
                vec![(DVec3::ZERO, DVec3::new(height, width, depth))],
            ),
            Posture::Sitting => {
                let thigh = DVec3::new(THIGH * height, width, 0.8 * depth);
                // Together they reach equally far to the front and to the back of the origin.
                let trunk_m = DVec3::new(-0.5 * thigh.x, 0.0, 0.0);
                let thigh_m = DVec3::new(0.5 * depth, 0.0, 0.0);
                let trunk = DVec3::new(depth, width, SITTING * height);
                (
                    "a person sitting",
                    0.6,
                    vec![(trunk_m, trunk), (thigh_m, thigh)],
                )
            }
        };
        let part = |(base_m, size_m): (DVec3, DVec3)| {
            let mesh = Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0));
            Body::new(name, base_m, mesh, surface)
        };
        Self::of_parts(name, boxes.into_iter().map(part).collect(), climbs_m)
    }

    /// An agent of a scene at its start, with all parts, standing on the floor.
    #[must_use]
    pub fn of_agent(agent: &Agent) -> Self {
        let parts = agent.parts.iter();
        let parts = parts.map(|part| part.placed(0.0, -agent.start_m));
        Self::of_parts(&format!("agent `{}`", agent.name), parts.collect(), 0.0)
    }

    fn of_parts(name: &str, parts: Vec<Body>, climbs_m: f64) -> Self {
        let tops = parts.iter().map(|part| part.mesh.bounds_m().1.z);
        Self {
            name: name.to_owned(),
            height_m: tops.fold(0.0, f64::max),
            parts,
            climbs_m,
        }
    }

    /// A description of the person.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Height above the ground, meters.
    #[must_use]
    pub const fn height_m(&self) -> f64 {
        self.height_m
    }

    /// The highest surface it sits or lies on, meters; 0 if it only stands on the floor.
    #[must_use]
    pub const fn climbs_m(&self) -> f64 {
        self.climbs_m
    }

    pub(crate) fn at(&self, ground_m: DVec3, turn_deg: f64) -> Agent {
        let parts = self.parts.iter();
        let parts = parts.map(|part| part.placed(turn_deg, ground_m)).collect();
        Agent::at_rest(&self.name, parts, ground_m)
    }
}
