//! The dependency table of `crates/README.md`, held against the manifests.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::{programs, skip};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Crate → the crates of this workspace that its `[dependencies]` name.
fn manifest_dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(manifest) = std::fs::read_to_string(folder.join("Cargo.toml")) else {
            continue;
        };
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        assert!(
            manifest.contains(&format!("name = \"{name}\"")),
            "{name} is not in a folder of its name"
        );
        all.insert(name, section(&manifest, "[dependencies]"));
    }
    all
}

fn section(manifest: &str, header: &str) -> BTreeSet<String> {
    manifest
        .lines()
        .skip_while(|line| *line != header)
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| line.split(['.', ' ', '=']).next())
        .filter(|name| !name.is_empty() && !name.starts_with('#'))
        .map(str::to_owned)
        .collect()
}

#[test]
fn no_crate_depends_on_what_it_must_not_know() {
    let forbidden: &[(&str, &[&str])] = &[
        ("grideye-frame", &["*"]),
        (
            "amg8833",
            &["grideye-scene", "grideye-recording", "amg8833-emulator"],
        ),
        (
            "amg8833-emulator",
            &["amg8833", "grideye-scene", "axum", "ureq"],
        ),
        (
            "i2c-emulation",
            &[
                "amg8833",
                "amg8833-emulator",
                "grideye-frame",
                "grideye-scene",
                "axum",
                "ureq",
            ],
        ),
        (
            "grideye-scene",
            &["amg8833", "amg8833-emulator", "embedded-hal"],
        ),
        (
            "grideye-recording",
            &["embedded-hal", "axum", "hyper", "grideye-scene"],
        ),
        (
            "grideye-validator",
            &["embedded-hal", "axum", "ureq", "amg8833-emulator"],
        ),
        (
            "grideye-agent",
            &[
                "grideye-scene",
                "axum",
                "tokio",
                "grideye-collector",
                "amg8833-emulator",
            ],
        ),
        (
            "grideye-collector",
            &[
                "embedded-hal",
                "grideye-scene",
                "grideye-agent",
                "amg8833-emulator",
            ],
        ),
    ];
    let dependencies = manifest_dependencies();
    for (name, must_not) in forbidden {
        let found = &dependencies[*name];
        if must_not == &["*"] {
            assert!(
                found.is_empty(),
                "{name} must depend on nothing, found {found:?}"
            );
        }
        for other in *must_not {
            assert!(!found.contains(*other), "{name} must not depend on {other}");
        }
    }
}

#[test]
fn the_code_map_names_every_crate() {
    let map = std::fs::read_to_string(root().join("crates/README.md")).unwrap();
    for name in manifest_dependencies().keys() {
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

/// Unsafe code stands in the one crate that talks to the kernel on behalf of other programs.
#[test]
fn unsafe_code_is_confined_to_one_crate() {
    for name in manifest_dependencies()
        .keys()
        .filter(|name| *name != "i2c-emulation")
    {
        for file in rust_files(&root().join("crates").join(name).join("src")) {
            let source = std::fs::read_to_string(&file).unwrap();
            assert!(
                !source.contains("unsafe_code"),
                "{} lifts the ban on unsafe code",
                file.display()
            );
        }
        let manifest =
            std::fs::read_to_string(root().join("crates").join(name).join("Cargo.toml")).unwrap();
        assert!(
            manifest.contains("[lints]\nworkspace = true"),
            "{name} does not take the workspace's lints"
        );
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

/// The crates whose files import downward only. The others follow; none leaves the list.
const WITHOUT_CIRCLES: &[&str] = &[
    "grideye-frame",
    "amg8833",
    "amg8833-emulator",
    "i2c-emulation",
    "grideye-recording",
    "grideye-scene",
    "grideye-agent",
];

/// A module's path within its crate; the root's is empty.
type Module = Vec<String>;

#[test]
fn no_file_imports_one_that_imports_it() {
    for name in WITHOUT_CIRCLES {
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

/// Every path that begins at the crate, at a module around this one, or at one that this one declares.
fn paths(tokens: &[String], module: &Module) -> Vec<Module> {
    let declared: BTreeSet<&String> = tokens
        .windows(3)
        .filter(|window| window[0] == "mod" && window[2] == ";")
        .map(|window| &window[1])
        .collect();
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
