//! What a scene has and its sensors never see: people who are never in the room or in view, warm things beyond the view.

use crate::geometry::{Cuboid, Mesh, clipped, polygon::bounds};
use crate::model::{Agent, Body, Doing, Model, Scene, Sensor};
use crate::simulator::Simulator;
use glam::{DVec2, DVec3};
use grideye_text::{Place, Refusal};
use std::time::Duration;
use toml::de::DeTable;

/// Something that is in no frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unseen {
    /// What is wrong.
    pub why: Why,
    /// The name of the agent, object or sensor.
    pub name: String,
    /// The sensor it is about; `None` for all sensors of the scene.
    pub sensor: Option<String>,
}

/// Why something is in no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// The agent is not in the room at any time.
    NeverHere,
    /// The agent is in the room, but no sensor sees it.
    NeverInView,
    /// The object is warmer or colder than the room, and out of view.
    HeatOutOfView,
    /// The sensor sees nothing of what the scene has.
    SeesNothing,
}

/// At most so many moments are looked at, and so many images made; a scene that would need more has no findings.
const MOMENTS_MAX: u32 = 100_000;
const IMAGES_MAX: usize = 6_000;
/// How far from its middle a person upright reaches, in heights.
const STRIDE: f64 = 0.4;
/// Somebody is seen from so many pixels on.
const SEEN_PIXELS: f64 = 0.01;
/// Less than this off the room's temperature is no heat source.
const HEAT_C: f64 = 2.0;
/// In the physical model, pixels reach beyond the field of view.
const PHYSICAL_REACH: f64 = 1.15;

impl Scene {
    /// What this sensor never sees in the scene's time, or what no sensor sees; without sensors, only who is never there.
    ///
    /// It says only what is certain: if too many images would be needed to know, it is silent.
    #[must_use]
    pub fn unseen(&self, sensor: Option<&str>) -> Vec<Unseen> {
        self.unseen_while(sensor, &|| true)
    }

    /// The same, and silent about agents once `goes_on` says no.
    #[must_use]
    pub fn unseen_while(&self, sensor: Option<&str>, goes_on: &dyn Fn() -> bool) -> Vec<Unseen> {
        let is_asked = |one: &&Sensor| sensor.is_none_or(|name| one.name == name);
        let sensors: Vec<&Sensor> = self.sensors.iter().filter(is_asked).collect();
        let of = |why: Why, name: &str| Unseen {
            why,
            name: name.to_owned(),
            sensor: sensor.map(str::to_owned),
        };
        let (here, never): (Vec<&Agent>, Vec<&Agent>) =
            self.agents.iter().partition(|agent| agent.is_ever_here());
        let never = never.iter();
        let mut found: Vec<Unseen> = never.map(|agent| of(Why::NeverHere, &agent.name)).collect();
        if sensors.is_empty() {
            return found;
        }
        let mut hidden = here.clone();
        for sensor in &sensors {
            hidden = self.not_seen_by(sensor, &hidden, goes_on);
        }
        found.extend(hidden.iter().map(|agent| of(Why::NeverInView, &agent.name)));
        let is_out = |object: &&Body| !sensors.iter().any(|one| self.is_in_view(one, &object.mesh));
        let ambient_c = self.room.ambient_c;
        let is_warm = |object: &&Body| (object.celsius(ambient_c, 0.0) - ambient_c).abs() >= HEAT_C;
        let warm = self.objects.iter().filter(is_warm).filter(is_out);
        found.extend(warm.map(|object| of(Why::HeatOutOfView, &object.name)));
        for one in sensors {
            let is_empty = self.objects.is_empty() && here.is_empty();
            let mut objects = self.objects.iter();
            let sees_objects = objects.any(|body| self.is_in_view(one, &body.mesh));
            let unseen = || self.not_seen_by(one, &here, goes_on).len();
            if !is_empty && !sees_objects && unseen() == here.len() {
                let sensor = None;
                found.push(Unseen {
                    sensor,
                    ..of(Why::SeesNothing, &one.name)
                });
            }
        }
        found
    }

    /// Those of the agents that the sensor is sure never to see.
    fn not_seen_by<'a>(
        &self,
        sensor: &Sensor,
        agents: &[&'a Agent],
        goes_on: &dyn Fn() -> bool,
    ) -> Vec<&'a Agent> {
        let Ok(mut simulator) = Simulator::new(self, &sensor.name) else {
            return Vec::new();
        };
        let mut pending = agents.to_vec();
        let moments = self.frame_count(sensor).clamp(1, u64::from(MOMENTS_MAX));
        let step = self.duration() / u32::try_from(moments).unwrap_or(MOMENTS_MAX);
        let times = (0..=moments).map(|index| step * u32::try_from(index).unwrap_or(MOMENTS_MAX));
        let (mut images, mut drawn) = (0, Vec::new());
        for time in times {
            if !goes_on() {
                return Vec::new();
            }
            let is_near = |agent: &&&Agent| self.may_be_in_view(sensor, agent, time);
            let near: Vec<&Agent> = pending.iter().filter(is_near).copied().collect();
            let state = |agent: &&Agent| {
                let (place_m, doing) = (agent.position_m(time), agent.doing(time));
                (agent.name.clone(), place_m, agent.posture(time), doing)
            };
            let states: Vec<_> = near.iter().map(state).collect();
            if states.is_empty() || states == drawn {
                continue;
            }
            // The time of an image grows with the square.
            images += near.len() * near.len();
            if images > IMAGES_MAX {
                return Vec::new();
            }
            simulator.replace_agents(near.iter().copied().cloned().collect());
            let (.., filled) = simulator.labeled(time, 0);
            let near = near.iter();
            let seen = near
                .zip(filled)
                .filter(|(_, filled)| filled.seen.pixels() > SEEN_PIXELS);
            let seen: Vec<&str> = seen.map(|(agent, _)| agent.name.as_str()).collect();
            pending.retain(|agent| !seen.contains(&agent.name.as_str()));
            drawn = states;
        }
        pending
    }

    /// Whether a box around the agent, however it turns, reaches into the view.
    fn may_be_in_view(&self, sensor: &Sensor, agent: &Agent, time: Duration) -> bool {
        let corners = agent.parts.iter().flat_map(|part| part.mesh.vertices_m());
        let corners = corners.map(|corner| *corner - agent.start_m);
        let (mut aside_m, mut low_m, mut high_m) = (0.0_f64, 0.0_f64, 0.0_f64);
        for corner in corners {
            aside_m = aside_m.max(corner.truncate().length());
            (low_m, high_m) = (low_m.min(corner.z), high_m.max(corner.z));
        }
        if let Some(person) = agent.person {
            let is_upright = matches!(agent.doing(time), Some(Doing::Walk | Doing::Stand));
            aside_m = person.height_m * if is_upright { STRIDE } else { 1.0 };
            high_m = high_m.max(person.height_m);
        }
        let base_m = agent.position_m(time) + low_m * DVec3::Z;
        let size_m = DVec3::new(2.0 * aside_m, 2.0 * aside_m, high_m - low_m);
        let around = Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0));
        agent.is_here(time) && self.is_in_view(sensor, &around)
    }

    /// Whether any face reaches into the view, hidden or not.
    fn is_in_view(&self, sensor: &Sensor, mesh: &Mesh) -> bool {
        let slopes = self.reach(sensor);
        let borders = [
            DVec3::new(slopes.x, 1.0, 0.0),
            DVec3::new(slopes.x, -1.0, 0.0),
            DVec3::new(slopes.y, 0.0, 1.0),
            DVec3::new(slopes.y, 0.0, -1.0),
        ];
        let vertices_m = mesh.vertices_m();
        mesh.faces().any(|face| {
            let corners = face.iter().map(|corner| vertices_m[*corner]);
            let corners: Vec<DVec3> = corners.map(|at| sensor.pose.point_in_sensor(at)).collect();
            let inside = borders.iter().fold(corners, |inside, border| {
                clipped(&inside, |corner: DVec3| border.dot(corner))
            });
            let ahead = inside.iter().filter(|corner| corner.x > 1e-9);
            let (low, high) = bounds(ahead.map(|at| DVec2::new(at.y, at.z) / at.x));
            (high - low).max_element() > 1e-6
        })
    }

    fn reach(&self, sensor: &Sensor) -> DVec2 {
        let reach = if self.model == Model::Physical {
            PHYSICAL_REACH
        } else {
            1.0
        };
        reach * sensor.view_slopes()
    }
}

impl Unseen {
    /// Whether it is most likely a mistake; heat out of view is often only a part of the room.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.why != Why::HeatOutOfView
    }

    /// The warning, at the name's place in the scene's text.
    #[must_use]
    pub fn warning(&self, text: &str, origin: &str) -> Refusal {
        let name = &self.name;
        let view = match &self.sensor {
            Some(sensor) => format!("in view of sensor `{sensor}`"),
            None => "in view of any sensor".to_owned(),
        };
        let (kind, problem, hint) = match self.why {
            Why::NeverHere => (
                "agent",
                format!(
                    "agent `{name}` is never in the room: no leg of its trajectory has a posture"
                ),
                "it is in the room from the waypoint with `enter` to the one with `leave`, or between any whose posture is not `away`: give the waypoints between walk, stand, sit or lie",
            ),
            Why::NeverInView => (
                "agent",
                format!("agent `{name}` is never {view}, so no frame shows it"),
                "move it, or move and turn the sensor; `grideye simulate --view room.svg` draws both",
            ),
            Why::HeatOutOfView => (
                "object",
                format!("object `{name}` is not {view}, so no frame shows its heat"),
                "move and turn the sensor if it should; else leave temperature_c out",
            ),
            Why::SeesNothing => (
                "sensor",
                format!("sensor `{name}` never sees anything of what the scene has"),
                "elevation_deg = 90 looks straight down, 0 level; azimuth_deg turns from +x to +y",
            ),
        };
        let start = start_of(text, kind, name).unwrap_or(0);
        Place::of_byte(origin, text, start).refused(problem, hint)
    }
}

/// Where the table of this kind with this name says its name.
fn start_of(text: &str, kind: &str, name: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let tables = document.get_ref().get(kind)?.get_ref().as_array()?.iter();
    let mut names = tables.filter_map(|table| table.get_ref().as_table()?.get("name"));
    let found = names.find(|found| found.get_ref().as_str() == Some(name))?;
    Some(found.span().start)
}
