//! How far a scene may be from the room that it describes, and still be right.

/// What a scene leaves open.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Laws {
    /// One for each person.
    pub(crate) people: Vec<PersonLaw>,
    /// Standard deviation of the delay, seconds.
    pub(crate) lag_sd_s: f64,
    /// Standard deviation of the logarithm of the contrast of objects, in a scene without people.
    pub(crate) objects_sd: f64,
}

/// What a scene leaves open of one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PersonLaw {
    /// Standard deviation of its constant offset in x and in y, meters.
    pub(crate) place_sd_m: f64,
    /// Standard deviation of a walker's wandering about its way in x and in y, meters.
    pub(crate) wander_sd_m: f64,
    /// How long it wanders to one side, seconds: the time constant of its correlation.
    pub(crate) wander_over_s: f64,
    /// Standard deviation of the logarithm of its contrast: clothes, skin and size.
    pub(crate) contrast_sd: f64,
}

impl Laws {
    pub(crate) fn of_people(number: usize) -> Self {
        let law = PersonLaw {
            place_sd_m: 0.07,
            wander_sd_m: 0.07,
            wander_over_s: 0.7,
            contrast_sd: 0.35,
        };
        Self {
            people: vec![law; number],
            lag_sd_s: 0.07,
            objects_sd: 0.2,
        }
    }
}
