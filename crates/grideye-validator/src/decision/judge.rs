//! Statistics of a recording beside a scene and its alternatives.

use crate::align::Orientation;
use crate::decision::alternative::Alternative;
use crate::decision::film::{Film, Image, add, less, turned};
use grideye_scene::Laws;
use crate::decision::template::{Hiding, Template, centered};
use crate::decision::unit::Unit;
use crate::decision::world::{Drawn, later};
use crate::numbers::count;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// Worlds whose mean is the picture of a scene or an alternative.
const FOR_MEAN: usize = 24;
/// Delays that are tried each way, in standard deviations.
const LAGS: i32 = 3;
/// Warmth that the scene lacks or has too much is sought in stretches of this length, seconds.
const STRETCH_S: f64 = 1.0;
/// Blocks of 2 x 2 pixels.
const BLOCKS: usize = (ROWS - 1) * (COLUMNS - 1);

/// Looks at recordings.
pub(crate) struct Judge {
    hiding: Hiding,
    rooms: Vec<Template>,
    scene: Story,
    /// `W` of the scene's room with its subject, by delay.
    with_room: Vec<f64>,
    pub(crate) rivals: Vec<Rival>,
    pub(crate) lags_s: Vec<f64>,
    stretches: Vec<Range<usize>>,
    room_means: Vec<Image>,
    /// By delay.
    scene_means: Vec<Vec<Image>>,
    own_share: [f64; PIXELS],
}

/// What a recording should show: a room, and what is to be recognized in it, as warm as it turns out.
struct Story {
    room: usize,
    /// What is to be recognized, by delay.
    subject: Vec<Template>,
}

/// Another story beside the scene's, for a likelihood ratio that depends on the contrast `s`.
pub(crate) struct Rival {
    pub(crate) what: Alternative,
    story: Story,
    /// By delay: `W` of the middle between both with their difference, and of the difference with itself, as
    /// polynomials of `s`.
    middle: Vec<[f64; 3]>,
    difference: Vec<[f64; 3]>,
    /// How far it is from the scene without noise, in standard deviations.
    pub(crate) apart: f64,
}

/// How well the scene explains a recording.
#[derive(Debug, Clone, Copy)]
struct Fit {
    lag: usize,
    contrast: f64,
    /// `W` of the recording with the subject at this delay.
    product: f64,
    explained: f64,
}

/// What a recording says of the scene.
#[derive(Debug, Clone)]
pub(crate) struct Statistics {
    pub(crate) contrast: f64,
    pub(crate) lag_s: f64,
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
            .map(|_| Drawn::of(film, laws, random).as_warm_as_claimed())
            .collect();
        let step_s = laws.lag_sd_s;
        let lags = if film.has_movement() && step_s > 0.0 { LAGS } else { 0 };
        let lags_s: Vec<f64> = (-lags..=lags).map(|lag| step_s * f64::from(lag)).collect();
        let mut painter = Painter {
            hiding: &hiding,
            drawn,
            lags_s: &lags_s,
            rooms: Vec::new(),
        };
        let (scene, subjects) = painter.story(film, None);
        let mut rivals = Vec::new();
        for what in Alternative::of(film, laws) {
            let (story, pictures) = painter.story(film, Some(&what));
            rivals.push(painter.rival(what, story, &pictures, (&scene, &subjects)));
        }
        let stretches = stretches(&film.times_s);
        let means_of = |film: &[Image]| means(&centered(film), &stretches);
        let rooms = painter.rooms.into_iter().map(|room| room.template).collect();
        let with_room = scene.subject.iter().map(|subject| subject.product(&film.room));
        Self {
            with_room: with_room.collect(),
            room_means: means_of(&film.room),
            scene_means: subjects.iter().map(|subject| means_of(subject)).collect(),
            own_share: hiding.own_share(film.len()),
            hiding,
            rooms,
            scene,
            rivals,
            lags_s,
            stretches,
        }
    }

    fn fit(&self, recording: &[Image]) -> Fit {
        let mut best = Fit {
            lag: self.lags_s.len() / 2,
            contrast: 0.0,
            product: 0.0,
            explained: f64::NEG_INFINITY,
        };
        for lag in 0..self.scene.subject.len() {
            let fit = self.fit_at(recording, lag);
            if fit.explained > best.explained {
                best = fit;
            }
        }
        best
    }

    fn fit_at(&self, recording: &[Image], lag: usize) -> Fit {
        let (subject, with_room) = (&self.scene.subject[lag], self.with_room[lag]);
        let product = subject.product(recording);
        let square = subject.square.max(1e-9);
        Fit {
            lag,
            contrast: (product - with_room) / square,
            product,
            explained: (product - with_room).max(0.0).powi(2) / square,
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

    fn likeness_at(&self, rival: &Rival, recording: &[Image], fit: Fit, in_rooms: f64) -> f64 {
        /// Noise adds more in one of a hundred recordings.
        const NOISE_SDS: f64 = 2.326;
        let s = fit.contrast;
        let polynomial = |[a, b, c]: [f64; 3]| a + s * (b + s * c);
        let square = polynomial(rival.difference[fit.lag]);
        if s <= 0.0 || square <= 0.0 {
            return f64::from(f32::MIN);
        }
        let other = rival.story.subject[fit.lag].product(recording);
        let product = in_rooms + s * (fit.product - other);
        let likeness = 0.5 + (product - polynomial(rival.middle[fit.lag])) / square;
        likeness - NOISE_SDS / square.sqrt()
    }

    /// How much more a recording resembles the scene than one alternative.
    pub(crate) fn likeness(&self, rival: usize, recording: &[Image]) -> f64 {
        let rival = &self.rivals[rival];
        let in_rooms = match rival.story.room == self.scene.room {
            true => 0.0,
            false => {
                self.in_room(self.scene.room, recording) - self.in_room(rival.story.room, recording)
            }
        };
        self.likeness_at(rival, recording, self.fit(recording), in_rooms)
    }

    pub(crate) fn of(&self, recording: &[Image]) -> Statistics {
        let rooms: Vec<f64> = (0..self.rooms.len())
            .map(|room| self.in_room(room, recording))
            .collect();
        let fit = self.fit(recording);
        let own = rooms[self.scene.room];
        let room = self.rooms[self.scene.room].square - 2.0 * own;
        let left = self.hiding.square(recording) + room - fit.explained;
        let likeness = self.rivals.iter().map(|rival| {
            self.likeness_at(rival, recording, fit, own - rooms[rival.story.room])
        });
        Statistics {
            contrast: fit.contrast,
            lag_s: self.lag_s(recording, fit),
            misfit: left.max(1e-9).ln(),
            likeness: likeness.collect(),
            beyond: self.beyond(recording, fit.lag, fit.contrast),
        }
    }

    /// The best delay, by a parabola through the best of those tried and its neighbors.
    fn lag_s(&self, recording: &[Image], best: Fit) -> f64 {
        let middle_s = self.lags_s[best.lag];
        if best.lag == 0 || best.lag + 1 >= self.lags_s.len() {
            return middle_s;
        }
        let [before, after] = [best.lag - 1, best.lag + 1].map(|lag| self.fit_at(recording, lag).explained);
        let curve = before - 2.0 * best.explained + after;
        let step_s = self.lags_s[best.lag + 1] - middle_s;
        match curve < 0.0 {
            true => middle_s + step_s * (0.5 * (before - after) / curve).clamp(-0.5, 0.5),
            false => middle_s,
        }
    }

    fn beyond(&self, recording: &[Image], lag: usize, contrast: f64) -> Vec<f32> {
        let mut left = means(&centered(recording), &self.stretches);
        let mut mean = [0.0_f64; PIXELS];
        let number = count(recording.len().max(1));
        let claims = self.room_means.iter().zip(&self.scene_means[lag]);
        for ((left, (room, subject)), stretch) in left.iter_mut().zip(claims).zip(&self.stretches) {
            for pixel in 0..PIXELS {
                left[pixel] -= room[pixel] + contrast as f32 * subject[pixel];
                mean[pixel] += f64::from(left[pixel]) * count(stretch.len()) / number;
            }
        }
        let own: Image = std::array::from_fn(|pixel| (self.own_share[pixel] * mean[pixel]) as f32);
        let mut all = Vec::with_capacity(BLOCKS * left.len());
        for (left, stretch) in left.iter().zip(&self.stretches) {
            let share = 0.25 * count(stretch.len()).sqrt() as f32;
            let at = |pixel: usize| left[pixel] - own[pixel];
            for row in 0..ROWS - 1 {
                for column in 0..COLUMNS - 1 {
                    let first = row * COLUMNS + column;
                    let sum = at(first) + at(first + 1) + at(first + COLUMNS) + at(first + COLUMNS + 1);
                    all.push(share * sum);
                }
            }
        }
        all
    }

    /// The stretch and the upper left pixel of a block, row and column.
    pub(crate) fn block(&self, index: usize) -> (Range<usize>, usize, usize) {
        let block = index % BLOCKS;
        let (row, column) = (block / (COLUMNS - 1), block % (COLUMNS - 1));
        (self.stretches[index / BLOCKS].clone(), row, column)
    }
}

/// Makes the stories' pictures: means over worlds.
struct Painter<'a> {
    hiding: &'a Hiding,
    drawn: Vec<Drawn>,
    lags_s: &'a [f64],
    rooms: Vec<Room>,
}

struct Room {
    orientation: Orientation,
    pictures: Vec<Image>,
    template: Template,
}

impl Painter<'_> {
    fn room(&mut self, film: &Film, orientation: Orientation) -> usize {
        let mut rooms = self.rooms.iter();
        rooms.position(|room| room.orientation == orientation).unwrap_or_else(|| {
            let pictures = turned(&film.room, orientation);
            self.rooms.push(Room {
                orientation,
                template: self.hiding.template(&pictures),
                pictures,
            });
            self.rooms.len() - 1
        })
    }

    /// A story, and the pictures of what is to be recognized by delay.
    fn story(&mut self, film: &mut Film, what: Option<&Alternative>) -> (Story, Vec<Vec<Image>>) {
        let orientation = what.map_or(Orientation::Upright, Alternative::orientation);
        let room = self.room(film, orientation);
        let seen = &self.rooms[room].pictures;
        let mut sum = vec![[0.0; PIXELS]; film.len()];
        for drawn in &self.drawn {
            let shown = match what {
                None => drawn.as_claimed(film),
                Some(what) => what.shown(film, drawn),
            };
            for (sum, (shown, room)) in sum.iter_mut().zip(shown.iter().zip(seen)) {
                add(sum, &less(shown, room), 1.0 / FOR_MEAN as f32);
            }
        }
        let delayed = self.lags_s.iter();
        let pictures: Vec<Vec<Image>> = delayed
            .map(|lag_s| later(&sum, &film.times_s, *lag_s))
            .collect();
        let templates = pictures.iter().map(|pictures| self.hiding.template(pictures));
        let subject = templates.collect();
        (Story { room, subject }, pictures)
    }

    fn rival(
        &self,
        what: Alternative,
        story: Story,
        pictures: &[Vec<Image>],
        (scene, subjects): (&Story, &[Vec<Image>]),
    ) -> Rival {
        let [a, b] = [scene.room, story.room].map(|room| &self.rooms[room]);
        let (aa, bb, ab) = (
            a.template.square,
            b.template.square,
            a.template.product(&b.pictures),
        );
        let mut middle = Vec::new();
        let mut difference = Vec::new();
        for (lag, (one, other)) in scene.subject.iter().zip(&story.subject).enumerate() {
            let with = |room: &Room, subject: &Vec<Image>| room.template.product(subject);
            let (a_one, a_other) = (with(a, &subjects[lag]), with(a, &pictures[lag]));
            let (b_one, b_other) = (with(b, &subjects[lag]), with(b, &pictures[lag]));
            let both = one.product(&pictures[lag]);
            middle.push([
                0.5 * (aa - bb),
                a_one - b_other,
                0.5 * (one.square - other.square),
            ]);
            difference.push([
                aa - 2.0 * ab + bb,
                2.0 * (a_one - a_other - b_one + b_other),
                one.square - 2.0 * both + other.square,
            ]);
        }
        // The best delay of the alternative may hide the difference.
        let aligned = |other: &Template| {
            let lag = self.lags_s.len() / 2;
            let both = other.product(&subjects[lag]);
            let one = scene.subject[lag].square;
            one - both.max(0.0).powi(2) / other.square.max(1e-9)
        };
        let rooms: f64 = difference.first().map_or(0.0, |difference| difference[0]);
        let subjects = story.subject.iter().map(aligned).fold(f64::INFINITY, f64::min);
        Rival {
            what,
            story,
            middle,
            difference,
            apart: (rooms + subjects.max(0.0)).max(0.0).sqrt(),
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
        let share = 1.0 / stretch.len().max(1) as f32;
        film[stretch.clone()]
            .iter()
            .for_each(|image| add(&mut sum, image, share));
        sum
    };
    stretches.iter().map(mean).collect()
}
