//! What simulated recordings draw: a scene within its laws.

use crate::constants::OBJECTS_SD;
use crate::decision::view::{Image, View, add};
use crate::numbers::single;
use grideye_frame::PIXELS;
use grideye_scene::{AgentLaws, Laws};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::Arc;

/// What one world draws of its scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawn {
    /// For each person: how many times its contrast, and how far aside it is in each picture, meters.
    people: Vec<(f32, Vec<[f64; 2]>)>,
    /// How many times the contrast of the objects, if they are the subjects.
    objects: f32,
    /// How many standard deviations each uncertain number of the scene is off.
    numbers: Vec<f32>,
    lag_s: f64,
    looks: Looks,
}

/// For each person and picture, how many times each pixel of what it adds; once if empty.
pub(crate) type Looks = Arc<Vec<Vec<Image>>>;

/// A world, and what is seen of it beyond the room, without noise.
pub(crate) struct World {
    pub(crate) drawn: Drawn,
    pub(crate) shows: Vec<Image>,
}

impl World {
    pub(crate) fn new(drawn: Drawn, view: &mut View) -> Self {
        Self {
            shows: drawn.shown(view),
            drawn,
        }
    }
}

pub(crate) fn normal(random: &mut ChaCha8Rng, sd: f64) -> f64 {
    let draw: f64 = StandardNormal.sample(random);
    sd * draw
}

/// Noise at these times that is forgotten exponentially.
fn wander<'a, const N: usize>(
    sd: f64,
    over_s: f64,
    times_s: &'a [f64],
    random: &'a mut ChaCha8Rng,
) -> impl Iterator<Item = [f64; N]> + 'a {
    let mut now = [(); N].map(|()| normal(random, sd));
    let mut before_s = times_s.first().copied().unwrap_or_default();
    times_s.iter().map(move |&time_s| {
        let kept = (-(time_s - before_s).max(0.0) / over_s).exp();
        before_s = time_s;
        let fresh = sd * (1.0 - kept * kept).sqrt();
        now = now.map(|now| kept * now + normal(random, fresh));
        now
    })
}

pub(crate) fn looks(view: &View, laws: &Laws, random: &mut ChaCha8Rng) -> Looks {
    let of = |law: &AgentLaws| {
        let more = wander(law.looks_sd, law.wander_over_s, &view.times_s, random);
        let looks = more.map(|pixels| pixels.map(|more| single(1.0 + more)));
        looks.collect()
    };
    let laws = laws.agents.iter().filter(|law| law.looks_sd > 0.0);
    Looks::new(laws.map(of).collect())
}

impl Drawn {
    /// Draws within the laws, all but looks.
    pub(crate) fn of(view: &View, laws: &Laws, random: &mut ChaCha8Rng) -> Self {
        let people = view.people.iter().zip(&laws.agents).map(|(walker, law)| {
            let contrast = single(normal(random, law.contrast_sd).exp());
            let aside_m = [(); 2].map(|()| normal(random, law.place_sd_m));
            let wander_m = if walker.moves { law.wander_sd_m } else { 0.0 };
            let wander_m = wander(wander_m, law.wander_over_s, &view.times_s, random);
            let places = wander_m.map(|[x, y]| [aside_m[0] + x, aside_m[1] + y]);
            let places = places.collect();
            (contrast, places)
        });
        let people = people.collect();
        Self {
            people,
            objects: single(normal(random, OBJECTS_SD).exp()),
            numbers: view
                .responses
                .iter()
                .map(|_| single(normal(random, 1.0)))
                .collect(),
            lag_s: normal(random, laws.lag_sd_s),
            looks: Looks::default(),
        }
    }

    pub(crate) fn looking(self, looks: &Looks) -> Self {
        let looks = Arc::clone(looks);
        Self { looks, ..self }
    }

    /// The same world with one of its people further aside.
    pub(crate) fn moved(mut self, person: usize, by_m: [f64; 2]) -> Self {
        if let Some((_, places)) = self.people.get_mut(person) {
            for place in places {
                *place = [place[0] + by_m[0], place[1] + by_m[1]];
            }
        }
        self
    }

    /// Two worlds for a mean, each off its place as far as the other and the opposite way. What people wander by is part of
    /// where they are aside all the time: at each time the mean is the same, and so few worlds would leave a movement in it.
    /// With the scene's own contrast and numbers.
    pub(crate) fn two_for_mean(view: &View, laws: &Laws, random: &mut ChaCha8Rng) -> [Self; 2] {
        let mut steady = laws.clone();
        for (walker, law) in view.people.iter().zip(&mut steady.agents) {
            let wander_sd_m = if walker.moves { law.wander_sd_m } else { 0.0 };
            law.place_sd_m = law.place_sd_m.hypot(wander_sd_m);
            (law.wander_sd_m, law.contrast_sd) = (0.0, 0.0);
        }
        let mut one = Self::of(view, &steady, random);
        one.objects = 1.0;
        one.numbers.clear();
        let mut other = one.clone();
        other.lag_s *= -1.0;
        let places = other.people.iter_mut().flat_map(|(_, places)| places);
        places.for_each(|place| *place = place.map(|aside_m| -aside_m));
        [one, other]
    }

    /// The contrast of its first person.
    pub(crate) fn contrast(&self) -> f32 {
        self.people.first().map_or(1.0, |(contrast, _)| *contrast)
    }

    /// How much warmer than the scene's its room is, with nobody and nothing warm in it.
    pub(crate) fn empty(&self, view: &View) -> Vec<Image> {
        let mut all = vec![[0.0; PIXELS]; view.len()];
        let responses = view.responses.iter().filter(|_| view.objects.is_none());
        for (response, sds) in responses.zip(&self.numbers) {
            for (index, image) in all.iter_mut().enumerate() {
                response.room.add_to(image, index, *sds);
            }
        }
        all
    }

    /// What is seen beyond the room, without noise.
    pub(crate) fn shown(&self, view: &mut View) -> Vec<Image> {
        self.without_hidden(view, |_, _| false)
    }

    /// The same without the people who are hidden in a picture.
    pub(crate) fn without_hidden(
        &self,
        view: &mut View,
        is_hidden: impl Fn(usize, usize) -> bool,
    ) -> Vec<Image> {
        let (objects, people) = (&view.objects, &mut view.people);
        let responses = &view.responses;
        let picture = |index: usize| {
            let mut image = [0.0; PIXELS];
            if let Some(objects) = objects {
                add(&mut image, &objects[index], self.objects);
            }
            for (response, sds) in responses.iter().zip(&self.numbers) {
                response.whole.add_to(&mut image, index, *sds);
            }
            for (number, (walker, (contrast, places))) in
                people.iter_mut().zip(&self.people).enumerate()
            {
                if *contrast > 0.0 && !is_hidden(number, index) {
                    let mut adds = walker.aside(index, places[index]);
                    if let Some(looks) = self.looks.get(number) {
                        for (adds, times) in adds.iter_mut().zip(&looks[index]) {
                            *adds *= times;
                        }
                    }
                    add(&mut image, &adds, *contrast);
                }
            }
            image
        };
        let all: Vec<Image> = (0..view.times_s.len()).map(picture).collect();
        later(&all, &view.times_s, self.lag_s)
    }
}

/// Pictures shown later.
pub(super) fn later(pictures: &[Image], times_s: &[f64], lag_s: f64) -> Vec<Image> {
    if lag_s == 0.0 {
        return pictures.to_vec();
    }
    let last = pictures.len().saturating_sub(1);
    let at = |time_s: &f64| {
        let time_s = time_s - lag_s;
        let after = times_s.partition_point(|other| *other < time_s).min(last);
        let before = after.saturating_sub(1);
        let (low, high) = (times_s[before], times_s[after]);
        let share = match high > low {
            true => single(((time_s - low) / (high - low)).clamp(0.0, 1.0)),
            false => 1.0,
        };
        let mut image = [0.0; PIXELS];
        add(&mut image, &pictures[before], 1.0 - share);
        add(&mut image, &pictures[after], share);
        image
    };
    times_s.iter().map(at).collect()
}
