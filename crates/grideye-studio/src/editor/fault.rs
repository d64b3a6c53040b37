//! Why a text is not a valid scene, and where.

use grideye_scene::{Place, SceneError};
use serde_json::{Value, json};
use std::fmt;

/// The file name in places within the scene's own text.
pub(super) const ORIGIN: &str = "scene";

/// An error with a hint and, if known, its place.
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

    /// An edit that cannot be applied; the text is unchanged.
    pub(super) fn unfit(message: &str) -> Self {
        Self::new(message, "change it in the scene file", None)
    }

    /// An error in a file that the scene or an edit names.
    pub(super) fn of_file(file: &str, line: usize, message: &str) -> Self {
        let (file, column) = (file.into(), 1);
        let hint = "a trajectory has the columns x_mm,y_mm,z_mm and one waypoint per row";
        Self::new(message, hint, Some(Place { file, line, column }))
    }

    /// A text that is not TOML.
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

    /// Splits a message that starts with its place and ends with a hint line.
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

fn place_json(place: &Place) -> Value {
    json!({ "file": place.file, "line": place.line, "column": place.column })
}

/// Splits off the leading place, and the trailing hint.
fn parts(said: &str, place: Option<&Place>) -> (String, Option<String>) {
    let placed = place.and_then(|place| said.strip_prefix(&format!("{place}: ")));
    let said = placed.unwrap_or(said);
    match said.split_once("\nhint: ") {
        Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
        None => (said.to_owned(), None),
    }
}
