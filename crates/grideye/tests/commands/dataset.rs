//! `grideye dataset`: the same bytes however the work is spread or interrupted, and nothing of others overwritten.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::Duration;

const VARIED: &str = "room.ambient_c=18..26";

pub(crate) fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.toml"))
}

/// 130 frames of experiment 1 in parts of 10, into that folder, unless other options are given.
fn dataset(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.arg("dataset").arg(scene("experiment-1"));
    for [option, value] in [
        ["--frames", "130"],
        ["--frames-per-part", "10"],
        ["--seed", "7"],
    ] {
        if !more.contains(&option) {
            command.args([option, value]);
        }
    }
    command.args(["--vary", VARIED, "--vary", "agent.person.position=floor"]);
    command
        .args(more)
        .arg("--out")
        .arg(out)
        .stdin(Stdio::null());
    command
}

pub(crate) fn done(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    String::from_utf8(output.stdout).unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub(crate) fn refused(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    said(&output)
}

/// Each file of a folder by its name.
pub(crate) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let Ok(entries) = fs::read_dir(folder) else {
        return BTreeMap::new();
    };
    entries
        .map(Result::unwrap)
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

/// Clips of people who do something, in parts of one clip or two.
fn clips(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.arg("dataset").arg(scene("people"));
    command.args([
        "--frames",
        "120",
        "--clip",
        "12",
        "--seed",
        "5",
        "--format",
        "npz,npy,parquet",
    ]);
    command.args(["--vary", "agent.walking.acts=enter stand:1 leave,walk fall"]);
    command.args(["--vary", "agent.standing.person.clothing=light,coat"]);
    command.args(more).arg("--out").arg(out);
    command
}

#[test]
fn clips_are_the_same_with_any_threads_shards_and_parts() {
    let folder = tempfile::tempdir().unwrap();
    let parts = ["--frames-per-part", "24"];
    let whole = folder.path().join("whole");
    done(clips(&whole, &parts).args(["--threads", "1"]));
    // A commit that changes these bytes says why.
    assert_eq!(
        ["npz", "npy", "parquet"].map(|format| checksum(&whole, format)),
        ["2582689583 77452", "942878472 68032", "3263781199 57309"]
    );
    // 5 parts of three files and their counts, the plan, and the data card.
    assert_eq!(files(&whole).len(), 22);
    let threads = folder.path().join("threads");
    done(clips(&threads, &parts).args(["--threads", "4"]));
    assert_same(&whole, &threads);
    let shards = folder.path().join("shards");
    for shard in ["3/3", "1/3", "2/3"] {
        assert!(
            !shards.join("README.md").exists(),
            "before all parts are there"
        );
        done(clips(&shards, &parts).args(["--shard", shard]));
    }
    assert_same(&whole, &shards);
    // A lost card comes back, and a cut file of records is not taken for a whole one.
    fs::remove_file(whole.join("README.md")).unwrap();
    done(&mut clips(&whole, &parts));
    assert_same(&whole, &threads);
    let records = fs::read(whole.join("part-000001.npy")).unwrap();
    fs::write(whole.join("part-000001.npy"), &records[..records.len() - 8]).unwrap();
    let told = refused(&mut clips(&whole, &parts));
    assert!(
        told.contains("part-000001.npy exists but is not a complete file"),
        "{told}"
    );
}

/// Of the first part in a format.
fn checksum(folder: &Path, format: &str) -> String {
    let file = fs::File::open(folder.join(format!("part-000000.{format}"))).unwrap();
    let output = Command::new("cksum").stdin(file).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

#[test]
fn a_clip_is_never_cut() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = refused(&mut clips(&out, &["--frames-per-part", "30"]));
    assert!(
        told.contains("--frames-per-part 30 does not hold whole clips of 12 frames\nhint: write a multiple of 12, such as --frames-per-part 24"),
        "{told}"
    );
    let told = refused(&mut dataset(&out, &["--clip", "50"]));
    assert!(
        told.contains("--frames 130 does not hold whole clips"),
        "{told}"
    );
    // Without --frames-per-part, a part holds the whole clips that fit into 1,000 frames, or one that does not.
    for (clip, frames) in [("7", 994), ("1500", 1500)] {
        let out = folder.path().join(clip);
        let frames_asked = "10500";
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.arg("dataset").arg(scene("experiment-1"));
        command.args([
            "--frames",
            frames_asked,
            "--clip",
            clip,
            "--shard",
            "9999/9999",
            "--out",
        ]);
        done(command.arg(&out));
        let plan = fs::read_to_string(out.join("dataset.json")).unwrap();
        assert!(
            plan.contains(&format!("\"frames_per_part\": {frames},")),
            "{plan}"
        );
    }
}

/// The card's numbers are those of the last line, and its command makes the same dataset.
#[test]
fn the_data_card_says_what_is_in_the_folder_and_how_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = done(&mut clips(&out, &[]));
    let card = fs::read_to_string(out.join("README.md")).unwrap();
    let line = told
        .lines()
        .find_map(|line| line.strip_prefix("people in view: "));
    let mut sum = 0;
    for count in line.unwrap().split(", ") {
        let (people, frames) = count.split_once(" in ").unwrap();
        let frames: u32 = frames.strip_suffix(" frames").unwrap().parse().unwrap();
        assert!(card.contains(&format!("| {people} | {frames} |")), "{card}");
        sum += frames;
    }
    assert_eq!(sum, 120);
    for words in [
        "| fall | ",
        "| enter | ",
        "agent.standing.person.clothing=light,coat",
        "## How to cite",
    ] {
        assert!(card.contains(words), "{words}: {card}");
    }
    let command = card
        .lines()
        .find(|line| line.starts_with("grideye dataset "));
    let again = folder.path().join("again");
    let command = command
        .unwrap()
        .replace(
            "grideye dataset people.toml",
            &format!("\"$0\" dataset {}", scene("people").display()),
        )
        .replace("--out DIR", &format!("--out {}", again.display()));
    let mut shell = Command::new("sh");
    done(shell.args(["-c", &command, env!("CARGO_BIN_EXE_grideye")]));
    assert_same(&out, &again);
}

pub(crate) fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (files(one), files(other));
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for (name, bytes) in &one {
        assert!(*bytes == other[name], "{name} differs");
    }
}

/// The dataset, made at once by one thread.
fn whole(folder: &Path) -> PathBuf {
    let out = folder.join("whole");
    done(&mut dataset(&out, &["--threads", "1"]));
    out
}

#[test]
fn threads_and_shards_cannot_be_told_from_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    // 13 parts of two files and their counts, the plan, and the data card.
    assert_eq!(files(&whole).len(), 41);
    let threads = folder.path().join("threads");
    done(&mut dataset(&threads, &["--threads", "5"]));
    assert_same(&whole, &threads);
    for shards in [2, 5, 40] {
        let out = folder.path().join(format!("shards-{shards}"));
        // At the same time and in any order, as a scheduler starts them.
        let mut running: Vec<_> = (1..=shards)
            .rev()
            .map(|shard| {
                let shard = format!("{shard}/{shards}");
                dataset(&out, &["--shard", &shard])
                    .stdout(Stdio::null())
                    .spawn()
                    .unwrap()
            })
            .collect();
        for shard in &mut running {
            assert!(shard.wait().unwrap().success());
        }
        assert_same(&whole, &out);
    }
}

#[test]
fn another_seed_is_another_dataset_and_each_part_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let whole = files(&whole(folder.path()));
    let other = folder.path().join("other");
    done(&mut dataset(&other, &["--seed", "8"]));
    let other = files(&other);
    // Their counts may be the same.
    let is_part = |name: &str| name.starts_with("part-") && !name.ends_with("json");
    let parts = whole.iter().filter(|(name, _)| is_part(name));
    let mut seen = Vec::new();
    for (name, bytes) in parts {
        assert!(
            *bytes != other[name],
            "{name} is the same with another seed"
        );
        assert!(!seen.contains(&bytes), "{name} is there twice");
        seen.push(bytes);
    }
    assert_eq!(seen.len(), 26);
}

#[test]
fn killed_at_any_moment_it_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    let out = folder.path().join("killed");
    let (mut kills, mut wait_ms) = (0, 3);
    loop {
        let mut running = dataset(&out, &[]).stdout(Stdio::null()).spawn().unwrap();
        thread::sleep(Duration::from_millis(wait_ms));
        if running
            .try_wait()
            .unwrap()
            .is_some_and(|ended| ended.success())
        {
            break;
        }
        running.kill().unwrap();
        running.wait().unwrap();
        kills += 1;
        // Later and later, so that an end comes on any machine; never by whole multiples of anything.
        wait_ms += 7 + wait_ms / 3;
        assert!(wait_ms < 600_000, "it never comes to an end");
        for (name, bytes) in files(&out) {
            let is_part = name.starts_with("part-") && !name.ends_with(".partial");
            if is_part {
                assert!(
                    bytes == fs::read(whole.join(&name)).unwrap(),
                    "{name} is not whole"
                );
            }
        }
    }
    assert!(kills >= 3, "it was too fast to be killed");
    done(&mut dataset(&out, &[]));
    assert_same(&whole, &out);
}

#[test]
fn what_is_there_is_not_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    let modified = |name: &str| fs::metadata(whole.join(name)).unwrap().modified().unwrap();
    let before = modified("part-000003.npz");
    // One file of one part is lost: it comes back, the other kind stays.
    let lost = fs::read(whole.join("part-000003.parquet")).unwrap();
    fs::remove_file(whole.join("part-000003.parquet")).unwrap();
    let told = done(&mut dataset(&whole, &[]));
    assert!(told.contains("parts: 1 made, 12 there before"), "{told}");
    assert_eq!(modified("part-000003.npz"), before);
    assert!(fs::read(whole.join("part-000003.parquet")).unwrap() == lost);
    let told = done(&mut dataset(&whole, &["--json"]));
    for words in ["\"parts_made\":0", "\"parts_there\":13", "\"frames\":130"] {
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn another_scene_seed_or_cut_is_refused_in_the_same_folder() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    let before = files(&whole);
    for (more, words) in [
        (["--seed", "8"], "seed was 7 and is 8"),
        (["--frames", "140"], "frames was 130 and is 140"),
        (
            ["--frames-per-part", "20"],
            "frames_per_part was 10 and is 20",
        ),
        (
            ["--format", "npz"],
            "formats was [\"npz\",\"parquet\"] and is [\"npz\"]",
        ),
        (["--vary", "law=A,B"], "vary was"),
    ] {
        let told = refused(&mut dataset(&whole, &more));
        assert!(told.contains(words), "{told}");
        assert!(
            told.contains("dataset.json belongs to another dataset"),
            "{told}"
        );
        assert!(
            told.contains("hint: name another folder with --out"),
            "{told}"
        );
    }
    // The scene's text counts, not its name.
    let text = fs::read_to_string(scene("experiment-1")).unwrap();
    let same_name = folder.path().join("experiment-1.toml");
    fs::write(
        &same_name,
        text.replace("temperature_c = 28 ", "temperature_c = 29 "),
    )
    .unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
    command.arg("dataset").arg(&same_name);
    command.args(["--frames", "130", "--frames-per-part", "10", "--seed", "7"]);
    command.args([
        "--vary",
        VARIED,
        "--vary",
        "agent.person.position=floor",
        "--out",
    ]);
    let told = refused(command.arg(&whole));
    assert!(told.contains("scene_sha256 was"), "{told}");
    // And so does the version of the program.
    let plan = whole.join("dataset.json");
    let of_this_version = fs::read_to_string(&plan).unwrap();
    fs::write(&plan, of_this_version.replace("\"grideye 0", "\"grideye 9")).unwrap();
    let told = refused(&mut dataset(&whole, &[]));
    assert!(told.contains("program was \"grideye 9"), "{told}");
    fs::write(&plan, of_this_version).unwrap();
    assert!(before == files(&whole), "a refusal changed something");
}

#[test]
fn files_of_others_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    let good = fs::read(whole.join("part-000002.npz")).unwrap();
    let parquet = fs::read(whole.join("part-000002.parquet")).unwrap();
    let mut of_another_seed = folder.path().join("other");
    done(&mut dataset(&of_another_seed, &["--seed", "8"]));
    of_another_seed.push("part-000002.npz");
    for (name, content) in [
        ("part-000002.npz", b"my notes".to_vec()),
        ("part-000002.npz", Vec::new()),
        ("part-000002.npz", good[..good.len() - 1].to_vec()),
        ("part-000002.npz", fs::read(of_another_seed).unwrap()),
        ("part-000002.parquet", parquet[..parquet.len() / 2].to_vec()),
        ("part-000002.parquet", b"PAR1PAR1".to_vec()),
        ("dataset.json", b"{}".to_vec()),
    ] {
        let ours = fs::read(whole.join(name)).unwrap();
        fs::write(whole.join(name), &content).unwrap();
        let told = refused(&mut dataset(&whole, &[]));
        assert!(
            told.contains(name) && told.contains("it is left as it is"),
            "{told}"
        );
        assert!(fs::read(whole.join(name)).unwrap() == content);
        fs::write(whole.join(name), ours).unwrap();
    }
    // What has other names does not matter.
    fs::write(whole.join("notes.txt"), "mine").unwrap();
    done(&mut dataset(&whole, &[]));
    assert_eq!(fs::read(whole.join("notes.txt")).unwrap(), b"mine");
}

#[test]
fn a_disk_that_is_full_costs_nothing_but_time() {
    let folder = tempfile::tempdir().unwrap();
    let whole = whole(folder.path());
    let out = folder.path().join("full");
    // No file larger than 4 KiB: the plan fits, no part does.
    let tight = |out: &Path| {
        let dataset = dataset(out, &[]);
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""]);
        command.arg(dataset.get_program()).args(dataset.get_args());
        command
    };
    let output = tight(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let told = said(&output);
    assert!(
        told.contains("File too large")
            && told.find("too large") < told.find("hint:")
            && told.contains("run the same command again"),
        "{told}"
    );
    assert_eq!(
        files(&out).into_keys().collect::<Vec<_>>(),
        ["dataset.json"]
    );
    done(&mut dataset(&out, &[]));
    assert_same(&whole, &out);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    fs::write(&file, "").unwrap();
    let output = dataset(&file.join("below"), &[]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("cannot create the folder"),
        "{}",
        said(&output)
    );
}

#[test]
fn what_makes_no_sense_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (more, words) in [
        (vec!["--frames", "0"], "0 is not in 1.."),
        (vec!["--shard", "3/2"], "there is no shard 3 of 2"),
        (vec!["--shard", "0/2"], "shards count from 1 to 2"),
        (vec!["--threads", "0"], "'0' for '--threads <N>'"),
        (vec!["--format", "csv"], "possible values: parquet, npz"),
        (vec!["--sensor", "wall"], "wall"),
        (vec!["--vary", "agent.persn.yaw_deg=1"], "no agent `persn`"),
        (
            vec!["--vary", "sensor.ceiling.resolution=[8,8],[4,4]"],
            "has 4 x 4 pixels, but the scene's sensor has 8 x 8",
        ),
        (
            vec!["--frames", "1000001", "--frames-per-part", "1"],
            "need more than 1000000 parts",
        ),
    ] {
        let told = refused(&mut dataset(&out, &more));
        assert!(told.contains(words), "{more:?}: {told}");
        let parts = files(&out).len();
        assert!(parts <= 1, "{more:?} wrote parts");
        drop(fs::remove_dir_all(&out));
    }
}

#[test]
fn a_shard_without_parts_has_nothing_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let told = done(&mut dataset(
        &folder.path().join("out"),
        &["--shard", "14/14"],
    ));
    assert!(told.contains("0 of 130 frames"), "{told}");
    assert_eq!(
        files(&folder.path().join("out"))
            .into_keys()
            .collect::<Vec<_>>(),
        ["dataset.json"]
    );
}

#[test]
fn a_frame_does_not_know_which_were_made_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let part = |out: &str, shard: &str| {
        let out = folder.path().join(out);
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.arg("dataset").arg(scene("warm-print"));
        // Some keys change the agents only, one changes an object, one comes back to what it was.
        command.args([
            "--frames",
            "24",
            "--frames-per-part",
            "1",
            "--threads",
            "1",
            "--shard",
            shard,
        ]);
        command.args([
            "--vary",
            "agent.person.temperature_c=28..34",
            "--vary",
            "agent.person.present=on,off",
        ]);
        command.args([
            "--vary",
            "object.sofa.emissivity=0.8,0.9",
            "--vary",
            "time_s=0..1200",
            "--out",
        ]);
        done(command.arg(&out));
        out
    };
    let whole = part("whole", "1/1");
    let mut pieces = PathBuf::new();
    for shard in (1..=24).rev() {
        pieces = part("pieces", &format!("{shard}/24"));
    }
    assert_same(&whole, &pieces);
}

/// A table of bounds alone draws the same numbers as the range.
#[test]
fn a_key_alone_is_drawn_by_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.toml");
    let text = fs::read_to_string(scene("experiment-1")).unwrap();
    let table = "\n[[uncertain]]\nkey = \"room.ambient_c\"\nbounds = [18, 26]\n";
    fs::write(&path, text + table).unwrap();
    let varied = |asked: &str| {
        let out = folder.path().join(asked);
        let mut command = Command::new(env!("CARGO_BIN_EXE_grideye"));
        command.arg("dataset").arg(&path).arg("--out").arg(&out);
        command.args(["--frames", "20", "--format", "npz", "--vary", asked]);
        done(&mut command);
        let npz = fs::read(out.join("part-000000.npz")).unwrap();
        let after = |from: usize, mark: &[u8]| {
            let found = npz[from..].windows(mark.len());
            from + found.into_iter().position(|bytes| bytes == mark).unwrap()
        };
        // An .npy file: magic and version, the header's length in two bytes, the header, the numbers.
        let start = after(after(0, b"vary.npy"), b"\x93NUMPY");
        let header = u16::from_le_bytes([npz[start + 8], npz[start + 9]]);
        let numbers = npz[start + 10 + usize::from(header)..].chunks_exact(8);
        let numbers = numbers.map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
        numbers.take(20).collect::<Vec<_>>()
    };
    let drawn = varied("room.ambient_c");
    assert_eq!(drawn, varied(VARIED));
    let is_between = |number: &f64| (18.0..26.0).contains(number);
    assert!(drawn.iter().all(is_between), "{drawn:?}");
    assert_ne!(drawn, varied("room.ambient_c=22+-1"));
}
