//! Recordings that could be: a scene within its laws, seen by a unit.

use crate::decision::film::{Film, Image};
use crate::decision::law::Laws;
use grideye_frame::PIXELS;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What is known of the unit that recorded.
#[derive(Debug, Clone)]
pub(crate) struct Unit {
    /// Noise of a pixel from frame to frame, rounding included, °C.
    pub(crate) noise_c: f64,
    /// Standard deviation of each pixel's unknown constant error, unit and room, °C.
    pub(crate) pattern_c: Image,
    pub(crate) step_c: f64,
}

/// What one world draws of its scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawn {
    /// For each person: how many times its contrast, and how far aside it is in each frame, meters.
    people: Vec<(f32, Vec<[f64; 2]>)>,
    lag_s: f64,
}

pub(crate) fn normal(random: &mut ChaCha8Rng, sd: f64) -> f64 {
    let draw: f64 = StandardNormal.sample(random);
    sd * draw
}

impl Drawn {
    /// Draws within the laws.
    pub(crate) fn of(film: &Film, laws: &Laws, random: &mut ChaCha8Rng) -> Self {
        let people = film.people.iter().map(|walker| {
            let contrast = normal(random, laws.contrast).exp() as f32;
            let aside_m = [normal(random, laws.place_m), normal(random, laws.place_m)];
            let wander_m = if walker.moves { laws.wander_m } else { 0.0 };
            let mut now_m = [normal(random, wander_m), normal(random, wander_m)];
            let mut before_s = film.times_s.first().copied().unwrap_or_default();
            let places = film.times_s.iter().map(|&time_s| {
                let kept = (-(time_s - before_s).max(0.0) / laws.wander_s).exp();
                before_s = time_s;
                let fresh_m = wander_m * (1.0 - kept * kept).sqrt();
                now_m = now_m.map(|now_m| kept * now_m + normal(random, fresh_m));
                [aside_m[0] + now_m[0], aside_m[1] + now_m[1]]
            });
            let places = places.collect();
            (contrast, places)
        });
        let people = people.collect();
        Self {
            people,
            lag_s: normal(random, laws.lag_s),
        }
    }

    /// Exactly the scene, with every person `aside_m` aside, `lag_s` late and with `contrast` times its warmth.
    pub(crate) fn exact(film: &Film, aside_m: [f64; 2], lag_s: f64, contrast: f32) -> Self {
        let person = || (contrast, vec![aside_m; film.len()]);
        Self {
            people: film.people.iter().map(|_| person()).collect(),
            lag_s,
        }
    }

    /// The same world with its people moved further.
    pub(crate) fn moved(mut self, person: usize, by_m: [f64; 2]) -> Self {
        if let Some((_, places)) = self.people.get_mut(person) {
            for place in places {
                *place = [place[0] + by_m[0], place[1] + by_m[1]];
            }
        }
        self
    }

    /// The same world without one of its people.
    pub(crate) fn without(mut self, person: usize) -> Self {
        if let Some((contrast, _)) = self.people.get_mut(person) {
            *contrast = 0.0;
        }
        self
    }

    /// The same world with the scene's own contrast.
    pub(crate) fn as_warm_as_claimed(mut self) -> Self {
        for (contrast, _) in &mut self.people {
            *contrast = 1.0;
        }
        self
    }

    /// The contrast of its first person.
    pub(crate) fn contrast(&self) -> f32 {
        self.people.first().map_or(1.0, |(contrast, _)| *contrast)
    }

    /// What is seen without noise; frame `index` shows the scene's frame `order(index)`.
    pub(crate) fn shown(&self, film: &mut Film, order: impl Fn(&Film, usize) -> usize) -> Vec<Image> {
        let frames: Vec<usize> = (0..film.len()).map(|index| order(film, index)).collect();
        let sources = lagged(film, &frames, self.lag_s);
        let mut all = vec![[0.0; PIXELS]; film.len()];
        let (empty, people) = (&film.empty, &mut film.people);
        for (index, (image, source)) in all.iter_mut().zip(&sources).enumerate() {
            for &(frame, share) in source {
                add(image, &empty[frame], share);
                for (walker, (contrast, places)) in people.iter_mut().zip(&self.people) {
                    if *contrast > 0.0 && share > 0.0 {
                        add(image, &walker.aside(frame, places[index]), share * contrast);
                    }
                }
            }
        }
        all
    }
}

/// For each frame the two around its own time less the lag, with their shares.
fn lagged(film: &Film, frames: &[usize], lag_s: f64) -> Vec<[(usize, f32); 2]> {
    let last = film.len().saturating_sub(1);
    let source = |&frame: &usize| {
        let time_s = film.times_s[frame] - lag_s;
        let after = film.times_s.partition_point(|other| *other < time_s).min(last);
        let before = after.saturating_sub(1);
        let (low, high) = (film.times_s[before], film.times_s[after]);
        let share = match high > low {
            true => ((time_s - low) / (high - low)).clamp(0.0, 1.0) as f32,
            false => 1.0,
        };
        [(before, 1.0 - share), (after, share)]
    };
    frames.iter().map(source).collect()
}

pub(super) fn add(image: &mut Image, other: &Image, share: f32) {
    for (image, other) in image.iter_mut().zip(other) {
        *image += share * other;
    }
}

impl Unit {
    /// What the unit reports of what it sees.
    pub(crate) fn records(&self, shown: &[Image], random: &mut ChaCha8Rng) -> Vec<Image> {
        let level_c = normal(random, self.step_c.max(0.25));
        let errors = self
            .pattern_c
            .map(|sd_c| (level_c + normal(random, f64::from(sd_c))) as f32);
        // The measured noise includes rounding, which is applied again below.
        let unrounded = self.noise_c * self.noise_c - self.step_c * self.step_c / 12.0;
        let noise_c = unrounded.max(0.0).sqrt() as f32;
        let step_c = self.step_c as f32;
        let mut frame = |seen: &Image| {
            let mut recorded = *seen;
            for (pixel, error) in recorded.iter_mut().zip(&errors) {
                let noise: f32 = StandardNormal.sample(random);
                *pixel += error + noise_c * noise;
                if step_c > 0.0 {
                    *pixel = (*pixel / step_c).round() * step_c;
                }
            }
            recorded
        };
        shown.iter().map(&mut frame).collect()
    }
}
