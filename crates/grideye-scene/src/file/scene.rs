//! From the file's tables to a scene that can be simulated, or to the error that says why not.

use crate::file::document::SceneTable;
use crate::file::files::Files;
use crate::file::rule::{DURATION, PAPER_EXPERIMENT, REFLECTED, paper_experiment};
use crate::file::sensor::sensor;
use crate::file::source::Source;
use crate::file::{agent, body, clothes, fit, mosaic, physical, prints, room};
use crate::geometry::mesh::Mesh;
use crate::model::body::Body;
use crate::model::contact::Walls;
use crate::model::error::{SceneError, Warning};
use crate::model::room::Room;
use crate::model::scene::{Loaded, Model, Scene};
use crate::radiometry::perceived::Law;
use crate::text::lengths::{millimetres, reach};
use std::collections::HashSet;
use toml::Spanned;
use toml::de::DeTable;

impl Scene {
    /// The TOML document of a scene's text, for whoever changes the text: its places are bytes of the text.
    ///
    /// # Errors
    /// What [`Scene::parse`] has of a text that is too long, or no TOML.
    pub fn document<'t>(
        text: &'t str,
        origin: &'t str,
    ) -> Result<Spanned<DeTable<'t>>, SceneError> {
        let model = Model::default();
        Source {
            origin,
            text,
            model,
        }
        .document()
    }

    /// Reads a scene; `origin` is the file's name in messages, `files` hands over the trajectories it names.
    ///
    /// # Errors
    /// What makes the scene unfit to be simulated, with its place and a hint.
    pub fn parse(text: &str, origin: &str, files: &dyn Files) -> Result<Loaded, SceneError> {
        parse(None, text, origin, files)
    }

    /// The same, made by the given model whatever the file says; `None` leaves it to the file.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_as(
        model: Option<Model>,
        text: &str,
        origin: &str,
        files: &dyn Files,
    ) -> Result<Loaded, SceneError> {
        parse(model, text, origin, files)
    }
}

fn parse(
    model: Option<Model>,
    text: &str,
    origin: &str,
    files: &dyn Files,
) -> Result<Loaded, SceneError> {
    let mut source = Source {
        origin,
        text,
        model: Model::default(),
    };
    source.check_length()?;
    let mut tables: SceneTable = toml::from_str(text).map_err(|error| source.malformed(&error))?;
    source.check_counts(&tables)?;
    source.check_names(&tables)?;
    let of_file = physical::model(&source, tables.model.as_ref())?;
    source.model = model.unwrap_or(of_file);
    check_touches(&source, &tables)?;
    tables.leave_out_absent();
    let room = room::room(&source, &tables.room, files)?;
    let walls = Walls::new(&room);
    let (objects, mut warnings) = objects(&source, &tables, (&room, &walls), files)?;
    let agents = collect(&tables.agent, |table| {
        agent::agent(&source, table, (&room, &walls), files)
    })?;
    warnings.extend(clothes::warnings(&source, &tables));
    let sensors = collect(&tables.sensor, |table| sensor(&source, table, &room, files))?;
    let law = law(&source, tables.law.as_ref())?;
    let duration_s = source.number_or(tables.duration_s.as_ref(), &DURATION, 0.0)?;
    let experiment = source.optional(tables.paper_experiment.as_ref(), &PAPER_EXPERIMENT)?;
    let reflected = tables.room.get_ref().reflected_c.as_ref();
    let reflected_c = source.number_or(reflected, &REFLECTED, room.ambient_c)?;
    let mut scene = Scene {
        screen: room.screen(),
        room,
        objects,
        agents,
        sensors,
        model: source.model,
        law,
        band: physical::band(&source, &tables)?,
        reflected_c,
        duration_s,
        paper_experiment: experiment.and_then(paper_experiment),
        prints: Vec::new(),
    };
    scene.prints = prints::prints(&source, &scene)?;
    warnings.extend(contacts(&source, &tables, &scene)?);
    let fits = fit::fits(&source, &tables.fit)?;
    Ok(Loaded {
        scene,
        warnings,
        fits,
    })
}

/// The objects that are in the room, each mosaic as its cells, and a warning for each that is not.
fn objects(
    source: &Source<'_>,
    tables: &SceneTable,
    (room, walls): (&Room, &Walls),
    files: &dyn Files,
) -> Result<(Vec<Body>, Vec<Warning>), SceneError> {
    let (mut objects, mut warnings) = (Vec::new(), Vec::new());
    let mut keep = |object: Body, byte: usize| match beyond(&object.mesh, room, walls) {
        None => objects.push(object),
        Some(reach_mm) => warnings.push(Warning::ObjectOutsideRoom {
            place: source.place(byte),
            name: object.name,
            reach_mm,
            room_mm: room.described(),
        }),
    };
    for table in &tables.object {
        let object = body::object(source, table, room.ambient_c, files)?;
        keep(object, table.get_ref().name.span().start);
    }
    let mut count = tables.object.len();
    for table in &tables.mosaic {
        let cells = mosaic::cells(source, table, count)?;
        count += cells.len();
        for cell in cells {
            keep(cell, table.get_ref().name.span().start);
        }
    }
    Ok((objects, warnings))
}

/// Who runs into what, as warnings or as the first of them as an error.
fn contacts(
    source: &Source<'_>,
    tables: &SceneTable,
    scene: &Scene,
) -> Result<Vec<Warning>, SceneError> {
    let wanted = tables.collisions.as_ref();
    let is_error = match wanted.map_or("warning", |wanted| wanted.get_ref()) {
        "warning" => false,
        "error" => true,
        "ignore" => return Ok(Vec::new()),
        _ => {
            return Err(source.refused(
                "collisions",
                wanted.map_or(0..0, Spanned::span),
                "\"warning\", \"error\" or \"ignore\"",
                "warning is the default",
            ));
        }
    };
    let mut warnings = Vec::new();
    for contact in scene.contacts() {
        let table = tables.agent.get(contact.agent);
        let start = table.map_or(0, |table| table.get_ref().name.span().start);
        let (place, names) = (source.place(start), contact.names);
        let (time, place_mm) = (contact.time, millimetres(contact.place_m));
        if is_error {
            return Err(SceneError::Collision {
                place,
                names,
                time,
                place_mm,
            });
        }
        warnings.push(Warning::Collision {
            place,
            names,
            time,
            place_mm,
        });
    }
    Ok(warnings)
}

/// A name in `touches` that nobody has would be a collision that stays, or one that is never looked for.
fn check_touches(source: &Source<'_>, tables: &SceneTable) -> Result<(), SceneError> {
    let objects = tables.object.iter().map(|table| &table.get_ref().name);
    let agents = tables.agent.iter().map(|table| &table.get_ref().name);
    let known: HashSet<&String> = objects.chain(agents).map(Spanned::get_ref).collect();
    let lists = tables
        .agent
        .iter()
        .filter_map(|table| table.get_ref().touches.as_ref());
    for name in lists.flat_map(Spanned::get_ref) {
        if !known.contains(name.get_ref()) {
            return Err(source.refused(
                "touches",
                name.span(),
                "names of objects or agents of this scene",
                "list what the agent may touch, as in touches = [\"chair\"]",
            ));
        }
    }
    Ok(())
}

fn collect<T, U>(
    tables: &[Spanned<T>],
    build: impl Fn(&Spanned<T>) -> Result<U, SceneError>,
) -> Result<Vec<U>, SceneError> {
    tables.iter().map(build).collect()
}

fn law(source: &Source<'_>, law: Option<&Spanned<String>>) -> Result<Law, SceneError> {
    match law.map(|law| (law, law.get_ref().as_str())) {
        None => Ok(Law::default()),
        Some((_, "A")) => Ok(Law::A),
        Some((_, "B")) => Ok(Law::B),
        Some((law, _)) => Err(source.refused(
            "law",
            law.span(),
            "\"A\" or \"B\"",
            "B is the default; scenes/README.md has both formulas",
        )),
    }
}

/// From where to where a body reaches, if it sticks out of the room or through one of its walls.
fn beyond(mesh: &Mesh, room: &Room, walls: &Walls) -> Option<String> {
    let inside = room.holds_corners_of(mesh) && !walls.meet(mesh);
    (!inside).then(|| reach(mesh.bounds_m()))
}
