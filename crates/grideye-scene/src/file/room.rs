//! Builds the room from its keys: a box, a floor plan with a height, or a mesh.

use crate::file::keys::ROOM_WAYS;
use crate::file::obj;
use crate::file::reader::{Read, Reader, meters};
use crate::geometry::{Mesh, area_m2};
use crate::model::{Room, SceneError, limits};
use crate::text::MM_PER_M;
use glam::DVec2;
use grideye_text::{Table, Value};

pub(crate) fn room(reader: &Reader<'_>, table: &Table<'_>) -> Read<Room> {
    let ambient_c = table.number("ambient_c").unwrap_or_default();
    let missing = |key| table.missing(key, ROOM_WAYS);
    if let Some(plan_mm) = table.get("plan_mm") {
        let height_mm = table
            .number("height_mm")
            .ok_or_else(|| missing("height_mm"))?;
        let plan_m = plan(table, plan_mm)?;
        return Room::of_plan(&plan_m, height_mm / MM_PER_M, ambient_c)
            .ok_or_else(|| plan_mm.refused("an outline around a floor").into());
    }
    if let Some(vertices_mm) = table.get("vertices_mm") {
        let faces = table.get("faces").ok_or_else(|| missing("faces"))?;
        check_faces(table, faces.each().count(), faces)?;
        return of_mesh(faces, obj::given(vertices_mm, faces, "room")?, ambient_c);
    }
    if let Some(file) = table.get("file") {
        let mesh = obj::named(reader, table, file, "room")?;
        check_faces(table, mesh.faces().count(), file)?;
        return of_mesh(file, mesh, ambient_c);
    }
    let pairs = [
        ("height_mm", "plan_mm"),
        ("faces", "vertices_mm"),
        ("unit_mm", "file"),
    ];
    let absent = pairs.iter().find(|(given, _)| table.has(given));
    let absent = absent.map_or("size_mm", |(_, absent)| absent);
    let size_m = meters(table, "size_mm").ok_or_else(|| missing(absent))?;
    Ok(Room::of_box(size_m, ambient_c))
}

fn check_faces(table: &Table<'_>, found: usize, key: Value<'_>) -> Read<()> {
    let hint = "a room's walls are few; furniture goes into objects";
    let limit = (limits::ROOM_CORNERS_MAX, key.span().start);
    Ok(table
        .source
        .check_count("faces of a room", found, limit, hint)?)
}

fn of_mesh(given: Value<'_>, mesh: Mesh, ambient_c: f64) -> Read<Room> {
    Room::of_mesh(mesh, ambient_c).ok_or_else(|| {
        let expected =
            "a closed surface, with every edge shared by two faces that run along it in opposite directions";
        let hint = "a room has floor, ceiling and all walls, without gaps or doors";
        SceneError::from(given.refused_with(expected, hint))
    })
}

fn plan(table: &Table<'_>, plan_mm: Value<'_>) -> Read<Vec<DVec2>> {
    let corners: Vec<Value<'_>> = plan_mm.each().collect();
    let hint = "omit corners on straight walls";
    let limit = (limits::ROOM_CORNERS_MAX, plan_mm.span().start);
    table
        .source
        .check_count("corners", corners.len(), limit, hint)?;
    let plan_m = corners.iter().filter_map(Value::list);
    let plan_m: Vec<DVec2> = plan_m
        .map(|corner| DVec2::from_array(corner) / MM_PER_M)
        .collect();
    if plan_m.len() < 3 {
        return Err(plan_mm.refused("at least 3 corners").into());
    }
    for (is_fault, expected) in FAULTS {
        if let Some(index) = (0..plan_m.len()).find(|index| is_fault(&plan_m, *index)) {
            return Err(corners[index].refused(expected).into());
        }
    }
    if area_m2(&plan_m).abs() <= SLIVER_M * SLIVER_M {
        return Err(plan_mm.refused("an outline around a floor").into());
    }
    Ok(plan_m)
}

type Fault = fn(&[DVec2], usize) -> bool;

/// Possible mistakes in the wall that starts at a corner, with the message about each.
const FAULTS: [(Fault, &str); 3] = [
    (
        is_short,
        "a corner away from the next one; the last wall leads back to the first corner by itself",
    ),
    (
        leads_back,
        "a wall that the next one does not double back on",
    ),
    (meets_another, "a wall that meets only its neighbors"),
];

fn is_short(plan_m: &[DVec2], index: usize) -> bool {
    let [from, to] = wall(plan_m, index);
    from.distance(to) <= SLIVER_M
}

fn leads_back(plan_m: &[DVec2], index: usize) -> bool {
    let (here, next) = (wall(plan_m, index), wall(plan_m, index + 1));
    distance_m(next[1], here) <= SLIVER_M || distance_m(here[0], next) <= SLIVER_M
}

fn meets_another(plan_m: &[DVec2], index: usize) -> bool {
    let here = wall(plan_m, index);
    (index + 2..index + plan_m.len() - 1).any(|other| {
        let other = wall(plan_m, other);
        cross(here, other)
            || distance_m(here[0], other) <= SLIVER_M
            || distance_m(other[0], here) <= SLIVER_M
    })
}

/// The ends of the wall that starts at a corner; the corners repeat.
fn wall(plan_m: &[DVec2], index: usize) -> [DVec2; 2] {
    let count = plan_m.len();
    [plan_m[index % count], plan_m[(index + 1) % count]]
}

fn cross([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |from: DVec2, to: DVec2, point: DVec2| (to - from).perp_dot(point - from);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn distance_m(point: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared();
    point.distance(from + share.clamp(0.0, 1.0) * along)
}

/// Corners this close to each other or to a wall coincide: a micrometer.
const SLIVER_M: f64 = 1e-6;
