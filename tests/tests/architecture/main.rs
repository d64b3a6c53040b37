//! What `crates/README.md` promises, held against the manifests and the sources.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

mod code_lines;

use grideye_tests::{programs, skip};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What a manifest of one crate names.
#[derive(Debug, Default)]
struct Uses {
    /// In `dependencies` and `build-dependencies`, for whatever target.
    always: BTreeSet<String>,
    /// Those of them that only a feature brings.
    optional: BTreeSet<String>,
    /// In `dev-dependencies` alone.
    in_tests: BTreeSet<String>,
}

fn manifest(name: &str) -> toml::Table {
    let path = root().join("crates").join(name).join("Cargo.toml");
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

/// Crate → what every section of its manifest names.
fn manifests() -> BTreeMap<String, Uses> {
    let folders = std::fs::read_dir(root().join("crates")).unwrap();
    let folders = folders.map(|entry| entry.unwrap().path());
    let with_manifest = folders.filter(|folder| folder.join("Cargo.toml").is_file());
    let names =
        with_manifest.map(|folder| folder.file_name().unwrap().to_str().unwrap().to_owned());
    names
        .map(|name| {
            let manifest = manifest(&name);
            // On crates.io its name is that of another author's driver.
            let package = match name.as_str() {
                "grideye" => "grideye-hil",
                name => name,
            };
            assert_eq!(
                manifest["package"]["name"].as_str(),
                Some(package),
                "a crate in a folder of another name"
            );
            let mut uses = Uses::default();
            let of_targets = manifest.get("target").and_then(toml::Value::as_table);
            let of_targets = of_targets
                .into_iter()
                .flatten()
                .map(|(_, sections)| sections.as_table().unwrap());
            for sections in of_targets.chain([&manifest]) {
                let named = |section: &str| {
                    sections
                        .get(section)
                        .and_then(toml::Value::as_table)
                        .into_iter()
                        .flat_map(toml::Table::keys)
                        .cloned()
                };
                uses.always
                    .extend(named("dependencies").chain(named("build-dependencies")));
                uses.in_tests.extend(named("dev-dependencies"));
                let dependencies = sections.get("dependencies");
                let of_features = dependencies
                    .and_then(toml::Value::as_table)
                    .into_iter()
                    .flatten()
                    .filter(|(_, value)| value.get("optional").is_some())
                    .map(|(name, _)| name.clone());
                uses.optional.extend(of_features);
            }
            uses.in_tests = &uses.in_tests - &uses.always;
            (name, uses)
        })
        .collect()
}

/// The table "What a crate must not know": crate → the names that its cell has between backticks.
fn table() -> BTreeMap<String, BTreeSet<String>> {
    let map = std::fs::read_to_string(root().join("crates/README.md")).unwrap();
    let rows = map.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').collect();
        let [name, must_not, ""] = cells[..] else {
            panic!("the table of crates/README.md has another number of columns in {row}");
        };
        // Every second piece of a cell stands between backticks.
        let named = must_not.split('`').skip(1).step_by(2).map(str::to_owned);
        (
            name.trim_end_matches(['`', ' ']).to_owned(),
            named.collect(),
        )
    })
    .collect()
}

#[test]
fn the_table_of_what_a_crate_must_not_know_has_every_crate() {
    let (table, manifests) = (table(), manifests());
    assert_eq!(
        table.keys().collect::<Vec<_>>(),
        manifests.keys().collect::<Vec<_>>()
    );
}

/// The drawing of crates by floor: whoever is named on an upper line uses only those below.
#[test]
fn every_crate_uses_only_crates_of_lower_floors() {
    let map = std::fs::read_to_string(root().join("crates/README.md")).unwrap();
    let drawing = map.split("```").nth(1).unwrap();
    let floors = drawing.lines().enumerate();
    let floors: BTreeMap<&str, usize> = floors
        .flat_map(|(line, names)| names.split_whitespace().map(move |name| (name, line)))
        .collect();
    for (name, uses) in manifests() {
        for used in uses
            .always
            .iter()
            .filter(|used| floors.contains_key(used.as_str()))
        {
            assert!(
                floors[name.as_str()] < floors[used.as_str()],
                "{name} uses {used}, which the drawing has beside or above it"
            );
        }
    }
}

#[test]
fn no_crate_depends_on_what_it_must_not_know() {
    let manifests = manifests();
    for (name, must_not) in table() {
        // What it depends on, and what that depends on within this workspace: crates of others have no manifest here. Who
        // asks for a feature of another crate names what the feature brings, too.
        let mut known = manifests[&name].always.clone();
        let mut next: Vec<String> = known.iter().cloned().collect();
        while let Some(used) = next.pop() {
            let Some(uses) = manifests.get(&used) else {
                continue;
            };
            let reached = uses.always.difference(&uses.optional);
            next.extend(
                reached
                    .filter(|name| known.insert((*name).clone()))
                    .cloned(),
            );
        }
        let forbidden: Vec<_> = known.intersection(&must_not).collect();
        assert!(forbidden.is_empty(), "{name} knows {forbidden:?}");
        assert!(!known.contains(&name), "{name} depends on itself");
    }
}

/// A name that no source of the crate says is a dependency that nobody needs.
#[test]
fn every_dependency_is_used() {
    for (name, uses) in manifests() {
        let folder = root().join("crates").join(&name);
        let sources: String = rust_files(&folder)
            .iter()
            .map(|file| std::fs::read_to_string(file).unwrap())
            .collect();
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let said = sources + &manifest;
        for dependency in uses.always.iter().chain(&uses.in_tests) {
            let crate_name = dependency.replace('-', "_");
            let is_named = [
                format!("{crate_name}::"),
                format!("use {crate_name} "),
                format!("dep:{dependency}\""),
                format!("use {crate_name};"),
                format!("extern crate {crate_name}"),
            ];
            assert!(
                is_named.iter().any(|word| said.contains(word.as_str())),
                "{name} does not use {dependency}"
            );
        }
    }
}

/// The longest that a file may be.
const LINES_MAX: usize = 600;

#[test]
fn no_file_is_longer_than_one_can_read() {
    for folder in ["crates", "tests"] {
        for file in rust_files(&root().join(folder)) {
            let lines = std::fs::read_to_string(&file).unwrap().lines().count();
            assert!(
                lines <= LINES_MAX,
                "{} has {lines} lines, {LINES_MAX} at most",
                file.display()
            );
        }
    }
}

#[test]
fn the_code_map_names_every_crate() {
    let map = std::fs::read_to_string(root().join("crates/README.md")).unwrap();
    for name in manifests().keys() {
        assert!(
            map.contains(&format!("- **`{name}`**")),
            "crates/README.md does not describe {name}"
        );
    }
}

/// `tests/no-std` is a program of frame, both faces of the driver, and the emulator's core.
#[test]
fn the_crates_that_run_on_a_microcontroller_link_without_std() {
    const TARGET: &str = "thumbv6m-none-eabi";
    let library =
        programs::run(Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]));
    if !Path::new(library.stdout.trim()).is_dir() {
        skip::test(&format!(
            "frame, driver and emulator linked for {TARGET}: `rustup target add {TARGET}`"
        ));
        return;
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["build", "--locked", "--target", TARGET, "--manifest-path"])
        .arg(root().join("tests/no-std/Cargo.toml"))
        .arg("--target-dir")
        .arg(programs::target().join("no-std"));
    let built = programs::run(&mut cargo);
    assert_eq!(built.code, 0, "{}", built.stderr);
}

/// Unsafe code stands where another program hands the memory: in the crate that talks to the kernel on behalf of other
/// programs, and in the one whose functions C calls.
#[test]
fn unsafe_code_is_confined_to_two_crates() {
    const TWO: [&str; 2] = ["amg8833-c", "i2c-emulation"];
    for name in manifests()
        .keys()
        .filter(|name| !TWO.contains(&name.as_str()))
    {
        for file in rust_files(&root().join("crates").join(name).join("src")) {
            let source = std::fs::read_to_string(&file).unwrap();
            assert!(
                !source.contains("unsafe_code"),
                "{} lifts the ban on unsafe code",
                file.display()
            );
        }
        assert_eq!(
            manifest(name)["lints"]["workspace"].as_bool(),
            Some(true),
            "{name} does not take the workspace's lints"
        );
    }
}

/// `println!` and its kin panic where nobody reads on, and `grideye_agent::output` does not.
#[test]
fn nothing_prints_by_a_macro_that_panics() {
    const MACROS: [&str; 5] = ["print", "println", "eprint", "eprintln", "dbg"];
    for name in manifests().keys() {
        for file in rust_files(&root().join("crates").join(name).join("src")) {
            let tokens = tokens(&std::fs::read_to_string(&file).unwrap());
            let mut pairs = tokens.windows(2);
            let found = pairs.find(|pair| MACROS.contains(&pair[0].as_str()) && pair[1] == "!");
            assert_eq!(found, None, "{}", file.display());
        }
    }
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// A module's path within its crate; the root's is empty.
type Module = Vec<String>;

#[test]
fn no_file_imports_one_that_imports_it() {
    for name in manifests().keys() {
        let mut imports = imports(&root().join("crates").join(name).join("src"));
        // A file that imports nothing that is left, or that nothing left imports, is in no circle.
        loop {
            let before = imports.len();
            let files: BTreeSet<Module> = imports.keys().cloned().collect();
            for imported in imports.values_mut() {
                imported.retain(|module| files.contains(module));
            }
            let imported: BTreeSet<Module> = imports.values().flatten().cloned().collect();
            imports.retain(|module, from| !from.is_empty() && imported.contains(module));
            if imports.len() == before {
                break;
            }
        }
        assert!(
            imports.is_empty(),
            "{name}: a circle among {imports:#?}; what several files share belongs into one below them"
        );
    }
}

/// Module → the modules in other files that it names.
fn imports(src: &Path) -> BTreeMap<Module, BTreeSet<Module>> {
    let files: BTreeMap<Module, PathBuf> = rust_files(src)
        .into_iter()
        .map(|file| (module_of(src, &file), file))
        .collect();
    let named = |(module, file): (&Module, &PathBuf)| {
        let tokens = tokens(&std::fs::read_to_string(file).unwrap());
        let mut imported = BTreeSet::new();
        // A room that uses what the file that declares it defines makes a circle with it; tests may.
        let rooms =
            declared(&tokens).map(|name| [&module[..], std::slice::from_ref(name)].concat());
        imported.extend(rooms.filter(|room| !room.iter().any(|name| name == "tests")));
        for path in paths(&tokens, module) {
            let target = (0..=path.len())
                .rev()
                .map(|length| &path[..length])
                .find(|path| files.contains_key(*path));
            imported.extend(target.filter(|target| *target != module).map(<[_]>::to_vec));
        }
        (module.clone(), imported)
    };
    files.iter().map(named).collect()
}

fn module_of(src: &Path, file: &Path) -> Module {
    let path = file.strip_prefix(src).unwrap().with_extension("");
    let mut module: Module = path
        .iter()
        .map(|part| part.to_str().unwrap().to_owned())
        .collect();
    if matches!(module.last().unwrap().as_str(), "mod" | "lib" | "main") {
        module.pop();
    }
    module
}

/// The words and signs of a source, without comments, texts and the module of its tests.
fn tokens(source: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("r\"") || rest.starts_with("r#\"") {
            let end = if rest.starts_with("r#") { "\"#" } else { "\"" };
            3 + rest[3..].find(end).unwrap() + end.len()
        } else if first == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|letter| {
                let ends = letter == '"' && !escaped;
                escaped = letter == '\\' && !escaped;
                ends
            });
            end.unwrap() + 2
        } else if first == '\'' && rest.chars().nth(2) == Some('\'') {
            rest.char_indices().nth(3).map_or(rest.len(), |(at, _)| at)
        } else if rest.starts_with("'\\") {
            3 + rest[3..].find('\'').unwrap() + 1
        } else if first.is_alphabetic() || first == '_' {
            let end = rest.find(|letter: char| !letter.is_alphanumeric() && letter != '_');
            let word = &rest[..end.unwrap_or(rest.len())];
            tokens.push(word.to_owned());
            word.len()
        } else {
            let sign = if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            if !first.is_whitespace() {
                tokens.push(rest[..sign].to_owned());
            }
            sign
        };
        rest = &rest[length..];
        if tokens.ends_with(&["mod", "tests", "{"].map(str::to_owned)) {
            return tokens;
        }
    }
    tokens
}

/// The modules in files of their own that a file declares.
fn declared(tokens: &[String]) -> impl Iterator<Item = &String> {
    let declarations = tokens.windows(3);
    let declarations = declarations.filter(|window| window[0] == "mod" && window[2] == ";");
    declarations.map(|window| &window[1])
}

/// Every path that begins at the crate, at a module around this one, or at one that this one declares.
fn paths(tokens: &[String], module: &Module) -> Vec<Module> {
    let declared: BTreeSet<&String> = declared(tokens).collect();
    let mut found = Vec::new();
    // Modules within the file: `super` leads out of them first.
    let mut within: Vec<usize> = Vec::new();
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        match token.as_str() {
            "{" => {
                depth += 1;
                if at > 1 && tokens[at - 2] == "mod" {
                    within.push(depth);
                }
            }
            "}" => {
                within.retain(|begun| *begun < depth);
                depth -= 1;
            }
            _ => {}
        }
        let begins = tokens.get(at + 1).is_some_and(|next| next == "::")
            && (at == 0 || tokens[at - 1] != "::");
        let base = match token.as_str() {
            "crate" => Some((Vec::new(), at + 2)),
            "super" => {
                let ups = tokens[at..].iter().step_by(2);
                let ups = ups.take_while(|token| *token == "super").count();
                let out = ups.saturating_sub(within.len()).min(module.len());
                Some((module[..module.len() - out].to_vec(), at + 2 * ups))
            }
            "self" => Some((module.clone(), at + 2)),
            name if declared.contains(&name.to_owned()) => Some((module.clone(), at)),
            _ => None,
        };
        if let Some((base, from)) = base.filter(|_| begins) {
            tree(&tokens[from..], &base, &mut found);
        }
    }
    found
}

/// Follows a path from its first name: `a::{b, c::d}` are two. Returns how many tokens it has.
fn tree(tokens: &[String], base: &Module, found: &mut Vec<Module>) -> usize {
    let mut path = base.clone();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        if token == "{" {
            at += 1;
            while tokens.get(at).is_some_and(|token| token != "}") {
                at += if tokens[at] == "," {
                    1
                } else {
                    tree(&tokens[at..], &path, found).max(1)
                };
            }
            return at + 1;
        }
        path.push(token.clone());
        at += 1;
        if tokens.get(at).is_none_or(|next| next != "::") {
            break;
        }
        at += 1;
    }
    found.push(path);
    at
}
