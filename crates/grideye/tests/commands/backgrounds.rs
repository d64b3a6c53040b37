//! The README's way from an empty recording to a profile to a verdict, over units and rooms that are known.
use grideye_scene::profile::Profile;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A room that somebody crosses and leaves, of which the recording shows a warm window side that the scene lacks.
const ROOM: &str = r#"
[room]
size_mm = [6000, 6000, 2700]
ambient_c = 21
[[sensor]]
name = "ceiling"
preset = "grid-eye"
sampling_hz = 10
step_c = 0.25
position_mm = [2500, 2500, 2700]
elevation_deg = 90
azimuth_deg = -90
"#;
const PERSON: &str = r#"
[[agent]]
name = "person"
size_mm = [300, 450, 1750]
temperature_c = 29
trajectory = "way.csv"
speed_mm_per_s = 600
"#;

fn unit_c(pixel: i32) -> f64 {
    0.12 * f64::from(pixel * 37 % 11) - 0.6
}

/// The window side is this much warmer than the wall side.
const WINDOW_C: f64 = 1.4;

fn room_c(pixel: i32) -> f64 {
    WINDOW_C / 7.0 * (f64::from(pixel % 8) - 3.5)
}

fn grideye(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_grideye"))
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn done(folder: &Path, arguments: &str) -> String {
    let output = grideye(folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments}: {said}");
    said
}

fn pattern(of: impl Fn(i32) -> f64) -> String {
    let list: Vec<String> = (0..64).map(|pixel| format!("{:.3}", of(pixel))).collect();
    format!(
        "[noise]\nsigma_c = 0.24\n[fixed_pattern]\noffset_c = [{}]\n",
        list.join(", ")
    )
}

fn profile(path: &Path) -> Profile {
    Profile::parse(&fs::read_to_string(path).unwrap(), "profile.toml").unwrap()
}

/// Two rooms as the same unit sees them: `here` with the window, and `there`, turned. `walk.csv` ends with half a minute
/// of the empty room, `crossed.csv` is cut before it.
fn prepare(folder: &Path) {
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write(
        "here.unit.toml",
        &pattern(|pixel| unit_c(pixel) + room_c(pixel)),
    );
    write(
        "there.unit.toml",
        &pattern(|pixel| unit_c(pixel) - room_c(pixel)),
    );
    write(
        "way.csv",
        "x_mm,y_mm,z_mm,dwell_s\n1500,2000,0,0\n3300,3000,0,0\n1800,1900,0,0\n3300,3000,0,0\n5700,5700,0,30\n",
    );
    for place in ["here", "there"] {
        let unit = format!("{ROOM}profile = \"{place}.unit.toml\"\n");
        write(&format!("{place}.toml"), &unit);
        done(
            folder,
            &format!("simulate {place}.toml --frames 600 --out {place}.csv"),
        );
        done(
            folder,
            &format!("characterize {place}.csv --profile {place}.p.toml"),
        );
    }
    write(
        "walked.toml",
        &format!("{ROOM}profile = \"here.unit.toml\"\n{PERSON}"),
    );
    write("claim.toml", &format!("{ROOM}{PERSON}"));
    write("nobody.toml", ROOM);
    done(folder, "simulate walked.toml --seed 3 --out walk.csv");
    let walk = fs::read_to_string(folder.join("walk.csv")).unwrap();
    let crossed: Vec<&str> = walk.lines().take(101).collect();
    write("crossed.csv", &(crossed.join("\n") + "\n"));
    done(
        folder,
        "characterize here.csv --empty no --profile pattern.toml",
    );
}

/// Exit code, C, and all that was said and noted.
fn compare(
    folder: &Path,
    scene: &str,
    recording: &str,
    profile: &str,
) -> (Option<i32>, f64, String) {
    let profile = match profile {
        "" => String::new(),
        name => format!(" --profile {name}"),
    };
    let output = grideye(
        folder,
        &format!("compare --scene {scene} --recording {recording}{profile} --json out.json"),
    );
    let json = fs::read_to_string(folder.join("out.json")).unwrap();
    let said = format!("{}{json}", text(&output.stdout));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let c = json["scores"]["correlation"]["value"]
        .as_f64()
        .unwrap_or(f64::NAN);
    (output.status.code(), c, said)
}

#[test]
fn the_readmes_profile_tells_unit_and_room_apart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let found = profile(&folder.join("here.p.toml"));
    let background = found.background_c.unwrap();
    let (mut of_unit, mut of_room) = (0.0, 0.0);
    for (pixel, index) in (0..64).zip(0_usize..) {
        of_unit += (found.fixed_pattern.offset_c[index] - unit_c(pixel)).powi(2);
        of_room += (background[index] - room_c(pixel)).powi(2);
    }
    let [of_unit, of_room] = [of_unit, of_room].map(|squares: f64| (squares / 64.0).sqrt());
    // Six of 64 parts of the pattern of 0.38 °C are smooth: 0.12 °C; the room's slope alone has 0.46 °C.
    assert!(of_unit < 0.16 && of_room < 0.2, "{of_unit} {of_room}");

    // A simulated unit has the pattern, but not the room: the slope between the sides is gone.
    fs::write(
        folder.join("again.toml"),
        format!("{ROOM}profile = \"here.p.toml\"\n"),
    )
    .unwrap();
    done(folder, "simulate again.toml --frames 600 --out again.csv");
    done(folder, "characterize again.csv --profile again.p.toml");
    let again = profile(&folder.join("again.p.toml")).in_its_room_c();
    let side = |column: usize| (0..8).map(|row| again[8 * row + column]).sum::<f64>() / 8.0;
    let unit_side = |column: i32| (0..8).map(|row| unit_c(8 * row + column)).sum::<f64>() / 8.0;
    let slope = side(7) - side(0);
    assert!(
        slope.abs() < WINDOW_C / 4.0,
        "{slope} {}",
        unit_side(7) - unit_side(0)
    );
}

#[test]
fn the_readmes_profile_does_not_lower_the_score() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    for recording in ["walk.csv", "crossed.csv"] {
        let (_, without, _) = compare(folder, "claim.toml", recording, "");
        let (code, with, said) = compare(folder, "claim.toml", recording, "here.p.toml");
        assert_eq!(code, Some(0), "{recording}: {said}");
        assert!(with > without - 0.01, "{recording}: {with} {without}");
        assert!(
            said.contains("Background: from the profile, measured in an empty room."),
            "{said}"
        );
        assert!(!said.contains("warning: "), "{said}");
        let (code, _, said) = compare(folder, "nobody.toml", recording, "here.p.toml");
        assert_eq!(code, Some(1), "nobody is refused all the same: {said}");
    }

    // The unit's pattern alone: the recording's own empty stretches have the room, without a warning.
    let (_, without, _) = compare(folder, "claim.toml", "walk.csv", "");
    let (code, with, said) = compare(folder, "claim.toml", "walk.csv", "pattern.toml");
    assert_eq!(code, Some(0), "{said}");
    assert!(with > without - 0.01, "{with} {without}");
    assert!(
        said.contains(" empty frames of this recording.") && !said.contains("warning: "),
        "{said}"
    );
    // Without empty stretches the room is unknown, and the verdict knows it.
    let (_, without, _) = compare(folder, "claim.toml", "crossed.csv", "");
    let (code, with, said) = compare(folder, "claim.toml", "crossed.csv", "pattern.toml");
    assert_ne!(code, Some(1), "{said}");
    assert!(with > without - 0.01, "{with} {without}");
    assert!(
        said.contains("The profile has the unit's pattern only."),
        "{said}"
    );
}

#[test]
fn a_profile_of_another_room_is_warned_of_and_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let (code, _, said) = compare(folder, "claim.toml", "walk.csv", "there.p.toml");
    assert_eq!(code, Some(0), "{said}");
    let json = fs::read_to_string(folder.join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let fit = &json["background"];
    let (left, own) = (
        fit["profile_rms_c"].as_f64().unwrap(),
        fit["own_rms_c"].as_f64().unwrap(),
    );
    // Twice the slope of 0.2 °C a column: 0.4 times the root of (64 - 1) / 12.
    assert!((left - 0.917).abs() < 0.06 && own < 0.1, "{fit}");
    let warning = format!(
        "the profile leaves {left:.2} °C rms of the background unexplained, the recording's own empty stretches ("
    );
    for place in [&said, &json["warnings"][0].as_str().unwrap().to_owned()] {
        assert!(place.contains(&warning), "{warning}: {place}");
        assert!(place.contains("so the stretches' was used"), "{place}");
    }
    assert!(said.contains(" empty frames of this recording."), "{said}");
    assert!(
        said.contains("hint: measure the profile again in this room"),
        "{said}"
    );
}

/// Somebody is in view for a third of the recording, and does not show in its background.
#[test]
fn a_person_does_not_leak_into_the_background() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let said = done(folder, "characterize walk.csv --profile walk.p.toml");
    assert!(said.contains("empty room: "), "{said}");
    let shown = profile(&folder.join("walk.p.toml")).in_its_room_c();
    let middle = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        f64::midpoint(values[31], values[32])
    };
    let truth: Vec<f64> = (0..64).map(|pixel| unit_c(pixel) + room_c(pixel)).collect();
    let (level, true_level) = (middle(shown.to_vec()), middle(truth.clone()));
    for (pixel, (shown, truth)) in shown.iter().zip(&truth).enumerate() {
        let error = (shown - level) - (truth - true_level);
        assert!(error.abs() < 0.15, "{pixel}: {error}");
    }
}

/// A fan-coil that the scene has, and the profile's background too.
const FAN_COIL: &str = r#"
[[object]]
name = "fan-coil"
position_mm = [1600, 3300, 0]
size_mm = [500, 600, 900]
temperature_c = 40
"#;

#[test]
fn what_scene_and_background_both_have_is_counted_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    prepare(folder);
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    let unit = "profile = \"here.unit.toml\"\n";
    write("coil.toml", &format!("{ROOM}{unit}{FAN_COIL}"));
    write(
        "coil-walked.toml",
        &format!("{ROOM}{unit}{FAN_COIL}{PERSON}"),
    );
    write("coil-claim.toml", &format!("{ROOM}{FAN_COIL}{PERSON}"));
    write("coil-empty.toml", &format!("{ROOM}{FAN_COIL}"));
    done(folder, "simulate coil.toml --frames 600 --out coil.csv");

    // What it is taken for, and the scene is asked for.
    let asked = grideye(folder, "characterize coil.csv --profile p.toml");
    let said = text(&asked.stderr);
    assert_eq!(asked.status.code(), Some(3), "{said}");
    for part in [
        "cannot tell whether the room is empty: what is ",
        "taken for a warm object such as a radiator",
        "hint: name the scene that has it, with --scene FILE",
    ] {
        assert!(said.contains(part), "{said}");
    }
    let said = done(folder, "characterize coil.csv --empty yes --profile p.toml");
    assert!(said.contains("is kept as background"), "{said}");
    done(
        folder,
        "characterize coil.csv --scene coil-empty.toml --profile with.toml",
    );
    // Of a scene that lacks it, nothing is told.
    let lacks = grideye(
        folder,
        "characterize coil.csv --scene nobody.toml --profile p2.toml",
    );
    assert_eq!(lacks.status.code(), Some(3));
    assert!(text(&lacks.stderr).contains("hint: add to the scene what is warm there"));

    for seed in 3..6 {
        done(
            folder,
            &format!("simulate coil-walked.toml --seed {seed} --out coil-walk.csv"),
        );
        // Cut before the room is empty: nothing else than the profile has its background.
        let walk = fs::read_to_string(folder.join("coil-walk.csv")).unwrap();
        let cut: Vec<&str> = walk.lines().take(111).collect();
        write("coil-walk.csv", &(cut.join("\n") + "\n"));
        for (profile, is_shared) in [("p.toml", true), ("with.toml", false)] {
            let (code, _, said) = compare(folder, "coil-claim.toml", "coil-walk.csv", profile);
            assert_eq!(code, Some(0), "{profile}, seed {seed}: {said}");
            assert_eq!(
                said.contains("it was counted once"),
                is_shared,
                "{profile}: {said}"
            );
        }
        let (code, _, said) = compare(folder, "coil-empty.toml", "coil-walk.csv", "p.toml");
        assert_eq!(code, Some(1), "nobody is refused all the same: {said}");
    }
}
