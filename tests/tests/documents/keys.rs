//! The tables of keys in the documents, held to the rows by which the programs read those files.
//!
//! After a row has changed, `GRIDEYE_WRITE_KEYS=1` writes the tables: read the difference.

use grideye_scene::{keys, profile};
use grideye_tests::programs::root;
use grideye_text::{Kind, Row, Rows};

const DOCUMENTS: [(&str, &Rows, &str); 3] = [
    ("scenes/KEYS.md", &keys::SCENE, "the top of the file"),
    (
        "scenes/profiles/README.md",
        &profile::PROFILE,
        "the top of the file",
    ),
    (
        "crates/grideye-agent/README.md",
        &grideye_agent::config::CONFIG,
        "the top of `agent.toml`",
    ),
];
const HEADING: &str = "## Every key\n";

/// The section of a document: one table of keys for each table of the file, as deep as they go. What stands in an
/// earlier table with the same words is only named.
fn section(rows: &'static Rows, top: &str) -> String {
    let mut text = HEADING.to_owned();
    let mut tables = vec![(top.to_owned(), rows)];
    let mut explained: Vec<(String, String)> = Vec::new();
    let mut next = 0;
    while let Some((title, rows)) = tables.get(next).cloned() {
        text += &format!("\n| {title} | value | |\n|---|---|---|\n");
        let mut same: Vec<(String, String)> = Vec::new();
        for row in rows.all() {
            let line = line(row, rows);
            match explained.iter().find(|(known, _)| *known == line) {
                Some((_, at)) => match same.iter_mut().find(|(known, _)| known == at) {
                    Some((_, names)) => *names += &format!(", `{}`", row.name()),
                    None => same.push((at.clone(), format!("`{}`", row.name()))),
                },
                None => {
                    text += &line;
                    explained.push((line, title.clone()));
                }
            }
            let (below, title) = match row.kind {
                Kind::Table(below) => (below, format!("`[{}]`", row.key)),
                Kind::Tables(below, _) => (below, format!("`[[{}]]`", row.key)),
                _ => continue,
            };
            match tables
                .iter_mut()
                .find(|(_, known)| std::ptr::eq(*known, below))
            {
                Some((known, _)) => *known += &format!(" and {title}"),
                None => tables.push((title, below)),
            }
        }
        for (at, names) in same {
            text += &format!("\nAs in {at}: {names}.\n");
        }
        next += 1;
    }
    text
}

/// A key's row of the table.
fn line(row: &Row, rows: &Rows) -> String {
    let required = if rows.required.contains(&row.name()) {
        "; required"
    } else {
        ""
    };
    let meaning = row.doc.replace('|', "\\|");
    let (name, value) = (row.name(), value(row));
    format!("| `{name}` | {value}{required} | {meaning} |\n")
}

fn value(row: &Row) -> String {
    match row.kind {
        Kind::Flag => "`true` or `false`".to_owned(),
        Kind::Table(_) => "a table".to_owned(),
        Kind::Tables(_, usize::MAX) => "tables".to_owned(),
        Kind::Tables(_, most) => format!("up to {most} tables"),
        _ => match row.expected() {
            told if told.is_empty() => "text".to_owned(),
            told => told,
        },
    }
}

#[test]
fn the_documents_have_every_key_that_the_programs_read() {
    for (document, rows, top) in DOCUMENTS {
        let path = root().join(document);
        let text = std::fs::read_to_string(&path).unwrap();
        let (before, found) = text.split_once(HEADING).unwrap_or((&text, ""));
        let end = found.find("\n## ").map_or(found.len(), |at| at + 1);
        let expected = section(rows, top);
        let found = HEADING.to_owned() + found[..end].trim_end() + "\n";
        if std::env::var_os("GRIDEYE_WRITE_KEYS").is_some() {
            let rest = text
                .split_once(HEADING)
                .map_or("", |(_, rest)| &rest[end..]);
            let gap = if rest.is_empty() { "" } else { "\n" };
            let before = before.trim_end();
            std::fs::write(&path, format!("{before}\n\n{expected}{gap}{rest}")).unwrap();
            continue;
        }
        assert_eq!(found, expected, "{document}, left, and the rows, right");
    }
}
