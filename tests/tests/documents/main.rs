//! The examples of the documents: every command that a person can copy is run, or is run by a test that is named here.
//!
//! A command in a document that this file does not know fails the test, and so does one here that no document has.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::patience::wait_for;
use grideye_tests::programs::{Ended, folder, is_part_left_out, root, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

mod commands;
mod drivers;
mod errors;
mod helps;
mod keys;
mod tutorials;
mod units;

use commands::Kept::{By, Emulated, Not, Run, Serves};
use commands::{COMMANDS, Kept};

/// The documents with commands, from the repository's root.
fn documents() -> Vec<PathBuf> {
    let folders = [
        "",
        "firmware-config",
        "scenes",
        "scenes/profiles",
        "recordings",
        "tests",
        "tests/examples/driver-ci",
        "tests/examples/firmware-ci",
        "tests/hardware",
    ];
    let mut documents: Vec<PathBuf> = folders
        .iter()
        .map(|folder| root().join(folder).join("README.md"))
        .collect();
    for crate_folder in std::fs::read_dir(root().join("crates")).unwrap() {
        documents.push(crate_folder.unwrap().path().join("README.md"));
    }
    let others = [
        "crates/grideye/DATASET.md",
        "crates/grideye/tutorials/driver.md",
        "crates/grideye/tutorials/room.md",
        "crates/grideye/tutorials/counter.md",
        "crates/grideye-validator/CALIBRATION.md",
        "scenes/PEOPLE.md",
        "scenes/PHYSICS.md",
        "scenes/VARIES.md",
    ];
    documents.extend(others.map(|document| root().join(document)));
    documents.retain(|document| document.exists());
    documents
}

/// The commands of a document: lines of a `sh` block, lines behind a `$`, and indented lines that call one of the
/// programs. What stands two blanks behind a command is said about it.
fn commands_of(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut fence: Option<&str> = None;
    for line in text.lines() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            fence = if fence.is_some() {
                None
            } else {
                Some(language)
            };
            continue;
        }
        let command = match fence {
            Some("sh") => Some(line),
            // `tutorials` follows those.
            Some("console run") => None,
            Some(_) => line.strip_prefix("$ "),
            None => line.strip_prefix("    ").filter(|rest| is_call(rest)),
        };
        let command = command.and_then(|command| command.trim().split("  ").next());
        commands.extend(
            command
                .filter(|command| !command.is_empty())
                .map(str::to_owned),
        );
    }
    commands
}

fn is_call(line: &str) -> bool {
    let programs = [
        "grideye ",
        "grideye-agent ",
        "echo 'CODE'",
        "sudo ",
        "cargo ",
        "i2c",
        "python3 ",
    ];
    programs.iter().any(|program| line.starts_with(program))
}

/// The examples in the helps of `grideye`, from their source: what is printed is wrapped.
fn commands_of_the_helps() -> Vec<String> {
    let mut commands = Vec::new();
    let mut folders = vec![root().join("crates/grideye/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let lines = text.lines();
            let examples = lines.filter_map(|line| line.strip_prefix("/// Example: grideye "));
            commands.extend(examples.map(|rest| format!("grideye {rest}")));
        }
    }
    assert!(commands.len() >= 9, "{commands:?}");
    commands
}

fn words(ended: &Ended) -> String {
    format!("{}{}", ended.stdout, ended.stderr)
}

#[test]
fn every_documented_command_is_known_here_and_none_here_is_left_over() {
    let mut documented = BTreeSet::new();
    let mut unknown = Vec::new();
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for command in commands_of(&text) {
            if !COMMANDS.iter().any(|(known, _)| *known == command) {
                unknown.push(format!("{}: {command}", document.display()));
            }
            documented.insert(command);
        }
    }
    for command in commands_of_the_helps() {
        if !COMMANDS.iter().any(|(known, _)| *known == command) {
            unknown.push(format!("help: {command}"));
        }
        documented.insert(command);
    }
    assert!(
        unknown.is_empty(),
        "nothing keeps these examples:\n{}",
        unknown.join("\n")
    );
    for (command, kept) in COMMANDS {
        assert!(
            documented.contains(*command),
            "no document has this example: {command}"
        );
        match kept {
            By(file, function) => {
                let text = std::fs::read_to_string(root().join(file)).unwrap();
                assert!(
                    text.contains(&format!("fn {function}()")),
                    "{file} has no test {function}"
                );
            }
            Not(why) => println!("not run: {command} ({why})"),
            Run(..) | Emulated(..) | Serves(..) => {}
        }
    }
}

/// Whether it needs what the machine has not; names it.
fn lacks_what_it_needs(command: &str) -> bool {
    let i2c_tools = ["i2ctransfer", "i2cdetect", "i2cget"];
    i2c_tools.iter().any(|tool| command.contains(tool))
        && is_part_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", command)
}

/// A folder in which a command finds what it finds in the repository.
fn like_the_repository() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    // A copy: one command writes a new scene beside the others.
    let copied = Command::new("cp")
        .arg("-r")
        .args([root.join("scenes").as_path(), folder.path()])
        .status()
        .unwrap();
    assert!(copied.success(), "{copied}");
    std::os::unix::fs::symlink(root.join("recordings"), folder.path().join("recordings")).unwrap();
    folder
}

/// Runs a line with the release programs in reach; an example of a crate is built from the repository.
fn shell(line: &str, at: &Path) -> Ended {
    run(&mut sh(line, at))
}

fn sh(line: &str, at: &Path) -> Command {
    let path = std::env::var("PATH").unwrap();
    let manifest = root().canonicalize().unwrap().join("Cargo.toml");
    let cargo = format!(
        "{} run --quiet --locked --manifest-path {} -p",
        env!("CARGO"),
        manifest.display()
    );
    let line = line.replace("cargo run -p", &cargo);
    let mut command = Command::new("sh");
    command
        .args(["-c", &line])
        .current_dir(at)
        .env("PATH", format!("{}:{path}", folder().display()));
    command
}

#[test]
fn the_documented_commands_do_what_their_documents_say() {
    std::thread::scope(|scope| {
        for (command, kept) in COMMANDS {
            scope.spawn(move || holds(command, kept));
        }
    });
}

fn holds(command: &str, kept: &Kept) {
    let at = like_the_repository();
    let (before, line, expected) = match kept {
        Run(before, expected) => (*before, command.to_owned(), *expected),
        Emulated(expected) => (
            "",
            format!("grideye emulate --quiet --scene scenes/experiment-1.toml -- {command}"),
            *expected,
        ),
        Serves(before, expected) => (*before, with_free_ports(command, at.path()), *expected),
        By(..) | Not(_) => return,
    };
    if lacks_what_it_needs(command) {
        return;
    }
    let prepared = shell(before, at.path());
    assert_eq!(prepared.code, 0, "{before}: {prepared:?}");
    let at_its_socket = |word: &&str| {
        let socket = at.path().join("amg.sock");
        word.replace("/tmp/amg.sock", &socket.display().to_string())
    };
    let expected: Vec<String> = expected.iter().map(at_its_socket).collect();
    // What runs in real time on a host that stalls is asked again.
    let ended = match kept {
        Serves(..) => served(&line, &expected, at.path()),
        _ => (0..3)
            .map(|_| shell(&line, at.path()))
            .find(|ended| !words(ended).contains("too busy to read in time"))
            .unwrap_or_else(|| panic!("{line}: this computer is too busy")),
    };
    assert_eq!(ended.code, 0, "{line}: {ended:?}");
    for word in expected {
        assert!(
            words(&ended).contains(&word),
            "{line} does not print {word:?}: {ended:?}"
        );
    }
}

/// A server's command, with this machine's addresses and a socket of its own.
fn with_free_ports(command: &str, at: &Path) -> String {
    command
        .replace("192.168.1.20:8833", "127.0.0.1:0")
        .replace("0.0.0.0:8833", "0.0.0.0:0")
        .replace("collect --store", "collect --listen 127.0.0.1:0 --store")
        .replace("/tmp/amg.sock", &at.join("amg.sock").display().to_string())
}

/// Runs a server until it has printed these words, however long the machine takes, and ends it by Ctrl-C.
fn served(command: &str, expected: &[String], at: &Path) -> Ended {
    let files = ["served.out", "served.err"].map(|name| at.join(name));
    let [out, err] = files
        .each_ref()
        .map(|file| std::fs::File::create(file).unwrap());
    let mut server = sh(&format!("exec {command}"), at)
        .stdin(std::process::Stdio::null())
        .stdout(out)
        .stderr(err)
        .spawn()
        .unwrap();
    let said = || {
        files
            .each_ref()
            .map(|file| std::fs::read_to_string(file).unwrap())
    };
    let has_said = || expected.iter().all(|word| said().concat().contains(word));
    wait_for(&format!("{expected:?} of {command}"), || {
        (has_said() || server.try_wait().unwrap().is_some()).then_some(())
    });
    // One that has ended by itself is judged by its code.
    let _ = Command::new("kill")
        .args(["-INT", &server.id().to_string()])
        .status();
    let status = wait_for(&format!("the end of {command}"), || {
        server.try_wait().unwrap()
    });
    let [stdout, stderr] = said();
    Ended {
        code: status.code().unwrap_or(-1),
        stdout,
        stderr,
    }
}

/// What a document prints of a command's output is what the command prints.
#[test]
fn the_documented_outputs_are_those_of_the_table() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    for (command, kept) in COMMANDS {
        let shown = readme.contains(&format!("$ {command}\n"));
        if let (true, Run(_, expected)) = (shown, kept) {
            for word in *expected {
                assert!(
                    readme.contains(word),
                    "README.md does not show {word:?} of {command}"
                );
            }
        }
    }
}

/// The lines that a stranger reads to the end.
const README_LINES_MAX: usize = 150;

#[test]
fn the_readme_is_short_and_leads_to_every_document() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= README_LINES_MAX);
    let sought = "( -name target -o -name .?* ) -prune -o -name *.md -printf %P\\n";
    let listed = run(Command::new("find")
        .arg(".")
        .args(sought.split(' '))
        .current_dir(root()));
    let mut documents: Vec<&str> = listed.stdout.lines().collect();
    documents.retain(|name| *name != "README.md");
    assert!(documents.len() > 20, "{listed:?}");
    documents.retain(|name| !readme.contains(&format!("]({name})")));
    assert!(documents.is_empty(), "not in README.md: {documents:?}");
}

#[test]
fn every_test_behind_a_promise_is_there() {
    let promises = std::fs::read_to_string(root().join("tests/README.md")).unwrap();
    let (_, behind) = promises.split_once("| promise | test |\n").unwrap();
    let rows: Vec<&str> = behind
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .collect();
    assert!(rows.len() > 20, "{rows:?}");
    for row in rows {
        let test = row.trim_end_matches('|').rsplit('|').next().unwrap();
        let paths: Vec<&str> = test.split('`').skip(1).step_by(2).collect();
        assert!(!paths.is_empty(), "no test behind {row}");
        for path in paths {
            assert!(root().join(path).exists(), "{path} is not there: {row}");
        }
    }
}

/// Options in running text: `grideye emulate --socket …` must exist.
#[test]
fn every_option_that_a_document_names_exists() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        for piece in text.split('`').filter(|piece| !piece.contains('\n')) {
            let mut parts = piece.split_whitespace().peekable();
            let (Some("grideye"), Some(subcommand)) = (parts.next(), parts.next()) else {
                continue;
            };
            if !subcommand.chars().all(|letter| letter.is_ascii_lowercase()) {
                continue;
            }
            // A command of a command, as in `grideye token make`; what is an argument instead changes nothing.
            let deeper = parts.next_if(|part| part.bytes().all(|byte| byte.is_ascii_lowercase()));
            let mut command = Command::new(folder().join("grideye"));
            let help = run(command.arg(subcommand).args(deeper).arg("--help-all"));
            assert_eq!(help.code, 0, "{}: {piece}: {help:?}", document.display());
            for option in parts
                .take_while(|part| *part != "--")
                .filter(|part| part.starts_with("--"))
            {
                let option = option.trim_end_matches([',', '.']);
                assert!(
                    help.stdout.contains(option),
                    "{}: {piece}: there is no {option}",
                    document.display()
                );
            }
        }
    }
}

/// A crate's example in Rust is compiled where it stands in the crate's own documentation: as the README itself, or
/// line by line the same.
#[test]
fn every_example_in_rust_is_one_that_the_compiler_sees() {
    for crate_folder in std::fs::read_dir(root().join("crates")).unwrap() {
        let folder = crate_folder.unwrap().path();
        let (Ok(readme), Ok(library)) = (
            std::fs::read_to_string(folder.join("README.md")),
            std::fs::read_to_string(folder.join("src/lib.rs")),
        ) else {
            continue;
        };
        if library.contains("include_str!(\"../README.md\")") {
            continue;
        }
        let mut is_rust = false;
        for line in readme.lines() {
            if let Some(language) = line.strip_prefix("```") {
                is_rust = !is_rust && language.starts_with("rust");
                continue;
            }
            let compiled = format!("//! {line}");
            let is_compiled = library.lines().any(|found| found == compiled.trim_end());
            assert!(
                !is_rust || is_compiled,
                "{}: no compiler sees this line: {line}",
                folder.display()
            );
        }
    }
}
