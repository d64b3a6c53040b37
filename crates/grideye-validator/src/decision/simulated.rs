//! Simulated recordings of a scene: what its laws leave open is drawn.

use crate::decision::constants::OBJECTS_SD;
use crate::decision::film::Film;
use crate::decision::image::{Image, add, add_all, later};
use crate::numbers::{count, mean, single};
use grideye_frame::PIXELS;
use grideye_scene::Laws;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One of the laws that are drawn from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Law {
    /// Of the scene's uncertain number with this place.
    Number(usize),
    /// Of a person.
    Contrast(usize),
    Aside(usize),
    Wander(usize),
    Lag,
    /// Of unit and room.
    Background,
}

/// How one simulated recording differs from its scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Draw {
    people: Vec<Drawn>,
    /// How many times the contrast of the objects, if they are the subjects.
    objects: f32,
    /// How many standard deviations each uncertain number of the scene is off.
    off: Vec<f32>,
    lag_s: f64,
}

/// How one person differs.
#[derive(Debug, Clone)]
struct Drawn {
    /// How many times its contrast.
    contrast: f32,
    /// How far aside it is in each picture, meters; of several ways, what it adds is their mean.
    ways_m: Vec<Vec<[f64; 2]>>,
    /// By picture, how many times each pixel of what it adds; once if empty.
    looks: Vec<Image>,
}

/// What one simulated recording shows, without noise.
pub(crate) struct Simulated {
    pub(crate) draw: Draw,
    pub(crate) shows: Vec<Image>,
    /// What each person adds to it.
    pub(crate) people: Vec<Vec<Image>>,
}

impl Simulated {
    pub(crate) fn new(draw: Draw, film: &mut Film) -> Self {
        let mut shows = film.room.clone();
        if let Some(objects) = &film.objects {
            add_all(&mut shows, objects, draw.objects);
        }
        for (variation, off) in film.variations.iter().zip(&draw.off) {
            add_all(&mut shows, &variation.linear, *off);
            add_all(&mut shows, &variation.square, off * off);
        }
        let mut shows = later(shows, &film.times_s, draw.lag_s);
        let people = (0..film.people.len()).map(|number| draw.person(number, film));
        let people: Vec<Vec<Image>> = people.collect();
        for adds in &people {
            add_all(&mut shows, adds, 1.0);
        }
        Self {
            draw,
            shows,
            people,
        }
    }

    /// The mean of recordings of the scene with its own contrast and numbers. What a person adds is averaged over its places:
    /// four points have the mean and the variance of their normal law.
    pub(crate) fn mean(film: &mut Film, laws: &Laws) -> Self {
        const POINTS: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let number = film.len();
        let people = film.people.iter().zip(&laws.agents).map(|(person, law)| {
            let wander_m = if person.moves { law.wander_sd_m } else { 0.0 };
            let away_m = std::f64::consts::SQRT_2 * law.place_sd_m.hypot(wander_m);
            let ways = POINTS.map(|point| vec![point.map(|part| away_m * part); number]);
            Drawn {
                contrast: 1.0,
                ways_m: Vec::from(ways),
                looks: Vec::new(),
            }
        });
        let draw = Draw {
            people: people.collect(),
            objects: 1.0,
            ..Draw::default()
        };
        Self::new(draw, film)
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
        for now in &mut now {
            *now = kept * *now + normal(random, fresh);
        }
        now
    })
}

impl Draw {
    /// Draws within the laws.
    pub(crate) fn of(film: &Film, laws: &Laws, random: &mut ChaCha8Rng) -> Self {
        let people = film.people.iter().zip(&laws.agents).map(|(person, law)| {
            let contrast = single(normal(random, law.contrast_sd).exp());
            let always_m = [(); 2].map(|()| normal(random, law.place_sd_m));
            let wander_m = if person.moves { law.wander_sd_m } else { 0.0 };
            let wander_m = wander(wander_m, law.wander_over_s, &film.times_s, random);
            Drawn {
                contrast,
                ways_m: vec![
                    wander_m
                        .map(|[x, y]| [always_m[0] + x, always_m[1] + y])
                        .collect(),
                ],
                looks: Vec::new(),
            }
        });
        let people = people.collect();
        let off = film.variations.iter();
        Self {
            people,
            objects: single(normal(random, OBJECTS_SD).exp()),
            off: off.map(|_| single(normal(random, 1.0))).collect(),
            lag_s: normal(random, laws.lag_sd_s),
        }
    }

    /// The same with people who look otherwise than their models, pixel by pixel. Recordings of the scene are drawn so: those of
    /// an alternative are asked for likeness alone, a sum over many pixels and pictures.
    pub(crate) fn with_looks(mut self, film: &Film, laws: &Laws, random: &mut ChaCha8Rng) -> Self {
        for (person, law) in self.people.iter_mut().zip(&laws.agents) {
            let looks = wander(law.looks_sd, law.wander_over_s, &film.times_s, random);
            let looks = looks.map(|pixels: [f64; PIXELS]| {
                let mut times = [1.0; PIXELS];
                for (times, more) in times.iter_mut().zip(pixels) {
                    *times += single(more);
                }
                times
            });
            person.looks = looks.collect();
        }
        self
    }

    /// The same with one of its people further aside.
    pub(crate) fn moved(mut self, person: usize, by_m: [f64; 2]) -> Self {
        if let Some(person) = self.people.get_mut(person) {
            for aside_m in person.ways_m.iter_mut().flatten() {
                *aside_m = [aside_m[0] + by_m[0], aside_m[1] + by_m[1]];
            }
        }
        self
    }

    /// The same if a law were known.
    pub(crate) fn knowing(mut self, law: Law) -> Self {
        match law {
            Law::Number(number) => self.off[number] = 0.0,
            Law::Contrast(person) => self.people[person].contrast = 1.0,
            // What a person is aside all the time is nearly the mean of what it is aside.
            Law::Aside(person) | Law::Wander(person) => {
                let all_m = &mut self.people[person].ways_m[0];
                let along = |axis: usize| all_m.iter().map(|at| at[axis]).collect::<Vec<f64>>();
                let mean_m = [0, 1].map(|axis| mean(&along(axis)).unwrap_or(0.0));
                for aside_m in all_m {
                    *aside_m = match law {
                        Law::Aside(_) => [aside_m[0] - mean_m[0], aside_m[1] - mean_m[1]],
                        _ => mean_m,
                    };
                }
            }
            Law::Lag => self.lag_s = 0.0,
            Law::Background => {}
        }
        self
    }

    /// The contrast of its first person.
    pub(crate) fn contrast(&self) -> f32 {
        self.people.first().map_or(1.0, |person| person.contrast)
    }

    /// What one of the people adds.
    pub(crate) fn person(&self, number: usize, film: &mut Film) -> Vec<Image> {
        let Drawn {
            contrast,
            ways_m,
            looks,
        } = &self.people[number];
        let times = contrast / single(count(ways_m.len()));
        let (person, times_s) = (&mut film.people[number], &film.times_s);
        let picture = |index: usize| {
            let mut adds = [0.0; PIXELS];
            for aside_m in ways_m {
                add(&mut adds, &person.aside(index, aside_m[index]), times);
            }
            if let Some(looks) = looks.get(index) {
                let pixels = adds.iter_mut().zip(looks);
                pixels.for_each(|(adds, times)| *adds *= times);
            }
            adds
        };
        let adds = (0..times_s.len()).map(picture).collect();
        later(adds, times_s, self.lag_s)
    }
}

/// The laws that leave anything open, each with its key and standard deviation.
pub(crate) fn open_laws(film: &Film, laws: &Laws) -> Vec<(Law, String)> {
    let told = |key: &str, sd: f64| format!("`{key}` (sd {sd})");
    let mut all = Vec::new();
    for (number, variation) in film.variations.iter().enumerate() {
        all.push((Law::Number(number), told(&variation.key, variation.sd)));
    }
    for (number, (person, law)) in film.people.iter().zip(&laws.agents).enumerate() {
        let of = [
            (Law::Contrast(number), "contrast", law.contrast_sd),
            (Law::Aside(number), "aside_m", law.place_sd_m),
            (Law::Wander(number), "wander_m", law.wander_sd_m),
        ];
        let of = of.into_iter().filter(|(_, _, sd)| *sd > 0.0);
        all.extend(
            of.map(|(law, key, sd)| (law, told(&format!("agent.{}.{key}", person.name), sd))),
        );
    }
    all.push((Law::Lag, told("recording.start_s", laws.lag_sd_s)));
    all.push((Law::Background, "room.background_c".to_owned()));
    all
}
