//! Builds a scene from the file's tables, or reports why it cannot.

use crate::file::files::Files;
use crate::file::keys::SCENE;
use crate::file::reader::{Read, Reader, check_names, present, source};
use crate::file::waypoints::Waypoint;
use crate::file::{
    agent, body, calibrated, clothes, mosaic, prints, room, sensor, uncertain, vary,
};
use crate::model::uncertain::{Uncertain, with_values};
use crate::model::{
    Agent, Body, Claim, FITTED_MAX, Loaded, Model, Room, Scene, Variant, Vary, Walls, Warning,
};
use crate::radiometry::{Band, Law};
use crate::text::{Utc, millimeters, reach};
use grideye_text::{Source, Table};
use std::cell::Cell;
use std::collections::HashSet;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeTable;

impl Scene {
    /// The TOML document of a scene's text, for editing the text: its spans are bytes of the text.
    ///
    /// # Errors
    /// As [`Scene::parse`], for a text that is too long or not TOML.
    pub fn document<'t>(text: &'t str, origin: &'t str) -> Read<Spanned<DeTable<'t>>> {
        Ok(source(origin, text)?.document()?)
    }

    /// The `[[uncertain]]` tables of a scene's text, without reading the files it names.
    ///
    /// # Errors
    /// As [`Scene::parse`], for the tables and the form of the text.
    pub fn uncertain_in(text: &str, origin: &str) -> Read<Vec<Uncertain>> {
        let source = source(origin, text)?;
        uncertain::uncertain(&tables(&source, &source.document()?)?)
    }

    /// The `[[vary]]` tables of a scene's text, in its order.
    ///
    /// # Errors
    /// As [`Self::uncertain_in`].
    pub fn vary_in(text: &str, origin: &str) -> Read<Vec<Vary>> {
        let source = source(origin, text)?;
        let document = source.document()?;
        let tables = tables(&source, &document)?;
        tables
            .tables("vary")
            .map(|table| vary::vary(&table))
            .collect()
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
        Self::parse_unplaced(text, origin, files, &|_| false)
    }

    /// As [`parse_without_variants`](Self::parse_without_variants); agents with names that are free find their places
    /// later, by [`Self::stand`] or [`Self::send`], and may be anywhere.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_unplaced(
        text: &str,
        origin: &str,
        files: &dyn Files,
        is_free: &dyn Fn(&str) -> bool,
    ) -> Read<Loaded> {
        parse((origin, text), files, is_free, None)
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
        let parse = |text: &str| parse((origin, text), files, &|_| false, model);
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

fn parse(
    (origin, text): (&str, &str),
    files: &dyn Files,
    is_free: &dyn Fn(&str) -> bool,
    model: Option<Model>,
) -> Read<Loaded> {
    let source = source(origin, text)?;
    let document = source.document()?;
    let tables = tables(&source, &document)?;
    check_names(&tables)?;
    let of_file = match tables.text("model") {
        Some("physical") => Model::Physical,
        Some("paper-grid") => Model::PaperGrid,
        _ => Model::Paper,
    };
    let reader = Reader {
        model: model.unwrap_or(of_file),
        is_free,
        files,
        named_bytes: Cell::default(),
    };
    check_touches(&tables)?;
    read(&reader, &tables)
}

fn tables<'d>(source: &'d Source<'d>, document: &'d Spanned<DeTable<'d>>) -> Read<Table<'d>> {
    let tables = source.table(&SCENE, document).map_err(|mut refusal| {
        if refusal.problem.starts_with("unknown field `fit`")
            && document.get_ref().contains_key("fit")
        {
            refusal.problem = "[[fit]] is now [[uncertain]]".to_owned();
            refusal.hint = "rename the table; its keys are the same".to_owned();
        }
        refusal
    })?;
    let hint = "find some of the unknowns first, or measure them";
    let is_number = |table: &Table<'_>| Claim::of(table.text("key").unwrap_or_default()).is_none();
    let mut numbers = tables.tables("uncertain").filter(is_number);
    let found = numbers.clone().count();
    let first_too_many = numbers.nth(FITTED_MAX).map_or(0, |table| table.start);
    let limit = (FITTED_MAX, first_too_many);
    source.check_count("[[uncertain]] tables of numbers", found, limit, hint)?;
    Ok(tables)
}

fn read(reader: &Reader<'_>, tables: &Table<'_>) -> Read<Loaded> {
    let table = tables.table("room").unwrap_or(*tables);
    let room = room::room(reader, &table)?;
    let walls = Walls::new(&room);
    let (objects, mut warnings) = objects(reader, tables, (&room, &walls))?;
    let agent_tables = present(tables, "agent");
    let (agents, starts_utc) = agents(reader, &agent_tables, (&room, &walls))?;
    warnings.extend(clothes::warnings(reader, &agent_tables));
    let sensors = tables.tables("sensor");
    let sensors = sensors.map(|table| sensor::sensor(reader, &table, &room));
    let sensors = sensors.collect::<Read<Vec<_>>>()?;
    let calibrated = tables.tables("calibrated");
    let calibrated = calibrated.map(|table| calibrated::calibrated(&table));
    let experiment = |one: &u8| Some(f64::from(*one)) == tables.number("paper_experiment");
    let band_um = tables.list("band_um");
    let mut scene = Scene {
        screen: room.screen(),
        reflected_c: table.number("reflected_c").unwrap_or(room.ambient_c),
        room,
        objects,
        agents,
        sensors,
        model: reader.model,
        law: match tables.text("law") {
            Some("A") => Law::A,
            _ => Law::B,
        },
        band: band_um.map_or(Band::All, |[from_um, to_um]| Band::Window {
            from_um,
            to_um,
        }),
        duration_s: tables.number("duration_s").unwrap_or(0.0),
        starts_utc,
        paper_experiment: (1..=4).find(experiment),
        prints: Vec::new(),
        calibrated: calibrated.collect::<Read<_>>()?,
        uncertain: Vec::new(),
        variants: Vec::new(),
    };
    scene.prints = prints::prints(tables.source, &scene)?;
    warnings.extend(contacts(reader, tables, &agent_tables, &scene)?);
    scene.uncertain = uncertain::uncertain(tables)?;
    for one in &mut scene.uncertain {
        let mut latest = scene.calibrated.iter().rev();
        one.found_sd = latest.find_map(|table| table.sd.get(&one.key).copied());
    }
    Ok(Loaded { scene, warnings })
}

fn objects(
    reader: &Reader<'_>,
    tables: &Table<'_>,
    (room, walls): (&Room, &Walls),
) -> Read<(Vec<Body>, Vec<Warning>)> {
    let (mut objects, mut warnings) = (Vec::new(), Vec::new());
    let mut keep = |object: Body, table: &Table<'_>| {
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
            why: table.source.place(name_at(table)).refused(problem, hint),
        });
    };
    let tables_of_objects = present(tables, "object");
    for table in &tables_of_objects {
        keep(body::object(reader, table, room.ambient_c)?, table);
    }
    let mut count = tables_of_objects.len();
    for table in present(tables, "mosaic") {
        let cells = mosaic::cells(reader, &table, count)?;
        count += cells.len();
        for cell in cells {
            keep(cell, &table);
        }
    }
    Ok((objects, warnings))
}

/// Where a table's name stands.
fn name_at(table: &Table<'_>) -> usize {
    table
        .get("name")
        .map_or(table.start, |name| name.span().start)
}

/// The agents, and the earliest UTC stamp of their trajectories, which is the scene's start.
fn agents(
    reader: &Reader<'_>,
    tables: &[Table<'_>],
    place: (&Room, &Walls),
) -> Read<(Vec<Agent>, Option<Utc>)> {
    let ways = tables.iter().map(|table| agent::waypoints(reader, table));
    let ways = ways.collect::<Read<Vec<_>>>()?;
    let starts_utc = ways.iter().flatten().filter_map(Waypoint::utc).min();
    let agents = tables.iter().zip(&ways);
    let agents = agents.map(|(table, way)| agent::agent(reader, table, (way, starts_utc), place));
    Ok((agents.collect::<Read<_>>()?, starts_utc))
}

fn contacts(
    reader: &Reader<'_>,
    tables: &Table<'_>,
    agents: &[Table<'_>],
    scene: &Scene,
) -> Read<Vec<Warning>> {
    let collisions = tables.text("collisions");
    let is_free = |name: &String| (reader.is_free)(name);
    if collisions == Some("ignore") || scene.agents.iter().all(|agent| is_free(&agent.name)) {
        return Ok(Vec::new());
    }
    let mut warnings = Vec::new();
    let contacts = scene.contacts().into_iter();
    for contact in contacts.filter(|contact| !contact.names.iter().any(is_free)) {
        let start = agents.get(contact.agent).map_or(0, name_at);
        let (seconds, place_mm) = (contact.time.as_secs_f64(), millimeters(contact.place_m));
        let seconds = (seconds * 1000.0).round() / 1000.0;
        let names = contact.names;
        let [agent, other] = &names;
        let problem = format!("`{agent}` runs into `{other}` after {seconds} s at {place_mm} mm");
        let hint = format!(
            "move one of them, list `{other}` in the agent's `touches`, or write collisions = \"ignore\" at the top of the scene"
        );
        let why = tables.source.place(start).refused(problem, &hint);
        if collisions == Some("error") {
            return Err(why.into());
        }
        warnings.push(Warning::Collision { names, why });
    }
    Ok(warnings)
}

/// An unknown name in `touches` would leave a collision reported, or hide one that is never searched.
fn check_touches(tables: &Table<'_>) -> Read<()> {
    let mut names = tables
        .tables("agent")
        .flat_map(|table| table.each("touches"))
        .peekable();
    if names.peek().is_none() {
        return Ok(());
    }
    let bodies = tables.tables("object").chain(tables.tables("agent"));
    let known: HashSet<&str> = bodies.filter_map(|table| table.text("name")).collect();
    match names.find(|name| !name.text().is_some_and(|name| known.contains(name))) {
        None => Ok(()),
        Some(unknown) => Err(unknown.wrong().into()),
    }
}
