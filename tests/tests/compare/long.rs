//! `grideye compare` on recordings of any length: the memory it takes does not grow with them, and what it says is what is
//! said of the same recording in memory.
//!
//! `GRIDEYE_LONG_ROWS=100000,1000000 cargo test -p grideye-tests --test compare long -- --nocapture` prints the memory for those.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::comparing::simulate;
use grideye_tests::programs::{grideye, root};
use grideye_validator::{Options, RECORDS_MAX, Thinning, compare_scene};
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

const SCENE: &str = "scenes/experiment-1.toml";

/// A recording of so many rows: frames that the scene's sensor made, again and again, with numbers and times that go on.
fn long(folder: &Path, rows: usize) -> std::path::PathBuf {
    let short = folder.join("short.csv");
    simulate(SCENE, 9, 1000, &short);
    let text = std::fs::read_to_string(short).unwrap();
    let (header, frames) = text.split_once('\n').unwrap();
    let frames: Vec<&str> = frames.lines().collect();
    let first: Vec<&str> = frames[0].split(',').collect();
    let pixels: Vec<&str> = frames
        .iter()
        .map(|frame| frame.splitn(9, ',').last().unwrap())
        .collect();
    let path = folder.join(format!("{rows}.csv"));
    let mut file = BufWriter::new(std::fs::File::create(&path).unwrap());
    writeln!(file, "{header}").unwrap();
    for row in 0..rows {
        let (stream, pixels) = (first[..3].join(","), pixels[row % pixels.len()]);
        let ns = row * 100_000_000;
        writeln!(file, "{stream},{row},{ns},{ns},synced,,{pixels}").unwrap();
    }
    file.into_inner().unwrap();
    path
}

/// Runs the comparison; its JSON and the most memory that it ever took, in kilobytes.
fn compared(recording: &Path) -> (serde_json::Value, u64) {
    let out = recording.with_extension("json");
    let mut child = grideye()
        .args(["compare", "--scene", SCENE, "--recording"])
        .arg(recording)
        .arg("--json")
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kb = 0;
    // The peak never falls: the last look before the end is what counts.
    let code = loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
        peak_kb = kb.unwrap_or(0).max(peak_kb);
        if let Some(ended) = child.try_wait().unwrap() {
            break ended.code();
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    // Noise never repeats, so the verdict may well be that these frames are not the scene's.
    assert!(matches!(code, Some(0 | 1 | 3)), "{code:?}");
    let json = serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap();
    (json, peak_kb)
}

#[test]
fn memory_does_not_grow_with_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let asked = std::env::var("GRIDEYE_LONG_ROWS").unwrap_or_else(|_| "40000,280000".to_owned());
    let lengths: Vec<usize> = asked.split(',').map(|rows| rows.parse().unwrap()).collect();
    let mut peaks_kb = Vec::new();
    for &rows in &lengths {
        let recording = long(folder.path(), rows);
        let (json, peak_kb) = compared(&recording);
        println!("{rows} rows: at most {peak_kb} kB of memory");
        let said = json["context"]["assumptions"].to_string();
        assert!(
            said.contains(&format!("The recording has {rows} rows")),
            "{said}"
        );
        peaks_kb.push(peak_kb);
        std::fs::remove_file(recording).unwrap();
    }
    // A record takes 0.2 kB: were all of them kept, 240,000 more would take 48 MB. The allocator takes some megabytes
    // more or less from run to run.
    let grown_kb = peaks_kb[peaks_kb.len() - 1].saturating_sub(peaks_kb[0]);
    assert!(grown_kb < 20_000, "{peaks_kb:?} kB for {lengths:?} rows");
}

#[test]
fn a_long_recording_says_on_disk_what_it_says_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    for rows in [2_000, 2 * RECORDS_MAX + 500] {
        let recording = long(folder.path(), rows);
        let (json, _) = compared(&recording);
        let file = std::fs::File::open(&recording).unwrap();
        let reader = grideye_recording::csv::Reader::new(std::io::BufReader::new(file)).unwrap();
        let all: Vec<_> = reader.map(|row| row.unwrap().record).collect();
        assert_eq!(all.len(), rows);
        let mut thinning = Thinning::default();
        thinning.extend(all);
        let text = std::fs::read_to_string(root().join(SCENE)).unwrap();
        let files = |relative: &str| std::fs::read_to_string(root().join("scenes").join(relative));
        let scene = grideye_scene::Scene::parse(&text, SCENE, &files).unwrap();
        let options = Options {
            seed: 2,
            ..Options::default()
        };
        let kept = thinning.finish().records;
        let comparison = compare_scene(&kept, &scene.scene, "ceiling", &options).unwrap();
        for score in comparison.scores.iter() {
            let found = json["scores"][score.measure.name()]["value"].as_f64();
            let close = match (found, score.value) {
                (Some(found), Some(value)) => (found - value).abs() < 1e-12,
                (found, value) => found == value,
            };
            assert!(
                close,
                "{rows} rows, {}: {found:?} {:?}",
                score.measure, score.value
            );
        }
    }
}
