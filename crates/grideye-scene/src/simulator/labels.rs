//! What a frame is labelled with: where each agent is, and how much of it is seen.

use super::frames::{Method, Objects, Simulator, facets, number, shaded, shown};
use crate::model::scene::Scene;
use crate::picture::area::{Facet, StaticFacets};
use crate::picture::grid::{Accumulator, Backdrop, ShadedPatch};
use crate::picture::image::{Image, Mask};
use crate::picture::physical::Shown;
use crate::sensor::noise::add_noise;
use crate::sensor::unit;
use std::time::Duration;

impl Simulator {
    /// Makes this the simulator of a scene that [differs only in its agents](Scene::has_the_room_of), without casting
    /// again what stands still.
    pub fn set_agents(&mut self, scene: &Scene) {
        self.agents.clone_from(&scene.agents);
        self.objects = Objects::new(scene);
    }

    /// What its sampling grid takes up in memory, bytes, about; 0 without one.
    #[must_use]
    pub fn grid_bytes(&self) -> usize {
        match &self.method {
            Method::Grid(_) => 2 * size_of::<f64>() * self.sensor.grid_points.element_product(),
            Method::Area { .. } | Method::Physical(_) => 0,
        }
    }

    /// [`Self::image`] and [`Self::noisy`] at once, for little more than the price of one.
    #[must_use]
    pub fn image_and_noisy(&self, time: Duration, seed: u64) -> (Image, Image) {
        let received = self.received(time);
        let noisy = self.with_noise(received.clone(), time, seed);
        (self.detected(received), noisy)
    }

    /// What is made of an image that was received: its noise at `time` by `seed`, the sensor's steps and its range.
    pub(super) fn with_noise(&self, mut image: Image, time: Duration, seed: u64) -> Image {
        let sensor = &self.sensor;
        match &sensor.profile {
            Some(profile) => unit::measure(profile, sensor, &mut image, (time, seed)),
            None => add_noise(
                &mut image.celsius,
                sensor.noise_sigma,
                seed,
                &sensor.name,
                time,
            ),
        }
        unit::quantise(&mut image.celsius, sensor.step_c);
        self.detected(image)
    }

    /// How much of each pixel would be the agent with this place in [`Scene::agents`](crate::Scene::agents) at `time`
    /// if nothing else were in the room: [`Self::truth_of`] without anything that hides it.
    #[must_use]
    pub fn unhidden(&self, agent: usize, time: Duration) -> Mask {
        let mut share = vec![0.0; self.still_c.len()];
        let counts = |owner| owner == number(agent);
        match &self.method {
            Method::Grid(grid) => {
                let mut patches: Vec<ShadedPatch> = self.changing_by(time, |skin, sight| {
                    shaded(&grid.view, &self.air, skin, sight)
                });
                patches.retain(|shaded| counts(shaded.owner));
                let empty = Backdrop::empty(&grid.view);
                Accumulator::new(&grid.view, &self.air, &empty, &grid.resampler)
                    .add_share(&patches, counts, &mut share);
            }
            Method::Area { plane, .. } => {
                let mut alone: Vec<Facet> =
                    self.changing_by(time, |skin, sight| facets(plane, &self.air, skin, sight));
                alone.retain(|facet| counts(facet.owner));
                StaticFacets::new(Vec::new()).add_share(plane, &alone, counts, &mut share);
            }
            Method::Physical(physical) => {
                let alone: Vec<Shown> = self.changing_by(time, |skin, sight| {
                    let mine = counts(skin.owner).then(|| shown(physical, skin, sight));
                    mine.into_iter().collect()
                });
                share = physical.bare().share(&alone, counts);
            }
        }
        self.mask_of(share)
    }

    /// The share of an agent that is seen at `time`: the sum of [`Self::truth_of`] over all pixels by that of
    /// [`Self::unhidden`], 0 to 1; 0 if none of it is in view.
    #[must_use]
    pub fn visibility(&self, agent: usize, time: Duration) -> f64 {
        visibility(&self.truth_of(agent, time), &self.unhidden(agent, time))
    }
}

/// The share of what would be seen if nothing hid it that is seen, 0 to 1; 0 if that is nothing.
#[must_use]
pub fn visibility(seen: &Mask, unhidden: &Mask) -> f64 {
    let whole = unhidden.pixels();
    if whole > 0.0 {
        (seen.pixels() / whole).min(1.0)
    } else {
        0.0
    }
}

impl Mask {
    /// The sum of all shares: how many pixels the agent would fill.
    #[must_use]
    pub fn pixels(&self) -> f64 {
        self.share.iter().sum()
    }
}
