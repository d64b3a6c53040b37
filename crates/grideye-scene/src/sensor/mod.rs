//! What a sensor makes of a picture: noise, the faults of one unit, steps.

pub(crate) mod noise;
pub(crate) mod unit;
