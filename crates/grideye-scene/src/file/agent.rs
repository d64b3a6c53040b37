//! Builds an agent from its keys and its trajectory.

use crate::file::body;
use crate::file::document::AgentTable;
use crate::file::person;
use crate::file::postures;
use crate::file::reader::{Read, Reader};
use crate::file::rule::{ACCELERATION, SPEED};
use crate::file::waypoints::{TIME, UTC, Waypoint, read_waypoints};
use crate::model::limits::{TIME_MAX_S, WALK_DAYS_MAX};
use crate::model::{Agent, Body, Keep, Person, Room, SceneError, Walls};
use crate::motion::{Clock, Motion, Schedule, Trajectory, lengths_m};
use crate::text::{MM_PER_M, Utc, millimeters, reach};
use glam::{DMat3, DVec3};
use std::time::Duration;
use toml::Spanned;

pub(crate) fn agent(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
    (room, walls): (&Room, &Walls),
) -> Read<Agent> {
    let keys = table.get_ref();
    let first = waypoints.first();
    let start_m = first.map_or(DVec3::ZERO, |point| point.position_mm / MM_PER_M);
    let trajectory = trajectory(reader, table, (waypoints, starts_utc))?;
    let touches = keys.touches.iter().flat_map(Spanned::get_ref);
    let (person, parts) = match person::person(reader, table, start_m, room.ambient_c)? {
        Some((person, parts)) => (Some(person), parts),
        None => (None, body::parts(reader, table, start_m, room.ambient_c)?),
    };
    let keeps = postures::keeps(reader, table, (waypoints, starts_utc))?;
    let agent = Agent {
        name: reader.name(&keys.name)?,
        parts,
        turns: turns(reader, keys, (trajectory.as_ref(), person.as_ref()), &keeps)?,
        person,
        start_m,
        keeps,
        touches: touches.map(|name| name.get_ref().clone()).collect(),
        trajectory,
    };
    if !reader.checks_places {
        return Ok(agent);
    }
    // The agent turns only at waypoints; between them it can leave the room only through walls that jut in.
    let (low_m, high_m) = bounds_however_turned_m(&agent);
    for (index, point) in waypoints.iter().enumerate() {
        let moved_m = point.position_mm / MM_PER_M - agent.start_m;
        if room.is_box() && room.contains(low_m + moved_m) && room.contains(high_m + moved_m) {
            continue;
        }
        check_inside(&agent, index, point, room)?;
    }
    for (keep, point) in agent.keeps.iter().zip(waypoints) {
        check_laid_out(&agent, keep, point, room)?;
    }
    check_walls(&agent, waypoints, walls)?;
    Ok(agent)
}

pub(crate) fn waypoints(reader: &Reader<'_>, table: &Spanned<AgentTable>) -> Read<Vec<Waypoint>> {
    let keys = table.get_ref();
    let start = table.span().start;
    match (&keys.position_mm, &keys.trajectory) {
        (Some(position_mm), None) => Ok(vec![Waypoint {
            position_mm: reader.position_m(position_mm)? * MM_PER_M,
            time: None,
            dwell_s: 0.0,
            posture: None,
            place: reader.place(position_mm.span().start),
        }]),
        (None, Some(path)) => {
            let text = reader.read_below(("trajectory", "trajectory"), path)?;
            Ok(read_waypoints(path.get_ref(), &text)?)
        }
        (Some(_), Some(_)) => {
            let hint = "an agent that walks starts at the first row of its trajectory";
            let both = ["position_mm", "trajectory"];
            Err(reader.conflict(start, &titled(keys), both, hint))
        }
        (None, None) => {
            let hint =
                "give position_mm if it stands still, or trajectory and speed_mm_per_s if it walks";
            Err(reader.missing(start, &titled(keys), "position_mm", hint))
        }
    }
}

fn trajectory(
    reader: &Reader<'_>,
    table: &Spanned<AgentTable>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
) -> Read<Option<Trajectory>> {
    let keys = table.get_ref();
    let motion = motion(reader, table)?;
    let Some(path) = &keys.trajectory else {
        return check_no_way(reader, keys).map(|()| None);
    };
    let points = waypoints.iter();
    let points_m: Vec<DVec3> = points.map(|point| point.position_mm / MM_PER_M).collect();
    let stamps = waypoints.iter().map(|point| point.time_s(starts_utc));
    let stamps: Option<Vec<f64>> = stamps.collect();
    let column = match starts_utc.filter(|_| waypoints.iter().any(|point| point.utc().is_some())) {
        Some(start) => TimeColumn::Utc(start),
        None => TimeColumn::Seconds,
    };
    match (stamps, &keys.speed_mm_per_s) {
        (Some(_), Some(speed)) => {
            let column = column.name();
            let hint = format!(
                "the trajectory's column {column} already gives the time of each waypoint; remove the speed or the column"
            );
            let both = ["speed_mm_per_s", column];
            Err(reader.conflict(speed.span().start, &titled(keys), both, &hint))
        }
        (Some(stamps), None) => stamped(motion, (waypoints, column), points_m, &stamps).map(Some),
        (None, None) => {
            let hint = "a person walks at 500 to 1500 mm/s; the paper's examples have 800 and 1600";
            Err(reader.missing(path.span().start, &titled(keys), "speed_mm_per_s", hint))
        }
        (None, Some(speed)) => {
            let speed_m_per_s = reader.number(speed, &SPEED)? / MM_PER_M;
            let trajectory = paced(motion, waypoints, points_m, speed_m_per_s);
            if trajectory.end_s() <= TIME_MAX_S {
                return Ok(Some(trajectory));
            }
            let expected = format!("a speed at which the path takes at most {WALK_DAYS_MAX} days");
            Err(reader
                .refused(SPEED.key, speed.span(), &expected, SPEED.hint)
                .into())
        }
    }
}

fn check_no_way(reader: &Reader<'_>, keys: &AgentTable) -> Read<()> {
    let start = |key: &Option<Spanned<String>>| key.as_ref().map(|key| key.span().start);
    let speed = keys.speed_mm_per_s.as_ref().map(|key| key.span().start);
    let starts = [speed, start(&keys.motion), start(&keys.faces)];
    let Some(first) = starts.into_iter().flatten().min() else {
        return Ok(());
    };
    let hint = "only an agent with a trajectory has a speed";
    Err(reader.missing(first, &titled(keys), "trajectory", hint))
}

fn motion(reader: &Reader<'_>, table: &Spanned<AgentTable>) -> Read<Motion> {
    let keys = table.get_ref();
    let given = keys.acceleration_mm_per_s2.as_ref();
    let acceleration = reader.optional(&keys.acceleration_mm_per_s2, &ACCELERATION)?;
    let trapezoidal = Motion::Trapezoidal {
        acceleration_m_per_s2: acceleration.unwrap_or_default() / MM_PER_M,
    };
    let motions = [
        ("constant", Motion::Constant),
        ("trapezoidal", trapezoidal),
        ("minimum-jerk", Motion::MinimumJerk),
    ];
    let hint = "constant is the default; scenes/README.md describes each";
    let motion = reader.choice("motion", &keys.motion, &motions, hint)?;
    let start = |place: Option<usize>| place.unwrap_or(table.span().start);
    match (motion.unwrap_or(Motion::Constant), acceleration) {
        (Motion::Trapezoidal { .. }, None) => {
            let start = start(keys.motion.as_ref().map(|motion| motion.span().start));
            let key = ACCELERATION.key;
            Err(reader.missing(start, &titled(keys), key, ACCELERATION.hint))
        }
        (Motion::Constant | Motion::MinimumJerk, Some(_)) => {
            let start = start(given.map(|given| given.span().start));
            let hint = "only motion = \"trapezoidal\" has an acceleration";
            Err(reader.conflict(start, &titled(keys), [ACCELERATION.key, "motion"], hint))
        }
        (motion, _) => Ok(motion),
    }
}

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
        // Only stamped schedules can be too fast.
        Err(_) => Trajectory::new(points_m, speed_m_per_s),
    }
}

fn stamped(
    motion: Motion,
    (waypoints, column): (&[Waypoint], TimeColumn),
    points_m: Vec<DVec3>,
    stamps: &[f64],
) -> Read<Trajectory> {
    let mut free_s = f64::NEG_INFINITY;
    for (point, time_s) in waypoints.iter().zip(stamps) {
        let refused = |expected: String| {
            let (found, name) = (column.told(*time_s), column.name());
            point.refused(&format!("`{found}` as {name}"), &expected)
        };
        if *time_s <= free_s {
            let expected = match column {
                TimeColumn::Seconds => format!("more than {free_s} s"),
                TimeColumn::Utc(_) => format!("later than {}", column.told(free_s)),
            };
            let expected = format!("{expected}, when the agent leaves the previous waypoint");
            return Err(refused(expected).into());
        }
        free_s = time_s + point.dwell_s;
        if free_s > TIME_MAX_S {
            let unit = column.unit();
            let latest = column.told(TIME_MAX_S);
            return Err(refused(format!("a stop that ends by {latest}{unit}")).into());
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
            // From rest to rest, accelerating over half the distance and slowing down over the other: L = a T² / 4.
            let needed = (4.0 * leg_m * MM_PER_M / (travel_s * travel_s)).ceil();
            let leg_mm = (leg_m * MM_PER_M * 1000.0).round() / 1000.0;
            let expected = format!(
                "a leg that the acceleration allows; this one needs at least {needed} mm/s²"
            );
            let found = format!("{leg_mm} mm in {travel_s} s");
            Err(waypoints[index].refused(&found, &expected).into())
        }
    }
}

/// How a trajectory gives its times.
#[derive(Clone, Copy)]
enum TimeColumn {
    Seconds,
    /// With the scene's start.
    Utc(Utc),
}

impl TimeColumn {
    const fn name(self) -> &'static str {
        match self {
            Self::Seconds => TIME,
            Self::Utc(_) => UTC,
        }
    }

    const fn unit(self) -> &'static str {
        match self {
            Self::Seconds => " s",
            Self::Utc(_) => "",
        }
    }

    /// A second of the scene as the file would give it.
    fn told(self, time_s: f64) -> String {
        match self {
            Self::Seconds => time_s.to_string(),
            Self::Utc(start) => start.after_s(time_s).to_string(),
        }
    }
}

/// The body's rotation on the way to each waypoint; `None` if it does not turn.
fn turns(
    reader: &Reader<'_>,
    keys: &AgentTable,
    (trajectory, person): (Option<&Trajectory>, Option<&Person>),
    keeps: &[Keep],
) -> Read<Option<Vec<DMat3>>> {
    let Some(trajectory) = trajectory else {
        return Ok(None);
    };
    let hint =
        "\"way\" turns the body's front, its own +x, to where it goes; \"fixed\" is the default";
    let turns = reader.choice(
        "faces",
        &keys.faces,
        &[("fixed", false), ("way", true)],
        hint,
    )?;
    let turns = turns.unwrap_or(keys.person.is_some());
    // Who sits first faces as the file says until it walks.
    let first = person.filter(|_| !keeps.is_empty());
    let first = first.map(|person| person.facing);
    Ok(turns.then(|| headings(trajectory.waypoints_m(), keeps, first)))
}

/// Turns +x to the direction of each waypoint's leg. A leg without direction, or on which the person is not upright, uses
/// the previous one, or else the first.
fn headings(waypoints_m: &[DVec3], keeps: &[Keep], first: Option<DMat3>) -> Vec<DMat3> {
    let mut headings: Vec<Option<DMat3>> = vec![first];
    for (index, pair) in waypoints_m.windows(2).enumerate() {
        let is_upright = keeps.iter().skip(index).take(2).all(Keep::is_upright);
        let along = (pair[1] - pair[0]).with_z(0.0).try_normalize();
        let along = along.filter(|_| is_upright);
        let heading = along.map(|along| DMat3::from_cols(along, DVec3::Z.cross(along), DVec3::Z));
        headings.push(heading.or(headings.last().copied().flatten()));
    }
    let first = headings.iter().flatten().next().copied();
    let first = first.unwrap_or(DMat3::IDENTITY);
    let headings = headings.into_iter();
    headings.map(|heading| heading.unwrap_or(first)).collect()
}

/// A box around the body at its start in any direction: spares most waypoints the exact check.
fn bounds_however_turned_m(agent: &Agent) -> (DVec3, DVec3) {
    let vertices = agent.parts.iter().flat_map(|part| part.mesh.vertices_m());
    let (mut radius_m, mut low_m, mut high_m) = (0.0_f64, f64::INFINITY, f64::NEG_INFINITY);
    for vertex in vertices {
        let from_start_m = *vertex - agent.start_m;
        radius_m = radius_m.max(from_start_m.truncate().length());
        low_m = low_m.min(from_start_m.z);
        high_m = high_m.max(from_start_m.z);
    }
    let corner =
        |side: f64, z_m: f64| agent.start_m + DVec3::new(side * radius_m, side * radius_m, z_m);
    (corner(-1.0, low_m), corner(1.0, high_m))
}

fn check_inside(agent: &Agent, index: usize, point: &Waypoint, room: &Room) -> Read<()> {
    let moved_m = point.position_mm / MM_PER_M - agent.start_m;
    let beyond = |turn: &DMat3| {
        agent.parts.iter().find_map(|part| {
            let turned = agent.turned(&part.mesh, *turn);
            let mesh = turned.placed(DMat3::IDENTITY, moved_m);
            (!room.holds_corners_of(&mesh)).then(|| reach(mesh.bounds_m()))
        })
    };
    let reaches = match &agent.turns {
        None => beyond(&DMat3::IDENTITY),
        Some(turns) => turns.iter().skip(index).take(2).find_map(beyond),
    };
    reaches.map_or(Ok(()), |reach_mm| Err(left(agent, point, room, &reach_mm)))
}

const LIFT_M: f64 = 0.1;

/// A person who sits or lies reaches farther than one who stands.
fn check_laid_out(agent: &Agent, keep: &Keep, point: &Waypoint, room: &Room) -> Read<()> {
    let time = Duration::try_from_secs_f64(keep.from_s).unwrap_or_default();
    let bodies = match keep.is_upright() {
        true => Vec::new(),
        false => agent.bodies_at(time),
    };
    // Feet may be a little below the floor.
    let lifted = |body: &Body| body.mesh.clone().placed(DMat3::IDENTITY, LIFT_M * DVec3::Z);
    let outside = |body: &&Body| !room.holds_corners_of(&lifted(body));
    match bodies.iter().find(outside) {
        None => Ok(()),
        Some(body) => Err(left(agent, point, room, &reach(body.mesh.bounds_m()))),
    }
}

fn left(agent: &Agent, point: &Waypoint, room: &Room, reach_mm: &str) -> SceneError {
    let (name, room_mm) = (agent.name.clone(), room.described());
    let problem = format!(
        "agent `{name}` leaves the room of {room_mm} mm: its body reaches {reach_mm} mm there"
    );
    let hint = "a position is the center of the base; move the waypoint or shrink the body";
    let why = point.place.clone().refused(problem, hint);
    SceneError::AgentLeavesRoom { name, why }
}

fn check_walls(agent: &Agent, waypoints: &[Waypoint], walls: &Walls) -> Read<()> {
    let Some((time, place_m)) = walls.first_met_by(agent) else {
        return Ok(());
    };
    let way = agent.trajectory.as_ref();
    let heads_for = way.map_or(0, |way| way.heads_for(time.as_secs_f64()));
    let Some(point) = waypoints.get(heads_for) else {
        return Ok(());
    };
    let problem = format!(
        "agent `{}` goes through a wall after {} s, at {} mm, on its way to this point",
        agent.name,
        (time.as_secs_f64() * 1000.0).round() / 1000.0,
        millimeters(place_m)
    );
    let hint = "add waypoints that lead around the corner, or shrink the body";
    Err(SceneError::AgentMeetsWall(
        point.place.clone().refused(problem, hint),
    ))
}

fn titled(keys: &AgentTable) -> String {
    format!("agent `{}`", keys.name.get_ref())
}
