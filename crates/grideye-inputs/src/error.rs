//! Why a file cannot be used.

use amg8833_emulator::script::ScriptError;
use grideye_import::ImportError;
use grideye_recording::printable;
use grideye_scene::{Refusal, SceneError};
use grideye_validator::ValidatorError;
use std::fmt::Display;
use std::path::Path;

/// Bad input: the whole message with its hint, and where it is.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct InputError {
    message: String,
    /// The file as it was named; `None` where no file is to blame.
    pub file: Option<String>,
    /// The line in it, from 1.
    pub line: Option<usize>,
}

impl InputError {
    /// An error that no file is to blame for. A hint follows `\nhint: `.
    #[must_use]
    pub fn new(message: impl Display) -> Self {
        Self {
            message: message.to_string(),
            file: None,
            line: None,
        }
    }

    /// Blames a file.
    #[must_use]
    pub fn of(mut self, file: &Path) -> Self {
        self.file = Some(file.display().to_string());
        self
    }

    /// Blames a line, from 1.
    #[must_use]
    pub const fn at(mut self, line: Option<usize>) -> Self {
        self.line = line;
        self
    }

    /// A row of a recording, or the file as a whole: adds the file's name, and a hint unless the error has one.
    #[must_use]
    pub fn of_recording(file: &Path, error: &ImportError) -> Self {
        let told = error.to_string();
        let hint = match told.contains("\nhint: ") {
            true => "",
            false => {
                "\nhint: correct or delete this row; recordings/README.md describes the format"
            }
        };
        let line = error.line().and_then(|line| usize::try_from(line).ok());
        Self::new(format!("{}: {told}{hint}", shown(file)))
            .of(file)
            .at(line)
    }

    /// The message without its hint.
    #[must_use]
    pub fn problem(&self) -> &str {
        self.message
            .split_once(HINT)
            .map_or(&self.message, |(problem, _)| problem)
    }

    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<&str> {
        self.message.split_once(HINT).map(|(_, hint)| hint)
    }
}

const HINT: &str = "\nhint: ";

/// A file's name in messages, in one line.
#[must_use]
pub fn shown(file: impl AsRef<Path>) -> String {
    printable(&file.as_ref().display().to_string())
}

impl From<SceneError> for InputError {
    fn from(error: SceneError) -> Self {
        let place = error.place();
        let file = place.map(|place| place.file.to_string());
        let line = place.map(|place| place.line);
        Self {
            file,
            line,
            ..Self::new(error)
        }
    }
}

impl From<ValidatorError> for InputError {
    fn from(error: ValidatorError) -> Self {
        match error {
            ValidatorError::Scene(error) => error.into(),
            other => Self::new(other),
        }
    }
}

/// Errors that begin with `FILE:LINE:`.
macro_rules! placed {
    ($($error:ty),*) => {$(
        impl From<$error> for InputError {
            fn from(error: $error) -> Self {
                let error = Self::new(error);
                let mut parts = error.message.splitn(3, ':');
                let (file, line) = (parts.next().map(str::to_owned), parts.next());
                match line.and_then(|line| line.parse().ok()) {
                    Some(line) => Self { file, line: Some(line), ..error },
                    None => error,
                }
            }
        }
    )*};
}

placed!(Refusal, ScriptError);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_knows_its_file_line_and_hint() {
        let profile = grideye_scene::profile::Profile::parse("name = 1\n", "a.toml");
        let error = InputError::from(profile.unwrap_err());
        assert_eq!(error.file.as_deref(), Some("a.toml"));
        assert_eq!(error.line, Some(1));
        assert!(!error.problem().contains("hint"), "{error}");
        assert!(error.to_string().ends_with(error.hint().unwrap()));
    }
}
