//! The data card: what the dataset shows, how many frames of each class it has, how it was made, and how to cite it.

use crate::counts::Counts;
use crate::manifest::{Manifest, PART};
use crate::shard::Table;
use std::fmt::Write as _;

impl Manifest {
    /// The card as Markdown, headed by the YAML that makes `datasets.load_dataset` read the folder; the same for all processes
    /// that made the dataset.
    pub(crate) fn card(&self, counts: &Counts, features: &[String]) -> String {
        let mut card = self.heading(features);
        // Writing to a string cannot fail.
        let _ = write!(
            card,
            "# {}: simulated frames of an infrared sensor\n\n",
            self.scene
        );
        let clips = match self.clip {
            1 => String::new(),
            clip => format!(" in clips of {clip}",),
        };
        let (frames, columns, rows) = (self.frames, self.columns, self.rows);
        let _ = write!(
            card,
            "{frames} labeled frames{clips}: {columns} x {rows} pixels of the sensor `{}`. No frame was measured. `dataset.json` has the whole description; crates/grideye/DATASET.md of grideye-hil says what the columns mean.\n\n## What varies\n\n",
            self.sensor
        );
        for asked in &self.varies {
            let _ = writeln!(card, "- `{asked}`");
        }
        if self.varies.is_empty() {
            card.push_str("Only the time and the noise.\n");
        }
        if !self.in_view.is_empty() {
            let weights: Vec<String> = self.in_view.iter().map(f64::to_string).collect();
            let _ = writeln!(
                card,
                "- 0, 1, 2 and more people in view, in proportions of {}: other situations were left out",
                weights.join(" : ")
            );
        }
        if counts.conflicts > 0 {
            let conflicts = counts.conflicts;
            let _ = writeln!(
                card,
                "- {conflicts} draws were left out: their values conflict"
            );
        }
        card.push_str("\n## Frames by class\n");
        let people = counts.people.iter();
        let people = people.map(|(people, frames)| (people.to_string(), *frames));
        table(&mut card, "people in view", people);
        for (title, by) in [
            ("posture of a person", &counts.posture),
            ("what a person does", &counts.doing),
        ] {
            let named = by.iter().map(|(name, frames)| (name.clone(), *frames));
            table(&mut card, title, named);
        }
        let _ = write!(
            card,
            "\nSomebody counts as in view who fills {:?} pixels or more and changes one by {:?} °C or more. With several people a frame is in several rows of the lower tables.\n\n## How it was made\n\n```sh\n{}\n```\n\nWith {}. The scene's SHA-256 is {}.\n\n## How to cite\n\n> {} frames simulated by {} (grideye-hil) from the scene {}, seed {}; dataset {}.\n\nThe frames are simulated: report results on them apart from results on real frames.\n",
            self.count_pixels,
            self.count_contrast_c,
            self.command(),
            self.program,
            self.scene_sha256,
            self.frames,
            self.program,
            self.scene,
            self.seed,
            self.fingerprint(),
        );
        card
    }

    /// Splits and their files, and the columns with their shapes; nothing of a dataset without Parquet.
    fn heading(&self, features: &[String]) -> String {
        if !self.tables().any(|table| table == Table::Parquet) {
            return String::new();
        }
        let mut heading = "---\nconfigs:\n- config_name: default\n  data_files:\n".to_owned();
        for (name, _) in self.splits() {
            let split = if name == PART { "train" } else { name };
            let _ = write!(heading, "  - split: {split}\n    path: {name}-*.parquet\n");
        }
        heading.push_str("dataset_info:\n  features:\n");
        for feature in features {
            let _ = writeln!(heading, "  - {feature}");
        }
        heading + "---\n\n"
    }

    /// A command that makes the same dataset.
    fn command(&self) -> String {
        let mut words = vec!["grideye".to_owned(), "dataset".to_owned()];
        words.push(match self.built_in {
            true => format!("--preset {}", self.scene),
            false => quoted(&format!("{}.toml", self.scene)),
        });
        let mut option = |name: &str, value: &str| words.extend([name.to_owned(), quoted(value)]);
        option("--sensor", &self.sensor);
        option("--frames", &self.frames.to_string());
        option("--clip", &self.clip.to_string());
        option("--seed", &self.seed.to_string());
        option("--count-pixels", &format!("{:?}", self.count_pixels));
        option("--count-contrast", &format!("{:?}", self.count_contrast_c));
        if !self.in_view.is_empty() {
            let weights: Vec<String> = self.in_view.iter().map(f64::to_string).collect();
            option("--in-view", &weights.join(","));
        }
        option("--format", &self.formats.join(","));
        option("--frames-per-part", &self.frames_per_part.to_string());
        if !self.splits.is_empty() {
            let splits = self.splits.iter();
            let splits = splits.map(|(name, frames)| format!("{name}={}", frames / self.clip));
            option("--split", &splits.collect::<Vec<_>>().join(","));
        }
        if let [name, value] = self.given.as_slice() {
            option(name, value);
        }
        for asked in &self.vary {
            option("--vary", asked);
        }
        option("--out", "DIR");
        words.join(" ")
    }
}

fn table(card: &mut String, title: &str, rows: impl Iterator<Item = (String, u64)>) {
    let mut rows = rows.peekable();
    if rows.peek().is_none() {
        return;
    }
    let _ = write!(card, "\n| {title} | frames |\n|---|---|\n");
    for (name, frames) in rows {
        let _ = writeln!(card, "| {name} | {frames} |");
    }
}

/// For a shell.
fn quoted(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "_-./=,:".contains(letter);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
