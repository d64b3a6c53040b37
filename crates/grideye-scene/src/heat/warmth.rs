//! How the warmth of a body is spread over its faces, and how it changes in time.

use super::cooling::{Heat, Material};

/// How the warmth of a body is spread and changes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Warmth {
    /// By how much each face is warmer than the body, °C; empty if none is.
    pub(crate) offsets_c: Vec<f64>,
    /// How its temperature changes in time.
    pub(crate) heat: Option<Heat>,
    /// What it is made of, if warm prints are left on it.
    pub(crate) material: Option<Material>,
}
