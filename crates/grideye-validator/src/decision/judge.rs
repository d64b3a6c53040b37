//! Statistics of a recording beside a scene and its alternatives.

use crate::align::Orientation;
use crate::decision::alternative::{Alternative, PEOPLE_MOST};
use crate::decision::film::{Film, Image, add, less, turned};
use crate::decision::template::{Hiding, Template, centered};
use crate::decision::unit::Unit;
use crate::decision::world::{Drawn, later};
use crate::numbers::{count, median, single};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_scene::Laws;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// Worlds whose mean is the picture of a scene or an alternative.
const FOR_MEAN: usize = 24;
/// Delays that are tried each way, in standard deviations.
const LAGS: i32 = 3;
/// Warmth that the scene lacks or has too much is sought in stretches of this length, seconds.
const STRETCH_S: f64 = 1.0;
/// Standard deviations of noise by which an alternative differs from the scene at least.
const ALIKE: f64 = 2.0;
/// So far aside a person is still where the scene has it, meters.
const QUARTER_M: f64 = 0.25;
/// Blocks of 2 x 2 pixels, in a row and in all.
pub(crate) const ACROSS: usize = COLUMNS - 1;
pub(crate) const BLOCKS: usize = (ROWS - 1) * ACROSS;

/// Looks at recordings.
pub(crate) struct Judge {
    hiding: Hiding,
    rooms: Vec<Template>,
    /// What each person adds, or the objects, by delay.
    subjects: Vec<Vec<Template>>,
    /// By delay: how they lie to each other and to the room.
    equations: Vec<Equations>,
    pub(crate) rivals: Vec<Rival>,
    pub(crate) lags_s: Vec<f64>,
    stretches: Vec<Range<usize>>,
    room_means: Vec<Image>,
    /// By delay and subject.
    subject_means: Vec<Vec<Vec<Image>>>,
    own_share: [f64; PIXELS],
}

/// Normal equations of the subjects' contrasts.
struct Equations {
    with_room: Vec<f64>,
    products: Vec<Vec<f64>>,
}

/// Another story beside the scene's: the scene less this difference, which is as warm as one subject or as all.
pub(crate) struct Rival {
    pub(crate) what: Alternative,
    subject: Option<usize>,
    /// The room in this story.
    room: usize,
    /// By delay: the difference of what is to be recognized, and its products.
    difference: Vec<(Template, Products)>,
    /// Products of the difference of the rooms, without and with each delay.
    rooms: RoomProducts,
    /// Whether it differs from the scene by less than noise, or than a person [`QUARTER_M`] aside: a symmetric scene is the
    /// scene, however well it is known.
    pub(crate) is_alike: bool,
}

/// `W` of a difference with the scene's room, with each subject, and with the difference of the rooms.
struct Products {
    room: f64,
    subjects: Vec<f64>,
    rooms: f64,
}

#[derive(Default)]
struct RoomProducts {
    square: f64,
    room: f64,
    /// By delay.
    subjects: Vec<Vec<f64>>,
}

/// How well the scene explains a recording.
#[derive(Debug, Clone)]
struct Fit {
    lag: usize,
    contrasts: Vec<f64>,
    /// The one contrast of all that fits best.
    contrast: f64,
    explained: f64,
}

/// What a recording says of the scene.
#[derive(Debug, Clone)]
pub(crate) struct Statistics {
    /// For each person, or the objects.
    pub(crate) contrasts: Vec<f64>,
    pub(crate) lag_s: f64,
    /// What the scene leaves unexplained, in units of the recording's own noise, logarithm.
    pub(crate) misfit: f64,
    /// How much more it resembles the scene than each alternative: 1 as the scene, 0 as the alternative, less what noise
    /// may add.
    pub(crate) likeness: Vec<f64>,
    /// Warmth beyond the scene of each stretch and block, °C times the root of the pictures.
    pub(crate) beyond: Vec<f32>,
}

impl Judge {
    pub(crate) fn new(film: &mut Film, laws: &Laws, unit: &Unit, random: &mut ChaCha8Rng) -> Self {
        let hiding = Hiding::new(unit);
        // The same draws for all, with the scene's own contrast.
        let drawn: Vec<Drawn> = (0..FOR_MEAN)
            .map(|_| Drawn::of(film, laws, random).with_claimed_warmth())
            .collect();
        let step_s = laws.lag_sd_s;
        let lags = if film.has_movement() && step_s > 0.0 {
            LAGS
        } else {
            0
        };
        let lags_s: Vec<f64> = (-lags..=lags).map(|lag| step_s * f64::from(lag)).collect();
        let mut painter = Painter::new(film, &hiding, &drawn, &lags_s);
        painter.alike = painter.quarter(film).max(ALIKE);
        let rivals = Alternative::of(film, laws)
            .into_iter()
            .map(|what| painter.rival(film, what))
            .collect();
        let stretches = stretches(&film.times_s);
        let means_of = |film: &[Image]| means(&centered(film), &stretches);
        let by_subject =
            |pictures: &Vec<Vec<Image>>| pictures.iter().map(|one| means_of(one)).collect();
        Self {
            subject_means: painter.pictures.iter().map(by_subject).collect(),
            room_means: means_of(&film.room),
            own_share: hiding.own_share(film.len()),
            rooms: painter
                .rooms
                .into_iter()
                .map(|room| room.template)
                .collect(),
            subjects: painter.subjects,
            equations: painter.equations,
            hiding,
            rivals,
            lags_s,
            stretches,
        }
    }

    fn fit(&self, recording: &[Image]) -> Fit {
        let fits = (0..self.lags_s.len()).map(|lag| self.fit_at(recording, lag));
        let best = fits.reduce(|best, fit| {
            if fit.explained > best.explained {
                fit
            } else {
                best
            }
        });
        best.unwrap_or(Fit {
            lag: 0,
            contrasts: Vec::new(),
            contrast: 0.0,
            explained: 0.0,
        })
    }

    fn fit_at(&self, recording: &[Image], lag: usize) -> Fit {
        let equations = &self.equations[lag];
        let products: Vec<f64> = self
            .subjects
            .iter()
            .zip(&equations.with_room)
            .map(|(subject, with_room)| subject[lag].product(recording) - with_room)
            .collect();
        let contrasts = equations.solve(&products);
        let all = |values: &[f64]| values.iter().sum::<f64>();
        let square: f64 = equations.products.iter().map(|row| all(row)).sum();
        let explained = contrasts.iter().zip(&products);
        Fit {
            lag,
            contrast: (all(&products) + PRIOR) / (square + PRIOR),
            explained: explained
                .map(|(contrast, product)| contrast * product)
                .sum(),
            contrasts,
        }
    }

    /// `W` of a recording with a room.
    fn in_room(&self, room: usize, recording: &[Image]) -> f64 {
        let room = &self.rooms[room];
        match room.square > 0.0 {
            true => room.product(recording),
            false => 0.0,
        }
    }

    /// 1, and the projection of what the scene leaves unexplained on the difference, in its own length.
    fn likeness_at(&self, rival: &Rival, recording: &[Image], fit: &Fit, in_rooms: f64) -> f64 {
        /// Noise adds more in one of a hundred recordings.
        const NOISE_SDS: f64 = 2.326;
        let (difference, products) = &rival.difference[fit.lag];
        let s = rival
            .subject
            .map_or(fit.contrast, |subject| fit.contrasts[subject]);
        let rooms = &rival.rooms;
        let square = rooms.square + s * (2.0 * products.rooms + s * difference.square);
        if s <= 0.0 || square <= 0.0 {
            return f64::from(f32::MIN);
        }
        let shown = |with: &[f64]| -> f64 {
            let subjects = fit.contrasts.iter().zip(with);
            subjects.map(|(contrast, product)| contrast * product).sum()
        };
        let mut left =
            s * (difference.product(recording) - products.room - shown(&products.subjects));
        if rooms.square > 0.0 {
            left += in_rooms - rooms.room - shown(&rooms.subjects[fit.lag]);
        }
        1.0 + left / square - NOISE_SDS / square.sqrt()
    }

    /// How much more a recording resembles the scene than one alternative.
    pub(crate) fn likeness(&self, rival: usize, recording: &[Image]) -> f64 {
        let rival = &self.rivals[rival];
        let in_rooms = match rival.room {
            0 => 0.0,
            room => self.in_room(0, recording) - self.in_room(room, recording),
        };
        self.likeness_at(rival, recording, &self.fit(recording), in_rooms)
    }

    pub(crate) fn of(&self, recording: &[Image]) -> Statistics {
        let rooms: Vec<f64> = (0..self.rooms.len())
            .map(|room| self.in_room(room, recording))
            .collect();
        let fit = self.fit(recording);
        let room = self.rooms[0].square - 2.0 * rooms[0];
        let left = self.hiding.square(recording) + room - fit.explained;
        let noise = self.hiding.steps(recording);
        let likeness = self
            .rivals
            .iter()
            .map(|rival| self.likeness_at(rival, recording, &fit, rooms[0] - rooms[rival.room]));
        Statistics {
            lag_s: self.lag_s(recording, &fit),
            misfit: left.max(1e-9).ln() - noise.max(1e-9).ln(),
            likeness: likeness.collect(),
            beyond: self.beyond(recording, &fit),
            contrasts: fit.contrasts,
        }
    }

    /// Whether a recording shows nothing but the room and noise.
    pub(crate) fn is_empty(&self, recording: &[Image], room: &[Image]) -> bool {
        /// In standard deviations, what the scene has to be recognized.
        const SEEN_SDS: f64 = 3.0;
        /// Of what changes, beyond that of noise: its estimate may be off by as much.
        const MOVING: f64 = 0.1;
        /// Of the mean picture, in standard deviations of chi squared.
        const STILL_SDS: f64 = 5.0;
        let left: Vec<Image> = recording
            .iter()
            .zip(room)
            .map(|(seen, room)| less(seen, room))
            .collect();
        let [moving, still] = self.hiding.squares(&left);
        let degrees = count(PIXELS - 1);
        let frames = count(recording.len().saturating_sub(1).max(1));
        let is_seen = self.fit(recording).explained > SEEN_SDS * SEEN_SDS;
        !is_seen
            && moving < (1.0 + MOVING) * frames * degrees
            && still < degrees + STILL_SDS * (2.0 * degrees).sqrt()
    }

    /// The best delay, by a parabola through the best of those tried and its neighbors.
    fn lag_s(&self, recording: &[Image], best: &Fit) -> f64 {
        let middle_s = self.lags_s[best.lag];
        if best.lag == 0 || best.lag + 1 >= self.lags_s.len() {
            return middle_s;
        }
        let [before, after] =
            [best.lag - 1, best.lag + 1].map(|lag| self.fit_at(recording, lag).explained);
        let curve = before - 2.0 * best.explained + after;
        let step_s = self.lags_s[best.lag + 1] - middle_s;
        match curve < 0.0 {
            true => middle_s + step_s * (0.5 * (before - after) / curve).clamp(-0.5, 0.5),
            false => middle_s,
        }
    }

    fn beyond(&self, recording: &[Image], fit: &Fit) -> Vec<f32> {
        let mut left = means(&centered(recording), &self.stretches);
        let mut mean = [0.0_f64; PIXELS];
        let number = count(recording.len().max(1));
        for (index, (left, stretch)) in left.iter_mut().zip(&self.stretches).enumerate() {
            add(left, &self.room_means[index], -1.0);
            for (contrast, means) in fit.contrasts.iter().zip(&self.subject_means[fit.lag]) {
                add(left, &means[index], -single(*contrast));
            }
            let share = count(stretch.len()) / number;
            for (mean, left) in mean.iter_mut().zip(&*left) {
                *mean += share * f64::from(*left);
            }
        }
        let own: Image = std::array::from_fn(|pixel| single(self.own_share[pixel] * mean[pixel]));
        let mut all = Vec::with_capacity(BLOCKS * left.len());
        for (left, stretch) in left.iter().zip(&self.stretches) {
            let share = single(0.25 * count(stretch.len()).sqrt());
            let at = |pixel: usize| left[pixel] - own[pixel];
            for row in 0..ROWS - 1 {
                for column in 0..COLUMNS - 1 {
                    let first = row * COLUMNS + column;
                    let sum =
                        at(first) + at(first + 1) + at(first + COLUMNS) + at(first + COLUMNS + 1);
                    all.push(share * sum);
                }
            }
        }
        all
    }

    /// The stretch and the upper left pixel of a block, row and column.
    pub(crate) fn block(&self, index: usize) -> (Range<usize>, usize, usize) {
        let block = index % BLOCKS;
        let (row, column) = (block / ACROSS, block % ACROSS);
        (self.stretches[index / BLOCKS].clone(), row, column)
    }
}

/// Weight of the scene's own contrast against what the recording says: as if it were known to a standard deviation of 1. It
/// decides only for people whom the recording does not show.
const PRIOR: f64 = 1.0;

impl Equations {
    /// Gaussian elimination; the equations are symmetric and positive.
    fn solve(&self, products: &[f64]) -> Vec<f64> {
        let rows = self.products.iter().zip(products).enumerate();
        let mut rows: Vec<(Vec<f64>, f64)> = rows
            .map(|(place, (row, product))| {
                let mut row = row.clone();
                row[place] += PRIOR;
                (row, product + PRIOR)
            })
            .collect();
        for place in 0..rows.len() {
            let (done, below) = rows.split_at_mut(place + 1);
            let (pivot, value) = &done[place];
            for (row, below_value) in below {
                let share = row[place] / pivot[place];
                row.iter_mut()
                    .zip(pivot)
                    .for_each(|(own, pivot)| *own -= share * pivot);
                *below_value -= share * value;
            }
        }
        let mut contrasts = vec![0.0; rows.len()];
        for (place, (row, value)) in rows.iter().enumerate().rev() {
            let known = row
                .iter()
                .zip(&contrasts)
                .map(|(own, contrast)| own * contrast);
            contrasts[place] = (value - known.sum::<f64>()) / row[place];
        }
        contrasts
    }
}

/// Makes the stories' pictures: means over worlds.
struct Painter<'a> {
    hiding: &'a Hiding,
    drawn: &'a [Drawn],
    lags_s: &'a [f64],
    /// The scene's, then those of other orientations.
    rooms: Vec<Room>,
    /// All that is to be recognized.
    claimed: Vec<Image>,
    /// By delay and subject.
    pictures: Vec<Vec<Vec<Image>>>,
    /// By subject and delay.
    subjects: Vec<Vec<Template>>,
    equations: Vec<Equations>,
    /// Standard deviations by which another place, time or orientation differs from the scene at least.
    alike: f64,
}

struct Room {
    orientation: Orientation,
    pictures: Vec<Image>,
    template: Template,
}

impl<'a> Painter<'a> {
    fn new(film: &mut Film, hiding: &'a Hiding, drawn: &'a [Drawn], lags_s: &'a [f64]) -> Self {
        let mut painter = Self {
            hiding,
            drawn,
            lags_s,
            rooms: Vec::new(),
            claimed: Vec::new(),
            pictures: vec![Vec::new(); lags_s.len()],
            subjects: Vec::new(),
            equations: Vec::new(),
            alike: ALIKE,
        };
        let _ = painter.room(film, Orientation::Upright);
        painter.claimed = vec![[0.0; PIXELS]; film.len()];
        for subject in 0..film.people.len().max(1) {
            let alone = painter.mean(film, 0, |film, drawn| {
                drawn.shown(film, |_, index| index, |person, _| person != subject)
            });
            for (claimed, alone) in painter.claimed.iter_mut().zip(&alone) {
                add(claimed, alone, 1.0);
            }
            let delayed = lags_s
                .iter()
                .map(|lag_s| later(&alone, &film.times_s, *lag_s));
            let mut templates = Vec::with_capacity(lags_s.len());
            for (pictures, delayed) in painter.pictures.iter_mut().zip(delayed) {
                templates.push(hiding.template(&delayed));
                pictures.push(delayed);
            }
            painter.subjects.push(templates);
        }
        for lag in 0..lags_s.len() {
            let with = |template: &Template| -> Vec<f64> {
                painter.pictures[lag]
                    .iter()
                    .map(|pictures| template.product(pictures))
                    .collect()
            };
            let products = painter
                .subjects
                .iter()
                .map(|subject| with(&subject[lag]))
                .collect();
            painter.equations.push(Equations {
                with_room: with(&painter.rooms[0].template),
                products,
            });
        }
        painter
    }

    /// What worlds show beyond a room, in the mean.
    fn mean(
        &self,
        film: &mut Film,
        room: usize,
        shown: impl Fn(&mut Film, &Drawn) -> Vec<Image>,
    ) -> Vec<Image> {
        let mut sum = vec![[0.0; PIXELS]; film.len()];
        for drawn in self.drawn {
            let shown = shown(film, drawn);
            let beyond = shown.iter().zip(&self.rooms[room].pictures);
            for (sum, (shown, room)) in sum.iter_mut().zip(beyond) {
                add(sum, &less(shown, room), single(1.0 / count(FOR_MEAN)));
            }
        }
        sum
    }

    fn room(&mut self, film: &Film, orientation: Orientation) -> usize {
        let mut rooms = self.rooms.iter();
        rooms
            .position(|room| room.orientation == orientation)
            .unwrap_or_else(|| {
                let pictures = turned(&film.room, orientation);
                self.rooms.push(Room {
                    orientation,
                    template: self.hiding.template(&pictures),
                    pictures,
                });
                self.rooms.len() - 1
            })
    }

    /// The part of a difference that another contrast would explain.
    fn by_contrast(&self, subject: Option<usize>, difference: &Template) -> f64 {
        let pictures = &self.pictures[self.lags_s.len() / 2];
        let subjects = subject.map_or(0..pictures.len(), |subject| subject..subject + 1);
        let products = &self.equations[self.lags_s.len() / 2].products;
        let with: f64 = subjects
            .clone()
            .map(|subject| difference.product(&pictures[subject]))
            .sum();
        let square: f64 = subjects
            .clone()
            .flat_map(|one| subjects.clone().map(move |other| products[one][other]))
            .sum();
        with * with / square.max(1e-9)
    }

    /// How far a person a quarter of a meter aside is from the scene, whatever its contrast, in standard deviations: in the
    /// median over the directions, of the person for whom it is least.
    fn quarter(&self, film: &mut Film) -> f64 {
        let mut least = f64::INFINITY;
        for person in 0..film.people.len().min(PEOPLE_MOST) {
            let apart = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|way| {
                let by_m = way.map(|part| QUARTER_M * part);
                let other = self.mean(film, 0, |film, drawn| {
                    drawn.clone().moved(person, by_m).claimed(film)
                });
                let pairs = self.claimed.iter().zip(&other);
                let apart: Vec<Image> =
                    pairs.map(|(claimed, other)| less(claimed, other)).collect();
                let template = self.hiding.template(&apart);
                (template.square - self.by_contrast(Some(person), &template)).max(0.0)
            });
            let middle = median(&apart).unwrap_or(0.0).sqrt();
            if middle > 0.0 {
                least = least.min(middle);
            }
        }
        if least.is_finite() { least } else { 0.0 }
    }

    fn rival(&mut self, film: &mut Film, what: Alternative) -> Rival {
        let room = self.room(film, what.orientation());
        let other = self.mean(film, room, |film, drawn| what.shown(film, drawn));
        let pairs = self.claimed.iter().zip(&other);
        let apart: Vec<Image> = pairs.map(|(claimed, other)| less(claimed, other)).collect();
        let own = &self.rooms[0];
        let pairs = own.pictures.iter().zip(&self.rooms[room].pictures);
        let rooms_apart: Vec<Image> = pairs.map(|(own, other)| less(own, other)).collect();
        let rooms_template = self.hiding.template(&rooms_apart);
        let products = |template: &Template, pictures: &[Vec<Image>]| -> Vec<f64> {
            pictures
                .iter()
                .map(|pictures| template.product(pictures))
                .collect()
        };
        let difference: Vec<(Template, Products)> = self
            .lags_s
            .iter()
            .zip(&self.pictures)
            .map(|(lag_s, pictures)| {
                let delayed = later(&apart, &film.times_s, *lag_s);
                let template = self.hiding.template(&delayed);
                let all = Products {
                    room: template.product(&own.pictures),
                    subjects: products(&template, pictures),
                    rooms: rooms_template.product(&delayed),
                };
                (template, all)
            })
            .collect();
        let middle = &difference[self.lags_s.len() / 2];
        let square = rooms_template.square + 2.0 * middle.1.rooms + middle.0.square;
        let is_alike = match what.keeps_people() {
            true => square - self.by_contrast(what.person(), &middle.0) < self.alike * self.alike,
            false => square < ALIKE * ALIKE,
        };
        Rival {
            subject: what.person(),
            is_alike,
            room,
            rooms: RoomProducts {
                square: rooms_template.square,
                room: rooms_template.product(&own.pictures),
                subjects: self
                    .pictures
                    .iter()
                    .map(|pictures| products(&rooms_template, pictures))
                    .collect(),
            },
            difference,
            what,
        }
    }
}

fn stretches(times_s: &[f64]) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut first = 0;
    for index in 1..=times_s.len() {
        if index == times_s.len() || times_s[index] - times_s[first] >= STRETCH_S - 1e-3 {
            all.push(first..index);
            first = index;
        }
    }
    all
}

fn means(film: &[Image], stretches: &[Range<usize>]) -> Vec<Image> {
    let mean = |stretch: &Range<usize>| {
        let mut sum = [0.0; PIXELS];
        let share = single(1.0 / count(stretch.len().max(1)));
        film[stretch.clone()]
            .iter()
            .for_each(|image| add(&mut sum, image, share));
        sum
    };
    stretches.iter().map(mean).collect()
}
