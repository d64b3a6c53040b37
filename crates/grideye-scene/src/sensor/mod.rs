//! What a sensor makes of a picture: noise, the faults of one specimen, steps.

pub(crate) mod noise;
pub(crate) mod specimen;
