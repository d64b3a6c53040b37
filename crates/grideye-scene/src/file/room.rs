//! From the room's keys to a room: a box, a floor plan with a height, or a mesh.

use crate::file::document::{Exactly, RoomTable, Triple};
use crate::file::files::Files;
use crate::file::obj;
use crate::file::rule::{AMBIENT, HEIGHT, PLAN, UNIT};
use crate::file::source::{Source, read_below};
use crate::geometry::mesh::Mesh;
use crate::geometry::polygon::area_m2;
use crate::model::error::SceneError;
use crate::model::limits;
use crate::model::room::Room;
use crate::text::lengths::MM_PER_M;
use glam::DVec2;
use toml::Spanned;

pub(crate) fn room(
    source: &Source<'_>,
    table: &Spanned<RoomTable>,
    files: &dyn Files,
) -> Result<Room, SceneError> {
    let keys = table.get_ref();
    let ambient_c = source.number(&keys.ambient_c, &AMBIENT)?;
    match kind(source, table)? {
        Kind::Box(size_mm) => Ok(Room::of_box(source.size_m(size_mm)?, ambient_c)),
        Kind::Plan(plan_mm, height_mm) => {
            let height_m = source.number(height_mm, &HEIGHT)? / MM_PER_M;
            let plan_m = plan(source, plan_mm)?;
            Room::of_plan(&plan_m, height_m, ambient_c)
                .ok_or_else(|| no_plan(source, plan_mm, "an outline around a floor"))
        }
        Kind::Mesh(vertices_mm, faces) => {
            check_faces(source, faces.get_ref().len(), faces)?;
            let vertices_m = source.vertices_m(vertices_mm.get_ref())?;
            let mesh = Mesh::new(vertices_m, faces.get_ref()).map_err(|error| {
                SceneError::NoSolid {
                    place: source.place(faces.span().start),
                    name: "room".to_owned(),
                    source: error,
                    hint: "faces are lists of vertices, counted from 0, in the order of the outline",
                }
            })?;
            of_mesh(source, "faces", faces, mesh, ambient_c)
        }
        Kind::File(file) => {
            let text = read_below(source, ("file", "OBJ file"), file, files)?;
            let unit_mm = source.number_or(keys.unit_mm.as_ref(), &UNIT, MM_PER_M)?;
            let mesh = obj::read(file.get_ref(), &text, unit_mm / MM_PER_M, "room")?;
            check_faces(source, mesh.faces().count(), file)?;
            of_mesh(source, "file", file, mesh, ambient_c)
        }
    }
}

type PlanKey = Spanned<Vec<Spanned<Exactly<f64, 2>>>>;
type VerticesKey = Spanned<Vec<Spanned<Triple>>>;
type FacesKey = Spanned<Vec<Vec<i64>>>;

/// What a room is given as.
enum Kind<'a> {
    Box(&'a Spanned<Triple>),
    Plan(&'a PlanKey, &'a Spanned<f64>),
    Mesh(&'a VerticesKey, &'a FacesKey),
    File(&'a Spanned<String>),
}

/// The one of the four ways whose keys are there, all of them and no others.
fn kind<'a>(source: &Source<'_>, table: &'a Spanned<RoomTable>) -> Result<Kind<'a>, SceneError> {
    let keys = table.get_ref();
    let given = [
        ("size_mm", keys.size_mm.is_some()),
        ("plan_mm", keys.plan_mm.is_some()),
        ("height_mm", keys.height_mm.is_some()),
        ("vertices_mm", keys.vertices_mm.is_some()),
        ("faces", keys.faces.is_some()),
        ("file", keys.file.is_some()),
        ("unit_mm", keys.unit_mm.is_some()),
    ];
    let ways: [&[&str]; 4] = [
        &["size_mm"],
        &["plan_mm", "height_mm"],
        &["vertices_mm", "faces"],
        &["file", "unit_mm"],
    ];
    let names = given.iter().filter(|(_, given)| *given);
    let mut names = names.map(|(name, _)| *name);
    let first = names.next().unwrap_or("size_mm");
    let way = ways.into_iter().find(|way| way.contains(&first));
    if let Some(other) = names.find(|name| way.is_some_and(|way| !way.contains(name))) {
        return Err(SceneError::KeysConflict {
            place: source.place(table.span().start),
            table: "the room".to_owned(),
            key: first,
            other,
            hint: HINT,
        });
    }
    let missing = |key| SceneError::MissingKey {
        place: source.place(table.span().start),
        table: "the room".to_owned(),
        key,
        hint: HINT,
    };
    match way.and_then(|way| way.first().copied()) {
        Some("plan_mm") => Ok(Kind::Plan(
            keys.plan_mm.as_ref().ok_or_else(|| missing("plan_mm"))?,
            keys.height_mm
                .as_ref()
                .ok_or_else(|| missing("height_mm"))?,
        )),
        Some("vertices_mm") => Ok(Kind::Mesh(
            keys.vertices_mm
                .as_ref()
                .ok_or_else(|| missing("vertices_mm"))?,
            keys.faces.as_ref().ok_or_else(|| missing("faces"))?,
        )),
        Some("file") => Ok(Kind::File(
            keys.file.as_ref().ok_or_else(|| missing("file"))?,
        )),
        _ => Ok(Kind::Box(
            keys.size_mm.as_ref().ok_or_else(|| missing("size_mm"))?,
        )),
    }
}

fn check_faces<T>(source: &Source<'_>, found: usize, key: &Spanned<T>) -> Result<(), SceneError> {
    let hint = "a room's walls are few; furniture goes into objects";
    source.check_count(
        "faces of a room",
        found,
        limits::ROOM_CORNERS_MAX,
        key.span().start,
        hint,
    )
}

fn of_mesh<T>(
    source: &Source<'_>,
    key: &'static str,
    place: &Spanned<T>,
    mesh: Mesh,
    ambient_c: f64,
) -> Result<Room, SceneError> {
    Room::of_mesh(mesh, ambient_c).ok_or_else(|| {
        source.refused(
            key,
            place.span(),
            "a closed surface, every edge of which two faces share, in either direction once",
            "a room has floor, ceiling and all walls, without gaps or doors",
        )
    })
}

/// The corners of a simple polygon with an area.
fn plan(source: &Source<'_>, plan_mm: &PlanKey) -> Result<Vec<DVec2>, SceneError> {
    let corners = plan_mm.get_ref();
    let hint = "leave out corners on straight walls";
    let byte = plan_mm.span().start;
    let found = corners.len();
    source.check_count("corners", found, limits::ROOM_CORNERS_MAX, byte, hint)?;
    let plan_m = corners
        .iter()
        .map(|corner| source.plan_m(corner, &PLAN))
        .collect::<Result<Vec<_>, _>>()?;
    if plan_m.len() < 3 {
        return Err(no_plan(source, plan_mm, "at least 3 corners"));
    }
    for (is_fault, expected) in FAULTS {
        if let Some(index) = (0..plan_m.len()).find(|index| is_fault(&plan_m, *index)) {
            let span = corners[index].span();
            return Err(source.refused("plan_mm", span, expected, PLAN.hint));
        }
    }
    if area_m2(&plan_m).abs() <= SLIVER_M * SLIVER_M {
        return Err(no_plan(source, plan_mm, "an outline around a floor"));
    }
    Ok(plan_m)
}

fn no_plan(source: &Source<'_>, plan_mm: &PlanKey, expected: &str) -> SceneError {
    source.refused("plan_mm", plan_mm.span(), expected, PLAN.hint)
}

type Fault = fn(&[DVec2], usize) -> bool;

/// What may be wrong with the wall that begins at a corner, and what is expected of that corner.
const FAULTS: [(Fault, &str); 3] = [
    (
        is_short,
        "another place than the next corner's; the last wall leads back to the first corner by itself",
    ),
    (
        leads_back,
        "a wall that the next one does not lead back along",
    ),
    (
        meets_another,
        "a wall that meets no other but those before and after it",
    ),
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

/// The ends of the wall that begins at a corner, counted round and round.
fn wall(plan_m: &[DVec2], index: usize) -> [DVec2; 2] {
    let count = plan_m.len();
    [plan_m[index % count], plan_m[(index + 1) % count]]
}

/// Whether two segments cross within both.
fn cross([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |from: DVec2, to: DVec2, point: DVec2| (to - from).perp_dot(point - from);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn distance_m(point: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared();
    point.distance(from + share.clamp(0.0, 1.0) * along)
}

const HINT: &str = "a room has size_mm, or plan_mm and height_mm, or vertices_mm and faces, or file and perhaps unit_mm";
/// Corners nearer than this to one another or to a wall are on it: a micrometre.
const SLIVER_M: f64 = 1e-6;
