//! Counts the frames of a part by class; their sums are in the data card.

use crate::manifest::Manifest;
use crate::part::Part;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How many frames have what.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// The dataset.
    pub(crate) fingerprint: String,
    /// All frames.
    pub frames: u64,
    /// Draws that were left out because their values conflict.
    #[serde(default)]
    pub conflicts: u64,
    /// Frames by the number of people in view.
    pub people: BTreeMap<u64, u64>,
    /// Frames in which a person has a posture, by posture.
    pub posture: BTreeMap<String, u64>,
    /// Frames in which a person does something, by activity.
    pub doing: BTreeMap<String, u64>,
}

impl Counts {
    pub(crate) fn of(part: &Part, manifest: &Manifest) -> Self {
        let mut counts = Self {
            fingerprint: manifest.fingerprint().to_owned(),
            conflicts: part.conflicts,
            ..Self::default()
        };
        for people in &part.people {
            counts.frames += 1;
            *counts.people.entry(*people).or_default() += 1;
        }
        let labels = part.agents.iter().flat_map(|agent| &agent.labels);
        for label in labels.flatten() {
            for (found, by) in [
                (label.posture, &mut counts.posture),
                (label.doing, &mut counts.doing),
            ] {
                if let Some(name) = found {
                    *by.entry(name.to_owned()).or_default() += 1;
                }
            }
        }
        counts
    }

    /// Adds what other frames show.
    pub fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.conflicts += other.conflicts;
        for (people, frames) in &other.people {
            *self.people.entry(*people).or_default() += frames;
        }
        for (to, from) in [
            (&mut self.posture, &other.posture),
            (&mut self.doing, &other.doing),
        ] {
            for (name, frames) in from {
                *to.entry(name.clone()).or_default() += frames;
            }
        }
    }
}
