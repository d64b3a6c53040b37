//! Where in the text of a scene a key stands, or would stand.

use super::error::Mistake;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A part of the text that a value takes the place of, with what goes before and behind it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Edit {
    pub(crate) range: Range<usize>,
    pub(crate) before: String,
    pub(crate) after: String,
}

impl Edit {
    /// Takes a part of the text away.
    fn deletion(range: Range<usize>) -> Self {
        Self {
            range,
            before: String::new(),
            after: String::new(),
        }
    }
}

/// The kinds of tables that have names.
const NAMED: [&str; 5] = ["object", "mosaic", "agent", "sensor", "part"];

/// The keys of an agent that goes somewhere.
const OF_A_WAY: [&str; 5] = [
    "trajectory",
    "speed_mm_per_s",
    "motion",
    "acceleration_mm_per_s2",
    "faces",
];

/// The place of a key such as `agent.person.temperature_c` in the text.
pub(crate) fn edit(
    text: &str,
    document: &Spanned<DeTable<'_>>,
    path: &str,
) -> Result<Edit, Mistake> {
    let mut table = Table {
        entries: document.get_ref(),
        is_root: true,
        is_inline: false,
        title: "the scene".to_owned(),
    };
    let mut rest = path;
    loop {
        let (key, behind) = match rest.split_once('.') {
            Some((key, behind)) => (key, Some(behind)),
            None => (rest, None),
        };
        let Some((_, value)) = table.entry(key) else {
            if behind.is_some() || key.is_empty() || NAMED.contains(&key) {
                return Err(table.unknown(key));
            }
            return table.addition(key);
        };
        let Some(behind) = behind else {
            return match value.get_ref() {
                DeValue::Array(_) if NAMED.contains(&key) => Err(Mistake::NoKey(format!(
                    "name one of them and a key: {key}.NAME.KEY, with {}",
                    listed(names(value))
                ))),
                DeValue::Table(_) if table.is_root => {
                    Err(Mistake::NoKey(format!("name a key of it: {key}.KEY")))
                }
                _ => Ok(Edit {
                    range: value.span(),
                    before: String::new(),
                    after: String::new(),
                }),
            };
        };
        (table, rest) = below(text, key, value, behind)?;
    }
}

/// The edits that put an agent on the floor: the first for its position, the others for what goes with its way.
pub(crate) fn floor(
    text: &str,
    document: &Spanned<DeTable<'_>>,
    agent: &str,
) -> Result<Vec<Edit>, Mistake> {
    let path = format!("agent.{agent}");
    let mut edits = vec![edit(text, document, &format!("{path}.position_mm"))?];
    let Some(agents) = document.get_ref().get("agent") else {
        return Ok(edits);
    };
    let (table, _) = below(text, "agent", agents, &format!("{agent}.position_mm"))?;
    for key in OF_A_WAY {
        if let Some((key, value)) = table.entry(key) {
            if table.is_inline {
                return Err(Mistake::NotAddable("position_mm".to_owned()));
            }
            edits.push(Edit::deletion(key.span().start..value.span().end));
        }
    }
    Ok(edits)
}

/// The value of each key in turn: for finding out whether an edit did what it was to do.
pub(crate) fn has(document: &Spanned<DeTable<'_>>, text: &str, path: &str) -> bool {
    edit(text, document, path).is_ok_and(|edit| edit.before.is_empty())
}

/// The names of all agents.
pub(crate) fn agents(document: &Spanned<DeTable<'_>>) -> Vec<String> {
    let agents = document.get_ref().get("agent");
    agents.into_iter().flat_map(names).collect()
}

struct Table<'a, 'i> {
    entries: &'a DeTable<'i>,
    is_root: bool,
    is_inline: bool,
    title: String,
}

type Entry<'a, 'i> = (
    &'a Spanned<std::borrow::Cow<'i, str>>,
    &'a Spanned<DeValue<'i>>,
);

impl<'a, 'i> Table<'a, 'i> {
    fn entry(&self, key: &str) -> Option<Entry<'a, 'i>> {
        self.entries
            .iter()
            .find(|(name, _)| name.get_ref().as_ref() == key)
    }

    fn unknown(&self, key: &str) -> Mistake {
        let keys = self.entries.keys().map(|key| key.get_ref().to_string());
        let mut known = format!("{} has {}", self.title, listed(keys));
        if self.is_root {
            known.push_str("; beside these, time_s is the moment of the frame");
        }
        Mistake::Unknown {
            what: format!("`{key}`"),
            known,
        }
    }

    /// A key that the table has not: behind one that it has.
    fn addition(&self, key: &str) -> Result<Edit, Mistake> {
        if self.is_root {
            return Ok(Edit {
                range: 0..0,
                before: format!("{key} = "),
                after: "\n".to_owned(),
            });
        }
        let is_plain = |value: &DeValue<'_>| match value {
            DeValue::Table(_) => false,
            DeValue::Array(list) => !list.iter().any(|item| item.get_ref().is_table()),
            _ => true,
        };
        let ends = self
            .entries
            .values()
            .filter(|value| is_plain(value.get_ref()))
            .map(|value| value.span().end);
        let Some(end) = ends.min() else {
            return Err(Mistake::NotAddable(key.to_owned()));
        };
        let separator = if self.is_inline { ", " } else { "\n" };
        Ok(Edit {
            range: end..end,
            before: format!("{separator}{key} = "),
            after: String::new(),
        })
    }
}

/// The table that a key leads to, and what is left of the path: behind the name, if it has one.
fn below<'a, 'i, 'p>(
    text: &str,
    key: &str,
    value: &'a Spanned<DeValue<'i>>,
    behind: &'p str,
) -> Result<(Table<'a, 'i>, &'p str), Mistake> {
    let is_inline = |value: &Spanned<DeValue<'_>>| {
        text.get(value.span())
            .is_some_and(|text| text.starts_with('{'))
    };
    match value.get_ref() {
        DeValue::Table(entries) => Ok((
            Table {
                entries,
                is_root: false,
                is_inline: is_inline(value),
                title: format!("`{key}`"),
            },
            behind,
        )),
        DeValue::Array(tables) if NAMED.contains(&key) => {
            // The longest name, as one may begin with another and a dot.
            let found = tables
                .iter()
                .filter_map(|table| Some((table, name(table)?)))
                .filter(|(_, name)| {
                    behind
                        .strip_prefix(*name)
                        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
                })
                .max_by_key(|(_, name)| name.len());
            let Some((table, name)) = found else {
                let asked = behind.split('.').next().unwrap_or_default();
                return Err(Mistake::Unknown {
                    what: format!("{key} `{asked}`"),
                    known: format!("it has {}", listed(names(value))),
                });
            };
            let rest = behind.get(name.len() + 1..).unwrap_or_default();
            let (Some(entries), false) = (table.get_ref().as_table(), rest.is_empty()) else {
                return Err(Mistake::NoKey(format!(
                    "name a key of it, as in {key}.{name}.KEY; scenes/README.md describes every key"
                )));
            };
            Ok((
                Table {
                    entries,
                    is_root: false,
                    is_inline: is_inline(table),
                    title: format!("{key} `{name}`"),
                },
                rest,
            ))
        }
        _ => Err(Mistake::Unknown {
            what: format!("key below `{key}`: {behind}"),
            known: format!("`{key}` is a value; vary it as a whole"),
        }),
    }
}

fn name<'a>(table: &'a Spanned<DeValue<'_>>) -> Option<&'a str> {
    table.get_ref().get("name")?.get_ref().as_str()
}

fn names<'a>(tables: &'a Spanned<DeValue<'_>>) -> impl Iterator<Item = String> + 'a {
    let tables = tables.get_ref().as_array();
    tables
        .into_iter()
        .flat_map(|tables| tables.iter())
        .filter_map(|table| name(table).map(str::to_owned))
}

/// The first of the names.
fn listed(names: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(LISTED_MAX);
    let mut list = names
        .into_iter()
        .take(LISTED_MAX)
        .collect::<Vec<_>>()
        .join(", ");
    if more > 0 {
        list.push_str(&format!(" and {more} more"));
    }
    if list.is_empty() {
        list.push_str("none");
    }
    list
}

const LISTED_MAX: usize = 20;

/// An agent that is put on the floor.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    pub(crate) asked: String,
    pub(crate) agent: String,
    /// The first is its position's.
    pub(crate) edits: Vec<Edit>,
}

/// The text with values in the places of the edits, which do not overlap.
pub(crate) fn edited(text: &str, mut edits: Vec<(&Edit, String)>) -> String {
    edits.sort_by_key(|(edit, _)| (edit.range.start, edit.range.end));
    let mut whole = String::with_capacity(text.len() + 32 * edits.len());
    let mut copied = 0;
    for (edit, value) in edits {
        whole.push_str(text.get(copied..edit.range.start).unwrap_or_default());
        whole.push_str(&edit.before);
        whole.push_str(&value);
        whole.push_str(&edit.after);
        copied = edit.range.end;
    }
    whole.push_str(text.get(copied..).unwrap_or_default());
    whole
}
