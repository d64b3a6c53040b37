//! Builds the room from its keys: a box, a floor plan with a height, or a mesh.

use crate::file::document::{Pair, RoomTable};
use crate::file::obj;
use crate::file::reader::{Read, Reader};
use crate::file::rule::{AMBIENT, HEIGHT, PLAN};
use crate::geometry::{Mesh, area_m2};
use crate::model::{Room, SceneError, limits};
use crate::text::MM_PER_M;
use glam::DVec2;
use toml::Spanned;

type PlanKey = Spanned<Vec<Spanned<Pair>>>;

pub(crate) fn room(reader: &Reader<'_>, table: &Spanned<RoomTable>) -> Read<Room> {
    let keys = table.get_ref();
    let ambient_c = reader.number(&keys.ambient_c, &AMBIENT)?;
    check_keys(reader, table)?;
    let missing = |key| reader.missing(table.span().start, "the room", key, HINT);
    if let Some(plan_mm) = &keys.plan_mm {
        let height_mm = keys
            .height_mm
            .as_ref()
            .ok_or_else(|| missing("height_mm"))?;
        let height_m = reader.number(height_mm, &HEIGHT)? / MM_PER_M;
        let plan_m = plan(reader, plan_mm)?;
        return Room::of_plan(&plan_m, height_m, ambient_c)
            .ok_or_else(|| no_plan(reader, plan_mm, "an outline around a floor"));
    }
    if let Some(vertices_mm) = &keys.vertices_mm {
        let faces = keys.faces.as_ref().ok_or_else(|| missing("faces"))?;
        check_faces(reader, faces.get_ref().len(), faces)?;
        let mesh = obj::given(reader, vertices_mm, faces, "room")?;
        return of_mesh(reader, "faces", faces, mesh, ambient_c);
    }
    if let Some(file) = &keys.file {
        let mesh = obj::named(reader, file, &keys.unit_mm, "room")?;
        check_faces(reader, mesh.faces().count(), file)?;
        return of_mesh(reader, "file", file, mesh, ambient_c);
    }
    let absent = match (&keys.height_mm, &keys.faces, &keys.unit_mm) {
        (Some(_), ..) => "plan_mm",
        (_, Some(_), _) => "vertices_mm",
        (.., Some(_)) => "file",
        _ => "size_mm",
    };
    let size_mm = keys.size_mm.as_ref().ok_or_else(|| missing(absent))?;
    Ok(Room::of_box(reader.size_m(size_mm)?, ambient_c))
}

fn check_keys(reader: &Reader<'_>, table: &Spanned<RoomTable>) -> Read<()> {
    let keys = table.get_ref();
    let given = [
        ("size_mm", 0, keys.size_mm.is_some()),
        ("plan_mm", 1, keys.plan_mm.is_some()),
        ("height_mm", 1, keys.height_mm.is_some()),
        ("vertices_mm", 2, keys.vertices_mm.is_some()),
        ("faces", 2, keys.faces.is_some()),
        ("file", 3, keys.file.is_some()),
        ("unit_mm", 3, keys.unit_mm.is_some()),
    ];
    let mut given = given.iter().filter(|(.., is_given)| *is_given);
    let Some((first, way, _)) = given.next() else {
        return Ok(());
    };
    let Some((other, ..)) = given.find(|(_, other, _)| other != way) else {
        return Ok(());
    };
    Err(reader.conflict(table.span().start, "the room", [first, other], HINT))
}

fn check_faces<T>(reader: &Reader<'_>, found: usize, key: &Spanned<T>) -> Read<()> {
    let hint = "a room's walls are few; furniture goes into objects";
    let limit = limits::ROOM_CORNERS_MAX;
    Ok(reader.check_count("faces of a room", found, limit, key.span().start, hint)?)
}

fn of_mesh<T>(
    reader: &Reader<'_>,
    key: &str,
    place: &Spanned<T>,
    mesh: Mesh,
    ambient_c: f64,
) -> Read<Room> {
    Room::of_mesh(mesh, ambient_c).ok_or_else(|| {
        let expected =
            "a closed surface, with every edge shared by two faces that run along it in opposite directions";
        let hint = "a room has floor, ceiling and all walls, without gaps or doors";
        reader.refused(key, place.span(), expected, hint).into()
    })
}

fn plan(reader: &Reader<'_>, plan_mm: &PlanKey) -> Read<Vec<DVec2>> {
    let corners = plan_mm.get_ref();
    let hint = "omit corners on straight walls";
    let (found, byte) = (corners.len(), plan_mm.span().start);
    reader.check_count("corners", found, limits::ROOM_CORNERS_MAX, byte, hint)?;
    let mut plan_m = Vec::with_capacity(found);
    for corner in corners {
        plan_m.push(DVec2::from_array(reader.numbers(corner, &PLAN)?) / MM_PER_M);
    }
    if plan_m.len() < 3 {
        return Err(no_plan(reader, plan_mm, "at least 3 corners"));
    }
    for (is_fault, expected) in FAULTS {
        if let Some(index) = (0..plan_m.len()).find(|index| is_fault(&plan_m, *index)) {
            let span = corners[index].span();
            return Err(reader.refused(PLAN.key, span, expected, PLAN.hint).into());
        }
    }
    if area_m2(&plan_m).abs() <= SLIVER_M * SLIVER_M {
        return Err(no_plan(reader, plan_mm, "an outline around a floor"));
    }
    Ok(plan_m)
}

fn no_plan(reader: &Reader<'_>, plan_mm: &PlanKey, expected: &str) -> SceneError {
    reader
        .refused(PLAN.key, plan_mm.span(), expected, PLAN.hint)
        .into()
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

const HINT: &str = "a room has size_mm, or plan_mm and height_mm, or vertices_mm and faces, or file and optionally unit_mm";
/// Corners this close to each other or to a wall coincide: a micrometer.
const SLIVER_M: f64 = 1e-6;
