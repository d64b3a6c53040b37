//! What a dataset is, before any of it is made: everything that its bytes depend on, and how it is cut into parts.

use super::frames::Studio;
use crate::cli::{Dataset, Method, Shard, Table};
use crate::exit::bad_input;
use anyhow::{Result, anyhow};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::ops::Range;

/// Parts of a dataset: so many names have six digits.
pub(super) const PARTS_MAX: u64 = 1_000_000;
/// Frames of a part, unless they are too large or it was said otherwise.
const FRAMES_PER_PART: u64 = 1_000;
/// What the frames of a part take up in memory, about, unless it was said otherwise.
const PART_BYTES: u64 = 64 << 20;
/// The version of the files' layout.
const LAYOUT: u32 = 1;

/// The content of `dataset.json`: two datasets with the same one have the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    /// The version of the layout of the files.
    pub(super) layout: u32,
    /// The program and its version.
    pub(super) program: String,
    /// The scene's name.
    pub(super) scene: String,
    /// SHA-256 of the scene file.
    pub(super) scene_sha256: String,
    /// SHA-256 of each file that the scene names.
    pub(super) files_sha256: BTreeMap<String, String>,
    /// What varies, as it was asked for.
    pub(super) vary: Vec<String>,
    pub(super) sensor: String,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The agents, in the order of the arrays.
    pub(super) agents: Vec<String>,
    pub(super) method: String,
    pub(super) seed: u64,
    pub(super) frames: u64,
    pub(super) frames_per_part: u64,
    pub(super) formats: Vec<String>,
    /// SHA-256 of all of the above.
    #[serde(default)]
    pub(super) fingerprint: String,
}

impl Plan {
    pub(super) fn new(options: &Dataset, studio: &Studio) -> Result<Self> {
        let bytes = studio.bytes_of_frame();
        let fitting = (PART_BYTES / bytes.max(1)).clamp(1, FRAMES_PER_PART);
        let frames_per_part = options.frames_per_part.unwrap_or(fitting);
        let mut formats = options.formats.clone();
        formats.sort_by_key(|format| format.name());
        formats.dedup();
        let mut plan = Self {
            layout: LAYOUT,
            program: concat!("grideye ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene: studio.title.clone(),
            scene_sha256: sha256(studio.text.as_bytes()),
            files_sha256: studio
                .files
                .iter()
                .map(|(name, text)| (name.clone(), sha256(text.as_bytes())))
                .collect(),
            vary: options.varied.clone(),
            sensor: studio.sensor.clone(),
            columns: studio.columns,
            rows: studio.rows,
            agents: studio.agents.clone(),
            method: match options.method {
                Method::Grid => "grid",
                Method::Area => "area",
            }
            .to_owned(),
            seed: options.seed,
            frames: options.frames,
            frames_per_part,
            formats: formats
                .into_iter()
                .map(Table::name)
                .map(str::to_owned)
                .collect(),
            fingerprint: String::new(),
        };
        plan.check_parts()?;
        plan.fingerprint = sha256(&serde_json::to_vec(&plan)?);
        Ok(plan)
    }

    fn check_parts(&self) -> Result<()> {
        if self.parts() <= PARTS_MAX {
            return Ok(());
        }
        Err(bad_input(anyhow!(
            "{} frames, {} in each part, are more than {PARTS_MAX} parts\nhint: ask for fewer frames, or for more in a part with --frames-per-part",
            self.frames,
            self.frames_per_part
        )))
    }

    /// The number of parts.
    pub(super) const fn parts(&self) -> u64 {
        self.frames.div_ceil(self.frames_per_part)
    }

    /// The parts of a shard, in their order.
    pub(super) fn parts_of(&self, shard: Shard) -> impl Iterator<Item = u64> + use<> {
        (0..self.parts()).filter(move |part| shard.has(*part))
    }

    /// The frames of a part.
    pub(super) fn frames_of(&self, part: u64) -> Range<u64> {
        let first = part * self.frames_per_part;
        first..(first + self.frames_per_part).min(self.frames)
    }

    /// How many frames a part has.
    pub(super) fn count(&self, part: u64) -> u64 {
        let frames = self.frames_of(part);
        frames.end - frames.start
    }

    /// The kinds of files of each part.
    pub(super) fn tables(&self) -> impl Iterator<Item = Table> + '_ {
        let all = [Table::Npz, Table::Parquet];
        all.into_iter()
            .filter(|table| self.formats.iter().any(|name| name == table.name()))
    }

    /// What is different in another plan, for whoever wonders why it is not taken up again.
    pub(super) fn differences(&self, there: &Self) -> Vec<String> {
        let (Ok(here), Ok(there)) = (serde_json::to_value(self), serde_json::to_value(there))
        else {
            return Vec::new();
        };
        let Some(here) = here.as_object() else {
            return Vec::new();
        };
        here.iter()
            .filter(|(key, value)| *key != "fingerprint" && there.get(key) != Some(value))
            .map(|(key, value)| {
                let old = there.get(key).map_or_else(String::new, ToString::to_string);
                format!("{key} was {old} and is {value}")
            })
            .collect()
    }
}

fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
