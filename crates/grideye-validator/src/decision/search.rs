//! Searches time, orientation and place for what explains a recording best.

use crate::align::Orientation;
use crate::decision::film::{Film, Image, Rendered, add, less, turned};
use crate::decision::recording::Recording;
use crate::decision::template::{Hiding, Template};
use crate::numbers::{count, evenly, index, median, whole};
use grideye_frame::PIXELS;
use grideye_scene::{Scene, SceneError};

/// What is changed of a scene: the recording's image, its time, and its sensor's place, in x and y, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Changed {
    pub(super) turned: Orientation,
    pub(super) late_s: f64,
    pub(super) moved_m: [f64; 2],
}

/// Longest delay that is tried, seconds.
const DELAY_MAX_S: f64 = 10.0;
/// Farthest that the sensor is moved each way, and the steps, meters; then about the best.
const MOVE_MAX_M: f64 = 1.5;
const MOVE_STEP_M: f64 = 0.25;
const NEAR_MAX_M: f64 = 0.2;
const NEAR_STEP_M: f64 = 0.05;
/// Pictures that are looked at.
const PICTURES_MOST: usize = 150;
/// How often place and time are sought in turns.
const ROUNDS: usize = 2;

impl Changed {
    pub(super) const NONE: Self = Self {
        turned: Orientation::Upright,
        late_s: 0.0,
        moved_m: [0.0; 2],
    };

    /// Each of its changes alone.
    pub(super) fn parts(self) -> impl Iterator<Item = Self> {
        let Self {
            turned,
            late_s,
            moved_m,
        } = self;
        let alone = [
            Self {
                turned,
                ..Self::NONE
            },
            Self {
                late_s,
                ..Self::NONE
            },
            Self {
                moved_m,
                ..Self::NONE
            },
        ];
        alone.into_iter().filter(|part| *part != Self::NONE)
    }

    /// Without one of its parts.
    fn without(self, part: Self) -> Self {
        let (is_turned, is_late) = (part.turned != Orientation::Upright, part.late_s != 0.0);
        match (is_turned, is_late) {
            (true, _) => Self {
                turned: Orientation::Upright,
                ..self
            },
            (_, true) => Self {
                late_s: 0.0,
                ..self
            },
            _ => Self {
                moved_m: [0.0; 2],
                ..self
            },
        }
    }
}

/// How much of a recording a changed scene explains, at its best contrast, in squared standard deviations.
pub(super) struct Search {
    hiding: Hiding,
    /// The scene at all times that the recording may be of.
    reel: Film,
    /// The pictures of the recording that are looked at, turned back from each orientation.
    pictures: Vec<Back>,
    /// Where each is in the reel if nothing is late.
    places: Vec<f64>,
    within_s: f64,
    times_s: Vec<f64>,
    step_s: f64,
    /// Most steps of a delay.
    late_most: i32,
}

struct Back {
    from: Orientation,
    pictures: Vec<Image>,
    /// `W` of what they show beyond the room.
    square: f64,
}

impl Search {
    pub(super) fn new(
        (scene, sensor): (&Scene, &str),
        recording: &Recording,
        film: Film,
    ) -> Result<Self, SceneError> {
        let steps: Vec<f64> = recording
            .times_s
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        let chosen = evenly(recording.pictures.len(), PICTURES_MOST);
        let times_s: Vec<f64> = chosen.iter().map(|at| recording.times_s[*at]).collect();
        let pictures: Vec<Image> = chosen.iter().map(|at| recording.pictures[*at]).collect();
        let first_s = times_s.first().copied().unwrap_or_default();
        let last_s = times_s.last().copied().unwrap_or_default();
        let step_s = median(&steps).unwrap_or(0.1).max(0.05);
        let (reel_s, places, late_most) = match film.has_movement() {
            false => (times_s.clone(), (0..times_s.len()).map(count).collect(), 0),
            true => {
                let most = whole(DELAY_MAX_S / step_s);
                let from_s = first_s - f64::from(most) * step_s;
                let number = whole(((last_s - first_s) / step_s).round()) + 2 * most + 1;
                let at = |place: i32| from_s + f64::from(place) * step_s;
                let places = times_s.iter().map(|time_s| (time_s - from_s) / step_s);
                ((0..number).map(at).collect(), places.collect(), most)
            }
        };
        let within_s = recording.within_s;
        let reel = Film::after(film.into_rendered(), (scene, sensor), &reel_s, within_s)?;
        let mut search = Self {
            hiding: Hiding::new(&recording.unit),
            reel,
            pictures: Vec::new(),
            places,
            within_s,
            times_s,
            step_s,
            late_most,
        };
        let room = search.shown(0.0, [0.0; 2]).1;
        let back = Orientation::ALL.map(|from| {
            let pictures = turned(&pictures, from.inverse());
            let square = search.square_over(&pictures, &room);
            Back {
                from,
                pictures,
                square,
            }
        });
        search.pictures = Vec::from(back);
        Ok(search)
    }

    pub(super) fn into_rendered(self) -> Rendered {
        self.reel.into_rendered()
    }

    /// What the scene leaves unexplained beyond noise.
    pub(super) fn left(&self, explained: f64) -> f64 {
        let noise = count(self.times_s.len()) * count(PIXELS - 1);
        (self.pictures[0].square - noise - explained).max(1.0)
    }

    pub(super) fn explained(&mut self, changed: Changed) -> f64 {
        let (subject, room) = self.shown(changed.late_s / self.step_s, changed.moved_m);
        let back = self
            .pictures
            .iter()
            .find(|back| back.from == changed.turned);
        back.map_or(0.0, |back| {
            self.explained_of(&self.hiding.template(&subject), &room, back)
        })
    }

    /// The same as another of the scene's sensors sees it.
    pub(super) fn explained_by(&self, scene: &Scene, sensor: &str) -> Result<f64, SceneError> {
        let film = Film::new(scene, sensor, &self.times_s, self.within_s)?;
        let template = self.hiding.template(&film.claimed());
        let back = &self.pictures[0];
        let other = self.square_over(&back.pictures, &film.room);
        Ok(self.explained_of(&template, &film.room, back) + back.square - other)
    }

    /// The best change of each kind.
    pub(super) fn singles(&mut self, tried: &[(f64, Changed)]) -> Vec<(f64, Changed)> {
        let is_turned = |one: &Changed| one.turned != Orientation::Upright;
        let is_late = |one: &Changed| one.late_s != 0.0;
        let is_moved = |one: &Changed| one.moved_m != [0.0; 2];
        let kinds: [&dyn Fn(&Changed) -> bool; 3] = [&is_turned, &is_late, &is_moved];
        let best = kinds.into_iter().filter_map(|is_of_kind| {
            let alone = tried
                .iter()
                .filter(|(_, one)| is_of_kind(one) && one.parts().count() == 1);
            alone.max_by(|a, b| a.0.total_cmp(&b.0)).copied()
        });
        let best: Vec<(f64, Changed)> = best.collect();
        let nearer = best.into_iter().map(|one| {
            let one = self.nearer_in_time(one);
            match is_moved(&one.1) {
                true => self.nearer_in_place(one, NEAR_MAX_M, NEAR_STEP_M),
                false => one,
            }
        });
        nearer.collect()
    }

    /// The best of two changes or three, each of which makes it explain `clearly` times as much; `None` if it is fewer.
    pub(super) fn together(
        &mut self,
        tried: &[(f64, Changed)],
        clearly: f64,
    ) -> Option<(f64, Changed)> {
        let mut best = *tried.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        for _ in 0..ROUNDS {
            best = self.nearer_in_place(best, MOVE_MAX_M, MOVE_STEP_M);
            best = self.nearer_in_place(best, NEAR_MAX_M, NEAR_STEP_M);
            for late in -self.late_most..=self.late_most {
                let late_s = f64::from(late) * self.step_s;
                best = self.better(best, Changed { late_s, ..best.1 });
            }
        }
        best = self.nearer_in_time(best);
        for part in best.1.parts() {
            let without = best.1.without(part);
            let explained = self.explained(without);
            if best.0 < clearly * explained {
                best = (explained, without);
            }
        }
        (best.1.parts().count() > 1).then_some(best)
    }

    /// Every delay, and every place, in every orientation.
    pub(super) fn tried(&mut self) -> Vec<(f64, Changed)> {
        let delays = -self.late_most..=self.late_most;
        let delays = delays.map(|late| (f64::from(late) * self.step_s, [0.0; 2]));
        let places = self.around([0.0; 2], MOVE_MAX_M, MOVE_STEP_M).into_iter();
        let both: Vec<_> = delays.chain(places.map(|moved_m| (0.0, moved_m))).collect();
        let mut all = Vec::new();
        for (late_s, moved_m) in both {
            let (subject, room) = self.shown(late_s / self.step_s, moved_m);
            let template = self.hiding.template(&subject);
            all.extend(self.pictures.iter().map(|back| {
                let turned = back.from;
                let changed = Changed {
                    turned,
                    late_s,
                    moved_m,
                };
                (self.explained_of(&template, &room, back), changed)
            }));
        }
        all
    }

    fn better(&mut self, best: (f64, Changed), changed: Changed) -> (f64, Changed) {
        let explained = self.explained(changed);
        if explained > best.0 {
            (explained, changed)
        } else {
            best
        }
    }

    fn nearer_in_place(
        &mut self,
        best: (f64, Changed),
        most_m: f64,
        step_m: f64,
    ) -> (f64, Changed) {
        let middle_m = match most_m < MOVE_MAX_M {
            true => best.1.moved_m,
            false => [0.0; 2],
        };
        let around = self.around(middle_m, most_m, step_m).into_iter();
        let start = best;
        around.fold(best, |best, moved_m| {
            self.better(best, Changed { moved_m, ..start.1 })
        })
    }

    /// Between steps, by a parabola.
    fn nearer_in_time(&mut self, (explained, changed): (f64, Changed)) -> (f64, Changed) {
        let step_s = self.step_s;
        if changed.late_s == 0.0 {
            return (explained, changed);
        }
        let [before, after] = [-step_s, step_s].map(|by_s| {
            let late_s = changed.late_s + by_s;
            self.explained(Changed { late_s, ..changed })
        });
        let curve = before - 2.0 * explained + after;
        let aside = match curve < 0.0 {
            true => (0.5 * (before - after) / curve).clamp(-0.5, 0.5),
            false => 0.0,
        };
        let late_s = changed.late_s + aside * step_s;
        (explained, Changed { late_s, ..changed })
    }

    fn around(&self, middle_m: [f64; 2], most_m: f64, step_m: f64) -> Vec<[f64; 2]> {
        if self.reel.people.is_empty() {
            return Vec::new();
        }
        let steps = whole((most_m / step_m).round());
        let at = |x: i32, y: i32| {
            let by_m = [f64::from(x), f64::from(y)].map(|by| step_m * by);
            [middle_m[0] + by_m[0], middle_m[1] + by_m[1]]
        };
        (-steps..=steps)
            .flat_map(|x| (-steps..=steps).map(move |y| (x, y)))
            .map(|(x, y)| at(x, y))
            .collect()
    }

    /// Subjects and room of each picture, so many steps late; a sensor that moves is the people moved the other way.
    fn shown(&mut self, late: f64, moved_m: [f64; 2]) -> (Vec<Image>, Vec<Image>) {
        let Film {
            room,
            objects,
            people,
            ..
        } = &mut self.reel;
        let last = count(room.len().saturating_sub(1));
        let picture = |place: &f64| {
            let source = index((place - late).round().clamp(0.0, last));
            let mut subject = objects
                .as_ref()
                .map_or([0.0; PIXELS], |objects| objects[source]);
            for walker in people.iter_mut() {
                add(
                    &mut subject,
                    &walker.aside(source, moved_m.map(|by_m| -by_m)),
                    1.0,
                );
            }
            (subject, room[source])
        };
        self.places.iter().map(picture).unzip()
    }

    fn explained_of(&self, template: &Template, room: &[Image], back: &Back) -> f64 {
        let product = template.product(&back.pictures) - template.product(room);
        let explained = product.max(0.0).powi(2) / template.square.max(1.0);
        // What is warm in the room lies otherwise too.
        explained + self.pictures[0].square - back.square
    }

    fn square_over(&self, pictures: &[Image], room: &[Image]) -> f64 {
        let beyond = pictures
            .iter()
            .zip(room)
            .map(|(seen, room)| less(seen, room));
        self.hiding.square(&beyond.collect::<Vec<Image>>())
    }
}
