//! What is asked to vary: the scene's `[[vary]]` tables, and options that replace them key by key.

use crate::error::{Mistake, VariationError};
use grideye_scene::key::names;
use grideye_scene::{Scene, Vary};
use toml::Spanned;
use toml::de::DeTable;

/// One key and its values, as somebody wrote them.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    /// The request in errors, with its place if it is a table.
    pub(crate) shown: String,
    /// The same in words, as the file has it for all agents.
    pub(crate) said: String,
    pub(crate) key: String,
    /// `None` draws by the key's `[[uncertain]]` table.
    pub(crate) values: Option<String>,
    /// Of each choice; empty: all alike.
    pub(crate) weights: Vec<f64>,
    /// Another key, and what is added for each unit that it is off its middle.
    pub(crate) with: Option<(String, f64)>,
    /// The values of the table that this option replaces: what goes with the key is told from their middle.
    pub(crate) replaced: Option<String>,
}

impl Asked {
    pub(crate) fn mistaken(&self, mistake: Mistake) -> VariationError {
        VariationError::Asked {
            asked: self.shown.clone(),
            mistake,
        }
    }

    /// Checks that each of so many choices has a weight.
    pub(crate) fn check_weights(&self, choices: usize) -> Result<(), Mistake> {
        match self.weights.len() {
            0 => Ok(()),
            weights if weights == choices => Ok(()),
            weights => Err(Mistake(format!(
                "{weights} weights for {choices} choices\nhint: give one weight for each of the values, as in values = \"0,1,2\" and weights = [3, 2, 1]"
            ))),
        }
    }

    fn of_option(text: &str) -> Self {
        let (key, values) = match text.split_once('=') {
            Some((key, values)) => (key, Some(values.trim().to_owned())),
            None => (text, None),
        };
        Self {
            shown: text.to_owned(),
            said: text.to_owned(),
            key: key.trim().to_owned(),
            values,
            weights: Vec::new(),
            with: None,
            replaced: None,
        }
    }

    fn of_table(table: Vary) -> Self {
        let values = table.values.as_ref().map(|values| format!("={values}"));
        let request = table.key.clone() + &values.unwrap_or_default();
        let mut said = request.clone();
        if !table.weights.is_empty() {
            let weights: Vec<String> = table.weights.iter().map(f64::to_string).collect();
            said += &format!(", weights {}", weights.join(" "));
        }
        if let Some((with, slope)) = &table.with {
            said += &format!(", with {with}, slope {slope}");
        }
        Self {
            shown: format!("{}: {request}", table.place),
            said,
            key: table.key,
            values: table.values.map(|values| values.trim().to_owned()),
            weights: table.weights,
            with: table.with,
            replaced: None,
        }
    }

    /// One for each table of the kind that the key names with `*`.
    fn each(self, document: &DeTable<'_>) -> Vec<Self> {
        let Some((kind, rest)) = self.key.split_once(".*.") else {
            return vec![self];
        };
        let tables = document.get(kind).into_iter();
        let named = |name: String| Self {
            key: format!("{kind}.{name}.{rest}"),
            with: self
                .with
                .clone()
                .map(|(key, slope)| (key.replacen(".*.", &format!(".{name}."), 1), slope)),
            ..self.clone()
        };
        let all: Vec<Self> = tables.flat_map(names).map(named).collect();
        if all.is_empty() { vec![self] } else { all }
    }
}

/// All requests, an option in the place of the table of the same key.
pub(crate) fn all(
    (text, origin): (&str, &str),
    document: &Spanned<DeTable<'_>>,
    options: &[String],
) -> Result<Vec<Asked>, VariationError> {
    let tables = Scene::vary_in(text, origin)?;
    let document = document.get_ref();
    let each = |asked: Asked| asked.each(document);
    let options = options.iter().map(|option| Asked::of_option(option));
    let mut options: Vec<Asked> = options.flat_map(each).collect();
    let tables = tables.into_iter().map(Asked::of_table).flat_map(each);
    let mut all: Vec<Asked> = Vec::new();
    for table in tables {
        let option = options.iter().position(|option| option.key == table.key);
        all.push(match option {
            Some(option) => Asked {
                replaced: table.values,
                ..options.remove(option)
            },
            None => table,
        });
    }
    all.extend(options);
    Ok(all)
}
