//! The results for a room, before they are written.

use crate::coverage::candidates::{Candidate, Mount};
use crate::coverage::error::CoverageError;
use crate::coverage::figure::Figure;
use crate::coverage::map::Map;
use crate::coverage::search::Choice;
use crate::coverage::survey::{Look, Survey};
use crate::coverage::wish::{Wish, check};
use grideye_scene::{Scene, count};

/// The results for the kept and the chosen poses.
#[derive(Debug)]
pub struct Report<'a> {
    pub(super) scene_name: String,
    pub(super) scene: &'a Scene,
    pub(super) survey: &'a Survey,
    pub(super) figure: &'a Figure,
    pub(super) wish: Wish,
    /// The kept poses, then the chosen ones.
    pub(super) poses: Vec<Candidate>,
    pub(super) kept: usize,
    /// `None` if only the scene's own sensors were requested.
    pub(super) choice: Option<&'a Choice>,
    /// For each pose: it and all before it, combined; and all.
    pub(super) steps: Vec<Map>,
    pub(super) map: Map,
}

impl<'a> Report<'a> {
    /// Combines the kept poses and what was chosen beside them.
    ///
    /// # Errors
    /// [`CoverageError`] for an invalid wish.
    pub fn new(
        (scene_name, scene): (String, &'a Scene),
        (survey, figure): (&'a Survey, &'a Figure),
        wish: Wish,
        (kept, looks): (&[Candidate], &[Look]),
        choice: Option<&'a Choice>,
    ) -> Result<Self, CoverageError> {
        check(1, &wish)?;
        let chosen = || choice.iter().flat_map(|choice| &choice.steps);
        let looks = looks.iter().chain(chosen().map(|step| &step.look));
        let looks: Vec<&Look> = looks.collect();
        let map_of = |looks: &[&Look]| Map::new(survey.floor(), looks, &wish);
        Ok(Self {
            scene_name,
            scene,
            survey,
            figure,
            wish,
            poses: kept
                .iter()
                .chain(chosen().map(|step| &step.pose))
                .cloned()
                .collect(),
            kept: kept.len(),
            choice,
            map: map_of(&looks),
            steps: (1..=looks.len())
                .map(|count| map_of(&looks[..count]))
                .collect(),
        })
    }

    /// The share of places where the wish is met, 0 to 1.
    #[must_use]
    pub fn detected_share(&self) -> f64 {
        share(self.map.totals.detected, self.map.totals.places)
    }

    /// The name of a pose: the scene's name for its own sensors, mounting and number for a candidate.
    pub(super) fn shown_name(&self, index: usize) -> String {
        let candidate = &self.poses[index];
        if candidate.mount.is_none() {
            return candidate.sensor.name.clone();
        }
        let taken = |name: &String| {
            self.scene
                .sensors()
                .iter()
                .any(|sensor| sensor.name == *name)
        };
        let number = index + 1 - self.kept;
        let mut name = format!("{}-{number}", place(candidate));
        while taken(&name) {
            name.push('b');
        }
        name
    }
}

pub(super) const fn place(candidate: &Candidate) -> &'static str {
    match candidate.mount {
        None => "scene",
        Some(Mount::Ceiling) => "ceiling",
        Some(Mount::Wall) => "wall",
        Some(Mount::Corner) => "corner",
    }
}

pub(super) fn share(part: usize, whole: usize) -> f64 {
    count::float(part) / count::float(whole.max(1))
}
