//! Describes a dataset before it is made: everything its bytes depend on, and how it is split into parts.

use crate::error::DatasetError;
use crate::frames::Frames;
use crate::shard::{Shard, Table};
use crate::splits::Splits;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Limit on parts: their names have six digits.
const PARTS_MAX: u64 = 1_000_000;
/// Default frames per part, if they fit `PART_BYTES`.
const FRAMES_PER_PART: u64 = 1_000;
/// Approximate memory of a part's frames, unless `frames_per_part` is given.
const PART_BYTES: u64 = 64 << 20;
/// 4: frames less the empty room. 3: images in Parquet are lists of rows, and a dataset has splits.
const LAYOUT: u32 = 4;
/// How the files of a dataset without splits begin.
pub(crate) const PART: &str = "part";

/// The content of `dataset.json`: equal manifests mean equal bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The version of the file layout.
    pub(crate) layout: u32,
    pub(crate) program: String,
    pub(crate) scene: String,
    pub(crate) scene_sha256: String,
    /// SHA-256 of each file that the scene names.
    pub(crate) files_sha256: BTreeMap<String, String>,
    /// What varies, as requested.
    pub(crate) built_in: bool,
    pub(crate) vary: Vec<String>,
    /// The option that gave the sensor's profile.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) given: Vec<String>,
    /// All that varies, by options and by the scene's tables.
    pub(crate) varies: Vec<String>,
    pub(crate) sensor: String,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) agents: Vec<String>,
    /// Of versions that had a choice of "grid" or "area".
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) method: String,
    pub(crate) seed: u64,
    pub(crate) frames: u64,
    /// Frames of one clip; before layout 2, 1.
    #[serde(default)]
    pub(crate) clip: u64,
    #[serde(default)]
    pub(crate) count_pixels: f64,
    #[serde(default)]
    pub(crate) count_contrast_c: f64,
    /// How often how many people are in view, if that was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) in_view: Vec<f64>,
    pub(crate) frames_per_part: u64,
    /// Names and frames of the splits, in order; empty if all frames are for training.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) splits: Vec<(String, u64)>,
    pub(crate) formats: Vec<String>,
    /// SHA-256 of all of the above.
    #[serde(default)]
    pub(crate) fingerprint: String,
}

impl Manifest {
    /// The manifest of a dataset with `frames` frames made by `program`; by default `frames_per_part` is chosen to fit
    /// memory. Each split has its share of the clips, and parts of its own.
    ///
    /// # Errors
    /// [`DatasetError`] for too many parts, cut clips and empty splits.
    pub fn new(
        subject: &Frames,
        program: &str,
        frames: u64,
        frames_per_part: Option<u64>,
        splits: &Splits,
        tables: impl Iterator<Item = Table>,
    ) -> Result<Self, DatasetError> {
        let bytes = subject.bytes_of_frame();
        let clip = subject.subject.clip;
        let fitting = (PART_BYTES / bytes.max(1)).clamp(1, FRAMES_PER_PART);
        // A clip is never in two parts.
        let fitting = (fitting - fitting % clip).max(clip);
        for (what, number) in [
            ("frames", Some(frames)),
            ("frames-per-part", frames_per_part),
        ] {
            if let Some(number) = number.filter(|number| number % clip != 0) {
                return Err(DatasetError::Refused(format!(
                    "--{what} {number} does not hold whole clips of {clip} frames\nhint: write a multiple of {clip}, such as --{what} {}",
                    (number / clip).max(1) * clip
                )));
            }
        }
        let mut formats: Vec<String> = tables.map(|table| table.name().to_owned()).collect();
        formats.sort();
        formats.dedup();
        let of = &subject.subject;
        let files = of.files.iter();
        let mut manifest = Self {
            layout: LAYOUT,
            program: program.to_owned(),
            scene: of.title.clone(),
            scene_sha256: sha256(of.text.as_bytes()),
            files_sha256: files
                .map(|(name, text)| (name.clone(), sha256(text.as_bytes())))
                .collect(),
            built_in: of.is_built_in,
            vary: of.vary.clone(),
            given: of.given.clone(),
            varies: of.recipe.asked().to_vec(),
            sensor: of.sensor.clone(),
            columns: subject.columns,
            rows: subject.rows,
            agents: subject.agents().to_vec(),
            method: String::new(),
            seed: of.seed,
            frames,
            clip,
            count_pixels: of.counts_from.pixels,
            count_contrast_c: of.counts_from.contrast_c,
            in_view: of.in_view.clone(),
            frames_per_part: frames_per_part.unwrap_or(fitting),
            splits: splits.frames(frames, clip)?,
            formats,
            fingerprint: String::new(),
        };
        if manifest.parts() > PARTS_MAX {
            return Err(DatasetError::Refused(format!(
                "{frames} frames with {} per part need more than {PARTS_MAX} parts\nhint: ask for fewer frames, or for more per part with --frames-per-part",
                manifest.frames_per_part
            )));
        }
        manifest.fingerprint = sha256(manifest.json().as_bytes());
        Ok(manifest)
    }

    /// The manifest on one line.
    #[must_use]
    pub fn json(&self) -> String {
        // Numbers, texts and lists of them are always valid JSON.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Frames in the whole dataset.
    #[must_use]
    pub const fn frames(&self) -> u64 {
        self.frames
    }

    /// Identifies this dataset among all others.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// The number of parts.
    #[must_use]
    pub fn parts(&self) -> u64 {
        self.splits().map(|(_, frames)| self.parts_in(frames)).sum()
    }

    const fn parts_in(&self, frames: u64) -> u64 {
        frames.div_ceil(self.frames_per_part)
    }

    /// Name and frames of each split; without any, of the one that all frames are in.
    pub(crate) fn splits(&self) -> impl Iterator<Item = (&str, u64)> {
        let splits = self.splits.iter();
        let splits = splits.map(|(name, frames)| (name.as_str(), *frames));
        let whole = (PART, self.frames);
        splits.chain(self.splits.is_empty().then_some(whole))
    }

    /// The split that has a part, and the part's frames.
    fn placed(&self, part: u64) -> (&str, Range<u64>) {
        let (mut before, mut first) = (0, 0);
        let mut last = (PART, self.frames..self.frames);
        for (name, frames) in self.splits() {
            let begin = first + (part - before) * self.frames_per_part;
            last = (
                name,
                begin..(begin + self.frames_per_part).min(first + frames),
            );
            if part - before < self.parts_in(frames) {
                break;
            }
            (before, first) = (before + self.parts_in(frames), first + frames);
        }
        last
    }

    /// A part's file name without its end, as in `part-000003`; of a dataset with splits, `train-000003`.
    pub(crate) fn stem(&self, part: u64) -> String {
        format!("{}-{part:06}", self.placed(part).0)
    }

    /// The parts of a shard, in order.
    pub fn parts_of(&self, shard: Shard) -> impl Iterator<Item = u64> + use<> {
        (0..self.parts()).filter(move |part| shard.has(*part))
    }

    /// The frames of a part.
    #[must_use]
    pub fn frames_of(&self, part: u64) -> Range<u64> {
        self.placed(part).1
    }

    /// The number of frames in a part.
    #[must_use]
    pub fn count(&self, part: u64) -> u64 {
        let frames = self.frames_of(part);
        frames.end - frames.start
    }

    /// The file formats of each part.
    pub(crate) fn tables(&self) -> impl Iterator<Item = Table> + '_ {
        let all = [Table::Npz, Table::Npy, Table::Parquet];
        all.into_iter()
            .filter(|table| self.formats.iter().any(|name| name == table.name()))
    }

    /// How another manifest differs, for the error that rejects its folder.
    pub(crate) fn differences(&self, there: &Self) -> Vec<String> {
        let (Ok(here), Ok(there)) = (serde_json::to_value(self), serde_json::to_value(there))
        else {
            return Vec::new();
        };
        let (Some(here), Some(there)) = (here.as_object(), there.as_object()) else {
            return Vec::new();
        };
        let keys: BTreeSet<&String> = here.keys().chain(there.keys()).collect();
        let differs = |key: &&String| *key != "fingerprint" && there.get(*key) != here.get(*key);
        let shown = |value: Option<&Value>| value.map_or_else(String::new, Value::to_string);
        keys.into_iter()
            .filter(differs)
            .map(|key| {
                let (old, new) = (shown(there.get(key)), shown(here.get(key)));
                format!("{key} was {old} and is {new}")
            })
            .collect()
    }
}

fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
