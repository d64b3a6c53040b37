//! What a report tells of its making: files, command, thresholds.

use crate::thresholds::ThresholdLine;

/// What was compared, with what, and how to do it again: all that the frames themselves do not tell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Context {
    /// Name of the scene, as the user gave it.
    pub scene: String,
    /// Name of the recording, as the user gave it.
    pub recording: String,
    /// Name of the sensor within the scene.
    pub sensor: String,
    /// The command that makes this report again.
    pub command: String,
    /// Program and version, for example `grideye 0.1.0`.
    pub program: String,
    /// When it was made, as text; left out if empty, so that equal input can give equal bytes.
    pub created: String,
    /// Seeds by what they were used for.
    pub seeds: Vec<(String, u64)>,
    /// The files that went in.
    pub inputs: Vec<Input>,
    /// What was assumed, each a sentence; those of the comparison itself are added to them.
    pub assumptions: Vec<String>,
    /// The paper's experiment that this is, 1 to 4: its figures are printed beside ours. Without it, the range of
    /// all four is.
    pub experiment: Option<u8>,
    /// Each threshold with where it comes from.
    pub thresholds: Vec<ThresholdLine>,
}

/// A file that went into the comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// The file's name.
    pub name: String,
    /// A hash of its bytes with the name of the hash in front, for example `sha256:…`.
    pub hash: String,
}
