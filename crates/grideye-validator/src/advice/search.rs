//! Tries every single change of scene or recording, and in every orientation, for what explains a recording best.

use crate::advice::change::{Change, Compared, DELAY_MAX_S, Kind, ROWS, Row, WITHIN_PEOPLE};
use crate::align::Orientation;
use crate::constants::OBJECTS_SD;
use crate::decision::template::{NoiseModel, centered};
use crate::decision::view::{
    Image, Rendered, View, add, each_less, image, less, levels_c, moment, turned,
};
use crate::numbers::{count, evenly, index, median, single, whole};
use grideye_frame::PIXELS;
use grideye_scene::{Scene, SceneError, Simulator};

/// Pictures that are looked at.
const PICTURES_MOST: usize = 40;
/// How often steps are halved about the best.
const ROUNDS: i32 = 2;
/// Standard deviations of a law within which what a scene leaves open is free.
const FREE_SDS: f64 = 2.6;
/// Steps by which people's places are sought within their laws, meters.
const WITHIN_STEP_M: f64 = 0.1;
/// Standard deviations of the level that its limit is.
const LEVEL_SDS: f64 = 2.576;
/// Somebody more is sought at places this far apart, and this far from the middle of the people, meters.
const MORE_STEP_M: f64 = 0.3;
const MORE_MAX_M: f64 = 1.8;
/// What somebody more must explain of a picture to be there, or to be elsewhere than in the one before, in squared standard
/// deviations: among so many places noise alone may explain as much.
const MORE_COST: f64 = 12.0;

/// A change that was tried, in an orientation.
#[derive(Clone, Copy)]
pub(super) struct Tried {
    pub(super) turned: Orientation,
    pub(super) change: Change,
    /// What it leaves unexplained, in squared standard deviations.
    pub(super) left: f64,
    /// How much warmer the recording is than the changed scene, °C.
    pub(super) level_c: f64,
}

/// What a changed scene shows at the pictures that are looked at.
#[derive(Clone)]
struct Shown {
    room: Vec<Image>,
    subject: Vec<Image>,
    /// What its freedom costs.
    cost: f64,
    /// Where somebody more is longest, meters.
    more_at_m: Option<[f64; 2]>,
}

impl Shown {
    fn free((room, subject): (Vec<Image>, Vec<Image>)) -> Self {
        Self {
            room,
            subject,
            cost: 0.0,
            more_at_m: None,
        }
    }
}

pub(super) struct Search<'a> {
    compared: &'a Compared<'a>,
    noise: NoiseModel,
    /// The scene as it is, with people within their laws.
    pub(super) own: Tried,
    /// What was rendered last.
    last: Option<(Change, Shown)>,
    /// The scene at all times that the recording may be of.
    reel: View,
    times_s: Vec<f64>,
    /// Where each is in the reel if nothing is late.
    places: Vec<f64>,
    step_s: f64,
    /// The pictures of the recording that are looked at, turned back from each orientation.
    pictures: Vec<(Orientation, Vec<Image>)>,
    pub(super) tried: Vec<Tried>,
}

impl<'a> Search<'a> {
    /// Tries all changes of all rows.
    pub(super) fn new(compared: &'a Compared<'a>, view: View) -> Result<Self, SceneError> {
        let recording = compared.recording;
        let pairs = recording.times_s.windows(2);
        let steps: Vec<f64> = pairs.map(|pair| pair[1] - pair[0]).collect();
        let chosen = evenly(recording.pictures.len(), PICTURES_MOST);
        let times_s: Vec<f64> = chosen.iter().map(|at| recording.times_s[*at]).collect();
        let pictures: Vec<Image> = chosen.iter().map(|at| recording.pictures[*at]).collect();
        let first_s = times_s.first().copied().unwrap_or_default();
        let last_s = times_s.last().copied().unwrap_or_default();
        let step_s = median(&steps).unwrap_or(0.1).clamp(0.1, 1.0);
        let (reel_s, places) = match view.has_movement() {
            false => (times_s.clone(), (0..times_s.len()).map(count).collect()),
            true => {
                let from_s = first_s - DELAY_MAX_S;
                let number = whole(((last_s - first_s + 2.0 * DELAY_MAX_S) / step_s).ceil());
                let at = |place: i32| from_s + f64::from(place) * step_s;
                let places = times_s.iter().map(|time_s| (time_s - from_s) / step_s);
                ((0..=number).map(at).collect(), places.collect())
            }
        };
        let of = (compared.scene, compared.sensor);
        let reel = View::after(view.into_rendered(), of, &reel_s, recording.within_s)?;
        let mut search = Self {
            compared,
            own: Tried {
                turned: Orientation::Upright,
                change: Change::NONE,
                left: 0.0,
                level_c: 0.0,
            },
            last: None,
            noise: NoiseModel::new(&recording.unit),
            reel,
            times_s,
            places,
            step_s,
            pictures: Orientation::ALL
                .map(|from| (from, turned(&pictures, from.inverse())))
                .into(),
            tried: Vec::new(),
        };
        let none = search.best_of(vec![Change::NONE], Orientation::Upright)?;
        search.own = search.within_laws(none)?.unwrap_or(search.own);
        for row in ROWS {
            for of in 0..(row.number)(compared, &search.reel) {
                let mut changes = row.changes(compared, of, search.step_s);
                if row.counts_people() {
                    let within_m = search.own.change.within_m;
                    changes.iter_mut().for_each(|one| one.within_m = within_m);
                }
                let best = search.best_of(changes, Orientation::Upright)?;
                let best = search.nearer(&row.axes(), best)?;
                let _ = search.within_laws(best)?;
            }
        }
        Ok(search)
    }

    pub(super) fn into_rendered(self) -> Rendered {
        self.reel.into_rendered()
    }

    /// Squared standard deviations of noise alone.
    pub(super) fn noise(&self) -> f64 {
        count(self.times_s.len()) * count(PIXELS - 1)
    }

    /// Two changes nearer to the best of their kinds.
    pub(super) fn halved(&mut self, two: Tried) -> Result<Tried, SceneError> {
        let axes = Row::of(two.change.kind).map(Row::axes).unwrap_or_default();
        let best = self.nearer(&axes, Some(two))?;
        Ok(self.within_laws(best)?.unwrap_or(two))
    }

    /// With people where the recording has them, within their laws: what these leave open is no mistake.
    fn within_laws(&mut self, best: Option<Tried>) -> Result<Option<Tried>, SceneError> {
        let people = self.reel.people.len().min(WITHIN_PEOPLE);
        let axes: Vec<_> = (2..2 + 2 * people)
            .map(|axis| (axis, WITHIN_STEP_M))
            .collect();
        self.nearer(&axes, best)
    }

    /// Halves the steps along these axes of a change about the best.
    fn nearer(
        &mut self,
        axes: &[(usize, f64)],
        best: Option<Tried>,
    ) -> Result<Option<Tried>, SceneError> {
        let Some(mut best) = best else {
            return Ok(None);
        };
        for round in 0..ROUNDS {
            for &(axis, step) in axes {
                let step = step * (-f64::from(round)).exp2();
                let by = |sign: f64| best.change.further(axis, sign * step);
                let sides = [self.at(by(-1.0), best)?, self.at(by(1.0), best)?];
                let [before, after] = sides.map(|side| side.map_or(f64::MAX, |one| one.left));
                let curve = before - 2.0 * best.left + after;
                let vertex = match curve > 0.0 {
                    true => (0.5 * (before - after) / curve).clamp(-2.0, 2.0),
                    false => 2.0 * (before - after).signum(),
                };
                let vertex = self.at(by(vertex), best)?;
                let all = sides.into_iter().chain([vertex]).flatten();
                best = all.fold(
                    best,
                    |best, one| if one.left < best.left { one } else { best },
                );
            }
        }
        Ok(Some(best))
    }

    fn at(&mut self, change: Change, like: Tried) -> Result<Option<Tried>, SceneError> {
        self.best_of(vec![change], like.turned)
    }

    fn best_of(
        &mut self,
        changes: Vec<Change>,
        turned: Orientation,
    ) -> Result<Option<Tried>, SceneError> {
        let before = self.tried.len();
        for change in changes {
            self.try_out(change)?;
        }
        let of = self.tried[before..]
            .iter()
            .filter(|one| one.turned == turned);
        Ok(of.min_by(|a, b| a.left.total_cmp(&b.left)).copied())
    }

    /// A change in all orientations.
    fn try_out(&mut self, mut change: Change) -> Result<(), SceneError> {
        let Some(shown) = self.shown(&change)? else {
            return Ok(());
        };
        change.by = shown.more_at_m.unwrap_or(change.by);
        let sd = self.compared.laws.agents.first();
        let sd = sd.map_or(OBJECTS_SD, |law| law.contrast_sd).max(0.05);
        let [low, high] = [-FREE_SDS, FREE_SDS].map(|sds| (sds * sd).exp());
        let (known, subject) = (1.0 / (sd * sd), self.noise.template(&shown.subject));
        let (scale, more_c) = change.unit();
        for (turned, pictures) in &self.pictures {
            let seen = pictures
                .iter()
                .zip(&shown.room)
                .map(|(seen, room)| less(&seen.map(|value| scale * value + more_c), room));
            let mut beyond: Vec<Image> = seen.collect();
            let product = subject.product(&beyond);
            let times = ((product + known) / (subject.square + known)).clamp(low, high);
            let mut left = self.noise.square(&beyond) + shown.cost + known * (times - 1.0).powi(2);
            left -= times * (2.0 * product - times * subject.square);
            for (beyond, subject) in beyond.iter_mut().zip(&shown.subject) {
                add(beyond, subject, -single(times));
            }
            // Noise is of the same unit.
            left /= f64::from(scale * scale);
            let level_c = median(&levels_c(&beyond)).unwrap_or(0.0);
            left += (LEVEL_SDS * level_c / self.compared.level_max_c).powi(2);
            self.tried.push(Tried {
                turned: *turned,
                change,
                left,
                level_c,
            });
        }
        Ok(())
    }

    /// `None` of what cannot be.
    fn shown(&mut self, change: &Change) -> Result<Option<Shown>, SceneError> {
        let late = if change.kind == Kind::Late {
            change.by[0] / self.step_s
        } else {
            0.0
        };
        if change.is_of_people() {
            let mut shown = Shown::free(self.reeled(late, change));
            if change.kind == Kind::More {
                self.with_more(&mut shown);
            }
            return Ok(Some(shown));
        }
        let bare = Change {
            within_m: Change::NONE.within_m,
            ..*change
        };
        if self.last.as_ref().is_none_or(|(last, _)| *last != bare) {
            let Some((scene, sensor)) = change.applied(self.compared.scene, self.compared.sensor)
            else {
                return Ok(None);
            };
            let first_s = self.times_s.first().copied().unwrap_or_default();
            let times_s = self.times_s.iter();
            let times_s = times_s.map(|time_s| first_s + change.rate() * (time_s - first_s));
            let simulator = Simulator::new(&scene, &sensor)?;
            let shown = rendered(&scene, &simulator, &times_s.collect::<Vec<f64>>());
            self.last = Some((bare, Shown::free(shown)));
        }
        let mut shown = self.last.as_ref().map(|(_, shown)| shown.clone());
        if *change != bare {
            // As much as in the scene as it is.
            let of = |within_m| Change {
                within_m,
                ..Change::NONE
            };
            let [with, without] = [change, &bare].map(|one| self.reeled(0.0, &of(one.within_m)).1);
            let subjects = shown.iter_mut().flat_map(|shown| &mut shown.subject);
            for (subject, (with, without)) in subjects.zip(with.iter().zip(&without)) {
                add(subject, &less(with, without), 1.0);
            }
        }
        Ok(shown)
    }

    /// Room and subjects of each picture from the reel, so many steps late, with one person changed.
    fn reeled(&mut self, late: f64, change: &Change) -> (Vec<Image>, Vec<Image>) {
        let View {
            room,
            objects,
            people,
            ..
        } = &mut self.reel;
        let last = count(room.len().saturating_sub(1));
        let picture = |place: &f64| {
            let place = (place - late).clamp(0.0, last);
            let (mut empty, mut subject) = ([0.0; PIXELS], [0.0; PIXELS]);
            let part = single(place.fract());
            for (source, share) in [(place.floor(), 1.0 - part), (place.ceil(), part)] {
                if share < 1e-3 {
                    continue;
                }
                let source = index(source);
                add(&mut empty, &room[source], share);
                if let Some(objects) = objects {
                    add(
                        &mut subject,
                        &objects[source],
                        share * change.contrast_of(0),
                    );
                }
                for (number, walker) in people.iter_mut().enumerate() {
                    let adds = walker.aside(source, change.aside_of(number));
                    add(&mut subject, &adds, share * change.contrast_of(number));
                }
            }
            (empty, subject)
        };
        self.places.iter().map(picture).unzip()
    }

    /// Somebody like the first person, who goes where the rest of each picture is warm.
    fn with_more(&mut self, shown: &mut Shown) {
        let Some(walker) = self.reel.people.first() else {
            return;
        };
        let places = walker.places.iter();
        let (x, y): (Vec<f64>, Vec<f64>) = places.map(|place| (place.0, place.1)).unzip();
        let middle_m = [x, y].map(|all| median(&all).unwrap_or(0.0));
        let rest = each_less(&self.pictures[0].1, &shown.room);
        let rest = each_less(&rest, &shown.subject);
        let (places_m, looks) = self.looks(middle_m, MORE_MAX_M, MORE_STEP_M);
        let path = path(&self.gains(&rest, &looks), MORE_COST);
        let moves = path.windows(2).filter(|pair| pair[0] != pair[1]).count();
        shown.cost = MORE_COST * count(1 + moves);
        let at = |place: usize| path.iter().filter(move |look| **look == place);
        let longest = (0..places_m.len()).max_by_key(|place| at(place + 1).count());
        if let Some(longest) = longest.filter(|longest| at(longest + 1).next().is_some()) {
            let there = rest
                .iter()
                .zip(&path)
                .filter(|(_, look)| **look == longest + 1);
            let there: Vec<Image> = there.map(|(rest, _)| *rest).collect();
            shown.more_at_m = self.nearest(places_m[longest], &there);
        }
        let more: Vec<Image> = path.into_iter().map(|look| looks[look]).collect();
        let template = self.noise.template(&more);
        let times = template.product(&rest) / template.square.max(1.0);
        for (room, more) in shown.room.iter_mut().zip(&more) {
            add(room, more, single(times.clamp(0.4, 2.5)));
        }
    }

    /// The places of the room around one, and what the first person shows: nowhere, then at each.
    fn looks(
        &mut self,
        middle_m: [f64; 2],
        most_m: f64,
        step_m: f64,
    ) -> (Vec<[f64; 2]>, Vec<Image>) {
        let steps = whole(most_m / step_m);
        let all = (-steps..=steps).flat_map(|x| (-steps..=steps).map(move |y| [x, y]));
        let at = |[x, y]: [i32; 2]| {
            let [by_x, by_y] = [x, y].map(|step| step_m * f64::from(step));
            [middle_m[0] + by_x, middle_m[1] + by_y]
        };
        let size_m = self.compared.scene.room().size_m;
        let is_inside =
            |[x, y]: &[f64; 2]| (0.0..size_m.x).contains(x) && (0.0..size_m.y).contains(y);
        let places_m: Vec<[f64; 2]> = all.map(at).filter(is_inside).collect();
        let walker = &mut self.reel.people[0];
        let shown = places_m.iter().map(|place_m| walker.standing(*place_m, 0));
        let looks = std::iter::once([0.0; PIXELS]).chain(shown).collect();
        (places_m, looks)
    }

    /// The place near this one, to a tenth of a meter, that explains most of these pictures.
    fn nearest(&mut self, place_m: [f64; 2], rest: &[Image]) -> Option<[f64; 2]> {
        let tenth = place_m.map(|m| (10.0 * m).round() / 10.0);
        let (places_m, looks) = self.looks(tenth, 0.25, 0.1);
        let gains = self.gains(rest, &looks);
        let sum = |place: usize| gains.iter().map(|gains| gains[place + 1]).sum::<f64>();
        let best = (0..places_m.len()).max_by(|a, b| sum(*a).total_cmp(&sum(*b)));
        best.map(|best| places_m[best])
    }

    /// What each look explains of each picture, in squared standard deviations.
    fn gains(&self, pictures: &[Image], looks: &[Image]) -> Vec<Vec<f64>> {
        let unit = &self.compared.recording.unit;
        let constant_c2 = unit.constant_c2();
        let weights: Image = std::array::from_fn(|pixel| {
            1.0 / (unit.noise_c[pixel].powi(2) + single(constant_c2[pixel]))
        });
        let looks = centered(looks);
        let gain = |(look, seen): (&Image, &Image)| {
            let pixels = look.iter().zip(seen).zip(&weights);
            let sum: f32 = pixels
                .map(|((look, seen), weight)| weight * look * (2.0 * seen - look))
                .sum();
            f64::from(sum)
        };
        let of = |seen: &Image| looks.iter().map(|look| gain((look, seen))).collect();
        centered(pictures).iter().map(of).collect()
    }
}

/// The place of each picture that gains most, if each move costs this much (Viterbi 1967).
fn path(gains: &[Vec<f64>], move_cost: f64) -> Vec<usize> {
    let best = |sums: &[f64]| {
        (0..sums.len())
            .max_by(|a, b| sums[*a].total_cmp(&sums[*b]))
            .unwrap_or(0)
    };
    let mut sums = vec![0.0; gains.first().map_or(0, Vec::len)];
    let mut from = Vec::with_capacity(gains.len());
    for gains in gains {
        let top = best(&sums);
        let limit = sums.get(top).map_or(0.0, |top| top - move_cost);
        let before: Vec<usize> = (0..sums.len())
            .map(|place| if sums[place] < limit { top } else { place })
            .collect();
        sums = before
            .iter()
            .zip(gains)
            .zip(0..)
            .map(|((before, gain), place): ((&usize, &f64), usize)| {
                sums[*before] - if *before == place { 0.0 } else { move_cost } + gain
            })
            .collect();
        from.push(before);
    }
    let mut place = best(&sums);
    let mut path = vec![place; gains.len()];
    for (index, before) in from.iter().enumerate().rev() {
        path[index] = place;
        place = before[place];
    }
    path
}

/// Room and subjects of a scene at these times.
fn rendered(scene: &Scene, simulator: &Simulator, times_s: &[f64]) -> (Vec<Image>, Vec<Image>) {
    let empty = |time_s: f64| image(&simulator.without_agents(moment(time_s)).celsius);
    let room: Vec<Image> = match scene.without_agents().is_static() {
        true => vec![empty(0.0); times_s.len()],
        false => times_s.iter().map(|time_s| empty(*time_s)).collect(),
    };
    if scene.agents().is_empty() {
        return (vec![[0.0; PIXELS]; times_s.len()], room);
    }
    let all = times_s.iter();
    let all = all.map(|time_s| image(&simulator.image(moment(*time_s)).celsius));
    let subject = each_less(&all.collect::<Vec<Image>>(), &room);
    (room, subject)
}
