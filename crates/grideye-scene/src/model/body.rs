//! What is in the room: bodies that stand, and agents that move.

use crate::geometry::{Mesh, rotation_z_deg};
use crate::heat::Thermal;
use crate::motion::Trajectory;
use crate::radiometry::Surface;
use glam::{DMat3, DVec3};
use std::time::Duration;

/// A thing, standing or at the start of its way; of one temperature, if its keys say nothing else.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Its name in the file.
    pub name: String,
    /// Its place in the room: what the file calls its position, meters.
    pub base_m: DVec3,
    /// Its surface, where it stands.
    pub mesh: Mesh,
    /// Its temperature at the start and on the whole, and its emissivity.
    pub surface: Surface,
    pub(crate) thermal: Thermal,
    /// Its color in drawings of the room: red, green, blue.
    pub color: Option<[u8; 3]>,
}

/// Somebody who may move: one or several bodies that keep their places to one another.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Agent {
    /// Its name in the file.
    pub name: String,
    /// Its bodies, where they are at the start of its way; one at least.
    pub parts: Vec<Body>,
    /// Where it starts, meters.
    pub start_m: DVec3,
    /// Its way, or `None` if it stands still.
    pub trajectory: Option<Trajectory>,
    /// How it is turned on its way to each way-point; `None` if it does not turn.
    pub(crate) turns: Option<Vec<DMat3>>,
    pub(crate) touches: Vec<String>,
}

impl Body {
    /// A body of one temperature that stays as it is.
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

    /// The same turned counter-clockwise about the vertical through the origin, seen from above, and then moved.
    #[must_use]
    pub fn placed(&self, yaw_deg: f64, offset_m: DVec3) -> Self {
        let turn = rotation_z_deg(yaw_deg);
        Self {
            base_m: offset_m + turn * self.base_m,
            mesh: self.mesh.clone().placed(turn, offset_m),
            ..self.clone()
        }
    }

    /// Its temperature on the whole after `time_s`.
    #[must_use]
    pub fn celsius(&self, ambient_c: f64, time_s: f64) -> f64 {
        match &self.thermal.transient {
            None => self.surface.celsius,
            Some(heat) => heat.celsius(self.surface.celsius, ambient_c, time_s),
        }
    }
}

impl Agent {
    /// Somebody who stays where he is.
    #[must_use]
    pub fn at_rest(name: &str, parts: Vec<Body>, start_m: DVec3) -> Self {
        Self {
            name: name.to_owned(),
            parts,
            start_m,
            trajectory: None,
            turns: None,
            touches: Vec::new(),
        }
    }

    /// Where the agent is at `time`: the middle of its underside, meters.
    #[must_use]
    pub fn position_m(&self, time: Duration) -> DVec3 {
        let way = self.trajectory.as_ref();
        way.map_or(self.start_m, |way| way.position_m(time))
    }

    /// How it is turned about the vertical at `time`, from how its parts are given: with its way, if the file says so.
    #[must_use]
    pub fn turn(&self, time: Duration) -> Option<DMat3> {
        let turns = self.turns.as_ref()?;
        let heads_for = self.trajectory.as_ref()?.heads_for(time.as_secs_f64());
        turns.get(heads_for).copied()
    }

    /// Its bodies where they are at `time`.
    #[must_use]
    pub fn bodies_at(&self, time: Duration) -> Vec<Body> {
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

    /// One of its parts, turned about the vertical through its start.
    pub(crate) fn turned(&self, part: &Mesh, turn: DMat3) -> Mesh {
        part.clone()
            .placed(turn, self.start_m - turn * self.start_m)
    }

    /// The time it takes for its way: zero if it stands still.
    #[must_use]
    pub fn duration(&self) -> Duration {
        let way = self.trajectory.as_ref();
        way.map_or(Duration::ZERO, Trajectory::duration)
    }
}
