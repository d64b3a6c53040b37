//! What is in the room: bodies that stand, and agents that may move.

use crate::geometry::{Ellipsoid, Mesh, rotation_z_deg};
use crate::heat::Thermal;
use crate::model::doing::{Change, Doing, Keep};
use crate::model::person::{Moment, Person, Posture, SEGMENTS, Stride};
use crate::motion::Trajectory;
use crate::radiometry::Surface;
use glam::{DMat3, DVec3};
use std::time::Duration;

/// A body, standing or at the start of an agent's path; by default its temperature is uniform and constant.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Its name in the file.
    pub name: String,
    /// Its position as in the file, meters.
    pub base_m: DVec3,
    /// Its surface, in place.
    pub mesh: Mesh,
    /// Its mean temperature at the start, and its emissivity.
    pub surface: Surface,
    pub(crate) thermal: Thermal,
    /// Its color in drawings of the room: red, green, blue.
    pub color: Option<[u8; 3]>,
}

/// One or several bodies that move together, or stand still.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Agent {
    /// Its name in the file.
    pub name: String,
    /// Its bodies at the start of its path; at least one.
    pub parts: Vec<Body>,
    /// Where it starts, meters.
    pub start_m: DVec3,
    /// Its path, or `None` if it stands still.
    pub trajectory: Option<Trajectory>,
    /// Its rotation on the way to each waypoint; `None` if it does not turn.
    pub(crate) turns: Option<Vec<DMat3>>,
    pub(crate) touches: Vec<String>,
    /// The person whose segments its bodies are; `None` for bodies that the file gives.
    pub person: Option<Person>,
    /// The person's posture at each waypoint; empty if it does not change.
    pub(crate) keeps: Vec<Keep>,
}

impl Body {
    /// A person's segments at the start of its path.
    pub(crate) fn segments_of(
        person: &Person,
        start_m: DVec3,
        surfaces: [Surface; SEGMENTS],
        color: Option<[u8; 3]>,
    ) -> Vec<Self> {
        let segments = person.segments(&Moment::of(person.posture, Stride::default()));
        let parts = Person::names().zip(segments).zip(surfaces);
        let parts = parts.map(|((name, segment), surface)| Self {
            color,
            ..Self::new(
                name,
                start_m,
                segment.turned(person.facing, start_m).mesh(),
                surface,
            )
        });
        parts.collect()
    }

    /// A body of uniform, constant temperature.
    #[must_use]
    pub fn new(name: &str, base_m: DVec3, mesh: Mesh, surface: Surface) -> Self {
        Self {
            name: name.to_owned(),
            base_m,
            mesh,
            surface,
            thermal: Thermal::default(),
            color: None,
        }
    }

    /// The body rotated counter-clockwise (seen from above) about the vertical through the origin, then moved.
    #[must_use]
    pub fn placed(&self, yaw_deg: f64, offset_m: DVec3) -> Self {
        let turn = rotation_z_deg(yaw_deg);
        Self {
            base_m: offset_m + turn * self.base_m,
            mesh: self.mesh.clone().placed(turn, offset_m),
            ..self.clone()
        }
    }

    /// Its mean temperature after `time_s`.
    #[must_use]
    pub fn celsius(&self, ambient_c: f64, time_s: f64) -> f64 {
        match &self.thermal.transient {
            None => self.surface.celsius,
            Some(heat) => heat.celsius(self.surface.celsius, ambient_c, time_s),
        }
    }
}

impl Agent {
    /// An agent that stands still.
    #[must_use]
    pub fn at_rest(name: &str, parts: Vec<Body>, start_m: DVec3) -> Self {
        Self {
            name: name.to_owned(),
            parts,
            start_m,
            trajectory: None,
            turns: None,
            touches: Vec::new(),
            person: None,
            keeps: Vec::new(),
        }
    }

    /// The agent's position at `time`: the center of its base, meters.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        let way = self.trajectory.as_ref();
        way.map_or(self.start_m, |way| way.position_m(time))
    }

    /// Its rotation about the vertical at `time`, relative to its given parts; `None` unless the file lets it turn.
    #[must_use]
    pub fn turn(&self, time: Duration) -> Option<DMat3> {
        let turns = self.turns.as_ref()?;
        let heads_for = self.trajectory.as_ref()?.heads_for(time.as_secs_f64());
        turns.get(heads_for).copied()
    }

    /// Turns a person's front from +x to where it faces at `time`; `None` for other agents.
    #[must_use]
    pub fn facing(&self, time: Duration) -> Option<DMat3> {
        let person = self.person.as_ref()?;
        Some(self.heading_at(time).unwrap_or(person.facing))
    }

    /// A person's segments at `time`, in the order of its bodies: the center and, as columns, the semi-axes of each,
    /// meters; `None` for other agents.
    #[must_use]
    pub fn rounded_m(&self, time: Duration) -> Option<[(DVec3, DMat3); SEGMENTS]> {
        let segments = self.segments_at(time)?;
        Some(segments.map(|segment| (segment.center_m, segment.axes_m)))
    }

    /// A person's segments at `time`, in the order of its bodies.
    pub(crate) fn segments_at(&self, time: Duration) -> Option<[Ellipsoid; SEGMENTS]> {
        let person = self.person.as_ref()?;
        let time_s = time.as_secs_f64();
        let change = self.change_at(time_s);
        // Who sits down or falls moves along the way too, but not by steps.
        let is_upright = change.is_none_or(|change| change.is_upright());
        let way = self.trajectory.as_ref().filter(|_| is_upright);
        let stride = way.map_or(Stride::default(), |way| {
            let (length_m, speed_m_per_s) = way.pace_at_s(time_s);
            person.stride(length_m, speed_m_per_s)
        });
        let turn = self.facing(time)?;
        let at_m = self.position_m(time);
        let moment = match change {
            None => Moment::of(person.posture, stride),
            Some(change) => {
                let [from, to] = change.postures();
                let share = change.share();
                Moment {
                    from,
                    to,
                    share,
                    head_to: Some(turn.transpose() * change.head_to(turn.x_axis)),
                    stride,
                }
            }
        };
        let segments = person.segments(&moment);
        Some(segments.map(|segment| segment.turned(turn, at_m)))
    }

    fn change_at(&self, time_s: f64) -> Option<Change> {
        Change::at(&self.keeps, time_s)
    }

    /// Whether the agent is in the room at `time`: its trajectory may begin or end with its being away.
    #[must_use]
    pub fn is_here(&self, time: Duration) -> bool {
        let change = self.change_at(time.as_secs_f64());
        change.is_none_or(|change| !change.is_away())
    }

    /// Whether it is in the room at any time.
    #[must_use]
    pub fn is_ever_here(&self) -> bool {
        self.keeps.is_empty() || self.keeps.iter().any(|keep| keep.posture.is_some())
    }

    /// A person's posture at `time`, of a change the nearer one; `None` for other agents and while it is away.
    #[must_use]
    pub fn posture(&self, time: Duration) -> Option<Posture> {
        let nearer = match self.change_at(time.as_secs_f64()) {
            None => self.person.as_ref()?.posture,
            Some(change) => change.postures()[usize::from(change.passed >= 0.5)],
        };
        Some(match self.doing(time)? {
            Doing::Walk | Doing::Enter | Doing::Leave => Posture::Walk,
            _ if nearer == Posture::Walk => Posture::Stand,
            _ => nearer,
        })
    }

    /// What a person does at `time`; `None` for other agents and while it is away.
    #[must_use]
    pub fn doing(&self, time: Duration) -> Option<Doing> {
        const MOVES_M_PER_S: f64 = 0.05;
        let person = self.person.as_ref()?;
        let time_s = time.as_secs_f64();
        let way = self.trajectory.as_ref();
        let moves = way.is_some_and(|way| way.pace_at_s(time_s).1 > MOVES_M_PER_S);
        match self.change_at(time_s) {
            None => Some(Doing::between(
                Some(person.posture),
                Some(person.posture),
                moves,
            )),
            Some(change) if change.is_away() => None,
            Some(change) => {
                let [from, to] = [change.from.posture, change.to.posture];
                Some(Doing::between(from, to, moves && change.passed > 0.0))
            }
        }
    }

    /// The agent standing at another place, in a walk's neutral pose.
    ///
    /// `turn` is its rotation about the vertical: a person's from facing +x, otherwise from how its parts are given.
    #[must_use]
    pub fn standing_at(&self, place_m: DVec3, turn: DMat3) -> Self {
        let move_m = place_m - self.start_m;
        let parts = self.parts.iter().map(|part| Body {
            base_m: part.base_m + move_m,
            mesh: self
                .turned(&part.mesh, turn)
                .placed(DMat3::IDENTITY, move_m),
            ..part.clone()
        });
        // Not the rest of a copy: a trajectory is long.
        let mut standing = Self::at_rest(&self.name, parts.collect(), place_m);
        standing.touches.clone_from(&self.touches);
        let facing = turn;
        standing.person = self.person.map(|person| Person { facing, ..person });
        standing
    }

    /// The way a walker faces: where it goes within a step's time, so that a tracker's noise does not turn it.
    fn heading_at(&self, time: Duration) -> Option<DMat3> {
        const AROUND_S: f64 = 0.3;
        const FAR_M: f64 = 0.1;
        let turn = self.turn(time)?;
        let way = self.trajectory.as_ref()?;
        let time_s = time.as_secs_f64();
        let (mut from_s, mut to_s) = ((time_s - AROUND_S).max(0.0), time_s + AROUND_S);
        if let Some(change) = self.change_at(time_s) {
            if !change.is_upright() {
                return Some(turn);
            }
            // Not into the next leg, which may be a fall.
            (from_s, to_s) = (from_s.max(change.from.from_s), to_s.min(change.to.until_s));
        }
        let along_m = way.at_s(to_s) - way.at_s(from_s);
        let along_m = along_m.with_z(0.0);
        Some(match along_m.try_normalize() {
            Some(along) if along_m.length() > FAR_M => {
                DMat3::from_cols(along, DVec3::Z.cross(along), DVec3::Z)
            }
            _ => turn,
        })
    }

    /// The direction of its front at `time`, radians counter-clockwise from +x; a body that the file gives has its front
    /// at +x until it turns.
    #[must_use]
    pub fn front_rad(&self, time: Duration) -> f64 {
        let turn = self.facing(time).or_else(|| self.turn(time));
        let turn = turn.unwrap_or(DMat3::IDENTITY);
        libm::atan2(turn.x_axis.y, turn.x_axis.x)
    }

    /// Its bodies at `time`; none while it is away.
    #[must_use]
    pub fn bodies_at(&self, time: Duration) -> Vec<Body> {
        if !self.is_here(time) {
            return Vec::new();
        }
        if let Some(segments) = self.segments_at(time) {
            let parts = self.parts.iter().zip(&segments);
            let moved = parts.map(|(part, segment)| Body {
                base_m: self.position_m(time),
                mesh: segment.mesh(),
                ..part.clone()
            });
            return moved.collect();
        }
        let turn = self.turn(time).unwrap_or(DMat3::IDENTITY);
        let at_m = self.position_m(time);
        let parts = self.parts.iter().map(|part| Body {
            base_m: at_m + turn * (part.base_m - self.start_m),
            mesh: self.standing(&part.mesh, time.as_secs_f64()),
            ..part.clone()
        });
        parts.collect()
    }

    pub(crate) fn standing(&self, part: &Mesh, time_s: f64) -> Mesh {
        let time = Duration::try_from_secs_f64(time_s).unwrap_or(Duration::MAX);
        let turned = self.turned(part, self.turn(time).unwrap_or(DMat3::IDENTITY));
        turned.placed(DMat3::IDENTITY, self.position_m(time) - self.start_m)
    }

    /// One of its parts, rotated about the vertical through its start.
    pub(crate) fn turned(&self, part: &Mesh, turn: DMat3) -> Mesh {
        part.clone()
            .placed(turn, self.start_m - turn * self.start_m)
    }

    /// The duration of its path; zero if it stands still.
    #[must_use]
    pub fn duration(&self) -> Duration {
        let way = self.trajectory.as_ref();
        way.map_or(Duration::ZERO, Trajectory::duration)
    }
}
