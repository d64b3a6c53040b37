//! How the warmth of a body is spread over its faces, and how it changes in time.

use super::transient::{Material, Transient};

#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Thermal {
    /// By how much each face is warmer than the body, °C; empty if none is.
    pub(crate) offsets_c: Vec<f64>,
    pub(crate) transient: Option<Transient>,
    /// What it is made of, if warm prints are left on it.
    pub(crate) material: Option<Material>,
}
