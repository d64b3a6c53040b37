//! Finds who collides with what over the whole path, and whether another body fits.

use crate::geometry::{Bounds, Meeting, Mesh, Piece, Shape, Span, TOLERANCE_M, first_meeting};
use crate::model::body::{Agent, Body};
use crate::model::limits;
use crate::model::room::Room;
use crate::model::scene::Scene;
use crate::motion::{Leg, Trajectory};
use glam::{DMat3, DVec3};
use std::time::Duration;

/// Two things in the same place.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Contact {
    /// The agent, and the object or the other agent.
    pub names: [String; 2],
    /// When the contact starts.
    pub time: Duration,
    /// Where it starts, meters.
    pub place_m: DVec3,
    pub(crate) agent: usize,
}

impl Scene {
    /// Each agent's first contact with each object and each other agent, sorted by time, up to
    /// [`limits::CONTACTS_MAX`]. Overlaps below a millimeter and anything in its `touches` are ignored.
    #[must_use]
    pub fn contacts(&self) -> Vec<Contact> {
        let obstacles = self.objects.iter();
        let obstacles = obstacles.map(|object| (&object.name, Shape::new([&object.mesh])));
        let obstacles: Vec<(&String, Shape)> = obstacles.collect();
        let movers: Vec<Mover<'_>> = self.agents.iter().map(Mover::new).collect();
        let mut contacts = Vec::new();
        for (index, mover) in movers.iter().enumerate() {
            let found = obstacles
                .iter()
                .filter(|(name, _)| !mover.may_touch(name))
                .filter_map(|(name, shape)| {
                    let meeting = mover.meets_shape(shape)?;
                    Some(Contact::at(meeting, index, mover.agent, name))
                });
            contacts.extend(found.take(limits::CONTACTS_MAX - contacts.len()));
            let others = movers[index + 1..].iter();
            let found = others
                .filter(|other| {
                    !mover.may_touch(&other.agent.name) && !other.may_touch(&mover.agent.name)
                })
                .filter_map(|other| {
                    let meeting = mover.meets_agent(other)?;
                    Some(Contact::at(meeting, index, mover.agent, &other.agent.name))
                });
            contacts.extend(found.take(limits::CONTACTS_MAX - contacts.len()));
        }
        contacts.sort_by_key(|contact| contact.time);
        contacts
    }

    /// Moves an agent that does not walk, by its index. Returns whether it is then in the room and crosses no wall.
    pub fn stand(&mut self, agent: usize, at_m: DVec3) -> bool {
        let Some(agent) = self.agents.get_mut(agent) else {
            return true;
        };
        let moved_m = at_m - agent.start_m;
        agent.start_m = at_m;
        for part in &mut agent.parts {
            part.base_m += moved_m;
            part.mesh.move_by(moved_m);
        }
        let walls = Walls::new(&self.room);
        let mut parts = agent.parts.iter();
        parts.all(|part| self.room.holds_corners_of(&part.mesh) && !walls.meet(&part.mesh))
    }
}

#[derive(Debug)]
pub(crate) struct Walls {
    shape: Shape,
}

impl Walls {
    pub(crate) fn new(room: &Room) -> Self {
        let sides = room.jutting_m();
        let pieces = sides.iter().map(|side| Piece::of_wall(side));
        Self {
            shape: Shape::of_pieces(pieces.collect()),
        }
    }

    pub(crate) fn meet(&self, mesh: &Mesh) -> bool {
        let still = |_| DVec3::ZERO;
        let span = Span::STILL;
        let met = || first_meeting((&Shape::new([mesh]), &still), (&self.shape, &still), &span);
        !self.shape.pieces.is_empty() && met().is_some()
    }

    pub(crate) fn first_met_by(&self, agent: &Agent) -> Option<(Duration, DVec3)> {
        if self.shape.pieces.is_empty() {
            return None;
        }
        let meeting = Mover::new(agent).meets_shape(&self.shape)?;
        let time = Duration::try_from_secs_f64(meeting.time_s).unwrap_or(Duration::MAX);
        Some((time, meeting.place_m))
    }
}

impl Contact {
    fn at(meeting: Meeting, index: usize, agent: &Agent, other: &str) -> Self {
        Self {
            names: [agent.name.clone(), other.to_owned()],
            time: Duration::try_from_secs_f64(meeting.time_s).unwrap_or(Duration::MAX),
            place_m: meeting.place_m,
            agent: index,
        }
    }
}

struct Mover<'a> {
    agent: &'a Agent,
    legs: Vec<Leg>,
    /// In its initial orientation, which is permanent if it does not turn.
    shape: Shape,
    /// The box around it in all its orientations.
    bounds: Bounds,
}

impl<'a> Mover<'a> {
    fn new(agent: &'a Agent) -> Self {
        let way = agent.trajectory.as_ref();
        let mut mover = Self {
            agent,
            legs: way.map_or_else(Vec::new, Trajectory::legs),
            shape: Shape::new(agent.parts.iter().map(|part| &part.mesh)),
            bounds: Bounds::NOTHING,
        };
        mover.bounds = mover.shape.bounds;
        if let Some(turns) = &agent.turns {
            let turned = turns.iter().map(|turn| mover.turned(*turn).bounds);
            mover.bounds = turned.fold(mover.bounds, Bounds::with);
        }
        mover
    }

    /// Whether it is in the room in the middle of a span.
    fn is_here(&self, span: &Span) -> bool {
        let middle_s = 0.5 * (span.start_s + span.end_s);
        let middle = Duration::try_from_secs_f64(middle_s);
        middle.is_ok_and(|middle| self.agent.is_here(middle))
    }

    fn may_touch(&self, name: &str) -> bool {
        self.agent.touches.iter().any(|touched| touched == name)
    }

    fn moved_m(&self, time_s: f64) -> DVec3 {
        let trajectory = self.agent.trajectory.as_ref();
        trajectory.map_or(DVec3::ZERO, |way| way.at_s(time_s) - self.agent.start_m)
    }

    fn turned(&self, turn: DMat3) -> Shape {
        let parts = self.agent.parts.iter();
        let turned = parts.map(|part| self.agent.turned(&part.mesh, turn));
        Shape::new(&turned.collect::<Vec<_>>())
    }

    fn turned_in(&self, span: &Span) -> Option<Shape> {
        let turns = self.agent.turns.as_ref()?;
        let way = self.agent.trajectory.as_ref()?;
        let middle_s = 0.5 * (span.start_s + span.end_s);
        let turn = turns.get(way.heads_for(middle_s))?;
        Some(self.turned(*turn))
    }

    fn meets_shape(&self, obstacle: &Shape) -> Option<Meeting> {
        self.spans(&self.legs).into_iter().find_map(|span| {
            let (from_m, to_m) = (self.moved_m(span.start_s), self.moved_m(span.end_s));
            let is_near = self.bounds.swept(from_m, to_m).meets(&obstacle.bounds);
            if !is_near || !self.is_here(&span) {
                return None;
            }
            let turned = self.turned_in(&span);
            let shape = turned.as_ref().unwrap_or(&self.shape);
            let moved_m = |time_s| self.moved_m(time_s);
            first_meeting((shape, &moved_m), (obstacle, &|_| DVec3::ZERO), &span)
        })
    }

    fn meets_agent(&self, other: &Self) -> Option<Meeting> {
        let mut both = self.legs.clone();
        both.extend(&other.legs);
        self.spans(&both).into_iter().find_map(|mut span| {
            let swept = |mover: &Self| {
                let (from_m, to_m) = (mover.moved_m(span.start_s), mover.moved_m(span.end_s));
                mover.bounds.swept(from_m, to_m)
            };
            let are_near = swept(self).meets(&swept(other));
            if !are_near || !self.is_here(&span) || !other.is_here(&span) {
                return None;
            }
            span.speed_max_m_per_s = self.speed_in(&span) + other.speed_in(&span);
            let (turned, other_turned) = (self.turned_in(&span), other.turned_in(&span));
            let shape = turned.as_ref().unwrap_or(&self.shape);
            let other_shape = other_turned.as_ref().unwrap_or(&other.shape);
            let moved_m = |time_s| self.moved_m(time_s);
            let other_moved_m = |time_s| other.moved_m(time_s);
            first_meeting((shape, &moved_m), (other_shape, &other_moved_m), &span)
        })
    }

    /// The time spans between all ends of legs; one empty span if nobody moves.
    fn spans(&self, legs: &[Leg]) -> Vec<Span> {
        let mut ends_s: Vec<f64> = legs.iter().map(|leg| leg.end_s).collect();
        ends_s.sort_by(f64::total_cmp);
        ends_s.dedup();
        let mut start_s = 0.0;
        let mut spans = Vec::with_capacity(ends_s.len());
        for end_s in ends_s {
            let mut span = Span {
                start_s,
                end_s,
                speed_max_m_per_s: 0.0,
            };
            span.speed_max_m_per_s = self.speed_in(&span);
            spans.push(span);
            start_s = end_s;
        }
        if spans.is_empty() {
            spans.push(Span::STILL);
        }
        spans
    }

    fn speed_in(&self, span: &Span) -> f64 {
        let middle_s = 0.5 * (span.start_s + span.end_s);
        let leg = self.legs.partition_point(|leg| leg.end_s <= middle_s);
        self.legs.get(leg).map_or(0.0, |leg| leg.speed_max_m_per_s)
    }
}

/// The room left by objects and walls, for repeated tests whether something else fits into a scene.
#[derive(Debug)]
pub struct FreeSpace {
    room: Room,
    walls: Walls,
    objects: Vec<Shape>,
}

impl FreeSpace {
    /// How far bodies may overlap what stands there and still fit, meters; this counts as touching.
    pub const TOLERANCE_M: f64 = TOLERANCE_M;

    /// The space that a scene's walls and objects leave.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let objects = scene.objects.iter();
        Self {
            room: scene.room.clone(),
            walls: Walls::new(&scene.room),
            objects: objects.map(|object| Shape::new([&object.mesh])).collect(),
        }
    }

    /// Takes the space of these bodies, too.
    pub fn fill(&mut self, bodies: &[Body]) {
        self.objects
            .push(Shape::new(bodies.iter().map(|body| &body.mesh)));
    }

    /// Whether these bodies are in the room, cross no wall and overlap nothing that stands there; touching is allowed.
    #[must_use]
    pub fn holds(&self, bodies: &[Body]) -> bool {
        let meshes = || bodies.iter().map(|body| &body.mesh);
        let are_in_room =
            meshes().all(|mesh| self.room.holds_corners_of(mesh) && !self.walls.meet(mesh));
        let shape = Shape::new(meshes());
        let mut objects = self.objects.iter();
        let overlaps = |other: &Shape| other.bounds.meets(&shape.bounds) && shape.overlaps(other);
        are_in_room && !objects.any(overlaps)
    }
}
