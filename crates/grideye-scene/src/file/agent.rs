//! From an agent's keys and its trajectory to somebody who walks in the room.

use crate::file::body;
use crate::file::document::AgentTable;
use crate::file::files::Files;
use crate::file::rule::{ACCELERATION, SPEED};
use crate::file::source::{Source, read_below};
use crate::file::waypoints::{Waypoint, read_waypoints};
use crate::model::body::Agent;
use crate::model::contact::Walls;
use crate::model::error::SceneError;
use crate::model::limits;
use crate::model::limits::TIME_MAX_S;
use crate::model::room::Room;
use crate::motion::schedule::{Clock, Motion, Schedule};
use crate::motion::trajectory::{Trajectory, lengths_m};
use crate::text::lengths::{MM_PER_M, millimetres, reach};
use glam::{DMat3, DVec3};
use toml::Spanned;

pub(crate) fn agent(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    (room, walls): (&Room, &Walls),
    files: &dyn Files,
) -> Result<Agent, SceneError> {
    let keys = table.get_ref();
    let waypoints = waypoints(source, table, files)?;
    let start_m = waypoints
        .first()
        .map_or(DVec3::ZERO, |point| point.position_mm / MM_PER_M);
    let trajectory = trajectory(source, table, &waypoints)?;
    let agent = Agent {
        name: source.name(&keys.name)?,
        parts: body::parts(source, table, start_m, room.ambient_c, files)?,
        start_m,
        turns: turns(source, table, trajectory.as_ref())?,
        touches: touches(keys),
        trajectory,
    };
    // The agent turns at way-points only: if it is inside there, before and after the turn, it is so between them, but
    // for walls that jut into the room.
    for (index, point) in waypoints.iter().enumerate() {
        check_inside(&agent, index, point, room)?;
    }
    check_walls(&agent, &waypoints, walls)?;
    Ok(agent)
}

/// The rows of the trajectory, or the position as the only way-point.
fn waypoints(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    files: &dyn Files,
) -> Result<Vec<Waypoint>, SceneError> {
    let keys = table.get_ref();
    let place = || source.place(table.span().start);
    let titled = || format!("agent `{}`", keys.name.get_ref());
    match (&keys.position_mm, &keys.trajectory) {
        (Some(position_mm), None) => Ok(vec![Waypoint::standing(
            source.position_m(position_mm)? * MM_PER_M,
            source.place(position_mm.span().start),
        )]),
        (None, Some(path)) => {
            let text = read_below(source, ("trajectory", "trajectory"), path, files)?;
            read_waypoints(path.get_ref(), &text)
        }
        (Some(_), Some(_)) => Err(SceneError::KeysConflict {
            place: place(),
            table: titled(),
            key: "position_mm",
            other: "trajectory",
            hint: "an agent that walks starts at the first row of its trajectory",
        }),
        (None, None) => Err(SceneError::MissingKey {
            place: place(),
            table: titled(),
            key: "position_mm",
            hint: "give position_mm if it stands still, or trajectory and speed_mm_per_s if it walks",
        }),
    }
}

fn trajectory(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    waypoints: &[Waypoint],
) -> Result<Option<Trajectory>, SceneError> {
    let keys = table.get_ref();
    let motion = motion(source, table)?;
    let Some(path) = &keys.trajectory else {
        return check_no_way(source, keys).map(|()| None);
    };
    let points_m: Vec<DVec3> = waypoints
        .iter()
        .map(|point| point.position_mm / MM_PER_M)
        .collect();
    let missing_speed = || SceneError::MissingKey {
        place: source.place(path.span().start),
        table: titled(keys),
        key: "speed_mm_per_s",
        hint: "a person walks at 500 to 1500 mm/s; the paper's examples have 800 and 1600",
    };
    let stamps: Option<Vec<f64>> = waypoints.iter().map(|point| point.time_s).collect();
    match (stamps, &keys.speed_mm_per_s) {
        (Some(_), Some(speed)) => Err(SceneError::KeysConflict {
            place: source.place(speed.span().start),
            table: titled(keys),
            key: "speed_mm_per_s",
            other: "t_s",
            hint: "a trajectory with the column t_s says itself when each way-point is reached; leave the speed or the column out",
        }),
        (Some(stamps), None) => stamped(motion, waypoints, points_m, &stamps).map(Some),
        (None, None) => Err(missing_speed()),
        (None, Some(speed)) => {
            let speed_m_per_s = source.number(speed, &SPEED)? / MM_PER_M;
            let trajectory = paced(motion, waypoints, points_m, speed_m_per_s);
            if trajectory.end_s() <= TIME_MAX_S {
                return Ok(Some(trajectory));
            }
            Err(source.refused(
                "speed_mm_per_s",
                speed.span(),
                &format!(
                    "a speed at which the way takes at most {} days",
                    limits::WALK_DAYS_MAX
                ),
                SPEED.hint,
            ))
        }
    }
}

/// Who stands still has no key that is about moving.
fn check_no_way(source: &Source<'_>, keys: &AgentTable) -> Result<(), SceneError> {
    let starts = [
        keys.speed_mm_per_s.as_ref().map(|key| key.span().start),
        keys.motion.as_ref().map(|key| key.span().start),
        keys.faces.as_ref().map(|key| key.span().start),
    ];
    match starts.into_iter().flatten().min() {
        None => Ok(()),
        Some(start) => Err(SceneError::MissingKey {
            place: source.place(start),
            table: titled(keys),
            key: "trajectory",
            hint: "only an agent with a trajectory has a speed",
        }),
    }
}

fn motion(source: &Source<'_>, table: &Spanned<AgentTable>) -> Result<Motion, SceneError> {
    let keys = table.get_ref();
    let given = keys.acceleration_mm_per_s2.as_ref();
    let acceleration = source.optional(given, &ACCELERATION)?;
    let name = keys.motion.as_ref().map(|name| name.get_ref().as_str());
    match (name, acceleration, &keys.motion) {
        (None | Some("constant"), None, _) => Ok(Motion::Constant),
        (Some("minimum-jerk"), None, _) => Ok(Motion::MinimumJerk),
        (Some("trapezoidal"), Some(acceleration), _) => Ok(Motion::Trapezoidal {
            acceleration_m_per_s2: acceleration / MM_PER_M,
        }),
        (Some("trapezoidal"), None, Some(motion)) => Err(SceneError::MissingKey {
            place: source.place(motion.span().start),
            table: titled(keys),
            key: "acceleration_mm_per_s2",
            hint: ACCELERATION.hint,
        }),
        (None | Some("constant" | "minimum-jerk"), Some(_), _) => {
            let start = given.map_or(table.span().start, |given| given.span().start);
            Err(SceneError::KeysConflict {
                place: source.place(start),
                table: titled(keys),
                key: "acceleration_mm_per_s2",
                other: "motion",
                hint: "only motion = \"trapezoidal\" has an acceleration",
            })
        }
        (_, _, motion) => Err(source.refused(
            "motion",
            motion.as_ref().map_or(table.span(), Spanned::span),
            "\"constant\", \"trapezoidal\" or \"minimum-jerk\"",
            "constant is the default; scenes/README.md describes each",
        )),
    }
}

/// A way walked at a speed.
fn paced(
    motion: Motion,
    waypoints: &[Waypoint],
    points_m: Vec<DVec3>,
    speed_m_per_s: f64,
) -> Trajectory {
    let dwells_s: Vec<f64> = waypoints.iter().map(|point| point.dwell_s).collect();
    let without_stop = dwells_s.iter().all(|dwell_s| *dwell_s <= 0.0);
    if motion == Motion::Constant && without_stop {
        return Trajectory::new(points_m, speed_m_per_s);
    }
    let lengths_m = lengths_m(&points_m);
    match Schedule::new(&lengths_m, &dwells_s, motion, Clock::Speed(speed_m_per_s)) {
        Ok(schedule) => Trajectory::scheduled(points_m, lengths_m, schedule),
        // Only what is tied to times can be too fast.
        Err(_) => Trajectory::new(points_m, speed_m_per_s),
    }
}

/// A way whose way-points are reached at their times.
fn stamped(
    motion: Motion,
    waypoints: &[Waypoint],
    points_m: Vec<DVec3>,
    stamps: &[f64],
) -> Result<Trajectory, SceneError> {
    let mut free_s = None;
    for (point, time_s) in waypoints.iter().zip(stamps) {
        let refused = |expected: String| SceneError::TrajectoryRow {
            place: point.place.clone(),
            found: format!("`{time_s}` as t_s"),
            expected,
        };
        if free_s.is_some_and(|free_s| *time_s <= free_s) {
            let free_s = free_s.unwrap_or_default();
            return Err(refused(format!(
                "more than {free_s} s, when the way-point before it is left"
            )));
        }
        free_s = Some(time_s + point.dwell_s);
        if time_s + point.dwell_s > TIME_MAX_S {
            return Err(refused(format!("a stop that ends by {TIME_MAX_S} s")));
        }
    }
    let dwells_s: Vec<f64> = waypoints.iter().map(|point| point.dwell_s).collect();
    let lengths_m = lengths_m(&points_m);
    match Schedule::new(&lengths_m, &dwells_s, motion, Clock::Stamps(stamps)) {
        Ok(schedule) => Ok(Trajectory::scheduled(points_m, lengths_m, schedule)),
        Err(too_fast) => {
            let index = too_fast.0;
            let leg_m = lengths_m[index] - lengths_m[index - 1];
            let travel_s = stamps[index] - stamps[index - 1] - dwells_s[index - 1];
            // From rest to rest, half the way up and half the way down: L = a T² / 4.
            let needed = (4.0 * leg_m * MM_PER_M / (travel_s * travel_s)).ceil();
            Err(SceneError::TrajectoryRow {
                place: waypoints[index].place.clone(),
                found: format!(
                    "{} mm in {travel_s} s",
                    (leg_m * MM_PER_M * 1000.0).round() / 1000.0
                ),
                expected: format!(
                    "a way that the acceleration allows; this one takes at least {needed} mm/s²"
                ),
            })
        }
    }
}

fn touches(keys: &AgentTable) -> Vec<String> {
    let names = keys.touches.iter().flat_map(Spanned::get_ref);
    names.map(|name| name.get_ref().clone()).collect()
}

/// How the body is turned on its way to each way-point; `None` if it does not turn.
fn turns(
    source: &Source<'_>,
    table: &Spanned<AgentTable>,
    trajectory: Option<&Trajectory>,
) -> Result<Option<Vec<DMat3>>, SceneError> {
    let (Some(faces), Some(trajectory)) = (&table.get_ref().faces, trajectory) else {
        return Ok(None);
    };
    match faces.get_ref().as_str() {
        "fixed" => Ok(None),
        "way" => Ok(Some(headings(trajectory.waypoints_m()))),
        _ => Err(source.refused(
            "faces",
            faces.span(),
            "\"fixed\" or \"way\"",
            "\"way\" turns the body's own x, its front, to where it goes; \"fixed\" is the default",
        )),
    }
}

/// The rotation that turns +x to the horizontal direction of the leg before each way-point; a leg without one keeps
/// that of the leg before it, the first ones that of the first that has one.
fn headings(waypoints_m: &[DVec3]) -> Vec<DMat3> {
    let mut headings: Vec<Option<DMat3>> = vec![None];
    for pair in waypoints_m.windows(2) {
        let along = (pair[1] - pair[0]).with_z(0.0);
        let before = headings.last().copied().flatten();
        headings.push(match along.try_normalize() {
            Some(along) => Some(DMat3::from_cols(along, DVec3::Z.cross(along), DVec3::Z)),
            None => before,
        });
    }
    let first = headings.iter().flatten().next().copied();
    let first = first.unwrap_or(DMat3::IDENTITY);
    headings
        .into_iter()
        .map(|heading| heading.unwrap_or(first))
        .collect()
}

fn check_inside(
    agent: &Agent,
    index: usize,
    point: &Waypoint,
    room: &Room,
) -> Result<(), SceneError> {
    let moved_m = point.position_mm / MM_PER_M - agent.start_m;
    let beyond = |turn: DMat3| {
        agent.parts.iter().find_map(|part| {
            let mesh = agent
                .turned(&part.mesh, turn)
                .placed(DMat3::IDENTITY, moved_m);
            (!room.holds_corners_of(&mesh)).then(|| reach(mesh.bounds_m()))
        })
    };
    let reaches = match &agent.turns {
        None => beyond(DMat3::IDENTITY),
        Some(turns) => [index, index + 1]
            .into_iter()
            .filter_map(|leg| turns.get(leg))
            .find_map(|turn| beyond(*turn)),
    };
    let Some(reach_mm) = reaches else {
        return Ok(());
    };
    Err(SceneError::AgentLeavesRoom {
        place: point.place.clone(),
        name: agent.name.clone(),
        reach_mm,
        room_mm: room.described(),
    })
}

/// Between the way-points, a wall that juts into the room may be in the way.
fn check_walls(agent: &Agent, waypoints: &[Waypoint], walls: &Walls) -> Result<(), SceneError> {
    let Some((time, place_m)) = walls.first_met_by(agent) else {
        return Ok(());
    };
    let way = agent.trajectory.as_ref();
    let heads_for = way.map_or(0, |way| way.heads_for(time.as_secs_f64()));
    let Some(point) = waypoints.get(heads_for) else {
        return Ok(());
    };
    Err(SceneError::AgentMeetsWall {
        place: point.place.clone(),
        name: agent.name.clone(),
        time,
        place_mm: millimetres(place_m),
    })
}

fn titled(keys: &AgentTable) -> String {
    format!("agent `{}`", keys.name.get_ref())
}
