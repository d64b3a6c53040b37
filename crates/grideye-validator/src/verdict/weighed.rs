//! A criterion with what would turn it.

use crate::verdict::criterion::Criterion;

/// A criterion, and what would turn it.
pub(crate) struct Weighed {
    pub(crate) criterion: Criterion,
    /// How far a skill is above its threshold.
    pub(crate) margin: Option<f64>,
    /// What would break it if it is met, mend it if it failed, settle it if it is open.
    pub(crate) turn: String,
}

/// What tells a pattern from what is there.
pub(crate) const PROFILE: &str = "a profile of this unit (grideye characterize, then --profile), or a recording that also shows the room empty";
