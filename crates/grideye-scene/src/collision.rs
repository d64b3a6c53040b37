//! Who runs into what: the first contact of each agent with each object and with each other agent, along the whole way.
//!
//! ```text
//!  straight legs of both ──▶ boxes around what each sweeps ──▶ distance of the convex bodies
//!                            meet at all?                      step on by distance / speed until it is nothing
//! ```
//!
//! A step never leaps over a contact, as neither body is faster than its leg's highest speed. It is at least
//! [`STEP_M`] long, so that a contact that lasts for less than this may be missed. Bodies that are not convex are
//! taken face by face: what counts is their surface.

use crate::geometry::distance::{Gap, gap};
use crate::geometry::polygon::normal;
use crate::geometry::solid::{Enclosure, Solid};
use crate::limits;
use crate::model::body::Agent;
use crate::model::room::Room;
use crate::model::scene::Scene;
use crate::motion::trajectory::{Leg, Trajectory};
use glam::{DMat3, DVec3};
use std::time::Duration;

/// Two things that are in one place.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Contact {
    /// The agent, and the object or the other agent.
    pub names: [String; 2],
    /// When it begins.
    pub time: Duration,
    /// Where it begins, metres.
    pub place_m: DVec3,
    /// The agent's place in the scene.
    pub(crate) agent: usize,
}

/// Convex bodies are smaller by this on each side, metres: what only touches, or overlaps by up to twice this, is free.
pub(crate) const TOLERANCE_M: f64 = 5e-4;
/// The shortest step along a leg, metres; of a leg that is longer than so many steps, a part of it.
const STEP_M: f64 = 5e-4;
const STEPS_MAX: f64 = 10_000.0;
/// Halvings of the last step: to a millionth of it.
const HALVINGS: usize = 20;

impl Scene {
    /// The first contact of every agent with every object and every other agent, in the order of their times; at most
    /// [`limits::CONTACTS_MAX`].
    ///
    /// What an agent's file entry lists under `touches` is left out, and so are overlaps of less than a millimetre.
    #[must_use]
    pub fn contacts(&self) -> Vec<Contact> {
        let obstacles: Vec<Obstacle<'_>> = self
            .objects
            .iter()
            .map(|object| Obstacle::new(&object.name, [&object.solid]))
            .collect();
        let movers: Vec<Mover<'_>> = self.agents.iter().map(Mover::new).collect();
        let mut contacts = Vec::new();
        for (index, mover) in movers.iter().enumerate() {
            let found = obstacles
                .iter()
                .filter(|obstacle| !mover.may_touch(obstacle.name))
                .filter_map(|obstacle| {
                    let place = mover.meets_shape(&obstacle.shape)?;
                    Some(place.contact(index, mover.agent, obstacle.name))
                });
            contacts.extend(found.take(limits::CONTACTS_MAX - contacts.len()));
            let others = movers[index + 1..].iter();
            let found = others
                .filter(|other| {
                    !mover.may_touch(&other.agent.name) && !other.may_touch(&mover.agent.name)
                })
                .filter_map(|other| {
                    let place = mover.meets_agent(other)?;
                    Some(place.contact(index, mover.agent, &other.agent.name))
                });
            contacts.extend(found.take(limits::CONTACTS_MAX - contacts.len()));
        }
        contacts.sort_by_key(|contact| contact.time);
        contacts
    }
}

/// The walls that jut into a room, as obstacles.
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

    /// Whether a body reaches through one of them, rather than to it.
    pub(crate) fn meet(&self, solid: &Solid) -> bool {
        let still = |_| DVec3::ZERO;
        let span = Span::STILL;
        let met = || first_meeting((&Shape::new([solid]), &still), (&self.shape, &still), &span);
        !self.shape.pieces.is_empty() && met().is_some()
    }

    /// When and where an agent first reaches through one of them.
    pub(crate) fn first_met_by(&self, agent: &Agent) -> Option<(Duration, DVec3)> {
        if self.shape.pieces.is_empty() {
            return None;
        }
        let meeting = Mover::new(agent).meets_shape(&self.shape)?;
        let time = Duration::try_from_secs_f64(meeting.time_s).unwrap_or(Duration::MAX);
        Some((time, meeting.place_m))
    }
}

/// A moment and a place.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    time_s: f64,
    place_m: DVec3,
}

impl Meeting {
    fn contact(self, index: usize, agent: &Agent, other: &str) -> Contact {
        Contact {
            names: [agent.name.clone(), other.to_owned()],
            time: Duration::try_from_secs_f64(self.time_s).unwrap_or(Duration::MAX),
            place_m: self.place_m,
            agent: index,
        }
    }
}

/// What may be run into.
struct Obstacle<'a> {
    name: &'a str,
    shape: Shape,
}

impl<'a> Obstacle<'a> {
    fn new<'s>(name: &'a str, solids: impl IntoIterator<Item = &'s Solid>) -> Self {
        Self {
            name,
            shape: Shape::new(solids),
        }
    }
}

/// What stands in a room, for those who ask often whether there is place for something else.
#[derive(Debug, Clone)]
pub(crate) struct Obstacles {
    shapes: Vec<Shape>,
}

impl Obstacles {
    pub(crate) fn new<'s>(solids: impl IntoIterator<Item = &'s Solid>) -> Self {
        let shapes = solids.into_iter().map(|solid| Shape::new([solid]));
        Self {
            shapes: shapes.collect(),
        }
    }

    /// Whether any of these solids is where something stands already; touching does not count.
    pub(crate) fn meet<'s>(&self, solids: impl IntoIterator<Item = &'s Solid>) -> bool {
        let shape = Shape::new(solids);
        let mut near = self
            .shapes
            .iter()
            .filter(|other| other.bounds.meets(&shape.bounds));
        near.any(|other| shape.overlaps(other))
    }
}

/// Convex bodies, and the box around them all.
#[derive(Debug, Clone)]
struct Shape {
    pieces: Vec<Piece>,
    bounds: Bounds,
}

#[derive(Debug, Clone)]
struct Piece {
    points: Vec<DVec3>,
    bounds: Bounds,
}

#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NOTHING: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    fn of(points: &[DVec3]) -> Self {
        points.iter().fold(Self::NOTHING, |bounds, point| Self {
            low: bounds.low.min(*point),
            high: bounds.high.max(*point),
        })
    }

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The box around all that this one covers while it is moved from one place to another.
    fn swept(self, from_m: DVec3, to_m: DVec3) -> Self {
        Self {
            low: self.low + from_m.min(to_m),
            high: self.high + from_m.max(to_m),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

impl Shape {
    fn new<'s>(solids: impl IntoIterator<Item = &'s Solid>) -> Self {
        Self::of_pieces(solids.into_iter().flat_map(pieces).collect())
    }

    fn of_pieces(pieces: Vec<Piece>) -> Self {
        let bounds = pieces.iter().map(|piece| piece.bounds);
        Self {
            bounds: bounds.fold(Bounds::NOTHING, Bounds::with),
            pieces,
        }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.pieces.iter().any(|one| {
            let mut near = other
                .pieces
                .iter()
                .filter(|other| one.bounds.meets(&other.bounds));
            near.any(|other| gap(&one.points, DVec3::ZERO, &other.points).distance_m <= 0.0)
        })
    }
}

impl Piece {
    fn new(points: Vec<DVec3>) -> Self {
        Self {
            bounds: Bounds::of(&points),
            points,
        }
    }

    /// A convex face of a room, counter-clockwise from within, moved out of it by [`TOLERANCE_M`] so that bodies may
    /// lean against it, and smaller so that it does not touch the face next to it.
    fn of_wall(side: &[DVec3]) -> Self {
        let out_m = -TOLERANCE_M * normal(side);
        let moved: Vec<DVec3> = side.iter().map(|corner| *corner + out_m).collect();
        Self::new(shrunk(&moved))
    }
}

fn pieces(solid: &Solid) -> Vec<Piece> {
    if solid.enclosure() == Enclosure::Convex {
        return vec![Piece::new(shrunk(solid.vertices_m()))];
    }
    let vertices_m = solid.vertices_m();
    let face = |corners: &[usize]| {
        corners
            .iter()
            .map(|corner| vertices_m[*corner])
            .collect::<Vec<_>>()
    };
    solid
        .faces()
        .map(|corners| Piece::new(face(corners)))
        .collect()
}

/// The corners, nearer to the middle by [`TOLERANCE_M`] on each axis at most.
fn shrunk(points: &[DVec3]) -> Vec<DVec3> {
    let Bounds { low, high } = Bounds::of(points);
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let keep = (half - TOLERANCE_M).max(DVec3::ZERO) / half.max(DVec3::splat(TOLERANCE_M));
    points
        .iter()
        .map(|vertex| middle + (*vertex - middle) * keep)
        .collect()
}

/// An agent with the straight legs of its way.
struct Mover<'a> {
    agent: &'a Agent,
    legs: Vec<Leg>,
    /// Turned as it is at first; of one that does not turn, for ever.
    shape: Shape,
    /// The box around it in all its turns.
    bounds: Bounds,
}

/// A time in which neither of two turns or changes its direction.
#[derive(Debug, Clone, Copy)]
struct Span {
    start_s: f64,
    end_s: f64,
    /// The sum of their highest speeds.
    speed_max_m_per_s: f64,
}

impl Span {
    const STILL: Self = Self {
        start_s: 0.0,
        end_s: 0.0,
        speed_max_m_per_s: 0.0,
    };
}

impl<'a> Mover<'a> {
    fn new(agent: &'a Agent) -> Self {
        let legs = agent
            .trajectory
            .as_ref()
            .map_or_else(Vec::new, Trajectory::legs);
        let mut mover = Self {
            agent,
            legs,
            shape: Shape::new(agent.parts.iter().map(|part| &part.solid)),
            bounds: Bounds::NOTHING,
        };
        mover.bounds = mover.shape.bounds;
        if let Some(turns) = &agent.turns {
            let turned = turns.iter().map(|turn| mover.turned(*turn).bounds);
            mover.bounds = turned.fold(mover.bounds, Bounds::with);
        }
        mover
    }

    fn may_touch(&self, name: &str) -> bool {
        self.agent.touches.iter().any(|touched| touched == name)
    }

    /// How far it has moved from its start.
    fn moved_m(&self, time_s: f64) -> DVec3 {
        let trajectory = self.agent.trajectory.as_ref();
        trajectory.map_or(DVec3::ZERO, |way| way.at_s(time_s) - self.agent.start_m)
    }

    fn turned(&self, turn: DMat3) -> Shape {
        let turned: Vec<Solid> = self
            .agent
            .parts
            .iter()
            .map(|part| self.agent.turned(&part.solid, turn))
            .collect();
        Shape::new(&turned)
    }

    /// Its shape during a span, if it is not the one it has at first.
    fn turned_in(&self, span: &Span) -> Option<Shape> {
        let turns = self.agent.turns.as_ref()?;
        let way = self.agent.trajectory.as_ref()?;
        let middle_s = 0.5 * (span.start_s + span.end_s);
        turns
            .get(way.heads_for(middle_s))
            .map(|turn| self.turned(*turn))
    }

    fn meets_shape(&self, obstacle: &Shape) -> Option<Meeting> {
        self.spans(&self.legs).into_iter().find_map(|span| {
            let (from_m, to_m) = (self.moved_m(span.start_s), self.moved_m(span.end_s));
            if !self.bounds.swept(from_m, to_m).meets(&obstacle.bounds) {
                return None;
            }
            let turned = self.turned_in(&span);
            first_meeting(
                (turned.as_ref().unwrap_or(&self.shape), &|time_s| {
                    self.moved_m(time_s)
                }),
                (obstacle, &|_| DVec3::ZERO),
                &span,
            )
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
            if !swept(self).meets(&swept(other)) {
                return None;
            }
            span.speed_max_m_per_s = self.speed_in(&span) + other.speed_in(&span);
            let (turned, other_turned) = (self.turned_in(&span), other.turned_in(&span));
            first_meeting(
                (turned.as_ref().unwrap_or(&self.shape), &|time_s| {
                    self.moved_m(time_s)
                }),
                (other_turned.as_ref().unwrap_or(&other.shape), &|time_s| {
                    other.moved_m(time_s)
                }),
                &span,
            )
        })
    }

    /// The spans between all ends of the legs; one of no length if nobody moves.
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
            spans.push(Span {
                start_s,
                end_s: start_s,
                speed_max_m_per_s: 0.0,
            });
        }
        spans
    }

    fn speed_in(&self, span: &Span) -> f64 {
        let middle_s = 0.5 * (span.start_s + span.end_s);
        let leg = self.legs.partition_point(|leg| leg.end_s <= middle_s);
        self.legs.get(leg).map_or(0.0, |leg| leg.speed_max_m_per_s)
    }
}

/// A shape, and how far it has moved at a time.
type Moving<'a> = (&'a Shape, &'a dyn Fn(f64) -> DVec3);

/// The first moment of a span in which any of their pieces meet.
fn first_meeting(one: Moving<'_>, other: Moving<'_>, span: &Span) -> Option<Meeting> {
    let swept = |bounds: Bounds, moved_m: &dyn Fn(f64) -> DVec3| {
        bounds.swept(moved_m(span.start_s), moved_m(span.end_s))
    };
    let mut first: Option<Meeting> = None;
    for piece in &one.0.pieces {
        let bounds = swept(piece.bounds, one.1);
        if !bounds.meets(&swept(other.0.bounds, other.1)) {
            continue;
        }
        for other_piece in &other.0.pieces {
            if !bounds.meets(&swept(other_piece.bounds, other.1)) {
                continue;
            }
            let gap_at = |time_s: f64| {
                let (moved_m, other_moved_m) = (one.1(time_s), other.1(time_s));
                let gap = gap(&piece.points, moved_m - other_moved_m, &other_piece.points);
                Gap {
                    middle_m: gap.middle_m + other_moved_m,
                    ..gap
                }
            };
            // Nobody asks for what comes after the first that was found.
            let span = Span {
                end_s: first.map_or(span.end_s, |first| first.time_s),
                ..*span
            };
            let found = advance(&gap_at, &span);
            first = match (first, found) {
                (Some(first), Some(found)) if found.time_s >= first.time_s => Some(first),
                (_, Some(found)) => Some(found),
                (first, None) => first,
            };
        }
    }
    first
}

/// Steps through a span as fast as the gap allows.
fn advance(gap_at: &dyn Fn(f64) -> Gap, span: &Span) -> Option<Meeting> {
    let (start_s, end_s, speed) = (span.start_s, span.end_s, span.speed_max_m_per_s);
    let step_min_m = STEP_M.max(speed * (end_s - start_s) / STEPS_MAX);
    let (mut free_s, mut time_s) = (start_s, start_s);
    loop {
        let gap = gap_at(time_s);
        if gap.distance_m <= 0.0 {
            return Some(refined(gap_at, free_s, (time_s, gap)));
        }
        if time_s >= end_s || speed <= 0.0 {
            return None;
        }
        free_s = time_s;
        time_s = (time_s + gap.distance_m.max(step_min_m) / speed).min(end_s);
    }
}

/// Where between a time that is free and one that is not the contact begins.
fn refined(gap_at: &dyn Fn(f64) -> Gap, mut free_s: f64, mut met: (f64, Gap)) -> Meeting {
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (free_s + met.0);
        let gap = gap_at(middle_s);
        if gap.distance_m <= 0.0 {
            met = (middle_s, gap);
        } else {
            free_s = middle_s;
        }
    }
    Meeting {
        time_s: met.0,
        place_m: met.1.middle_m,
    }
}
