//! Simulates recordings of a scene and of its alternatives, and decides between them.

use crate::decision::alternative::Alternative;
use crate::decision::constants::{
    ABSENT, AT_FIRST, CLEAR_POWER, FOR_RANK, FOR_REFERENCE, LOOKED_AT, OF_ALTERNATIVE, OF_NEAR,
    OF_OFFSET, OFFSETS_M, UNTOLD_MOST,
};
use crate::decision::film::Film;
use crate::decision::image::{Image, add, add_all};
use crate::decision::model::{Model, Statistics};
use crate::decision::recording::{Recording, fill};
use crate::decision::reference::{Reference, Statistic, is_outside, one_in_a_hundred};
use crate::decision::simulated::{Draw, Law, Simulated, open_laws};
use crate::decision::template::mean;
use crate::numbers::{count, single};
use grideye_scene::Laws;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// What a recording says about its scene, beside simulated recordings of it and of its alternatives.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// Share of simulated recordings of the scene that are as far from the scene as the recording, or farther.
    pub right: f64,
    /// What is farthest off, in words.
    pub worst: String,
    /// How surprising that is: the negative logarithm of the share of simulated recordings in which it is as far off.
    pub surprise: f64,
    #[serde(skip)]
    pub(crate) cause: Statistic,
    /// Of each person, or of all objects together.
    pub contrasts: Vec<Contrast>,
    /// How much later than the scene the recording is, seconds, and what all but .5 % of simulated recordings show.
    pub delay_s: f64,
    /// Lowest and highest.
    pub delay_range_s: [f64; 2],
    /// The smallest of [`OFFSETS_M`] by which the first person must be aside so that nine of ten recordings would not
    /// agree; `None` if none of them is.
    pub refused_aside_m: Option<f64>,
    /// What else the recording could show; nothing else is asked about one that is refused.
    pub alternatives: Vec<Alternatively>,
    /// The law that keeps these from being told apart most: its key, and its standard deviation.
    #[serde(skip)]
    pub(crate) too_wide: Option<(Law, String)>,
    /// Whether the recording shows nothing but the room and noise.
    pub is_empty: bool,
    /// How far the level of all pixels runs away from the scene's, beyond the slow drift that was removed, °C.
    pub drift_c: f64,
    /// Frames that it was judged by.
    pub frames: usize,
    /// Pictures that it was judged by, each the mean of neighboring frames if there are many.
    pub pictures: usize,
    /// Frames that resemble neither neighbor, left out.
    pub strays: usize,
}

/// How warm a person is over the room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contrast {
    /// The person; `None` if there are only objects.
    pub of: Option<String>,
    /// In the recording, over the scene's.
    pub found: f64,
    /// Of all but .5 % of simulated recordings: lowest and highest.
    pub range: [f64; 2],
}

/// Whether something else than the scene explains the recording too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternatively {
    /// In words.
    pub what: String,
    #[serde(skip)]
    pub(crate) of: Alternative,
    /// 1 for the scene, 0 for the alternative, less what noise may add.
    pub likeness: f64,
    /// What recordings of the alternative stay below.
    pub limit: f64,
    /// Share of recordings of the scene above that limit.
    pub power: f64,
    /// Whether the two differ by less than noise.
    pub is_alike: bool,
}

/// Pictures of recordings that are kept for all alternatives: 51 megabytes.
const PICTURES_KEPT: usize = 200_000;

impl Decision {
    pub(crate) fn is_refused(&self, right_min: f64) -> bool {
        self.right <= right_min || self.off_contrast().is_some()
    }

    pub(crate) fn is_agreed(&self, right_min: f64) -> bool {
        !self.is_refused(right_min) && self.untold().next().is_none()
    }

    /// The contrast farthest out of its range, if any is out.
    pub(crate) fn off_contrast(&self) -> Option<&Contrast> {
        let off = |one: &&Contrast| is_outside(one.found, one.range);
        let by =
            |one: &Contrast| (one.range[0] / one.found.max(0.01)).max(one.found / one.range[1]);
        self.contrasts
            .iter()
            .filter(off)
            .max_by(|a, b| by(a).total_cmp(&by(b)))
    }

    /// Alternatives that the recording could come from too.
    pub(crate) fn untold(&self) -> impl Iterator<Item = &Alternatively> {
        self.alternatives
            .iter()
            .filter(|one| !one.is_told() && one.counts())
    }

    /// Alternatives that noise or pattern make the scene itself.
    pub(crate) fn alike(&self) -> impl Iterator<Item = &Alternatively> {
        self.alternatives
            .iter()
            .filter(|one| !one.is_told() && !one.counts())
    }
}

impl Contrast {
    /// Whether nothing is as warm where the scene has this, when it has it there: no clothes make it so.
    pub(crate) fn is_absent(&self) -> bool {
        self.found < ABSENT
    }
}

impl Alternatively {
    /// Whether the recording excludes it.
    #[must_use]
    pub fn is_told(&self) -> bool {
        // Who is one more may be told although any unit could hide them.
        let may_be = !self.is_alike || matches!(self.of, Alternative::More(_));
        may_be && self.likeness > self.limit
    }

    /// Whether agreeing takes excluding it: a symmetric scene is the scene.
    #[must_use]
    pub fn counts(&self) -> bool {
        !self.is_alike || self.of == Alternative::Nobody
    }
}

/// How a decision is made.
#[derive(Clone, Copy)]
pub(crate) struct How {
    /// Recordings of which no more simulated ones than this share are as far off are refused.
    pub(crate) right_min: f64,
    /// Whether all that is asked is whether it agrees.
    pub(crate) is_brief: bool,
    pub(crate) is_stopped: fn() -> bool,
}

/// `None` once it is stopped, and of a recording that is refused if it is brief.
pub(crate) fn decide(
    film: &mut Film,
    recording: &Recording,
    laws: &Laws,
    how: How,
) -> Option<Decision> {
    let mut simulation = Simulation::new(film, recording, laws, how.is_stopped);
    let right = simulation.of_scene()?;
    let (first, ranked) = right.split_at(FOR_REFERENCE);
    let reference = Reference::new(first);
    let ranked = ranked.iter().map(|one| reference.distance(one).1);
    let ranked = sorted(ranked.collect());
    let share_beyond = |distance: f64| {
        let nearer = ranked.partition_point(|other| *other < distance);
        count(ranked.len() - nearer + 1) / count(ranked.len() + 1)
    };
    let is_far = |distance: f64| share_beyond(distance) <= how.right_min;
    let is_refused =
        |one: &Statistics| is_far(reference.distance(one).1) || reference.has_off_contrast(one);
    let found = simulation.model.statistics(&recording.pictures);
    let is_over = is_refused(&found);
    if how.is_brief && is_over {
        return None;
    }
    let alternatives = match is_over {
        true => Vec::new(),
        false => simulation.alternatives(&found, &right, &is_refused)?,
    };
    let is_agreed = |one: &Statistics| {
        let mut all = alternatives.iter().zip(&one.likeness);
        !is_refused(one) && all.all(|(one, likeness)| !one.counts() || *likeness > one.limit)
    };
    let are_asked = !simulation.film.people.is_empty() && !how.is_brief && !is_over;
    let mut offsets = OFFSETS_M.into_iter().filter(|_| are_asked);
    let refused_aside_m = offsets.find(|aside_m| simulation.refuses_aside(*aside_m, &is_agreed));
    let too_wide = match how.is_brief || is_over {
        true => None,
        false => simulation.too_wide(&alternatives, &is_refused),
    };
    let (model, film) = (&simulation.model, &simulation.film);
    let (_, surprise) = reference.distance(&found);
    let cause = reference.cause(&found, &is_far);
    // Warmth that the scene lacks is more than nothing, however little it is.
    let has_more = is_far(reference.extra(&found));
    let ranges = reference.contrasts(found.contrasts.len());
    let contrasts = found.contrasts.iter().zip(ranges).enumerate();
    let contrasts = contrasts.map(|(subject, (found, range))| Contrast {
        of: film.people.get(subject).map(|person| person.name.clone()),
        found: *found,
        range,
    });
    Some(Decision {
        right: share_beyond(surprise),
        worst: reference.in_words(cause, &found, model, film),
        surprise,
        cause,
        contrasts: contrasts.collect(),
        delay_s: found.delay_s,
        delay_range_s: reference.delay_s(found.contrasts.len()),
        refused_aside_m,
        alternatives,
        too_wide,
        is_empty: !has_more && model.is_empty(&recording.pictures),
        drift_c: film.drift_c(&recording.pictures),
        frames: recording.frames - recording.strays,
        pictures: recording.pictures.len() - recording.missing.len(),
        strays: recording.strays,
    })
}

/// Simulates recordings by possible units.
struct Simulation<'a> {
    film: &'a mut Film,
    laws: &'a Laws,
    recording: &'a Recording,
    model: Model,
    random: ChaCha8Rng,
    /// What units added to the first recordings of the scene, for others to use again.
    errors: Vec<Vec<Image>>,
    /// The first of those that alternatives change.
    others: Vec<Simulated>,
    is_stopped: fn() -> bool,
}

impl<'a> Simulation<'a> {
    fn new(
        film: &'a mut Film,
        recording: &'a Recording,
        laws: &'a Laws,
        is_stopped: fn() -> bool,
    ) -> Self {
        Self {
            model: Model::new(film, laws, &recording.unit),
            film,
            laws,
            recording,
            // Any seed will do, but the same recording always gets the same verdict.
            random: ChaCha8Rng::seed_from_u64(0x0064_6563_6964_6500),
            errors: Vec::with_capacity(OF_ALTERNATIVE),
            others: Vec::new(),
            is_stopped,
        }
    }

    /// The statistics of recordings of the scene.
    fn of_scene(&mut self) -> Option<Vec<Statistics>> {
        let one = |_| {
            if (self.is_stopped)() {
                return None;
            }
            let draw = Draw::of(self.film, self.laws, &mut self.random);
            let draw = draw.with_looks(self.film, self.laws, &mut self.random);
            let shown = Simulated::new(draw, self.film).shows;
            let unit = &self.recording.unit;
            let error = unit.errors(self.film.len(), &mut self.random);
            let statistics = self.model.statistics(&self.recorded(shown, &error));
            if self.errors.len() < OF_ALTERNATIVE {
                self.errors.push(error);
            }
            Some(statistics)
        };
        (0..FOR_REFERENCE + FOR_RANK).map(one).collect()
    }

    /// How much more the recording is like the scene than like each alternative, and what limits that has, given the statistics
    /// of recordings of the scene.
    fn alternatives(
        &mut self,
        found: &Statistics,
        right: &[Statistics],
        is_refused: &impl Fn(&Statistics) -> bool,
    ) -> Option<Vec<Alternatively>> {
        let all = 0..self.model.differences.len();
        let one = |number: usize| {
            if (self.is_stopped)() {
                return None;
            }
            let right = right.iter().map(|right| right.likeness[number]);
            let right = sorted(right.collect());
            let limit = self.limit(number, right[0], is_refused);
            let above = right.len() - right.partition_point(|likeness| *likeness <= limit);
            let power = count(above) / count(right.len());
            let difference = &self.model.differences[number];
            let of = difference.from.clone();
            let is_clear = of.keeps_people() && power > CLEAR_POWER;
            Some(Alternatively {
                what: of.in_words(self.film),
                likeness: found.likeness[number],
                limit,
                power,
                is_alike: difference.is_alike && !is_clear,
                of,
            })
        };
        all.map(one).collect()
    }

    /// What one in a hundred recordings of an alternative exceeds; if that is more than the `least` of the scene's, of those
    /// that are not refused anyway.
    fn limit(
        &mut self,
        number: usize,
        least: f64,
        is_refused: &impl Fn(&Statistics) -> bool,
    ) -> f64 {
        let mut of = Vec::with_capacity(OF_NEAR);
        let mut limit = f64::INFINITY;
        for until in [AT_FIRST, OF_ALTERNATIVE] {
            self.draw_likeness(number, until, &mut of);
            let all = sorted(of.clone());
            limit = one_in_a_hundred(&all, f64::NEG_INFINITY, all.len());
            // Clear, if it is as far again from what they exceed as that is from their middle.
            if limit + (limit - all[all.len() / 2]) < least {
                return limit;
            }
        }
        if limit < least {
            return limit;
        }
        self.draw_likeness(number, OF_NEAR, &mut of);
        let mut near: Vec<(f64, usize)> = of.into_iter().zip(0..).collect();
        near.retain(|(likeness, _)| *likeness > least);
        near.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Below the last that is looked at nothing is known.
        let lowest = near.get(LOOKED_AT - 1).map_or(least, |last| last.0);
        near.truncate(LOOKED_AT);
        near.retain(|(_, index)| {
            let recording = self.of_alternative(number, *index);
            !is_refused(&self.model.statistics(&recording))
        });
        let agreed = near.iter().map(|near| near.0).collect();
        one_in_a_hundred(&sorted(agreed), lowest, OF_NEAR)
    }

    /// Likeness of recordings of an alternative, until there are so many.
    fn draw_likeness(&mut self, number: usize, until: usize, of: &mut Vec<f64>) {
        for index in of.len()..until {
            let recording = self.of_alternative(number, index);
            of.push(self.model.likeness(number, &self.model.fit(&recording)));
        }
    }

    /// A recording of an alternative.
    fn of_alternative(&mut self, number: usize, index: usize) -> Vec<Image> {
        let fresh;
        let other = match self.keep_others(index) {
            true => &self.others[index],
            false => {
                fresh = self.other(index);
                &fresh
            }
        };
        let shown = self.model.differences[number].from.shown(self.film, other);
        self.recorded(shown, &self.errors[index % self.errors.len()])
    }

    /// Draws those that alternatives change, up to this one; whether it is kept.
    fn keep_others(&mut self, index: usize) -> bool {
        let kept = PICTURES_KEPT / self.film.len().max(1);
        while self.others.len() <= index && self.others.len() < kept {
            let other = self.other(self.others.len());
            self.others.push(other);
        }
        index < self.others.len()
    }

    /// Each has numbers of its own: how many an alternative needs changes nothing for the next.
    fn other(&mut self, index: usize) -> Simulated {
        let mut random = self.random.clone();
        random.set_stream(1 + u64::try_from(index).unwrap_or(0));
        Simulated::new(Draw::of(self.film, self.laws, &mut random), self.film)
    }

    /// What is recorded of what is shown.
    fn recorded(&self, mut shown: Vec<Image>, error: &[Image]) -> Vec<Image> {
        add_all(&mut shown, error, 1.0);
        fill(&mut shown, &self.recording.missing);
        shown
    }

    /// Whether nine of ten recordings of the first person this far aside, in all directions, would not agree.
    fn refuses_aside(&mut self, aside_m: f64, is_agreed: &impl Fn(&Statistics) -> bool) -> bool {
        let not_agreed = (0..OF_OFFSET).filter(|index| {
            let angle = std::f64::consts::TAU * count(*index) / count(OF_OFFSET);
            let by_m = [aside_m * angle.cos(), aside_m * angle.sin()];
            let draw = self.other(*index).draw.moved(0, by_m);
            let shown = Simulated::new(draw, self.film).shows;
            let recorded = self.recorded(shown, &self.errors[*index]);
            !is_agreed(&self.model.statistics(&recorded))
        });
        count(not_agreed.count()) >= 0.9 * count(OF_OFFSET)
    }

    /// The law that lets most recordings of what is not told apart look like this one, if without it they would be half as
    /// many.
    fn too_wide(
        &mut self,
        alternatives: &[Alternatively],
        is_refused: &impl Fn(&Statistics) -> bool,
    ) -> Option<(Law, String)> {
        let untold = alternatives.iter().enumerate();
        let untold = untold.filter(|(_, one)| !one.is_told() && one.counts());
        let untold: Vec<_> = untold.take(UNTOLD_MOST).collect();
        if untold.is_empty() {
            return None;
        }
        let all = self.beyond(&untold, None, is_refused);
        let laws = open_laws(self.film, self.laws).into_iter();
        let left = laws.map(|(law, told)| (self.beyond(&untold, Some(law), is_refused), law, told));
        let (left, law, told) = left.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (left < 0.5 * all).then_some((law, told))
    }

    /// By how much recordings of these alternatives are more like the scene than this recording, if one law were known.
    fn beyond(
        &mut self,
        of: &[(usize, &Alternatively)],
        known: Option<Law>,
        is_refused: &impl Fn(&Statistics) -> bool,
    ) -> f64 {
        let mut sum = 0.0;
        for index in 0..OF_ALTERNATIVE {
            let mut draw = self.other(index).draw;
            if let Some(law) = known {
                draw = draw.knowing(law);
            }
            let other = Simulated::new(draw, self.film);
            let mut error = self.errors[index].clone();
            if known == Some(Law::Background) {
                let mean = mean(&error).map(single);
                error.iter_mut().for_each(|image| add(image, &mean, -1.0));
            }
            for (number, one) in of {
                let shown = one.of.shown(self.film, &other);
                let recorded = self.recorded(shown, &error);
                let likeness = self.model.likeness(*number, &self.model.fit(&recorded));
                if likeness > one.likeness && !is_refused(&self.model.statistics(&recorded)) {
                    sum += likeness - one.likeness;
                }
            }
        }
        sum
    }
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}
