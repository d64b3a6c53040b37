//! What a scene shows at the times of a recording, and what each of its people adds at any place.

use crate::align::Orientation;
use crate::numbers::{count, mean, median, single, whole};
use foldhash::fast::FixedState;
use glam::{DMat3, DVec3};
use grideye_frame::PIXELS;
use grideye_scene::{Agent, Scene, SceneError, Simulator};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// One image, row by row, °C.
pub(crate) type Image = [f32; PIXELS];
/// Pixels of an image.
pub(crate) const PIXEL_COUNT: f32 = 64.0;

/// Spacing of the places that a person is rendered at, meters: less than half of a pixel's width at a head below a ceiling.
const SPACING_M: f64 = 0.1;
/// The same of what is no parametric person: its parts take longer to render.
const COARSE_M: f64 = 0.25;
/// Directions that a person is rendered in.
const DIRECTIONS: u8 = 4;
/// Bytes that are kept of the scene's film: all that the alignment of ten minutes asks for.
const OWN_BYTES: usize = 8 << 20;
/// The same of each film of a changed scene: some 800 moments, more than the page's minute has.
const OTHER_BYTES: usize = 512 << 10;
/// Places of one person that are kept for the next recording: 15 megabytes, a path of some 250 meters.
const PLACES_MAX: usize = 50_000;
/// Longest time within one picture that a person counts as standing still, seconds.
const STILL_S: f64 = 0.35;

/// A scene at the times of a recording's pictures, without noise.
pub(crate) struct View {
    pub(crate) times_s: Vec<f64>,
    /// The scene without its subjects.
    pub(crate) room: Vec<Image>,
    pub(crate) people: Vec<Walker>,
    /// How it looks with each uncertain number of the scene off.
    pub(crate) responses: Vec<Response>,
    /// The subjects of a scene without people.
    pub(crate) objects: Option<Vec<Image>>,
    rendered: Rendered,
}

/// What was rendered of a scene at one of its sensors: the same for each recording of it.
#[derive(Default)]
pub(crate) struct Rendered {
    /// In the order in which they are asked for, which is the same each time: of the scene, of its empty room, without each of
    /// several people, and with each uncertain number off.
    films: Vec<Arc<grideye_scene::Film>>,
    /// By person.
    places: Vec<Places>,
}

/// What a person adds at each place and in each direction.
type Places = HashMap<(i32, i32, u8), Box<Image>, FixedState>;

/// What one uncertain number of a scene adds.
pub(crate) struct Response {
    /// To the scene, and to its room without people.
    pub(crate) whole: Effect,
    pub(crate) room: Effect,
}

/// By standard deviations `z`: `z` times `linear` and `z²` times `square`, which is exact at -1 and 1.
pub(crate) struct Effect {
    linear: Vec<Image>,
    square: Vec<Image>,
}

/// One person of a scene.
pub(crate) struct Walker {
    pub(crate) name: String,
    /// What it adds to each picture where the scene has it.
    pub(crate) adds: Vec<Image>,
    /// Where it is, and in which of the rendered directions it faces.
    pub(crate) places: Vec<(f64, f64, u8)>,
    pub(crate) moves: bool,
    /// What the atlas has at each of those places.
    here: Vec<Option<Image>>,
    atlas: Atlas,
}

/// What a person adds where it stands, rendered when first asked for.
struct Atlas {
    simulator: Simulator,
    agent: Agent,
    room: Vec<f64>,
    height_m: f64,
    spacing_m: f64,
    /// How many times its contrast.
    times: f32,
    /// Asked for every picture of every world: the standard library's hash was a tenth of the time.
    seen: Places,
}

impl View {
    /// Renders the scene at these times, each picture the mean over `within_s`, after another of the same scene and sensor.
    pub(crate) fn after(
        mut rendered: Rendered,
        (scene, sensor): (&Scene, &str),
        times_s: &[f64],
        within_s: f64,
    ) -> Result<Self, SceneError> {
        let mut places = std::mem::take(&mut rendered.places).into_iter();
        let apart_s = apart_s(within_s);
        let shown = |film: &grideye_scene::Film| pictures(film, times_s, &apart_s);
        let [own, empty] = rendered.own((scene, sensor))?;
        let with = shown(&own);
        let room = match scene.agents() {
            [] => with.clone(),
            _ => shown(&empty),
        };
        let mut next = 2;
        let mut other = |scene: &Scene| {
            let film = rendered.film(next, scene, sensor)?;
            next += 1;
            Ok::<_, SceneError>(shown(&film))
        };
        let mut people = Vec::with_capacity(scene.agents().len());
        for (number, agent) in scene.agents().iter().enumerate() {
            // With the others in the room, who may hide it.
            let without = match scene.agents().len() {
                1 => room.clone(),
                _ => other(&scene.without_agent(number))?,
            };
            people.push(Walker {
                name: agent.name.clone(),
                adds: each_less(&with, &without),
                places: times_s.iter().map(|time_s| place(agent, *time_s)).collect(),
                moves: !agent.duration().is_zero(),
                here: vec![None; times_s.len()],
                atlas: Atlas {
                    room: empty.image(Duration::ZERO).celsius,
                    simulator: empty.simulator().clone(),
                    height_m: agent.start_m.z,
                    spacing_m: if agent.person.is_some() {
                        SPACING_M
                    } else {
                        COARSE_M
                    },
                    agent: agent.clone(),
                    times: 1.0,
                    seen: places.next().unwrap_or_default(),
                },
            });
        }
        share_hidden(&mut people, &room, &with);
        let (room, objects) = if people.is_empty() {
            (vec![[0.0; PIXELS]; times_s.len()], Some(room))
        } else {
            (room, None)
        };
        let mut view = Self {
            times_s: times_s.to_vec(),
            room,
            people,
            objects,
            responses: Vec::new(),
            rendered: Rendered::default(),
        };
        view.lean(scene, other)?;
        view.rendered = rendered;
        Ok(view)
    }

    /// What was rendered, for the next.
    pub(crate) fn into_rendered(self) -> Rendered {
        let places = self.people.into_iter().map(|walker| {
            let mut places = walker.atlas.seen;
            if places.len() > PLACES_MAX {
                places.clear();
            }
            places
        });
        Rendered {
            places: places.collect(),
            ..self.rendered
        }
    }

    fn lean(
        &mut self,
        own_scene: &Scene,
        mut shown: impl FnMut(&Scene) -> Result<Vec<Image>, SceneError>,
    ) -> Result<(), SceneError> {
        let own: Vec<Image> = self
            .subjects()
            .into_iter()
            .zip(&self.room)
            .map(|(mut own, room)| {
                add(&mut own, room, 1.0);
                own
            })
            .collect();
        for variant in own_scene.variants() {
            let mut effect = |own: &[Image], of: fn(&Scene) -> Scene| {
                let sides = [&variant.below, &variant.above].map(|scene| {
                    // A stride out of step would be no difference of height.
                    let mut scene = of(scene);
                    scene.keep_strides_of(own_scene);
                    shown(&scene)
                });
                let [below, above] = sides;
                Ok::<_, SceneError>(Effect::new(own, &below?, &above?))
            };
            self.responses.push(Response {
                whole: effect(&own, Scene::clone)?,
                room: effect(&self.room, Scene::without_agents)?,
            });
        }
        Ok(())
    }

    pub(crate) fn len(&self) -> usize {
        self.times_s.len()
    }

    /// The subjects, as the scene has them.
    pub(crate) fn subjects(&self) -> Vec<Image> {
        let mut all = self
            .objects
            .clone()
            .unwrap_or_else(|| vec![[0.0; PIXELS]; self.len()]);
        for walker in &self.people {
            for (all, adds) in all.iter_mut().zip(&walker.adds) {
                add(all, adds, 1.0);
            }
        }
        all
    }

    /// The same with a subject of this many times the contrast.
    pub(crate) fn warmer(mut self, subject: usize, times: f32) -> Self {
        let scale = |image: &mut Image| image.iter_mut().for_each(|celsius| *celsius *= times);
        if let Some(walker) = self.people.get_mut(subject) {
            walker.adds.iter_mut().for_each(scale);
            walker.atlas.times = times;
        }
        self.objects.iter_mut().flatten().for_each(scale);
        self
    }

    /// Moves a person this far aside all the time.
    pub(crate) fn moved(&mut self, person: usize, by_m: [f64; 2]) {
        let number = self.len();
        let walker = &mut self.people[person];
        walker.adds = (0..number).map(|index| walker.aside(index, by_m)).collect();
        walker.here = vec![None; number];
        for place in &mut walker.places {
            *place = (place.0 + by_m[0], place.1 + by_m[1], place.2);
        }
    }

    /// How much warmer each picture is than the scene, °C, as most of its pixels say.
    fn levels_c(&self, pictures: &[Image]) -> Vec<f64> {
        levels_c(&each_less(
            &each_less(pictures, &self.room),
            &self.subjects(),
        ))
    }

    /// How much warmer a recording is than the scene, °C.
    pub(crate) fn level_c(&self, pictures: &[Image]) -> f64 {
        median(&self.levels_c(pictures)).unwrap_or(0.0)
    }

    /// How far the level runs away from the scene's over a recording, from its first third to its last, °C.
    pub(crate) fn drift_c(&self, pictures: &[Image]) -> f64 {
        let levels = self.levels_c(pictures);
        let third = levels.len() / 3;
        let mean = |levels: &[f64]| mean(levels).unwrap_or(0.0);
        // A ramp rises by two thirds of its height between the middles of these.
        1.5 * (mean(&levels[levels.len() - third..]) - mean(&levels[..third])).abs()
    }

    pub(crate) fn has_movement(&self) -> bool {
        self.people.iter().any(|walker| walker.moves)
    }

    /// From the first picture to the last, seconds.
    pub(crate) fn span_s(&self) -> f64 {
        match self.times_s.as_slice() {
            [first, .., last] => last - first,
            _ => 0.0,
        }
    }

    /// Neighboring pictures of this many seconds each; of a long recording at most about `most` stretches.
    pub(crate) fn stretches(&self, length_s: f64, most: f64) -> Vec<Range<usize>> {
        let times_s = &self.times_s;
        let length_s = length_s.max(self.span_s() / most);
        let mut all = Vec::new();
        let mut first = 0;
        for index in 1..=times_s.len() {
            if index == times_s.len() || times_s[index] - times_s[first] >= length_s - 1e-3 {
                all.push(first..index);
                first = index;
            }
        }
        all
    }

    /// The index of the picture nearest to a time, the first or last beyond the ends.
    pub(crate) fn near(&self, time_s: f64) -> usize {
        let after = self.times_s.partition_point(|other| *other < time_s);
        let before = after.saturating_sub(1);
        let after = after.min(self.len().saturating_sub(1));
        if time_s - self.times_s[before] <= self.times_s[after] - time_s {
            before
        } else {
            after
        }
    }
}

impl Effect {
    fn new(own: &[Image], below: &[Image], above: &[Image]) -> Self {
        let pairs = || below.iter().zip(above);
        let square = pairs().zip(own).map(|((below, above), own)| {
            std::array::from_fn(|pixel| 0.5 * (below[pixel] + above[pixel]) - own[pixel])
        });
        let linear = pairs().map(|(below, above)| less(above, below).map(|celsius| 0.5 * celsius));
        Self {
            linear: linear.collect(),
            square: square.collect(),
        }
    }

    pub(crate) fn add_to(&self, image: &mut Image, index: usize, sds: f32) {
        add(image, &self.linear[index], sds);
        add(image, &self.square[index], sds * sds);
    }
}

impl Rendered {
    /// The films of a scene and of its empty room.
    pub(crate) fn own(
        &mut self,
        (scene, sensor): (&Scene, &str),
    ) -> Result<[Arc<grideye_scene::Film>; 2], SceneError> {
        let own = self.film(0, scene, sensor)?;
        Ok([own, self.film(1, &scene.without_agents(), sensor)?])
    }

    /// A film by its number, made of this scene when first asked for.
    fn film(
        &mut self,
        number: usize,
        scene: &Scene,
        sensor: &str,
    ) -> Result<Arc<grideye_scene::Film>, SceneError> {
        if number == self.films.len() {
            let bytes = if number == 0 { OWN_BYTES } else { OTHER_BYTES };
            let film = grideye_scene::Film::new(scene, sensor, bytes)?;
            self.films.push(Arc::new(film));
        }
        Ok(Arc::clone(&self.films[number]))
    }
}

/// The moments that a picture is the mean of, from its time.
fn apart_s(within_s: f64) -> Vec<f64> {
    const MOST: f64 = 8.0;
    let number = (within_s / STILL_S).ceil().clamp(1.0, MOST);
    let halves = std::iter::successors(Some(0.5), |half| Some(half + 1.0));
    let halves = halves.take_while(|half| *half < number);
    halves
        .map(|half| within_s * (half / number - 0.5))
        .collect()
}

/// The mean over these moments about each time.
fn pictures(film: &grideye_scene::Film, times_s: &[f64], apart_s: &[f64]) -> Vec<Image> {
    let share = single(1.0 / count(apart_s.len()));
    let picture = |time_s: &f64| {
        let mut mean = [0.0; PIXELS];
        for apart_s in apart_s {
            let seen = film.image(moment(time_s + apart_s)).celsius;
            add(&mut mean, &image(&seen), share);
        }
        mean
    };
    times_s.iter().map(picture).collect()
}

/// Who stands behind another adds nothing, and who hides somebody as warm adds as little: together they would show nobody.
/// What all show beyond what each adds is shared.
fn share_hidden(people: &mut [Walker], room: &[Image], with: &[Image]) {
    if people.len() < 2 {
        return;
    }
    let share = single(1.0 / count(people.len()));
    for (index, (with, room)) in with.iter().zip(room).enumerate() {
        let mut hidden = less(with, room);
        for walker in people.iter() {
            add(&mut hidden, &walker.adds[index], -1.0);
        }
        for walker in people.iter_mut() {
            add(&mut walker.adds[index], &hidden, share);
        }
    }
}

pub(crate) fn moment(time_s: f64) -> Duration {
    Duration::try_from_secs_f64(time_s.max(0.0)).unwrap_or_default()
}

fn place(agent: &Agent, time_s: f64) -> (f64, f64, u8) {
    let time = moment(time_s);
    let at_m = agent.position_m(time);
    let turn = agent.facing(time).or_else(|| agent.turn(time));
    (at_m.x, at_m.y, direction(turn.unwrap_or(DMat3::IDENTITY)))
}

/// The rendered direction nearest to a rotation about the vertical.
fn direction(turn: DMat3) -> u8 {
    let angle = turn.x_axis.y.atan2(turn.x_axis.x) / TAU;
    let number = (angle * f64::from(DIRECTIONS)).round();
    u8::try_from(whole(number.rem_euclid(f64::from(DIRECTIONS)))).unwrap_or(0)
}

impl Walker {
    /// What the person adds to a picture if it is `aside_m` from where the scene has it then.
    pub(crate) fn aside(&mut self, index: usize, aside_m: [f64; 2]) -> Image {
        let mut adds = self.adds[index];
        if aside_m == [0.0; 2] {
            return adds;
        }
        let (x, y, direction) = self.places[index];
        let Self { here, atlas, .. } = self;
        let here = here[index].get_or_insert_with(|| atlas.at([x, y], direction));
        // The difference of two standing images carries the moment of the stride along.
        add(&mut adds, here, -1.0);
        atlas.add_at(&mut adds, [x + aside_m[0], y + aside_m[1]], direction);
        adds
    }

    /// What the person adds if it stands at a place.
    pub(crate) fn standing(&mut self, place_m: [f64; 2], direction: u8) -> Image {
        self.atlas.at(place_m, direction)
    }

    /// Sum of what it adds, by picture, °C.
    pub(crate) fn warmth(&self) -> Vec<f64> {
        let sum = |image: &Image| f64::from(image.iter().sum::<f32>());
        self.adds.iter().map(sum).collect()
    }
}

impl Atlas {
    fn at(&mut self, place_m: [f64; 2], direction: u8) -> Image {
        let mut image = [0.0; PIXELS];
        self.add_at(&mut image, place_m, direction);
        image
    }

    /// Between the four rendered places around this one.
    fn add_at(&mut self, all: &mut Image, place_m: [f64; 2], direction: u8) {
        let [x, y] = place_m.map(|place_m| place_m / self.spacing_m);
        let (left, below) = (x.floor(), y.floor());
        let (right, above) = (single(x - left), single(y - below));
        for (step_x, share_x) in [(0, 1.0 - right), (1, right)] {
            for (step_y, share_y) in [(0, 1.0 - above), (1, above)] {
                let key = (whole(left) + step_x, whole(below) + step_y, direction);
                add(all, self.rendered(key), share_x * share_y);
            }
        }
    }

    fn rendered(&mut self, key: (i32, i32, u8)) -> &Image {
        let Self {
            simulator,
            agent,
            room,
            height_m,
            spacing_m,
            times,
            seen,
        } = self;
        seen.entry(key).or_insert_with(|| {
            let (x, y, direction) = key;
            let place_m = DVec3::new(
                *spacing_m * f64::from(x),
                *spacing_m * f64::from(y),
                *height_m,
            );
            let angle = TAU * f64::from(direction) / f64::from(DIRECTIONS);
            let turn = DMat3::from_rotation_z(angle);
            simulator.replace_agents(vec![agent.standing_at(place_m, turn)]);
            let with = image(&simulator.image(Duration::ZERO).celsius);
            Box::new(less(&with, &image(room)).map(|celsius| *times * celsius))
        })
    }
}

pub(crate) fn image(celsius: &[f64]) -> Image {
    std::array::from_fn(|pixel| single(celsius.get(pixel).copied().unwrap_or_default()))
}

pub(crate) fn add(image: &mut Image, other: &Image, share: f32) {
    for pixel in 0..PIXELS {
        image[pixel] += share * other[pixel];
    }
}

pub(crate) fn less(with: &Image, without: &Image) -> Image {
    std::array::from_fn(|pixel| with[pixel] - without[pixel])
}

pub(crate) fn each_less(with: &[Image], without: &[Image]) -> Vec<Image> {
    let pairs = with.iter().zip(without);
    pairs.map(|(with, without)| less(with, without)).collect()
}

/// The level of each image as most of its pixels say, °C.
pub(crate) fn levels_c(images: &[Image]) -> Vec<f64> {
    let middle = |image: &Image| median(&image.map(f64::from)).unwrap_or(0.0);
    images.iter().map(middle).collect()
}

pub(crate) fn turned(images: &[Image], orientation: Orientation) -> Vec<Image> {
    let images = images.iter();
    images.map(|image| orientation.apply(image)).collect()
}
