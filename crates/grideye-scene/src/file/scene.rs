//! Builds a scene from the file's tables, or reports why it cannot.

use crate::file::document::SceneTable;
use crate::file::files::Files;
use crate::file::reader::{Read, Reader};
use crate::file::rule::{DURATION, PAPER_EXPERIMENT, REFLECTED, WAVELENGTH, paper_experiment};
use crate::file::waypoints::Waypoint;
use crate::file::{
    agent, body, calibrated, clothes, mosaic, prints, room, sensor, uncertain, vary,
};
use crate::model::uncertain::{Uncertain, with_values};
use crate::model::{
    Agent, Body, Loaded, Model, Room, Scene, SceneError, Variant, Vary, Walls, Warning,
};
use crate::radiometry::{Band, Law};
use crate::text::{Utc, millimeters, reach};
use std::collections::HashSet;
use std::io;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeTable;

impl Scene {
    /// The TOML document of a scene's text, for editing the text: its spans are bytes of the text.
    ///
    /// # Errors
    /// As [`Scene::parse`], for a text that is too long or not TOML.
    pub fn document<'t>(text: &'t str, origin: &'t str) -> Read<Spanned<DeTable<'t>>> {
        Reader::new(origin, text, &no_files)?.document()
    }

    /// The `[[uncertain]]` tables of a scene's text, without reading the files it names.
    ///
    /// # Errors
    /// As [`Scene::parse`], for the tables and the form of the text.
    pub fn uncertain_in(text: &str, origin: &str) -> Read<Vec<Uncertain>> {
        let reader = Reader::new(origin, text, &no_files)?;
        let tables = tables(&reader)?;
        uncertain::uncertain(&reader, &tables.uncertain)
    }

    /// The `[[vary]]` tables of a scene's text, in its order.
    ///
    /// # Errors
    /// As [`Self::uncertain_in`].
    pub fn vary_in(text: &str, origin: &str) -> Read<Vec<Vary>> {
        let reader = Reader::new(origin, text, &no_files)?;
        let tables = tables(&reader)?;
        vary::vary(&reader, &tables.vary)
    }

    /// Reads a scene; `origin` is the file's name in messages, `files` supplies the files it names.
    ///
    /// # Errors
    /// The reason why the scene or one of its [variants](Self::variants) cannot be simulated, with its place and a hint.
    pub fn parse(text: &str, origin: &str, files: &dyn Files) -> Read<Loaded> {
        Self::parse_as(None, text, origin, files)
    }

    /// As [`parse`](Self::parse), but without [variants](Self::variants): for a text that is one of many.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_without_variants(text: &str, origin: &str, files: &dyn Files) -> Read<Loaded> {
        parse(Reader::new(origin, text, files)?, None)
    }

    /// As [`parse_without_variants`](Self::parse_without_variants), for a scene with agents that find their places later, by [`Self::stand`]: agents may
    /// be anywhere.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_anywhere(text: &str, origin: &str, files: &dyn Files) -> Read<Loaded> {
        let mut reader = Reader::new(origin, text, files)?;
        reader.checks_places = false;
        parse(reader, None)
    }

    /// As [`parse`](Self::parse), but with the given model; `None` uses the file's.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_as(
        model: Option<Model>,
        text: &str,
        origin: &str,
        files: &dyn Files,
    ) -> Read<Loaded> {
        let parse = |text: &str| parse(Reader::new(origin, text, files)?, model);
        let mut loaded = parse(text)?;
        loaded.scene.variants = variants(&loaded, text, &parse)?;
        Ok(loaded)
    }
}

fn variants(
    loaded: &Loaded,
    text: &str,
    parse: &dyn Fn(&str) -> Read<Loaded>,
) -> Read<Vec<Variant>> {
    let uncertain = &loaded.scene.uncertain;
    let scene = |one: &Uncertain, value: f64| {
        let value = value.clamp(one.bounds[0], one.bounds[1]);
        let text = with_values(text, std::slice::from_ref(one), &[value]);
        let found = parse(&text).map_err(|error| error.to_string());
        let found = found.and_then(|found| match removed(&found, loaded) {
            Some(why) => Err(why.to_string()),
            None => Ok(found.scene),
        });
        let mut scene = found.map_err(|why| {
            let (why, _) = why.split_once('\n').unwrap_or((&why, ""));
            let problem = format!("`{}` may be {value} by its law, but then {why}", one.key);
            let hint = "`grideye compare` needs the scene with this number one sd off each way; give a smaller sd, or bounds";
            one.place.clone().refused(problem, hint)
        })?;
        // A law around the value must not move with it, and places are those of the file.
        scene.uncertain.clone_from(uncertain);
        Read::Ok(Arc::new(scene))
    };
    let numbers = uncertain.iter().filter(|one| one.value_span.is_some());
    let laws = numbers.filter_map(|one| Some((one, one.known()?)));
    let variants = laws.map(|(one, law)| {
        Ok(Variant {
            key: one.key.clone(),
            below: scene(one, law.mean - law.sd)?,
            above: scene(one, law.mean + law.sd)?,
        })
    });
    variants.collect()
}

/// The warning of an object that only the variant removed: without it, the variant would be another room.
fn removed<'v>(variant: &'v Loaded, loaded: &Loaded) -> Option<&'v Warning> {
    let outside = |warning: &Warning| match warning {
        Warning::ObjectOutsideRoom { name, .. } => Some(name.clone()),
        _ => None,
    };
    let known: HashSet<String> = loaded.warnings.iter().filter_map(outside).collect();
    let mut warnings = variant.warnings.iter();
    warnings.find(|warning| outside(warning).is_some_and(|name| !known.contains(&name)))
}

fn parse(mut reader: Reader<'_>, model: Option<Model>) -> Read<Loaded> {
    let mut tables = tables(&reader)?;
    reader.check_names(&tables)?;
    let models = [
        ("paper", Model::Paper),
        ("paper-grid", Model::PaperGrid),
        ("physical", Model::Physical),
    ];
    let hint = "paper is the default; scenes/README.md says when to use which";
    let of_file = reader.choice("model", &tables.model, &models, hint)?;
    reader.model = model.or(of_file).unwrap_or_default();
    check_touches(&reader, &tables)?;
    tables.leave_out_absent();
    read(&reader, &tables)
}

fn tables(reader: &Reader<'_>) -> Read<SceneTable> {
    let tables: SceneTable = toml::from_str(reader.text).map_err(|error| {
        let mut refusal = reader.malformed(&error);
        let problem = &mut refusal.problem;
        if problem.starts_with("unknown field `fit`") && problem.contains("`uncertain`") {
            *problem = "[[fit]] is now [[uncertain]]".to_owned();
            refusal.hint = "rename the table; its keys are the same".to_owned();
        }
        refusal
    })?;
    reader.check_counts(&tables)?;
    Ok(tables)
}

fn no_files(_: &str) -> io::Result<String> {
    Err(io::ErrorKind::NotFound.into())
}

fn read(reader: &Reader<'_>, tables: &SceneTable) -> Read<Loaded> {
    let room = room::room(reader, &tables.room)?;
    let walls = Walls::new(&room);
    let (objects, mut warnings) = objects(reader, tables, (&room, &walls))?;
    let (agents, starts_utc) = agents(reader, tables, (&room, &walls))?;
    warnings.extend(clothes::warnings(reader, tables));
    let sensors = tables.sensor.iter();
    let sensors = sensors.map(|table| sensor::sensor(reader, table, &room));
    let sensors = sensors.collect::<Read<Vec<_>>>()?;
    let hint = "B is the default; scenes/README.md has both formulas";
    let law = reader.choice("law", &tables.law, &[("A", Law::A), ("B", Law::B)], hint)?;
    let duration_s = reader.number_or(&tables.duration_s, &DURATION, 0.0)?;
    let experiment = reader.optional(&tables.paper_experiment, &PAPER_EXPERIMENT)?;
    let reflected = &tables.room.get_ref().reflected_c;
    let reflected_c = reader.number_or(reflected, &REFLECTED, room.ambient_c)?;
    let mut scene = Scene {
        screen: room.screen(),
        room,
        objects,
        agents,
        sensors,
        model: reader.model,
        law: law.unwrap_or_default(),
        band: band(reader, tables)?,
        reflected_c,
        duration_s,
        starts_utc,
        paper_experiment: experiment.and_then(paper_experiment),
        prints: Vec::new(),
        calibrated: calibrated::calibrated(reader, &tables.calibrated)?,
        uncertain: Vec::new(),
        variants: Vec::new(),
    };
    scene.prints = prints::prints(reader, &scene)?;
    warnings.extend(contacts(reader, tables, &scene)?);
    scene.uncertain = uncertain::uncertain(reader, &tables.uncertain)?;
    for one in &mut scene.uncertain {
        let mut latest = scene.calibrated.iter().rev();
        one.found_sd = latest.find_map(|table| table.sd.get(&one.key).copied());
    }
    Ok(Loaded { scene, warnings })
}

fn band(reader: &Reader<'_>, tables: &SceneTable) -> Read<Band> {
    let window = reader.range(&tables.band_um, &WAVELENGTH)?;
    Ok(window.map_or(Band::All, |(from_um, to_um)| Band::Window {
        from_um,
        to_um,
    }))
}

fn objects(
    reader: &Reader<'_>,
    tables: &SceneTable,
    (room, walls): (&Room, &Walls),
) -> Read<(Vec<Body>, Vec<Warning>)> {
    let (mut objects, mut warnings) = (Vec::new(), Vec::new());
    let mut keep = |object: Body, byte: usize| {
        if room.holds_corners_of(&object.mesh) && !walls.meet(&object.mesh) {
            objects.push(object);
            return;
        }
        let (reach_mm, room_mm) = (reach(object.mesh.bounds_m()), room.described());
        let problem = format!(
            "object `{}` was removed: it reaches {reach_mm} mm, beyond the room of {room_mm} mm",
            object.name
        );
        let hint = "a position is the center of the base; move or shrink the object";
        warnings.push(Warning::ObjectOutsideRoom {
            name: object.name,
            why: reader.place(byte).refused(problem, hint),
        });
    };
    for table in &tables.object {
        let object = body::object(reader, table, room.ambient_c)?;
        keep(object, table.get_ref().name.span().start);
    }
    let mut count = tables.object.len();
    for table in &tables.mosaic {
        let cells = mosaic::cells(reader, table.get_ref(), count)?;
        count += cells.len();
        for cell in cells {
            keep(cell, table.get_ref().name.span().start);
        }
    }
    Ok((objects, warnings))
}

/// The agents, and the earliest UTC stamp of their trajectories, which is the scene's start.
fn agents(
    reader: &Reader<'_>,
    tables: &SceneTable,
    place: (&Room, &Walls),
) -> Read<(Vec<Agent>, Option<Utc>)> {
    let ways = tables.agent.iter();
    let ways = ways.map(|table| agent::waypoints(reader, table));
    let ways = ways.collect::<Read<Vec<_>>>()?;
    let starts_utc = ways.iter().flatten().filter_map(Waypoint::utc).min();
    let agents = tables.agent.iter().zip(&ways);
    let agents = agents.map(|(table, way)| agent::agent(reader, table, (way, starts_utc), place));
    Ok((agents.collect::<Read<_>>()?, starts_utc))
}

fn contacts(reader: &Reader<'_>, tables: &SceneTable, scene: &Scene) -> Read<Vec<Warning>> {
    let choices = [
        ("warning", Some(false)),
        ("error", Some(true)),
        ("ignore", None),
    ];
    let hint = "warning is the default";
    let wanted = reader.choice("collisions", &tables.collisions, &choices, hint)?;
    let wanted = wanted.unwrap_or(Some(false));
    let Some(is_error) = wanted.filter(|_| reader.checks_places) else {
        return Ok(Vec::new());
    };
    let mut warnings = Vec::new();
    for contact in scene.contacts() {
        let table = tables.agent.get(contact.agent);
        let start = table.map_or(0, |table| table.get_ref().name.span().start);
        let (seconds, place_mm) = (contact.time.as_secs_f64(), millimeters(contact.place_m));
        let seconds = (seconds * 1000.0).round() / 1000.0;
        let names = contact.names;
        let [agent, other] = &names;
        let problem = format!("`{agent}` runs into `{other}` after {seconds} s at {place_mm} mm");
        let hint = format!(
            "move one of them, list `{other}` in the agent's `touches`, or write collisions = \"ignore\" at the top of the scene"
        );
        let why = reader.place(start).refused(problem, &hint);
        if is_error {
            return Err(SceneError::Collision(why));
        }
        warnings.push(Warning::Collision { names, why });
    }
    Ok(warnings)
}

/// An unknown name in `touches` would leave a collision reported, or hide one that is never searched.
fn check_touches(reader: &Reader<'_>, tables: &SceneTable) -> Read<()> {
    let objects = tables.object.iter().map(|table| &table.get_ref().name);
    let agents = tables.agent.iter().map(|table| &table.get_ref().name);
    let known: HashSet<&String> = objects.chain(agents).map(Spanned::get_ref).collect();
    let lists = tables.agent.iter();
    let lists = lists.filter_map(|table| table.get_ref().touches.as_ref());
    let mut names = lists.flat_map(Spanned::get_ref);
    let Some(unknown) = names.find(|name| !known.contains(name.get_ref())) else {
        return Ok(());
    };
    let expected = "names of objects or agents of this scene";
    let hint = "list what the agent may touch, as in touches = [\"chair\"]";
    Err(reader
        .refused("touches", unknown.span(), expected, hint)
        .into())
}
