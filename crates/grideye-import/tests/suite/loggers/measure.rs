//! Measures the reader on every variant. `GRIDEYE_SEEDS=10` takes as many seeds, `GRIDEYE_VARIANT=words` the variants with
//! that in their names, `GRIDEYE_MESSAGES=1` prints what is said where it is asked or refused by name, and
//! `GRIDEYE_FILES=target/loggers` keeps the files: `cargo test -p grideye-import --test suite loggers -- --nocapture`.

use super::judge::{Outcome, outcome};
use super::kinds;
use super::scene::Scene;
use super::variant::{Accept, Variant};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Of the files that say all that is needed, as many are read without options, in percent.
const RIGHT_MIN: usize = 85;

const CLASSES: [&str; 6] = ["right", "asked", "named", "refused", "lossy", "wrong"];
/// The first of the classes that may not be.
const FAULTS_FROM: usize = 3;

#[derive(Default)]
struct Measured {
    /// Where the files are kept, if they are.
    folder: Option<PathBuf>,
    /// How many of each class, and how many have all that is needed.
    kinds: BTreeMap<&'static str, [usize; 7]>,
    faults: Vec<String>,
    messages: BTreeSet<String>,
    /// How often the best option of a hint reads a file right, with loss, wrong, or not at all.
    answers: [usize; 4],
}

#[test]
fn foreign_recordings_are_read_right_or_asked_for() {
    let setting = |name: &str| std::env::var(name).ok();
    let seeds: u64 = setting("GRIDEYE_SEEDS").map_or(2, |seeds| seeds.parse().unwrap());
    let only = setting("GRIDEYE_VARIANT").unwrap_or_default();
    let mut measured = Measured {
        folder: setting("GRIDEYE_FILES").map(PathBuf::from),
        ..Measured::default()
    };
    let variants = kinds::all();
    let variants = variants.iter().filter(|one| one.name.contains(&only));
    for variant in variants.clone() {
        (0..seeds).for_each(|seed| measured.take(variant, seed));
    }
    println!("{} variants, {seeds} seeds", variants.count());
    let all = measured.print(setting("GRIDEYE_MESSAGES").is_some());
    let percent = 100 * all[0] / all[6].max(1);
    println!("{percent} % of {} readable files are right", all[6]);
    let faults = measured.faults.len();
    assert_eq!(
        faults, 0,
        "files read wrong, with loss, or refused as nothing"
    );
    let is_enough = percent >= RIGHT_MIN || !only.is_empty();
    assert!(is_enough, "only {percent} % are read right without options");
}

impl Measured {
    fn take(&mut self, variant: &Variant, seed: u64) {
        let written = (variant.write)(&mut Scene::new(seed, variant.name));
        if let Some(folder) = &self.folder {
            let name = format!("{} {} {}", variant.name, seed, written.name);
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(folder.join(name.replace('/', "_")), &written.bytes).unwrap();
        }
        let found = outcome(&written, "");
        if let Outcome::Asked(text) = &found {
            let rank = |columns: &String| match outcome(&written, columns) {
                Outcome::Right => 0,
                Outcome::Lossy(_) => 1,
                Outcome::Wrong(_) => 2,
                Outcome::Asked(_) | Outcome::Refused(_) => 3,
            };
            let best = answers(text).iter().map(rank).min().unwrap_or(3);
            self.answers[best] += 1;
            if best > 0 && variant.accept.has_right() {
                let what = ["", "with loss", "wrong", "not at all"][best];
                let name = variant.name;
                self.messages
                    .insert(format!("hint     {name} (seed {seed}) is read {what}"));
            }
        }
        let (class, text) = graded(variant, found);
        for row in [variant.kind, "all"] {
            let counts = self.kinds.entry(row).or_default();
            counts[class] += 1;
            counts[6] += usize::from(variant.accept.has_right());
        }
        let (kind, name) = (variant.kind, variant.name);
        let line = format!(
            "{:<8} {kind} / {name} (seed {seed}): {text}",
            CLASSES[class]
        );
        match class {
            0 => {}
            FAULTS_FROM.. => self.faults.push(line),
            _ => drop(self.messages.insert(line)),
        }
    }

    /// The table, then what was said, then the faults; returns the sums.
    fn print(&self, has_messages: bool) -> [usize; 7] {
        let heads = CLASSES.map(|class| format!("{class:>8}")).concat();
        println!("{:<24} {:>8}{heads}", "kind", "readable");
        for (kind, counts) in &self.kinds {
            let cells = counts[..6].iter().map(|count| format!("{count:>8}"));
            println!("{kind:<24} {:>8}{}", counts[6], cells.collect::<String>());
        }
        let [right, lossy, wrong, not] = self.answers;
        println!(
            "asked {} times; the best option of the hint alone reads the file right {right} times, with loss {lossy}, wrong \
             {wrong}, not at all {not}",
            self.answers.iter().sum::<usize>()
        );
        let messages = self.messages.iter().filter(|_| has_messages);
        messages
            .chain(&self.faults)
            .for_each(|line| println!("{line}"));
        self.kinds.get("all").copied().unwrap_or_default()
    }
}

/// The place in [`CLASSES`], and what was said.
fn graded(variant: &Variant, outcome: Outcome) -> (usize, String) {
    let accept = variant.accept;
    let is_named = |text: &str| accept.names().iter().any(|name| has_words(text, name));
    match outcome {
        Outcome::Right if accept.has_right() => (0, String::new()),
        Outcome::Right => (5, "it was guessed: nothing in the file says it".to_owned()),
        Outcome::Asked(text) | Outcome::Refused(text) if is_named(&text) => (2, text),
        Outcome::Asked(text) if !matches!(accept, Accept::Named(_)) => (1, text),
        Outcome::Asked(text) | Outcome::Refused(text) => (3, text),
        Outcome::Lossy(text) if accept.has_right() => (4, text),
        Outcome::Lossy(text) | Outcome::Wrong(text) => (5, text),
    }
}

/// What the hint says to write after `--columns`.
fn answers(hint: &str) -> Vec<String> {
    let said = hint.split("--columns ").skip(1);
    let word = |text: &str| {
        text.split([' ', '\n'])
            .next()
            .unwrap_or_default()
            .to_owned()
    };
    said.map(|text| word(text).trim_end_matches([',', ';', ')', ':']).to_owned())
        .collect()
}

/// Whether a text has such words, not as a part of others.
fn has_words(text: &str, words: &str) -> bool {
    let text = text.to_lowercase().replace('×', "x");
    let is_alone = |at: usize| {
        let before = text[..at].chars().next_back();
        let after = text[at + words.len()..].chars().next();
        !before.is_some_and(char::is_alphanumeric) && !after.is_some_and(char::is_alphanumeric)
    };
    text.match_indices(words).any(|(at, _)| is_alone(at))
}

#[test]
fn every_variant_has_a_name_of_its_own() {
    let (variants, mut seen) = (kinds::all(), BTreeSet::new());
    for variant in &variants {
        assert!(seen.insert(variant.name), "{} is there twice", variant.name);
    }
    assert!(seen.len() >= 150, "{}", seen.len());
}
