//! A file's name and text: what turns a value into a checked one, or into the message with its place.

use crate::file::document::{Exactly, PerAxis, SceneTable, Triple};
use crate::file::files::Files;
use crate::file::rule::{FIELD_OF_VIEW, POSITION, SIZE, VERTEX};
use crate::model::error::SceneError;
use crate::model::fit::FITS_MAX;
use crate::model::limits;
use crate::model::scene::Model;
use crate::text::lengths::MM_PER_M;
use crate::text::place::Place;
use crate::text::refusal::{Rule, excerpt};
use glam::{DVec2, DVec3, USizeVec2};
use grideye_frame::{NAME_RULE, is_name};
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Component, Path};
use toml::Spanned;
use toml::de::DeTable;

pub(crate) struct Source<'a> {
    pub(crate) origin: &'a str,
    pub(crate) text: &'a str,
    /// The model that it is read for: some keys mean something in one only.
    pub(crate) model: Model,
}

impl<'a> Source<'a> {
    /// The TOML document, bounded; places in it are those of the text.
    pub(crate) fn document(&self) -> Result<Spanned<DeTable<'a>>, SceneError> {
        self.check_length()?;
        DeTable::parse(self.text).map_err(|error| self.malformed(&error))
    }
}

impl Source<'_> {
    pub(crate) fn place(&self, byte: usize) -> Place {
        Place::of_byte(self.origin, self.text, byte)
    }

    /// What the TOML reader refused, with the key that it does not name itself.
    pub(crate) fn malformed(&self, error: &toml::de::Error) -> SceneError {
        let byte = error.span().map_or(0, |span| span.start);
        let message = error.message().trim_end().replace('\n', ", ");
        let hint = if message.starts_with("unknown field") {
            "correct the spelling or remove the key; scenes/README.md describes every key"
        } else if message.starts_with("missing field") {
            "add the key to this table; scenes/README.md describes every key"
        } else if message.starts_with("invalid") {
            "scenes/README.md gives each key's type; objects, agents and sensors are written [[object]], [[agent]], [[sensor]]"
        } else {
            "the file must be TOML: text in quotes, every key once, lists in brackets"
        };
        // The types of the program mean nothing to the file's author.
        let message = message
            .replace("expected f64", "expected a number")
            .replace("expected i64", "expected a whole number");
        let message = match self.key_before(byte) {
            Some(key) => format!("`{key}`: {message}"),
            None => message,
        };
        SceneError::Malformed {
            place: self.place(byte),
            message,
            hint,
        }
    }

    pub(crate) fn refused(
        &self,
        key: &'static str,
        span: Range<usize>,
        expected: &str,
        hint: &'static str,
    ) -> SceneError {
        SceneError::Value {
            place: self.place(span.start),
            key,
            found: excerpt(self.text.get(span).unwrap_or_default()),
            expected: expected.to_owned(),
            hint,
        }
    }

    pub(crate) fn check_length(&self) -> Result<(), SceneError> {
        let hint = "is it a scene file, or a trajectory, at all?";
        self.check_count(
            "bytes of text",
            self.text.len(),
            limits::TEXT_BYTES_MAX,
            0,
            hint,
        )
    }

    pub(crate) fn check_counts(&self, tables: &SceneTable) -> Result<(), SceneError> {
        self.check_tables(
            "[[object]] tables",
            &tables.object,
            limits::OBJECTS_MAX,
            "merge objects that touch and have one temperature",
        )?;
        self.check_tables(
            "[[agent]] tables",
            &tables.agent,
            limits::AGENTS_MAX,
            "write people who stand still as [[object]]",
        )?;
        for agent in &tables.agent {
            self.check_tables(
                "[[agent.part]] tables",
                &agent.get_ref().part,
                limits::PARTS_MAX,
                "a mesh, shape = \"obj\", may have more faces than parts can",
            )?;
        }
        self.check_tables(
            "[[sensor]] tables",
            &tables.sensor,
            limits::SENSORS_MAX,
            "spread the sensors over several scene files",
        )?;
        self.check_tables(
            "[[fit]] tables",
            &tables.fit,
            FITS_MAX,
            "find some of the unknowns first, or measure them",
        )
    }

    pub(crate) fn check_names(&self, tables: &SceneTable) -> Result<(), SceneError> {
        let objects = tables.object.iter().map(|table| &table.get_ref().name);
        let mosaics = tables.mosaic.iter().map(|table| &table.get_ref().name);
        let agents = tables.agent.iter().map(|table| &table.get_ref().name);
        let all = objects.chain(mosaics).chain(agents);
        self.check_unique(all, "object and agent")?;
        for agent in &tables.agent {
            let parts = agent.get_ref().part.iter();
            self.check_unique(parts.map(|part| &part.get_ref().name), "part of an agent")?;
        }
        self.check_unique(
            tables.sensor.iter().map(|table| &table.get_ref().name),
            "sensor",
        )
    }

    pub(crate) fn name(&self, name: &Spanned<String>) -> Result<String, SceneError> {
        let found = name.get_ref();
        let length = found.chars().count();
        if !found.trim().is_empty()
            && length <= limits::NAME_CHARACTERS_MAX
            && !found.contains(char::is_control)
        {
            return Ok(found.clone());
        }
        let expected = format!("1 to {} visible characters", limits::NAME_CHARACTERS_MAX);
        Err(self.refused(
            "name",
            name.span(),
            &expected,
            "names appear in messages, reports and file names",
        ))
    }

    /// A sensor is called in the scene as in its recordings.
    pub(crate) fn sensor_name(&self, name: &Spanned<String>) -> Result<String, SceneError> {
        let found = name.get_ref();
        if is_name(found) {
            return Ok(found.clone());
        }
        Err(self.refused(
            "name",
            name.span(),
            NAME_RULE,
            "a sensor's name goes into its recordings; write `-` for a blank, as in right-arm",
        ))
    }

    pub(crate) fn number(&self, number: &Spanned<f64>, rule: &Rule) -> Result<f64, SceneError> {
        self.check(*number.get_ref(), number.span(), rule)
    }

    pub(crate) fn optional(
        &self,
        number: Option<&Spanned<f64>>,
        rule: &Rule,
    ) -> Result<Option<f64>, SceneError> {
        number.map(|number| self.number(number, rule)).transpose()
    }

    pub(crate) fn number_or(
        &self,
        number: Option<&Spanned<f64>>,
        rule: &Rule,
        default: f64,
    ) -> Result<f64, SceneError> {
        Ok(self.optional(number, rule)?.unwrap_or(default))
    }

    pub(crate) fn size_m(&self, size_mm: &Spanned<Triple>) -> Result<DVec3, SceneError> {
        self.metres(size_mm, &SIZE)
    }

    pub(crate) fn position_m(&self, position_mm: &Spanned<Triple>) -> Result<DVec3, SceneError> {
        self.metres(position_mm, &POSITION)
    }

    pub(crate) fn fov_deg(
        &self,
        angles: Option<&Spanned<PerAxis>>,
    ) -> Result<Option<DVec2>, SceneError> {
        let Some(angles) = angles else {
            return Ok(None);
        };
        for angle_deg in angles.get_ref().0 {
            self.check(angle_deg, angles.span(), &FIELD_OF_VIEW)?;
        }
        Ok(Some(DVec2::from_array(angles.get_ref().0)))
    }

    pub(crate) fn range(
        &self,
        range: Option<&Spanned<Exactly<f64, 2>>>,
        rule: &Rule,
    ) -> Result<Option<(f64, f64)>, SceneError> {
        let Some(range) = range else { return Ok(None) };
        let [low, high] = range.get_ref().0;
        self.check(low, range.span(), rule)?;
        self.check(high, range.span(), rule)?;
        if low < high {
            return Ok(Some((low, high)));
        }
        Err(self.refused(rule.key, range.span(), rule.expected, rule.hint))
    }

    pub(crate) fn resolution(
        &self,
        resolution: Option<&Spanned<Exactly<i64, 2>>>,
    ) -> Result<Option<USizeVec2>, SceneError> {
        let Some(resolution) = resolution else {
            return Ok(None);
        };
        let axis = |pixels: i64| {
            usize::try_from(pixels)
                .ok()
                .filter(|pixels| (1..=limits::PIXELS_PER_AXIS_MAX).contains(pixels))
        };
        let [columns, rows] = resolution.get_ref().0.map(axis);
        columns
            .zip(rows)
            .map(|(columns, rows)| Some(USizeVec2::new(columns, rows)))
            .ok_or_else(|| {
                let expected =
                    format!("[columns, rows], each 1 to {}", limits::PIXELS_PER_AXIS_MAX);
                self.refused(
                    "resolution",
                    resolution.span(),
                    &expected,
                    "the Grid-EYE has [8, 8]",
                )
            })
    }

    pub(crate) fn vertices_m(
        &self,
        vertices_mm: &[Spanned<Triple>],
    ) -> Result<Vec<DVec3>, SceneError> {
        let vertices = vertices_mm.iter();
        vertices
            .map(|vertex| self.metres(vertex, &VERTEX))
            .collect()
    }

    pub(crate) fn plan_m(
        &self,
        corner_mm: &Spanned<Exactly<f64, 2>>,
        rule: &Rule,
    ) -> Result<DVec2, SceneError> {
        for length_mm in corner_mm.get_ref().0 {
            self.check(length_mm, corner_mm.span(), rule)?;
        }
        Ok(DVec2::from_array(corner_mm.get_ref().0) / MM_PER_M)
    }

    fn metres(&self, lengths_mm: &Spanned<Triple>, rule: &Rule) -> Result<DVec3, SceneError> {
        for length_mm in lengths_mm.get_ref().0 {
            self.check(length_mm, lengths_mm.span(), rule)?;
        }
        Ok(DVec3::from_array(lengths_mm.get_ref().0) / MM_PER_M)
    }

    fn check(&self, number: f64, span: Range<usize>, rule: &Rule) -> Result<f64, SceneError> {
        if (rule.holds)(number) {
            return Ok(number);
        }
        Err(self.refused(rule.key, span, rule.expected, rule.hint))
    }

    fn check_tables<T>(
        &self,
        what: &'static str,
        tables: &[Spanned<T>],
        limit: usize,
        hint: &'static str,
    ) -> Result<(), SceneError> {
        let first_too_many = tables.get(limit).map_or(0, |table| table.span().start);
        self.check_count(what, tables.len(), limit, first_too_many, hint)
    }

    pub(crate) fn check_count(
        &self,
        what: &'static str,
        found: usize,
        limit: usize,
        byte: usize,
        hint: &'static str,
    ) -> Result<(), SceneError> {
        if found <= limit {
            return Ok(());
        }
        Err(SceneError::TooMany {
            place: self.place(byte),
            what,
            found,
            limit,
            hint,
        })
    }

    fn check_unique<'n>(
        &self,
        names: impl Iterator<Item = &'n Spanned<String>>,
        kind: &'static str,
    ) -> Result<(), SceneError> {
        let mut first_bytes = HashMap::new();
        for name in names {
            if let Some(first_byte) = first_bytes.insert(name.get_ref(), name.span().start) {
                return Err(SceneError::DuplicateName {
                    place: self.place(name.span().start),
                    name: name.get_ref().clone(),
                    first_line: self.place(first_byte).line,
                    kind,
                });
            }
        }
        Ok(())
    }

    /// The key that stands before a byte on its line, if the byte is in a value.
    fn key_before(&self, byte: usize) -> Option<&str> {
        let line = self.text.get(..byte)?.rsplit('\n').next()?;
        line.split_once('=').map(|(key, _)| key.trim())
    }
}

/// The text of a file that the scene names, in or below its own folder; `what` is the key and what it stands for.
pub(crate) fn read_below(
    source: &Source<'_>,
    (key, what): (&'static str, &'static str),
    path: &Spanned<String>,
    files: &dyn Files,
) -> Result<String, SceneError> {
    let relative = path.get_ref();
    let stays_below = Path::new(relative)
        .components()
        .all(|part| matches!(part, Component::Normal(_)));
    if relative.is_empty() || relative.contains('\\') || !stays_below {
        return Err(source.refused(
            key,
            path.span(),
            "a path with / below the scene file's folder",
            "put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
        ));
    }
    let text = files
        .read(relative)
        .map_err(|error| SceneError::FileUnreadable {
            place: source.place(path.span().start),
            what,
            path: relative.clone(),
            source: error,
        })?;
    Source {
        origin: relative,
        text: &text,
        model: source.model,
    }
    .check_length()?;
    Ok(text)
}
