//! The drivers of other authors in the emulator's `CONFORMANCE.md`, which prints what they return below zero: the tests
//! exist, the versions are those of the tests, and the Python drivers return what the page prints.

use grideye_tests::emulated::run_emulated;
use grideye_tests::programs::root;
use grideye_tests::python;
use serde_json::Value;

/// The cells of the rows whose last one names a path of this repository.
fn rows() -> Vec<Vec<String>> {
    let page = root().join("crates/amg8833-emulator/CONFORMANCE.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, drivers) = page.split_once("## Drivers below zero\n").unwrap();
    let (drivers, _) = drivers.split_once("\n## ").unwrap();
    let rows = drivers.lines().filter(|line| line.ends_with("` |"));
    let rows: Vec<Vec<String>> = rows
        .map(|row| {
            row.split(" | ")
                .map(|cell| cell.trim_matches(['|', ' ']).to_owned())
        })
        .map(Iterator::collect)
        .collect();
    assert_eq!(rows.len(), 6, "{rows:?}");
    rows
}

/// The number at the beginning of a cell, which is bold where it is wrong.
fn number(cell: &str) -> f64 {
    let plain = cell.replace("**", "");
    plain.split([':', ' ']).next().unwrap().parse().unwrap()
}

#[test]
fn the_drivers_of_the_table_are_those_of_the_tests() {
    let pins = [
        "tests/python/requirements.txt",
        "crates/amg8833-emulator/third-party/Cargo.lock",
    ];
    let pins = pins
        .map(|file| std::fs::read_to_string(root().join(file)).unwrap())
        .concat();
    for row in rows() {
        let place = row.last().unwrap().trim_matches('`');
        assert!(root().join(place).exists(), "{place}");
        let driver = row[0].split(" (").next().unwrap();
        let (name, version) = driver.rsplit_once(' ').unwrap();
        let pinned = [
            format!("{name}=={version}\n"),
            format!("name = \"{name}\"\nversion = \"{version}\"\n"),
        ];
        let is_pinned = pinned.iter().any(|pin| pins.contains(pin.as_str()));
        assert!(is_pinned || driver == "Linux 6.1", "{driver}");
    }
}

#[test]
fn the_python_drivers_return_what_the_table_prints() {
    let scripts: [&[&str]; 3] = [
        &["circuitpython.py", "extended", "frame"],
        &["melopero.py", "frame"],
        &["grideye_driver.py", "frame"],
    ];
    for (row, script) in rows().iter().zip(scripts) {
        let what = "what Python drivers of other authors return below zero";
        let Some(command) = python::script(script[0], &script[1..], what) else {
            return;
        };
        let ended = run_emulated(&["--constant", "-5"], &command);
        assert_eq!(ended.code, 0, "{ended:?}");
        let answer: Value = serde_json::from_str(&ended.stdout).unwrap();
        let found = [&answer["frame"][7][7], &answer["thermistor"]];
        let found = found.map(|value| value.as_f64().unwrap());
        let printed = [number(&row[1]), number(&row[2])];
        assert!(
            (found[0] - printed[0]).abs() < 1e-9 && (found[1] - printed[1]).abs() < 1e-9,
            "{row:?}: {found:?}"
        );
    }
}
