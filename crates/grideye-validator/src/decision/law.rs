//! How far a scene may be from the room that it describes, and still be right.

/// What a scene leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Laws {
    /// Standard deviation of each person's constant offset in x and in y, meters.
    pub(crate) place_m: f64,
    /// Standard deviation of a walker's wandering about its way in x and in y, meters.
    pub(crate) wander_m: f64,
    /// How long it wanders to one side, seconds: the time constant of its correlation.
    pub(crate) wander_s: f64,
    /// Standard deviation of the logarithm of each person's contrast: clothes, skin and size.
    pub(crate) contrast: f64,
    /// Standard deviation of the delay that alignment leaves, seconds.
    pub(crate) lag_s: f64,
}

impl Laws {
    /// Of a person whose way was tracked or paced out. Two clothed people differ by a factor of 1.5 to 1.7 in contrast,
    /// a tracked place is good to 5 to 10 cm: measured on two persons (open-thermopile-dataset, doi
    /// 10.1109/JIOT.2022.3161646).
    pub(crate) const PEOPLE: Self = Self {
        place_m: 0.07,
        wander_m: 0.07,
        wander_s: 0.7,
        contrast: 0.35,
        lag_s: 0.07,
    };
}
