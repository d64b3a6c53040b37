//! A scene's text, its model and the files it names, with the checks that all tables need.

use crate::file::document::{Axes, Pair, Rows, SceneTable, Triple, Triples, UncertainTable};
use crate::file::files::Files;
use crate::file::rule::{POSITION, SIZE, VERTEX};
use crate::model::{Claim, FITTED_MAX, Model, SceneError, limits};
use crate::text::{MM_PER_M, Refusal, Rule, Source};
use glam::{DVec2, DVec3, USizeVec2};
use grideye_frame::{NAME_RULE, is_name};
use std::collections::HashMap;
use std::ops::Deref;
use std::path::{Component, Path};
use toml::Spanned;
use toml::de::DeTable;

pub(crate) type Read<T> = Result<T, SceneError>;

pub(crate) struct Reader<'a> {
    source: Source<'a>,
    /// Some keys apply to one model only.
    pub(crate) model: Model,
    /// Whether agents that leave the room or run into something are reported.
    pub(crate) checks_places: bool,
    files: &'a dyn Files,
}

impl<'a> Deref for Reader<'a> {
    type Target = Source<'a>;

    fn deref(&self) -> &Source<'a> {
        &self.source
    }
}

impl<'a> Reader<'a> {
    pub(crate) fn new(origin: &'a str, text: &'a str, files: &'a dyn Files) -> Read<Self> {
        let source = Source {
            origin,
            text,
            manual: "scenes/README.md",
            tables: "; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]",
        };
        let model = Model::default();
        let hint = "check that it is a scene file or a trajectory";
        let reader = Self {
            source,
            model,
            checks_places: true,
            files,
        };
        reader.check_count("bytes of text", text.len(), limits::TEXT_BYTES_MAX, 0, hint)?;
        Ok(reader)
    }

    pub(crate) fn document(&self) -> Read<Spanned<DeTable<'a>>> {
        Ok(DeTable::parse(self.text).map_err(|error| self.malformed(&error))?)
    }

    pub(crate) fn missing(&self, byte: usize, table: &str, key: &str, hint: &str) -> SceneError {
        let problem = format!("{table} has no `{key}`");
        self.place(byte).refused(problem, hint).into()
    }

    pub(crate) fn conflict(
        &self,
        byte: usize,
        table: &str,
        [key, other]: [&str; 2],
        hint: &str,
    ) -> SceneError {
        let problem = format!("{table} has both `{key}` and `{other}`");
        self.place(byte).refused(problem, hint).into()
    }

    pub(crate) fn check_count(
        &self,
        what: &str,
        found: usize,
        limit: usize,
        byte: usize,
        hint: &str,
    ) -> Result<(), Refusal> {
        if found <= limit {
            return Ok(());
        }
        let problem = format!("{found} {what}, expected at most {limit}");
        Err(self.place(byte).refused(problem, hint))
    }

    fn check_tables<T>(
        &self,
        name: &str,
        tables: &[Spanned<T>],
        limit: usize,
        hint: &str,
    ) -> Result<(), Refusal> {
        let first_too_many = tables.get(limit).map_or(0, |table| table.span().start);
        let what = format!("[[{name}]] tables");
        self.check_count(&what, tables.len(), limit, first_too_many, hint)
    }

    pub(crate) fn check_counts(&self, tables: &SceneTable) -> Result<(), Refusal> {
        let hint = "merge touching objects of the same temperature";
        self.check_tables("object", &tables.object, limits::OBJECTS_MAX, hint)?;
        let hint = "write people who stand still as [[object]]";
        self.check_tables("agent", &tables.agent, limits::AGENTS_MAX, hint)?;
        for agent in &tables.agent {
            let hint = "a mesh, shape = \"obj\", may have more faces than parts can";
            let parts = &agent.get_ref().part;
            self.check_tables("agent.part", parts, limits::PARTS_MAX, hint)?;
        }
        let hint = "spread the sensors over several scene files";
        self.check_tables("sensor", &tables.sensor, limits::SENSORS_MAX, hint)?;
        let hint = "find some of the unknowns first, or measure them";
        let of_numbers =
            |table: &&Spanned<UncertainTable>| Claim::of(table.get_ref().key.get_ref()).is_none();
        let mut numbers = tables.uncertain.iter().filter(of_numbers);
        let found = numbers.clone().count();
        let first_too_many = numbers
            .nth(FITTED_MAX)
            .map_or(0, |table| table.span().start);
        let what = "[[uncertain]] tables of numbers";
        self.check_count(what, found, FITTED_MAX, first_too_many, hint)
    }

    pub(crate) fn check_names(&self, tables: &SceneTable) -> Result<(), Refusal> {
        let objects = tables.object.iter().map(|table| &table.get_ref().name);
        let mosaics = tables.mosaic.iter().map(|table| &table.get_ref().name);
        let agents = tables.agent.iter().map(|table| &table.get_ref().name);
        self.check_unique(objects.chain(mosaics).chain(agents), "object and agent")?;
        for agent in &tables.agent {
            let parts = agent.get_ref().part.iter();
            self.check_unique(parts.map(|part| &part.get_ref().name), "part of an agent")?;
        }
        let sensors = tables.sensor.iter();
        self.check_unique(sensors.map(|table| &table.get_ref().name), "sensor")
    }

    fn check_unique<'n>(
        &self,
        names: impl Iterator<Item = &'n Spanned<String>>,
        kind: &str,
    ) -> Result<(), Refusal> {
        let mut first_bytes = HashMap::new();
        for name in names {
            let start = name.span().start;
            if let Some(first_byte) = first_bytes.insert(name.get_ref(), start) {
                let first_line = self.place(first_byte).line;
                let name = name.get_ref();
                let problem = format!("the name `{name}` is taken by line {first_line}");
                let hint = format!("give each {kind} its own name");
                return Err(self.place(start).refused(problem, &hint));
            }
        }
        Ok(())
    }

    pub(crate) fn name(&self, name: &Spanned<String>) -> Result<String, Refusal> {
        let found = name.get_ref();
        if !found.trim().is_empty()
            && found.chars().count() <= limits::NAME_CHARACTERS_MAX
            && !found.contains(char::is_control)
        {
            return Ok(found.clone());
        }
        let expected = format!("1 to {} visible characters", limits::NAME_CHARACTERS_MAX);
        let hint = "names appear in messages, reports and file names";
        Err(self.refused("name", name.span(), &expected, hint))
    }

    /// A sensor has the same name in the scene and in its recordings.
    pub(crate) fn sensor_name(&self, name: &Spanned<String>) -> Result<String, Refusal> {
        if is_name(name.get_ref()) {
            return Ok(name.get_ref().clone());
        }
        let hint = "a sensor's name goes into its recordings; write `-` instead of a space, as in right-arm";
        Err(self.refused("name", name.span(), NAME_RULE, hint))
    }

    pub(crate) fn numbers<const N: usize, const ONE: bool>(
        &self,
        numbers: &Spanned<crate::text::Bounded<f64, N, ONE>>,
        rule: &Rule,
    ) -> Result<[f64; N], Refusal> {
        let all = numbers.get_ref().0;
        for number in all {
            self.check(number, numbers.span(), rule)?;
        }
        Ok(all)
    }

    fn meters(&self, lengths_mm: &Spanned<Triple>, rule: &Rule) -> Result<DVec3, Refusal> {
        Ok(DVec3::from_array(self.numbers(lengths_mm, rule)?) / MM_PER_M)
    }

    pub(crate) fn size_m(&self, size_mm: &Spanned<Triple>) -> Result<DVec3, Refusal> {
        self.meters(size_mm, &SIZE)
    }

    pub(crate) fn position_m(&self, position_mm: &Spanned<Triple>) -> Result<DVec3, Refusal> {
        self.meters(position_mm, &POSITION)
    }

    pub(crate) fn vertices_m(&self, vertices_mm: &Triples) -> Result<Vec<DVec3>, Refusal> {
        let vertices = vertices_mm.get_ref().iter();
        let vertices_m = vertices.map(|vertex| self.meters(vertex, &VERTEX));
        vertices_m.collect()
    }

    pub(crate) fn per_axis(
        &self,
        given: &Option<Spanned<Axes>>,
        rule: &Rule,
    ) -> Result<Option<DVec2>, Refusal> {
        let Some(given) = given else { return Ok(None) };
        Ok(Some(self.numbers(given, rule)?.into()))
    }

    pub(crate) fn range(
        &self,
        range: &Option<Spanned<Pair>>,
        rule: &Rule,
    ) -> Result<Option<(f64, f64)>, Refusal> {
        let Some(range) = range else { return Ok(None) };
        let [low, high] = self.numbers(range, rule)?;
        if low < high {
            return Ok(Some((low, high)));
        }
        Err(self.refused(rule.key, range.span(), rule.expected, rule.hint))
    }

    pub(crate) fn resolution(
        &self,
        given: &Option<Spanned<crate::text::Bounded<i64, 2>>>,
    ) -> Result<Option<USizeVec2>, Refusal> {
        let Some(given) = given else { return Ok(None) };
        let limit = limits::PIXELS_PER_AXIS_MAX;
        let axis = given.get_ref().0;
        let axis = axis.map(|pixels| usize::try_from(pixels).unwrap_or(0));
        if axis.iter().all(|pixels| (1..=limit).contains(pixels)) {
            return Ok(Some(axis.into()));
        }
        let expected = format!("[columns, rows], each 1 to {limit}");
        let hint = "the Grid-EYE has [8, 8]";
        Err(self.refused("resolution", given.span(), &expected, hint))
    }

    /// The text of a file that the scene names, in or below its own folder. `key` names the key, `what` its meaning.
    pub(crate) fn read_below(
        &self,
        (key, what): (&str, &str),
        path: &Spanned<String>,
    ) -> Read<String> {
        let relative = path.get_ref();
        let mut parts = Path::new(relative).components();
        let stays_below = parts.all(|part| matches!(part, Component::Normal(_)));
        if relative.is_empty() || relative.contains('\\') || !stays_below {
            let expected = "a path with / below the scene file's folder";
            let hint =
                "put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"";
            return Err(self.refused(key, path.span(), expected, hint).into());
        }
        let unreadable = |source| {
            let problem = format!("cannot read the {what} `{relative}`: {source}");
            let hint = "the path is relative to the scene file's folder";
            let why = self.place(path.span().start).refused(problem, hint);
            SceneError::FileUnreadable { why, source }
        };
        let text = self.files.read(relative).map_err(unreadable)?;
        Reader::new(relative, &text, self.files)?;
        Ok(text)
    }
}

/// The common length of all rows, at least 1.
pub(crate) fn columns(
    reader: &Reader<'_>,
    key: &str,
    rows: &Spanned<Rows>,
    [expected, hint]: [&str; 2],
) -> Read<usize> {
    let first = rows.get_ref().first();
    let columns = first.map_or(0, |row| row.get_ref().len());
    let mut all = rows.get_ref().iter();
    let odd = all.find(|row| row.get_ref().len() != columns);
    if columns > 0 && odd.is_none() {
        return Ok(columns);
    }
    let span = odd.map_or(rows.span(), Spanned::span);
    Err(reader.refused(key, span, expected, hint).into())
}
