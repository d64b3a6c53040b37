//! The dependency table of `crates/README.md`, held against the manifests.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

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

#[test]
fn the_crates_that_run_on_a_microcontroller_are_no_std() {
    for name in ["grideye-frame", "amg8833", "amg8833-emulator"] {
        let library =
            std::fs::read_to_string(root().join("crates").join(name).join("src/lib.rs")).unwrap();
        assert!(
            library.lines().any(|line| line == "#![no_std]"),
            "{name} is not no_std"
        );
        // Tests have it, and whoever asks for the feature of that name.
        let always = library
            .replace("#[cfg(test)]\nextern crate std;", "")
            .replace("#[cfg(feature = \"std\")]\nextern crate std;", "");
        assert!(
            !always.contains("extern crate std"),
            "{name} brings std back"
        );
    }
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
