//! The person that a survey looks for: standing, sitting or lying.

use glam::DVec3;
use grideye_scene::{Agent, Body, Clothing, Cuboid, Mesh, Model, Person, Posture, Scene};

/// The person to look for.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    name: String,
    shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Person(Person),
    /// Bodies that stand on the origin.
    Parts(Vec<Body>),
}

/// The figure in a room, at every turn.
#[derive(Debug, Default)]
pub(crate) struct Stands {
    /// Seen in the paper's model, and what must fit in any: few flat faces. The front is +x.
    blocks: Vec<Body>,
    /// The blocks that are in a seat if the person sits on one.
    in_seat: usize,
    /// Seen in the physical model: an agent alone for each turn, a person of round segments.
    pub(crate) round: Vec<Vec<Agent>>,
    seat_m: f64,
    /// Height above the ground, meters.
    pub(crate) height_m: f64,
    /// The highest surface it sits or lies on, meters; 0 if it only stands on the floor.
    pub(crate) climbs_m: f64,
}

/// The figure at a place.
#[derive(Debug, Clone)]
pub(crate) struct Stand {
    pub(crate) blocks: Agent,
    pub(crate) turn: usize,
    pub(crate) base_m: DVec3,
    /// A ball around it: its middle and radius, meters.
    pub(crate) around_m: (DVec3, f64),
}

/// The blocks of a person, by the segments they stand for. Feet and hands are left out: too small to matter.
const HEAD: &[&str] = &["hair", "face"];
const TRUNK: &[&str] = &[
    "shoulders",
    "chest",
    "pelvis",
    "left upper arm",
    "right upper arm",
];
const THIGHS: &[&str] = &["left thigh", "right thigh"];
const SHANKS: &[&str] = &["left shank", "right shank"];
const LEGS: &[&str] = &["left thigh", "right thigh", "left shank", "right shank"];
/// The cube root of π / 6.
const ROUND: f64 = 0.806;
/// People sit on seats and lie in beds up to this height, meters.
const SEAT_MAX_M: f64 = 0.6;
const BED_MAX_M: f64 = 0.8;

impl Figure {
    /// An adult of mean height and build, standing, in shirt and sweater.
    #[must_use]
    pub fn standing() -> Self {
        let (height_m, posture) = (Person::HEIGHT_M, Posture::Stand);
        Self::new(Person::new(height_m, 1.0, posture, Clothing::INDOOR))
    }

    /// A person: standing on the floor, sitting also on a seat of up to 0.6 m, lying also in a bed of up to 0.8 m.
    #[must_use]
    pub fn new(person: Person) -> Self {
        let doing = match person.posture {
            Posture::Stand => "standing",
            Posture::Walk => "walking",
            Posture::Sit => "sitting",
            Posture::Lie => "lying",
        };
        Self {
            name: format!("a person {doing}"),
            shape: Shape::Person(person),
        }
    }

    /// An agent of a scene at its start; one of parts, or of a single body, only stands on the floor.
    #[must_use]
    pub fn of_agent(agent: &Agent) -> Self {
        let parts = agent.parts.iter();
        let parts = parts.map(|part| part.placed(0.0, -agent.start_m));
        Self {
            name: format!("agent `{}`", agent.name),
            shape: match agent.person {
                Some(person) => Shape::Person(person),
                None => Shape::Parts(parts.collect()),
            },
        }
    }

    /// A description of the person.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn in_room(&self, scene: &Scene, turns_deg: &[f64]) -> Stands {
        let mut stands = Stands::default();
        match &self.shape {
            Shape::Parts(parts) => stands.blocks.clone_from(parts),
            Shape::Person(person) => {
                let agent = |turn_deg: &f64| scene.person(&self.name, *person, *turn_deg);
                if scene.model() == Model::Physical {
                    let alone = turns_deg.iter().map(|turn_deg| vec![agent(turn_deg)]);
                    stands.round = alone.collect();
                }
                match person.posture {
                    Posture::Stand | Posture::Walk => {}
                    Posture::Sit => {
                        stands.seat_m = person.seat_m();
                        stands.climbs_m = SEAT_MAX_M;
                        stands.in_seat = 1;
                    }
                    Posture::Lie => stands.climbs_m = BED_MAX_M,
                }
                stands.blocks = blocks(&agent(&0.0), person.posture, stands.seat_m);
            }
        }
        let tops = stands.blocks.iter().map(|block| block.mesh.bounds_m().1.z);
        stands.height_m = tops.fold(0.0, f64::max);
        stands
    }
}

impl Stands {
    /// The figure on the ground at a place of a floor at `level_m`.
    pub(crate) fn at(
        &self,
        ground_m: DVec3,
        level_m: f64,
        (turn, turn_deg): (usize, f64),
    ) -> Stand {
        let is_on_seat = ground_m.z > level_m;
        let base_m = match is_on_seat {
            true => ground_m.with_z((ground_m.z - self.seat_m).max(level_m)),
            false => ground_m,
        };
        let in_seat = if is_on_seat { self.in_seat } else { 0 };
        let blocks = self.blocks.iter().take(self.blocks.len() - in_seat);
        let blocks: Vec<Body> = blocks.map(|block| block.placed(turn_deg, base_m)).collect();
        let corners = || blocks.iter().flat_map(|block| block.mesh.vertices_m());
        let middle_m = base_m + 0.5 * self.height_m * DVec3::Z;
        let away_m = corners().map(|corner| corner.distance(middle_m));
        Stand {
            around_m: (middle_m, away_m.fold(0.0, f64::max)),
            blocks: Agent::at_rest("", blocks, base_m),
            turn,
            base_m,
        }
    }
}

/// A person as cuboids, none of them below the ground: each has the volume of an ellipsoid around its segments. The last block of a person who sits is in front of the seat.
fn blocks(agent: &Agent, posture: Posture, seat_m: f64) -> Vec<Body> {
    let block = |segments: &[&str], above_m: f64| {
        let is_part = |part: &&Body| segments.contains(&part.name.as_str());
        let mut parts = agent.parts.iter().filter(is_part);
        let first = parts.next()?;
        let (low, high) = parts.fold(first.mesh.bounds_m(), |(low, high), part| {
            let bounds_m = part.mesh.bounds_m();
            (low.min(bounds_m.0), high.max(bounds_m.1))
        });
        let low = low.with_z(low.z.max(above_m));
        let size_m = ROUND * (high - low);
        let base_m = 0.5 * (low + high - size_m.with_x(0.0).with_y(0.0));
        let mesh = Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0));
        Some(Body::new("", base_m, mesh, first.surface))
    };
    let all = match posture {
        Posture::Sit => vec![
            block(HEAD, seat_m),
            block(TRUNK, seat_m),
            block(THIGHS, seat_m),
            block(SHANKS, 0.0),
        ],
        _ => vec![block(HEAD, 0.0), block(TRUNK, 0.0), block(LEGS, 0.0)],
    };
    all.into_iter().flatten().collect()
}
