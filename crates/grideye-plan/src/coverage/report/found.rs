//! The results for a room, before they are written.

use crate::coverage::candidates::{Candidate, Mount};
use crate::coverage::error::CoverageError;
use crate::coverage::figure::Figure;
use crate::coverage::map::Map;
use crate::coverage::pick::{Pick, Wish, pick};
use crate::coverage::survey::{Look, Survey};
use grideye_scene::{Scene, count};

/// The results for the kept and the picked poses.
#[derive(Debug)]
pub struct Report<'a> {
    pub(super) scene_name: String,
    pub(super) scene: &'a Scene,
    pub(super) survey: &'a Survey,
    pub(super) figure: &'a Figure,
    pub(super) wish: Wish,
    /// All poses: first the kept ones, then the candidates.
    pub(super) poses: &'a [Candidate],
    pub(super) kept: usize,
    pub(super) looks: &'a [Look],
    /// The picked candidates; `None` if only the scene's own sensors were requested.
    pub(super) pick: Option<Pick>,
    pub(super) shown: Vec<usize>,
    /// The shown poses combined, and the combination after each pose, kept ones first.
    pub(super) map: Map,
    pub(super) steps: Vec<Map>,
}

impl<'a> Report<'a> {
    /// Combines the first `kept` poses and, if requested, the `best` candidates among the others.
    ///
    /// # Errors
    /// [`CoverageError::Value`] for an invalid wish.
    pub fn new(
        (scene_name, scene): (String, &'a Scene),
        (survey, figure): (&'a Survey, &'a Figure),
        wish: Wish,
        (poses, kept): (&'a [Candidate], usize),
        looks: &'a [Look],
        best: Option<usize>,
    ) -> Result<Self, CoverageError> {
        let own: Vec<usize> = (0..kept).collect();
        // Always pick, because this also validates the wish.
        let pick = pick(survey.floor(), looks, &own, best.unwrap_or(1), &wish)?;
        let pick = best.map(|_| pick);
        let mut shown = own;
        let steps = pick.iter().flat_map(|pick| &pick.steps);
        shown.extend(steps.map(|step| step.chosen));
        let map_of = |poses: &[usize]| {
            let looks: Vec<&Look> = poses.iter().filter_map(|pose| looks.get(*pose)).collect();
            Map::new(survey.floor(), &looks, &wish)
        };
        Ok(Self {
            scene_name,
            scene,
            survey,
            figure,
            wish,
            poses,
            kept,
            looks,
            pick,
            map: map_of(&shown),
            steps: (1..=shown.len())
                .map(|count| map_of(&shown[..count]))
                .collect(),
            shown,
        })
    }

    /// The share of places where the wish is met, 0 to 1.
    #[must_use]
    pub fn detected_share(&self) -> f64 {
        share(self.map.totals.detected, self.map.totals.places)
    }

    /// The name of a shown pose: the scene's name for its own sensors, mounting and number for a candidate.
    pub(super) fn shown_name(&self, index: usize) -> Option<String> {
        let candidate = &self.poses[*self.shown.get(index)?];
        if candidate.mount.is_none() {
            return Some(candidate.sensor.name.clone());
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
        Some(name)
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
