//! Checks `CONFORMANCE.md` against the tests and options it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The page's rows by their line.
fn rows() -> BTreeMap<String, Vec<String>> {
    let page = std::fs::read_to_string("CONFORMANCE.md").unwrap();
    let mut rows = BTreeMap::new();
    for line in page.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<String> = line
            .trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().to_owned())
            .collect();
        if matches!(cells[0].as_str(), "line" | "---") {
            continue;
        }
        assert_eq!(cells.len(), 5, "{line}");
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{line}");
        let before = rows.insert(cells[0].clone(), cells);
        assert!(before.is_none(), "twice: {line}");
    }
    rows
}

/// The texts between backticks.
fn names(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// The names of all `#[test]` functions in this folder and below.
fn tests(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            tests(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            for behind in text.split("#[test]").skip(1) {
                let name = behind.split("fn ").nth(1).unwrap();
                found.insert(name.split('(').next().unwrap().to_owned());
            }
        }
    }
}

#[test]
fn every_test_that_is_named_exists() {
    let mut found = BTreeSet::new();
    for folder in ["src", "tests", "third-party/tests"] {
        tests(Path::new(folder), &mut found);
    }
    assert!(found.contains("every_test_that_is_named_exists"));
    for (line, cells) in rows() {
        let named = names(&cells[3]);
        if named.is_empty() {
            assert_eq!(cells[3], "-", "{line}");
            assert!(cells[4].starts_with("not here: "), "{line} has no test");
        }
        for name in named {
            assert!(
                found.contains(name),
                "{line} names {name}, which is no test"
            );
        }
    }
}

#[test]
fn every_line_of_the_matrix_and_every_section_is_there() {
    let rows = rows();
    for line in 1..=9 {
        let row = rows.get(&format!("4.10-{line}"));
        assert_eq!(row.map(|cells| cells[4].as_str()), Some("held"), "{line}");
    }
    let sections = "1 1.1 1.2 1.3 1.4 2.1 2.2 2.3 2.4 2.5 2.6 2.7 3.3";
    for section in sections.split(' ') {
        let prefix = format!("{section}-");
        assert!(
            rows.keys().any(|line| line.starts_with(&prefix)),
            "{section}"
        );
    }
}

/// Each option exists because sources or sensors differ, and the page says how.
#[test]
fn every_option_has_its_line() {
    let source = std::fs::read_to_string("src/device/options.rs").unwrap();
    let fields = source.split("pub struct Options {").nth(1).unwrap();
    let fields = fields.split("\n}").next().unwrap();
    let options: BTreeSet<&str> = fields
        .lines()
        .filter_map(|line| line.trim().strip_prefix("pub "))
        .filter_map(|line| line.split(':').next())
        .collect();
    assert!(options.len() >= 21, "{options:?}");
    let rows = rows();
    let named: BTreeSet<&str> = rows
        .values()
        .flat_map(|cells| names(&cells[1]).into_iter().chain(names(&cells[4])))
        .collect();
    assert_eq!(named, options);
}
