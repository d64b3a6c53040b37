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
    /// An edit that cannot be made; the text is as it was.
    pub(super) fn unfit(message: &str) -> Self {
        Self {
            message: message.to_owned(),
            hint: Some("change it in the scene's text".to_owned()),
            place: None,
        }
    }

    /// A file that the scene names, or that an edit is for.
    pub(super) fn of_file(file: &str, line: usize, message: &str) -> Self {
        let place = Place {
            file: file.into(),
            line,
            column: 1,
        };
        Self {
            message: message.to_owned(),
            hint: Some(
                "a trajectory has the columns x_mm,y_mm,z_mm and one way-point a row".to_owned(),
            ),
            place: Some(place),
        }
    }

    /// A text that is no TOML.
    pub(super) fn of_toml(text: &str, error: &toml_edit::TomlError) -> Self {
        let byte = error.span().map_or(0, |span| span.start);
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let column = before.get(line_start..).unwrap_or_default().chars().count();
        Self {
            message: error.message().trim_end().replace('\n', ", "),
            hint: Some("the text must be TOML before anything in it can be moved".to_owned()),
            place: Some(Place {
                file: ORIGIN.into(),
                line: before.matches('\n').count() + 1,
                column: column + 1,
            }),
        }
    }

    pub(super) fn of_scene(error: &SceneError) -> Self {
        let (message, hint) = parts(&error.to_string(), error.place());
        Self {
            message,
            hint,
            place: error.place().cloned(),
        }
    }

    /// What has no place, with its hint on a line of its own.
    pub(super) fn said(said: &str) -> Self {
        let (message, hint) = parts(said, None);
        Self {
            message,
            hint,
            place: None,
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
pub(super) fn place_json(place: &Place) -> Value {
    json!({ "file": place.file, "line": place.line, "column": place.column })
}

/// What is said, without the place that stands before it, and the hint behind it.
pub(super) fn parts(said: &str, place: Option<&Place>) -> (String, Option<String>) {
    let placed = place.and_then(|place| said.strip_prefix(&format!("{place}: ")));
    let said = placed.unwrap_or(said);
    match said.split_once("\nhint: ") {
        Some((message, hint)) => (message.to_owned(), Some(hint.to_owned())),
        None => (said.to_owned(), None),
    }
}
