//! Checks `CONFORMANCE.md` against the tests and options it names.

use std::collections::BTreeSet;
use std::path::Path;

const OPTIONS: &str = "## Where sources disagree\n";
const STATEMENTS: &str = "## What the emulator does\n";

/// The rows of the tables between a heading and the next one, of so many cells.
fn rows(heading: &str, count: usize) -> Vec<Vec<String>> {
    let page = std::fs::read_to_string("CONFORMANCE.md").unwrap();
    let (_, section) = page.split_once(heading).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let mut rows = Vec::new();
    let mut lines = section.lines().peekable();
    while let Some(line) = lines.next() {
        let is_head = lines.peek().is_some_and(|next| next.starts_with("|---"));
        if !line.starts_with("| ") || is_head {
            continue;
        }
        let cells = line.trim_matches('|').split('|');
        let cells: Vec<String> = cells.map(|cell| cell.trim().to_owned()).collect();
        assert_eq!(cells.len(), count, "{line}");
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{line}");
        rows.push(cells);
    }
    rows
}

/// The tests that the page names, each with its row's first cell.
fn named() -> Vec<(String, String)> {
    let rows = [rows(OPTIONS, 4), rows(STATEMENTS, 3)].concat();
    let mut named = Vec::new();
    for cells in rows {
        let tests = names(cells.last().unwrap());
        assert!(!tests.is_empty(), "{} has no test", cells[0]);
        named.extend(
            tests
                .iter()
                .map(|name| (cells[0].clone(), (*name).to_owned())),
        );
    }
    named
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

/// All tests of this crate.
fn tests_of_the_crate() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for folder in ["src", "tests", "third-party/tests"] {
        tests(Path::new(folder), &mut found);
    }
    found
}

#[test]
fn every_test_that_is_named_exists() {
    let found = tests_of_the_crate();
    assert!(found.contains("every_test_that_is_named_exists"));
    let named = named();
    assert!(named.len() > 100, "{}", named.len());
    for (statement, name) in named {
        assert!(
            found.contains(&name),
            "\"{statement}\" names {name}, which is no test"
        );
    }
}

/// Tests that are named after a line of what the drivers need, `line_1_…` to `line_9_…`.
#[test]
fn every_line_that_the_drivers_need_is_there() {
    let found = tests_of_the_crate();
    let named: BTreeSet<String> = named().into_iter().map(|(_, name)| name).collect();
    for line in 1..=9 {
        let prefix = format!("line_{line}_");
        let of_the_line = || found.iter().filter(|name| name.starts_with(&prefix));
        assert!(of_the_line().next().is_some(), "{prefix}");
        for name in of_the_line() {
            assert!(named.contains(name), "CONFORMANCE.md does not name {name}");
        }
    }
}

/// Each option exists because sources or sensors differ, and the page says how.
#[test]
fn every_option_has_its_row() {
    let source = std::fs::read_to_string("src/device/options.rs").unwrap();
    let fields = source.split("pub struct Options {").nth(1).unwrap();
    let fields = fields.split("\n}").next().unwrap();
    let options: BTreeSet<&str> = fields
        .lines()
        .filter_map(|line| line.trim().strip_prefix("pub "))
        .filter_map(|line| line.split(':').next())
        .collect();
    assert!(options.len() >= 21, "{options:?}");
    let rows = rows(OPTIONS, 4);
    let named: BTreeSet<&str> = rows.iter().flat_map(|cells| names(&cells[0])).collect();
    assert_eq!(named, options);
    assert_eq!(rows.len(), options.len(), "one row each");
}
