//! Builds an agent from its keys and its trajectory.

use crate::file::reader::{Read, Reader, meters, name, source};
use crate::file::waypoints::{TIME, UTC, Waypoint, read_waypoints};
use crate::file::{body, person, postures, prints};
use crate::geometry::rotation_z_deg;
use crate::model::limits::{TIME_MAX_S, WALK_DAYS_MAX};
use crate::model::{
    Agent, Body, Keep, Person, Posture, Room, SEGMENTS, Scene, SceneError, Stop, Walls,
};
use crate::motion::{Clock, Motion, Schedule, Trajectory, lengths_m};
use crate::radiometry::Surface;
use crate::text::{MM_PER_M, Utc, millimeters, reach};
use glam::{DMat3, DVec3};
use grideye_text::Table;
use std::time::Duration;

pub(crate) fn agent(
    reader: &Reader<'_>,
    table: &Table<'_>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
    (room, walls): (&Room, &Walls),
) -> Read<Agent> {
    let first = waypoints.first();
    let start_m = first.map_or(DVec3::ZERO, |point| point.position_mm / MM_PER_M);
    let trajectory = trajectory(table, (waypoints, starts_utc))?;
    let touches = table.each("touches").filter_map(|name| name.text());
    let (person, parts) = match person::person(reader, table, start_m, room.ambient_c) {
        Some((person, parts)) => (Some(person), parts),
        None => (None, body::parts(reader, table, start_m, room.ambient_c)?),
    };
    let keeps = postures::keeps(table, (waypoints, starts_utc))?;
    let agent = Agent {
        name: name(table),
        parts,
        turns: turns(table, (trajectory.as_ref(), person.as_ref()), &keeps),
        person,
        start_m,
        keeps,
        touches: touches.map(str::to_owned).collect(),
        trajectory,
    };
    if (reader.is_free)(&agent.name) {
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

impl Scene {
    /// Sends a person on a way in place of the file's; it faces `yaw_deg` from +x until it walks. Nothing checks that the way
    /// is free.
    ///
    /// # Errors
    /// If the way leaves too many warm prints.
    pub fn send(&mut self, name: &str, stops: &[Stop], yaw_deg: f64) -> Read<()> {
        let surfaces = |person: &Person| self.model.surfaces(person, self.room.ambient_c);
        let mut agents = self.agents.iter_mut();
        if let Some(agent) = agents.find(|agent| agent.name == name) {
            send(agent, surfaces, (stops, yaw_deg));
        }
        self.prints = prints::prints(&source("", "")?, self)?;
        Ok(())
    }
}

fn send(
    agent: &mut Agent,
    surfaces: impl Fn(&Person) -> [Surface; SEGMENTS],
    (stops, yaw_deg): (&[Stop], f64),
) {
    let points_m = stops.iter().map(|stop| stop.at_mm / MM_PER_M);
    let points_m: Vec<DVec3> = points_m.collect();
    let lengths_m = lengths_m(&points_m);
    let dwells_s: Vec<f64> = stops.iter().map(|stop| stop.stays_s).collect();
    let stamps: Vec<f64> = stops.iter().map(|stop| stop.from_s).collect();
    let clock = Clock::Stamps(&stamps);
    // No leg is too fast for a motion without acceleration.
    let schedule = Schedule::new(&lengths_m, &dwells_s, Motion::Constant, clock);
    let (Some(person), Some(start_m), Ok(schedule)) =
        (agent.person.as_mut(), points_m.first(), schedule)
    else {
        return;
    };
    person.posture = Posture::Walk;
    person.facing = rotation_z_deg(yaw_deg);
    agent.start_m = *start_m;
    agent.keeps = Keep::all(stops);
    agent.turns = Some(headings(&points_m, &agent.keeps, Some(person.facing)));
    let color = agent.parts.first().and_then(|part| part.color);
    agent.parts = Body::segments_of(person, *start_m, surfaces(person), color);
    agent.trajectory = Some(Trajectory::scheduled(points_m, lengths_m, schedule));
}

pub(crate) fn waypoints(reader: &Reader<'_>, table: &Table<'_>) -> Read<Vec<Waypoint>> {
    if let Some(path) = table.get("trajectory") {
        let text = reader.read_below("trajectory", path)?;
        return Ok(read_waypoints(path.text().unwrap_or_default(), &text)?);
    }
    let position_m = meters(table, "position_mm").unwrap_or_default();
    let place = table
        .get("position_mm")
        .map_or(table.start, |given| given.span().start);
    Ok(vec![Waypoint {
        position_mm: position_m * MM_PER_M,
        time: None,
        dwell_s: 0.0,
        posture: None,
        place: table.source.place(place),
    }])
}

fn trajectory(
    table: &Table<'_>,
    (waypoints, starts_utc): (&[Waypoint], Option<Utc>),
) -> Read<Option<Trajectory>> {
    let motion = motion(table)?;
    let Some(path) = table.get("trajectory") else {
        return Ok(None);
    };
    let points = waypoints.iter();
    let points_m: Vec<DVec3> = points.map(|point| point.position_mm / MM_PER_M).collect();
    let stamps = waypoints.iter().map(|point| point.time_s(starts_utc));
    let stamps: Option<Vec<f64>> = stamps.collect();
    let column = match starts_utc.filter(|_| waypoints.iter().any(|point| point.utc().is_some())) {
        Some(start) => TimeColumn::Utc(start),
        None => TimeColumn::Seconds,
    };
    match (stamps, table.get("speed_mm_per_s")) {
        (Some(_), Some(speed)) => {
            let column = column.name();
            let hint = format!(
                "the trajectory's column {column} already gives the time of each waypoint; remove the speed or the column"
            );
            let both = ["speed_mm_per_s", column];
            Err(table.conflict(speed.span().start, both, &hint).into())
        }
        (Some(stamps), None) => stamped(motion, (waypoints, column), points_m, &stamps).map(Some),
        (None, None) => {
            let hint = "a person walks at 500 to 1500 mm/s; the paper's examples have 800 and 1600";
            Err(table
                .missing_at(path.span().start, "speed_mm_per_s", hint)
                .into())
        }
        (None, Some(speed)) => {
            let speed_m_per_s = speed.number().unwrap_or_default() / MM_PER_M;
            let trajectory = paced(motion, waypoints, points_m, speed_m_per_s);
            if trajectory.end_s() <= TIME_MAX_S {
                return Ok(Some(trajectory));
            }
            let expected = format!("a speed at which the path takes at most {WALK_DAYS_MAX} days");
            Err(speed.refused(&expected).into())
        }
    }
}

fn motion(table: &Table<'_>) -> Read<Motion> {
    let given = table.get("acceleration_mm_per_s2");
    match (table.text("motion"), given.and_then(|given| given.number())) {
        (Some("trapezoidal"), Some(acceleration)) => Ok(Motion::Trapezoidal {
            acceleration_m_per_s2: acceleration / MM_PER_M,
        }),
        (Some("trapezoidal"), None) => {
            let start = table
                .get("motion")
                .map_or(table.start, |motion| motion.span().start);
            let hint = "a person starting to walk accelerates at about 1000 mm/s²";
            Err(table
                .missing_at(start, "acceleration_mm_per_s2", hint)
                .into())
        }
        (_, Some(_)) => {
            let start = given.map_or(table.start, |given| given.span().start);
            let hint = "only motion = \"trapezoidal\" has an acceleration";
            let both = ["acceleration_mm_per_s2", "motion"];
            Err(table.conflict(start, both, hint).into())
        }
        (Some("minimum-jerk"), None) => Ok(Motion::MinimumJerk),
        _ => Ok(Motion::Constant),
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
    table: &Table<'_>,
    (trajectory, person): (Option<&Trajectory>, Option<&Person>),
    keeps: &[Keep],
) -> Option<Vec<DMat3>> {
    let faces = table.text("faces").map(|faces| faces == "way");
    let turns = faces.unwrap_or(person.is_some());
    // Who sits first faces as the file says until it walks.
    let first = person.filter(|_| !keeps.is_empty());
    let first = first.map(|person| person.facing);
    let trajectory = trajectory.filter(|_| turns)?;
    Some(headings(trajectory.waypoints_m(), keeps, first))
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
    let (mut radius_m2, mut low_m, mut high_m) = (0.0_f64, f64::INFINITY, f64::NEG_INFINITY);
    for vertex in vertices {
        let from_start_m = *vertex - agent.start_m;
        radius_m2 = radius_m2.max(from_start_m.truncate().length_squared());
        low_m = low_m.min(from_start_m.z);
        high_m = high_m.max(from_start_m.z);
    }
    let radius_m = radius_m2.sqrt();
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
    let (name, room_mm) = (&agent.name, room.described());
    let problem = format!(
        "agent `{name}` leaves the room of {room_mm} mm: its body reaches {reach_mm} mm there"
    );
    let hint = "a position is the center of the base; move the waypoint or shrink the body";
    point.place.clone().refused(problem, hint).into()
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
    Err(point.place.clone().refused(problem, hint).into())
}
