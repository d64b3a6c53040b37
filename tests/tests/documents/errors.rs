//! Every error that a person can cause, produced by a real bad input: the rows are in `errors/*.txt`.
//!
//! A row has a title, a shell script that runs in a folder of its own, what it says from `error: ` on, and its exit code:
//! 2 for bad input. `(a failure)` ends the title of a row in which another machine, program or file is in the way, and
//! `(as a whole)` of one about a file without a line of it.
//!
//! `Before each` begins a script that runs before each row of its file. After a message has changed,
//! `GRIDEYE_WRITE_ERRORS=1` writes what the programs say into the files: read the difference.

use grideye_tests::programs::{folder, root, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

mod sources;

/// A row, or the script before each, in which nothing is said.
struct Row {
    title: String,
    script: Vec<String>,
    said: Vec<String>,
}

/// What a row says now: from `error: ` on, and the exit code in brackets.
struct Ended {
    said: Vec<String>,
    /// Whether an error of the command line ends with the way to its help.
    has_usage: bool,
}

fn files() -> Vec<PathBuf> {
    let folder = root().join("tests/tests/documents/errors");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|end| end == "txt"))
        .filter(|path| path.file_stem().unwrap() != "not-produced")
        .collect();
    files.sort();
    files
}

fn rows(text: &str) -> Vec<Row> {
    let blocks = text.trim_end().split("\n\n");
    blocks
        .map(|block| {
            let mut row = Row {
                title: String::new(),
                script: Vec::new(),
                said: Vec::new(),
            };
            for line in block.lines() {
                match line.strip_prefix("  ") {
                    None => row.title.push_str(line),
                    Some(line) if line.starts_with("$ ") || line.starts_with("> ") => {
                        row.script.push(line.to_owned());
                    }
                    Some(line) => row.said.push(line.to_owned()),
                }
            }
            row
        })
        .collect()
}

fn text(rows: &[Row]) -> String {
    let block = |row: &Row| {
        let indented = row.script.iter().chain(&row.said);
        let lines: Vec<String> = indented.map(|line| format!("\n  {line}")).collect();
        format!("{}{}", row.title, lines.concat())
    };
    let blocks: Vec<String> = rows.iter().map(block).collect();
    blocks.join("\n\n") + "\n"
}

fn script(rows: &[&Row]) -> String {
    let lines = rows.iter().flat_map(|row| &row.script);
    let lines: Vec<&str> = lines.map(|line| &line[2..]).collect();
    lines.join("\n")
}

fn ended(script: &str) -> Ended {
    let at = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    let programs = folder().canonicalize().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("timeout");
    command.args(["60", "sh", "-c", script]);
    command.current_dir(at.path()).env("PATH", path);
    command.env("ROOT", &root).env("LC_ALL", "C.UTF-8");
    for name in ["PGPASSFILE", "STATE_DIRECTORY", "CREDENTIALS_DIRECTORY"] {
        command.env_remove(name);
    }
    let ended = run(&mut command);
    let told = ended.stderr.replace(root.to_str().unwrap(), "$ROOT");
    let told = without_ports(&told.replace(&format!("{}/", at.path().display()), ""));
    let lines = told.lines().skip_while(|line| !line.starts_with("error: "));
    let mut said: Vec<String> = lines
        .take_while(|line| !line.is_empty())
        .map(str::to_owned)
        .collect();
    if said.is_empty() {
        said.push(format!("no error: {told:?} {:?}", ended.stdout));
    }
    said.push(format!("[{}]", ended.code));
    Ended {
        said,
        has_usage: told.contains("try '--help'"),
    }
}

/// `127.0.0.1:PORT` for every free port that a server took.
fn without_ports(text: &str) -> String {
    const HOST: &str = "127.0.0.1:";
    let mut parts = text.split(HOST);
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |told, part| {
        let rest = part.trim_start_matches(|c: char| c.is_ascii_digit());
        let is_free = part.len() - rest.len() == 5;
        told + HOST
            + &if is_free {
                format!("PORT{rest}")
            } else {
                part.to_owned()
            }
    })
}

/// What is wrong with the shape of an error.
fn faults(file: &str, row: &Row, ended: &Ended) -> Vec<&'static str> {
    let (code, said) = ended.said.split_last().unwrap();
    let said = said.join("\n");
    let (what, hint) = said.split_once("\nhint: ").unwrap_or((&said, ""));
    let what = what.strip_prefix("error: ").unwrap_or_default();
    let first: String = what.chars().take_while(|c| c.is_alphanumeric()).collect();
    let is_name =
        script(&[row]).contains(&first) || first == first.to_uppercase() && first.len() > 1;
    let lines = |text: &str| text.lines().any(|line| line.trim_end().ends_with('.'));
    // A place in a file: `scene.toml:3:1` or `line 3`.
    let is_placed = what.split(&[':', ' ']).zip(what.split(&[':', ' ']).skip(1));
    let is_placed = is_placed.into_iter().any(|(name, line)| {
        (name.contains('.') || name == "line") && line.trim_end_matches(',').parse::<u32>().is_ok()
    });
    let is_whole = row.title.contains("(as a whole)");
    let wants_place = match file {
        "scene" | "faults" | "recording" => !is_whole,
        "agent" => row.title == "The configuration",
        _ => false,
    };
    let is_failure = row.title.ends_with("(a failure)");
    let debugged = ["Os {", "Err(", "Some(", "Error(", "panicked", "Custom {"];
    let checks = [
        (what.is_empty(), "there is no error"),
        (
            first.starts_with(char::is_uppercase) && !is_name,
            "it starts with a capital",
        ),
        (lines(what) || lines(hint), "it ends with a period"),
        (hint.is_empty() && !ended.has_usage, "it has no hint"),
        (
            debugged.iter().any(|word| said.contains(word)),
            "it is Rust and not English",
        ),
        (wants_place && !is_placed, "it names no line of a file"),
        (
            (code == "[2]") == is_failure,
            "its exit code does not tell bad input (2) from a failure",
        ),
    ];
    let found = checks.into_iter().filter(|(is_wrong, _)| *is_wrong);
    found.map(|(_, fault)| fault).collect()
}

#[test]
fn every_error_is_the_one_written_down_and_has_its_shape() {
    let is_written = std::env::var_os("GRIDEYE_WRITE_ERRORS").is_some();
    let mut wrong = Vec::new();
    for path in files() {
        let file = path.file_stem().unwrap().to_string_lossy().into_owned();
        let mut rows = rows(&std::fs::read_to_string(&path).unwrap());
        let (before, after): (Vec<&Row>, Vec<&Row>) = rows
            .iter()
            .partition(|row| row.title.starts_with("Before each"));
        let after: Vec<&Row> = after
            .into_iter()
            .filter(|row| !row.script.is_empty())
            .collect();
        let scripts: Vec<String> = after
            .iter()
            .map(|row| script(&[before.as_slice(), &[row]].concat()))
            .collect();
        let ended = all_ended(&scripts);
        for (row, ended) in after.iter().zip(&ended) {
            let shown = format!("{file}: {}\n  {}", row.title, script(&[row]));
            for fault in faults(&file, row, ended) {
                wrong.push(format!("{shown}\n  {fault}: {}", ended.said.join("\n  ")));
            }
            if row.said != ended.said && !is_written {
                let found = ended.said.join("\n  ");
                wrong.push(format!(
                    "{shown}\n  says\n  {found}\n  and not\n  {}",
                    row.said.join("\n  ")
                ));
            }
        }
        if is_written {
            let mut ended = ended.into_iter();
            let is_run =
                |row: &&mut Row| !row.title.starts_with("Before each") && !row.script.is_empty();
            for row in rows.iter_mut().filter(is_run) {
                row.said = ended.next().unwrap().said;
            }
            std::fs::write(&path, text(&rows)).unwrap();
        }
    }
    assert!(
        wrong.is_empty(),
        "{} faults\n\n{}",
        wrong.len(),
        wrong.join("\n\n")
    );
}

/// A few at a time: most of each row's time is the start of programs.
fn all_ended(scripts: &[String]) -> Vec<Ended> {
    let next = AtomicUsize::new(0);
    let all = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while let Some((at, script)) = {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    scripts.get(at).map(|script| (at, script))
                } {
                    let ended = ended(script);
                    all.lock().unwrap().push((at, ended));
                }
            });
        }
    });
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, ended)| ended).collect()
}

/// A message that no row produces would be read for the first time by whoever needs it.
#[test]
fn every_hint_in_the_sources_is_produced_by_a_row_or_listed_with_the_reason() {
    let said: String = files()
        .iter()
        .flat_map(|path| rows(&std::fs::read_to_string(path).unwrap()))
        .flat_map(|row| row.said)
        .map(|line| line + "\n")
        .collect();
    let list = root().join("tests/tests/documents/errors/not-produced.txt");
    let list = std::fs::read_to_string(list).unwrap();
    let listed: BTreeSet<&str> = list
        .lines()
        .filter_map(|line| line.strip_prefix("  "))
        .collect();
    let hints = sources::hints();
    assert!(hints.len() > 250, "the sources have {} hints", hints.len());
    let missing: BTreeSet<&str> = hints
        .iter()
        .map(|(_, hint)| hint.as_str())
        .filter(|hint| !said.contains(hint))
        .collect();
    let place = |hint: &&&str| {
        let at = hints.iter().find(|(_, known)| known == **hint);
        format!(
            "{}: {hint}",
            at.map_or("nowhere", |(path, _)| path.as_str())
        )
    };
    let unlisted: Vec<String> = missing
        .difference(&listed)
        .map(|hint| place(&hint))
        .collect();
    let stale: Vec<&&str> = listed.difference(&missing).collect();
    assert!(
        unlisted.is_empty() && stale.is_empty(),
        "no row produces\n{}\n\nproduced, or gone\n{stale:#?}",
        unlisted.join("\n")
    );
}

fn is_rust(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "rs")
}
