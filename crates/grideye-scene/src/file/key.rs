//! Finds a key such as `agent.person.temperature_c` in a scene's text.

use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Why a key was not found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{problem}\nhint: {hint}")]
pub struct KeyError {
    pub(super) problem: String,
    pub(super) hint: String,
}

impl KeyError {
    fn unknown(what: &str, hint: String) -> Self {
        let problem = format!("the scene has no {what}");
        Self { problem, hint }
    }

    fn no_key(hint: String) -> Self {
        let problem = "it names a table, not a key".to_owned();
        Self { problem, hint }
    }
}

/// A table of a scene's document.
#[derive(Debug)]
pub struct Table<'a, 'i> {
    text: &'i str,
    /// Its keys and values.
    pub entries: &'a DeTable<'i>,
    /// Whether it is the whole document.
    pub is_root: bool,
    /// Whether it is an inline table, in braces.
    pub is_inline: bool,
    title: String,
}

/// A key and its value.
pub type Entry<'a, 'i> = (&'a Spanned<Cow<'i, str>>, &'a Spanned<DeValue<'i>>);

const NAMED: [&str; 5] = ["object", "mosaic", "agent", "sensor", "part"];
const LISTED_MAX: usize = 20;

impl<'a, 'i> Table<'a, 'i> {
    /// The whole document of this text.
    #[must_use]
    pub fn root(text: &'i str, entries: &'a DeTable<'i>) -> Self {
        Self {
            text,
            entries,
            is_root: true,
            is_inline: false,
            title: "the scene".to_owned(),
        }
    }

    /// The key's entry, if present.
    #[must_use]
    pub fn entry(&self, key: &str) -> Option<Entry<'a, 'i>> {
        let mut entries = self.entries.iter();
        entries.find(|(name, _)| name.get_ref().as_ref() == key)
    }

    /// Follows a path to its last table, key, and value if present. The path may end in a number of a list, as in
    /// `position_mm.z` or `fov_deg.down`, and may omit `part` before the name of an agent's part.
    ///
    /// # Errors
    /// If the path names something the scene lacks, or a table instead of a key.
    pub fn find<'p>(mut self, path: &'p str) -> Result<Found<'a, 'i, 'p>, KeyError> {
        let mut rest = path;
        loop {
            let (key, behind) = match rest.split_once('.') {
                Some((key, behind)) => (key, Some(behind)),
                None => (rest, None),
            };
            let value = self.entry(key).map(|(_, value)| value);
            match (value, behind) {
                (Some(value), Some(behind)) => {
                    if let Some(number) = element(key, value, behind) {
                        return Ok((self, rest, Some(number)));
                    }
                    (self, rest) = self.below(key, value, behind)?;
                }
                (Some(value), None) => {
                    self.check_no_table(key, value)?;
                    return Ok((self, key, Some(value)));
                }
                (None, None) if !key.is_empty() && !NAMED.contains(&key) => {
                    return Ok((self, key, None));
                }
                (None, _) => match self.entry("part") {
                    Some((_, parts)) if behind.is_some() => {
                        (self, rest) = self.below("part", parts, rest)?;
                    }
                    _ => return Err(self.unknown(key)),
                },
            }
        }
    }

    fn check_no_table(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Result<(), KeyError> {
        match value.get_ref() {
            DeValue::Array(_) if NAMED.contains(&key) => Err(KeyError::no_key(format!(
                "name one of them and a key: {key}.NAME.KEY, with {}",
                listed(names(value))
            ))),
            DeValue::Table(_) if self.is_root => {
                Err(KeyError::no_key(format!("name one of its keys: {key}.KEY")))
            }
            _ => Ok(()),
        }
    }

    fn unknown(&self, key: &str) -> KeyError {
        let keys = self.entries.keys().map(|key| key.get_ref().to_string());
        let mut known = format!("{} has {}", self.title, listed(keys));
        if self.is_root {
            known.push_str("; besides these, time_s is the time of the frame");
        }
        KeyError::unknown(&format!("`{key}`"), known)
    }

    /// The table that a key leads to, and the rest of the path after the table's name, if it has one.
    pub(crate) fn below<'p>(
        &self,
        key: &str,
        value: &'a Spanned<DeValue<'i>>,
        behind: &'p str,
    ) -> Result<(Self, &'p str), KeyError> {
        let table = |value: &'a Spanned<DeValue<'i>>, title: String| {
            let text = self.text.get(value.span()).unwrap_or_default();
            Some(Self {
                text: self.text,
                entries: value.get_ref().as_table()?,
                is_root: false,
                is_inline: text.starts_with('{'),
                title,
            })
        };
        match value.get_ref() {
            DeValue::Array(tables) if NAMED.contains(&key) => {
                // Use the longest matching name, because one name may start with another and a dot.
                let follows = |name: &str| {
                    let rest = behind.strip_prefix(name);
                    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
                };
                let named = tables
                    .iter()
                    .filter_map(|table| Some((table, name(table)?)));
                let fitting = named.filter(|(_, name)| follows(name));
                let Some((found, name)) = fitting.max_by_key(|(_, name)| name.len()) else {
                    let asked = behind.split('.').next().unwrap_or_default();
                    let known = format!("it has {}", listed(names(value)));
                    return Err(KeyError::unknown(&format!("{key} `{asked}`"), known));
                };
                let rest = behind.get(name.len() + 1..).unwrap_or_default();
                let found = table(found, format!("{key} `{name}`"));
                found.filter(|_| !rest.is_empty()).map(|table| (table, rest)).ok_or_else(|| {
                    KeyError::no_key(format!(
                        "name one of its keys, as in {key}.{name}.KEY; scenes/KEYS.md describes every key"
                    ))
                })
            }
            _ => table(value, format!("`{key}`"))
                .map(|table| (table, behind))
                .ok_or_else(|| {
                    let known = format!(
                        "`{key}` is a value; name it as a whole, or one number of a list by .x, .y, .z, .across or .down"
                    );
                    KeyError::unknown(&format!("key below `{key}`: {behind}"), known)
                }),
        }
    }
}

/// The end of a path: table, key, and value if present.
pub type Found<'a, 'i, 'p> = (Table<'a, 'i>, &'p str, Option<&'a Spanned<DeValue<'i>>>);

/// A number of a list, by its axis.
fn element<'a, 'i>(
    key: &str,
    list: &'a Spanned<DeValue<'i>>,
    axis: &str,
) -> Option<&'a Spanned<DeValue<'i>>> {
    let index = match axis {
        "x" | "across" => 0,
        "y" | "down" => 1,
        "z" => 2,
        _ => return None,
    };
    let list = list.get_ref().as_array()?;
    list.get(index).filter(|_| !NAMED.contains(&key))
}

fn name<'a>(table: &'a Spanned<DeValue<'_>>) -> Option<&'a str> {
    table.get_ref().get("name")?.get_ref().as_str()
}

/// The names of the tables in a list.
pub fn names<'a>(tables: &'a Spanned<DeValue<'_>>) -> impl Iterator<Item = String> + 'a {
    let lists = tables.get_ref().as_array().into_iter();
    let tables = lists.flat_map(|tables| tables.iter());
    tables.filter_map(|table| name(table).map(str::to_owned))
}

fn listed(names: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = names.collect();
    let listed = &names[..names.len().min(LISTED_MAX)];
    match names.len() - listed.len() {
        0 if names.is_empty() => "none".to_owned(),
        0 => listed.join(", "),
        more => format!("{} and {more} more", listed.join(", ")),
    }
}
