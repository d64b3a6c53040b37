//! What keeps a text from being a scene, and where.

use grideye_scene::{Place, SceneError};
use serde_json::{Value, json};
use std::fmt;

/// What places in the scene's own text name as their file.
pub(super) const ORIGIN: &str = "scene";

/// A fault with its place, if it has one, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    message: String,
    hint: Option<String>,
    place: Option<Place>,
}

impl Fault {
    fn new(message: &str, hint: &str, place: Option<Place>) -> Self {
        let (message, hint) = (message.to_owned(), Some(hint.to_owned()));
        Self {
            message,
            hint,
            place,
        }
    }

    /// An edit that cannot be made; the text is as it was.
    pub(super) fn unfit(message: &str) -> Self {
        Self::new(message, "change it in the scene file", None)
    }

    /// A file that the scene names, or that an edit is for.
    pub(super) fn of_file(file: &str, line: usize, message: &str) -> Self {
        let (file, column) = (file.into(), 1);
        let hint = "a trajectory has the columns x_mm,y_mm,z_mm and one waypoint per row";
        Self::new(message, hint, Some(Place { file, line, column }))
    }

    /// A text that is no TOML.
    pub(super) fn of_toml(text: &str, error: &toml_edit::TomlError) -> Self {
        let byte = error.span().map_or(0, |span| span.start);
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let column = before.get(line_start..).unwrap_or_default().chars().count();
        let place = Place {
            file: ORIGIN.into(),
            line: before.matches('\n').count() + 1,
            column: column + 1,
        };
        let message = error.message().trim_end().replace('\n', ", ");
        let hint = "fix the TOML first; until then nothing can be moved";
        Self::new(&message, hint, Some(place))
    }

    pub(super) fn of_scene(error: &SceneError) -> Self {
        Self::said(&error.to_string(), error.place())
    }

    /// What is said with its place before it, if it has one, and its hint on a line of its own.
    pub(super) fn said(said: &str, place: Option<&Place>) -> Self {
        let (message, hint) = parts(said, place);
        let place = place.cloned();
        Self {
            message,
            hint,
            place,
        }
    }

    pub(super) fn to_json(&self) -> Value {
        let place = self.place.as_ref();
        json!({ "message": self.message, "hint": self.hint, "place": place.map(place_json) })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(formatter, "{place}: ")?;
        }
        formatter.write_str(&self.message)?;
        match &self.hint {
            Some(hint) => write!(formatter, "\nhint: {hint}"),
            None => Ok(()),
        }
    }
}

/// Line and column of a place, and its file.
fn place_json(place: &Place) -> Value {
    json!({ "file": place.file, "line": place.line, "column": place.column })
}

/// What is said, without the place that stands before it, and the hint behind it.
fn parts(said: &str, place: Option<&Place>) -> (String, Option<String>) {
    let placed = place.and_then(|place| said.strip_prefix(&format!("{place}: ")));
    let said = placed.unwrap_or(said);
    match said.split_once("\nhint: ") {
        Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
        None => (said.to_owned(), None),
    }
}
