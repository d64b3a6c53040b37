//! The tutorials, followed as they stand. `GRIDEYE_PICTURES=1` writes what is printed and drawn now, and `GRIDEYE_TRAIN=1`
//! trains the counter as long as its page says.

use super::documents;
use grideye_tests::c_library::library;
use grideye_tests::programs::{folder, is_left_out, root, target};
use grideye_tests::python;
use grideye_tests::walkthrough::{Walkthrough, are_written};
use grideye_tests::workflow;
use std::fmt::Write as _;
use std::fs::Permissions;
use std::os::unix::fs::{PermissionsExt as _, symlink};

const DRIVER: &str = "crates/grideye/tutorials/driver.md";
const ROOM: &str = "crates/grideye/tutorials/room.md";
const COUNTER: &str = "crates/grideye/tutorials/counter.md";
const WORDS_MAX: usize = 800;
const PICTURE_BYTES_MAX: usize = 60_000;
/// Weights that the counter's page trained, kept beside it: what they count is compared in every run.
const WEIGHTS: &str = "crates/grideye/tutorials/own.gec";
/// Enough to see that frames, training and weights go together.
const SHORT: &str = "--frames 1000 --steps 20";

/// What the pages use of a checkout: all of it, with what was built.
fn checkout() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = root().canonicalize().unwrap();
    for name in ["crates", "recordings", "scenes"] {
        symlink(root.join(name), folder.path().join(name)).unwrap();
    }
    let built = folder.path().join("target/release");
    std::fs::create_dir_all(&built).unwrap();
    symlink(library(), built.join("libamg8833_c.a")).unwrap();
    folder
}

#[test]
fn a_driver_is_red_below_zero_and_on_a_loose_wire_then_green_then_in_a_workflow() {
    let what = "the tutorial of a driver in CI";
    if is_left_out("GRIDEYE_WITHOUT_CXX", what) {
        return;
    }
    let packages = target().join("tutorials");
    // The folder does not exist the first time.
    let _ = std::fs::remove_dir_all(&packages);
    let Some((_, programs)) = python::wheel(&packages, what) else {
        return;
    };
    let page = Walkthrough::of(DRIVER);
    page.follow(&[&programs], checkout().path());

    // The workflow is one for GitHub, and runs the page's own commands.
    let file = ".github/workflows/driver.yml";
    let schemas = python::programs("examples", "tests/examples/requirements.txt", what).unwrap();
    workflow::check(
        &schemas,
        "vendor.github-workflows",
        &page.here().join(file).display().to_string(),
    );
    let text = page.file(file).unwrap();
    let suites = text.lines().filter_map(|line| line.split_once("- run: "));
    let suites: Vec<&str> = suites.map(|(_, suite)| suite).skip(1).collect();
    assert_eq!(suites.len(), 2, "{text}");
    for suite in suites {
        // The checkout has tests of its own.
        let suite = suite.trim_end_matches(" --ignore grideye-hil");
        assert!(page.runs(suite), "the page does not run {suite}");
    }
}

#[test]
fn a_room_is_drawn_recorded_fitted_and_judged_and_a_wrong_one_is_told() {
    Walkthrough::of(ROOM).follow(&[], checkout().path());
}

#[test]
fn a_counter_is_trained_on_a_room_and_held_against_the_shipped_one() {
    let (train, what) = ("counting/train.py", "the tutorial of an own counter");
    let Some(peer) = python::peer(train, &[], what) else {
        return;
    };
    let checkout = checkout();
    // The page's training without building what is built. A short one shows that it runs; its weights count nothing.
    let mut words: Vec<String> = vec![peer.get_program().display().to_string(), "-B".into()];
    words.extend(peer.get_args().map(|word| word.display().to_string()));
    words.push(folder().join("grideye").display().to_string());
    let mut script = format!("#!/bin/sh -e\n{} \"$@\"", words.join(" "));
    if std::env::var_os("GRIDEYE_TRAIN").is_none() {
        let weights = root().join(WEIGHTS).canonicalize().unwrap();
        write!(
            script,
            " {SHORT}\ncp {} own/weights/counter.gec\n",
            weights.display()
        )
        .unwrap();
    }
    let training = checkout.path().join("tests/peers/counting/run");
    std::fs::create_dir_all(training.parent().unwrap()).unwrap();
    std::fs::write(&training, script).unwrap();
    std::fs::set_permissions(&training, Permissions::from_mode(0o755)).unwrap();
    let page = Walkthrough::of(COUNTER);
    page.follow(&[], checkout.path());
    if are_written() {
        let made = page.here().join("own/weights/counter.gec");
        std::fs::copy(made, root().join(WEIGHTS)).unwrap();
    }
}

#[test]
fn every_page_with_steps_is_followed() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        let is_known = [DRIVER, ROOM, COUNTER]
            .iter()
            .any(|page| document.ends_with(page));
        assert_eq!(
            Walkthrough::is_one(&text),
            is_known,
            "{}",
            document.display()
        );
    }
}

#[test]
fn a_tutorial_takes_ten_minutes_to_read_and_its_pictures_are_small() {
    let mut pictures = 0;
    for name in [DRIVER, ROOM, COUNTER] {
        let page = Walkthrough::of(name);
        let text = std::fs::read_to_string(root().join(name)).unwrap();
        let words = text.split_whitespace().count();
        assert!(words <= WORDS_MAX, "{name} has {words} words");
        for picture in page.pictures() {
            let bytes = std::fs::read(page.kept(picture)).unwrap().len();
            assert!(bytes <= PICTURE_BYTES_MAX, "{picture} has {bytes} bytes");
            pictures += 1;
        }
    }
    assert!(pictures <= 6, "{pictures} pictures");
}
