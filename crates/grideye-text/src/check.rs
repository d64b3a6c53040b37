//! Holds a table to its rows.

use crate::place::Refusal;
use crate::row::{Kind, Number, Row, Rows, Rule};
use crate::source::{Source, Style};
use crate::table::{Table, number};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads the text of a file, here with its name, by its rows.
///
/// # Errors
/// The first mistake, or what `of_table` finds.
pub fn read<T, E: From<Refusal>>(
    (origin, text): (&str, &str),
    style: &'static Style,
    rows: &'static Rows,
    of_table: impl FnOnce(&Table<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let source = Source {
        origin,
        text,
        style,
    };
    let document = source.document()?;
    of_table(&source.table(rows, &document)?)
}

impl Source<'_> {
    /// The document, if it has these keys and values.
    ///
    /// # Errors
    /// The first key or value that the rows do not allow.
    pub fn table<'d>(
        &'d self,
        rows: &'static Rows,
        document: &'d Spanned<DeTable<'d>>,
    ) -> Result<Table<'d>, Refusal> {
        let table = Table {
            source: self,
            rows,
            entries: document.get_ref(),
            start: document.span().start,
        };
        table.check()?;
        Ok(table)
    }
}

type Checked = Result<(), Refusal>;
type Given<'v, 'd> = &'v Spanned<DeValue<'d>>;

impl Table<'_> {
    fn check(&self) -> Checked {
        let style = self.source.style;
        for (key, value) in self.entries {
            let Some(row) = self.rows.row(key.get_ref()) else {
                let known = self.rows.all().map(|row| format!("`{}`", row.name()));
                let known: Vec<String> = known.collect();
                let expected = match known.len() {
                    0..=2 => known.join(" or "),
                    _ => format!("one of {}", known.join(", ")),
                };
                let message = format!("unknown field `{}`, expected {expected}", key.get_ref());
                return Err(self.source.told(key.span().start, message, style.unknown));
            };
            self.check_value(row, &row.kind, value, value)?;
        }
        if let Some(key) = self.rows.required.iter().find(|key| !self.has(key)) {
            let message = format!("missing field `{key}`");
            return Err(self.source.told(self.start, message, style.missing));
        }
        let mut rules = self.rows.rules.iter();
        rules.try_for_each(|rule| self.check_rule(rule))
    }

    fn check_rule(&self, rule: &Rule) -> Checked {
        let given = |keys: &'static str| keys.split_ascii_whitespace().filter(|key| self.has(key));
        let at = |key: &str| self.get(key).map_or(self.start, |value| value.span().start);
        match rule {
            Rule::OneWay(ways, hint) | Rule::OneWayHere(ways, hint) => {
                let mut given = ways.split('|').filter_map(|way| given(way).next());
                if let (Some(key), Some(other)) = (given.next(), given.next()) {
                    let is_here = matches!(rule, Rule::OneWayHere(..));
                    let byte = if is_here { at(key) } else { self.start };
                    return Err(self.conflict(byte, [key, other], hint));
                }
            }
            Rule::Excludes(key, others, hint) => {
                let other = self.has(key).then(|| given(others).next()).flatten();
                if let Some(other) = other {
                    return Err(self.conflict(self.start, [other, key], hint));
                }
            }
            Rule::OneOf(keys, hint) => {
                if given(keys).next().is_none() {
                    let first = keys.split_ascii_whitespace().next().unwrap_or_default();
                    return Err(self.missing_at(self.start, first, hint));
                }
            }
            Rule::Needs(keys, needed, hint) | Rule::NeedsHere(keys, needed, hint) => {
                if let (Some(byte), false) = (given(keys).map(at).min(), self.has(needed)) {
                    let is_here = matches!(rule, Rule::NeedsHere(..));
                    let byte = if is_here { byte } else { self.start };
                    return Err(self.missing_at(byte, needed, hint));
                }
            }
        }
        Ok(())
    }

    /// Checks a value, or one in a list; a refusal shows `shown`.
    fn check_value(
        &self,
        row: &Row,
        kind: &Kind,
        value: Given<'_, '_>,
        shown: Given<'_, '_>,
    ) -> Checked {
        let inner = value.get_ref();
        let (text, list, table) = (inner.as_str(), inner.as_array(), inner.as_table());
        let is_word = |words: &[&str]| text.map(|word| words.contains(&word));
        let holds = match kind {
            Kind::Text(holds) => text.map(holds),
            Kind::Flag => inner.as_bool().map(|_| true),
            Kind::Word(words) => is_word(words),
            Kind::Number(numbers) => allows(*numbers, inner),
            Kind::NumberOrWord(numbers, words) => is_word(words).or(allows(*numbers, inner)),
            Kind::ListOrOne(_, numbers) if list.is_none() => allows(*numbers, inner),
            Kind::OneOrEach(_, numbers, words) if list.is_none() => {
                is_word(words).or(allows(*numbers, inner))
            }
            Kind::List(..) | Kind::ListOrOne(..) | Kind::OneOrEach(..) | Kind::Rising(_) => list
                .map(|_| self.check_list(row, kind, value))
                .transpose()?,
            Kind::Each(kind) | Kind::Map(kind) => {
                let listed = list.iter().flat_map(|list| list.iter());
                let named = table.iter().flat_map(|table| table.values());
                let mut each = listed.chain(named);
                each.try_for_each(|item| self.check_value(row, kind, item, item))?;
                list.map(|_| ()).or(table.map(|_| ())).map(|()| true)
            }
            Kind::Table(rows) => table.map(|_| self.check_below(rows, value)).transpose()?,
            Kind::Tables(rows, most) => {
                let tables = list.iter().flat_map(|list| list.iter());
                let (found, what) = (tables.clone().count(), format!("[[{}]] tables", row.key));
                let first_too_many = tables
                    .clone()
                    .nth(*most)
                    .map_or(0, |table| table.span().start);
                let limit = (*most, first_too_many);
                self.source.check_count(&what, found, limit, row.doc)?;
                for table in tables {
                    self.check_value(row, &Kind::Table(rows), table, table)?;
                }
                list.map(|_| true)
            }
        };
        match holds {
            Some(true) => Ok(()),
            Some(false) => Err(self.source.refused_by(row, shown.span())),
            None => Err(self.source.mistyped(value, &type_of(kind))),
        }
    }

    fn check_below(&self, rows: &'static Rows, value: Given<'_, '_>) -> Result<bool, Refusal> {
        if let Some(entries) = value.get_ref().as_table() {
            let (source, start) = (self.source, value.span().start);
            Table {
                source,
                rows,
                entries,
                start,
            }
            .check()?;
        }
        Ok(true)
    }

    fn check_list(&self, row: &Row, kind: &Kind, value: Given<'_, '_>) -> Result<bool, Refusal> {
        let list = value
            .get_ref()
            .as_array()
            .into_iter()
            .flat_map(|list| list.iter());
        let (count, numbers) = match kind {
            Kind::List(count, numbers)
            | Kind::ListOrOne(count, numbers)
            | Kind::OneOrEach(count, numbers, _) => (*count, *numbers),
            Kind::Rising(numbers) => (2, *numbers),
            _ => return Ok(true),
        };
        let is_each = matches!(kind, Kind::OneOrEach(..));
        let found = list.clone().count();
        if found != count && !is_each {
            let message = format!("invalid length {found}, expected a list of {count} numbers");
            return Err(self
                .source
                .told(value.span().start, message, self.source.style.mistyped));
        }
        for item in list.clone() {
            let shown = if is_each { item } else { value };
            self.check_value(row, &Kind::Number(numbers), item, shown)?;
        }
        if found != count {
            let problem = format!("`{}` has {found} numbers, expected {count}", row.key);
            let hint =
                "give one number for all pixels, or pixels 1 to 64 in the order of the registers";
            return Err(self.source.place(value.span().start).refused(problem, hint));
        }
        let list = list.map(|item| number(item.get_ref()));
        Ok(!matches!(kind, Kind::Rising(_)) || list.is_sorted_by(|low, high| low < high))
    }
}

/// Whether these numbers have the value; `None` if it is none.
fn allows(numbers: Number, value: &DeValue<'_>) -> Option<bool> {
    let is_of_type = value.is_integer() || !matches!(numbers, Number::Integer(..));
    Some(numbers.holds(number(value).filter(|_| is_of_type)?))
}

fn type_of(kind: &Kind) -> String {
    match kind {
        Kind::Text(_) | Kind::Word(_) => "a string".to_owned(),
        Kind::Flag => "a boolean".to_owned(),
        Kind::Number(Number::Integer(..)) => "a whole number".to_owned(),
        Kind::Number(_) => "a number".to_owned(),
        Kind::NumberOrWord(..) => "a name or a number".to_owned(),
        Kind::List(count, _) => format!("a list of {count} numbers"),
        Kind::Rising(_) => "a list of 2 numbers".to_owned(),
        Kind::ListOrOne(count, _) | Kind::OneOrEach(count, ..) => {
            format!("a number, or a list of {count} numbers")
        }
        Kind::Each(_) | Kind::Tables(..) => "a sequence".to_owned(),
        Kind::Map(_) | Kind::Table(_) => "a table".to_owned(),
    }
}
