//! What else a recording could show.

use crate::align::Orientation;
use crate::constants::{ASIDE_M, LATE_S, PART_S, PARTS, SHOWN_MIN};
use crate::decision::view::{Image, PIXEL_COUNT, View, add, each_less, less, turned};
use crate::decision::world::World;
use crate::numbers::count;
use grideye_draw::text::fixed;
use grideye_frame::PIXELS;
use grideye_scene::Laws;
use std::ops::Range;

/// Another story for the recording than the scene's.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Alternative {
    /// Nobody is there, or nothing.
    Nobody,
    /// This person is not there.
    Missing(usize),
    /// This person is gone during these pictures.
    Gone(usize, Range<usize>),
    /// One more stands there all the time.
    More([f64; 2]),
    /// One more walks the same way, this much later, seconds.
    Follower(f64),
    /// The image is mirrored or turned.
    Turned(Orientation),
    /// This person is this far aside, meters.
    Aside(usize, [f64; 2]),
    /// Everything happens this much later, seconds.
    Later(f64),
    /// The recording runs backwards.
    Backwards,
}

/// Ways aside: along the axes and between them.
const WAYS: [[f64; 2]; 8] = {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [HALF, HALF],
        [0.0, 1.0],
        [-HALF, HALF],
        [-1.0, 0.0],
        [-HALF, -HALF],
        [0.0, -1.0],
        [HALF, -HALF],
    ]
};
/// People whose place is asked about one by one.
pub(crate) const PEOPLE_MOST: usize = 4;

impl Alternative {
    pub(crate) fn of(view: &mut View, laws: &Laws) -> Vec<Self> {
        let mut all = vec![Self::Nobody];
        let people = view.people.len();
        if people > 1 {
            all.extend((0..people).map(Self::Missing));
        }
        for person in 0..people.min(PEOPLE_MOST) {
            all.extend(WAYS.map(|way| Self::Aside(person, way.map(|part| ASIDE_M * part))));
            let warmth = view.people[person].warmth();
            let mut parts = parts_in_view(&warmth, &view.times_s);
            parts.extend(parts_of_time(&warmth, &view.times_s));
            all.extend(parts.into_iter().map(|part| Self::Gone(person, part)));
        }
        all.extend(Orientation::ALL.into_iter().skip(1).map(Self::Turned));
        let span_s = view.span_s();
        if view.has_movement() {
            let delays = [3.0 * laws.lag_sd_s + LATE_S, 5.0, 20.0];
            let delays = delays.into_iter().filter(|by_s| *by_s < 0.6 * span_s);
            all.extend(delays.flat_map(|by_s| [Self::Later(by_s), Self::Later(-by_s)]));
            all.push(Self::Backwards);
            all.push(Self::Follower(0.5 * span_s));
        }
        all.extend(free_places(view).into_iter().map(Self::More));
        all
    }

    /// Ends "this recording also fits …".
    pub(crate) fn in_words(&self, view: &View) -> String {
        let name = |person: &usize| format!("`{}`", view.people[*person].name);
        let at = |index: usize| fixed(view.times_s[index], 1);
        let later = |by_s: f64| if by_s < 0.0 { "earlier" } else { "later" };
        match self {
            Self::Nobody if view.people.is_empty() => "a room with nothing warm".to_owned(),
            Self::Nobody => "the room without its people".to_owned(),
            Self::Missing(person) => format!("the scene without {}", name(person)),
            Self::Gone(person, part) => {
                let (from, to) = (at(part.start), at(part.end - 1));
                format!("{} away from second {from} to {to}", name(person))
            }
            Self::More([x, y]) => {
                let (x, y) = (fixed(1e3 * x, 0), fixed(1e3 * y, 0));
                format!("one more person at [{x}, {y}] mm")
            }
            Self::Follower(_) => "one more person who walks the same way".to_owned(),
            Self::Turned(orientation) => format!("an image that is {orientation}"),
            Self::Aside(person, by_m) => {
                let toward = |(by_m, axis): (&f64, &str)| {
                    let sign = if *by_m < 0.0 { "-" } else { "+" };
                    (*by_m != 0.0).then(|| format!("{sign}{axis}"))
                };
                let axes: Vec<String> = by_m.iter().zip(["x", "y"]).filter_map(toward).collect();
                format!(
                    "{} {} m further toward {}",
                    name(person),
                    fixed(ASIDE_M, 1),
                    axes.join(" and ")
                )
            }
            Self::Later(by_s) => {
                format!("the scene {} s {}", fixed(by_s.abs(), 1), later(*by_s))
            }
            Self::Backwards => "the scene in reverse".to_owned(),
        }
    }

    /// Whether the scene's people are all there, elsewhere or at another time.
    pub(crate) fn keeps_people(&self) -> bool {
        matches!(
            self,
            Self::Turned(_) | Self::Aside(..) | Self::Later(_) | Self::Backwards
        )
    }

    /// Whether somebody is there for a while, or besides the scene's people, who are there.
    pub(crate) fn comes_or_goes(&self) -> bool {
        matches!(self, Self::Gone(..) | Self::More(_) | Self::Follower(_))
    }

    /// The one person that it is about.
    pub(crate) fn person(&self) -> Option<usize> {
        match self {
            Self::Missing(person) | Self::Gone(person, _) | Self::Aside(person, _) => Some(*person),
            _ => None,
        }
    }

    /// By how much the scene's room is warmer than this one.
    pub(crate) fn rooms_apart(&self, view: &View) -> Vec<Image> {
        match self {
            Self::Turned(orientation) => each_less(&view.room, &turned(&view.room, *orientation)),
            _ => vec![[0.0; PIXELS]; view.len()],
        }
    }

    /// What is seen beyond the scene's room, without noise, in a world of the alternative that otherwise draws as one of the
    /// scene.
    pub(crate) fn shown(&self, view: &mut View, world: &World) -> Vec<Image> {
        let World { drawn, shows } = world;
        // Other times and orientations show the room in them.
        let seen = |view: &View, at: &dyn Fn(usize) -> usize, turned: Orientation| -> Vec<Image> {
            let all = view.room.iter().enumerate();
            all.map(|(index, room)| {
                let at = at(index);
                let mut whole = view.room[at];
                add(&mut whole, &shows[at], 1.0);
                less(&turned.apply(&whole), room)
            })
            .collect()
        };
        match self {
            Self::Nobody => drawn.empty(view),
            Self::Missing(person) => drawn.without_hidden(view, |number, _| number == *person),
            Self::Gone(person, part) => drawn.without_hidden(view, |number, index| {
                number == *person && part.contains(&index)
            }),
            Self::Aside(person, by_m) => drawn.clone().moved(*person, *by_m).shown(view),
            Self::Turned(orientation) => seen(view, &|index| index, *orientation),
            Self::Later(by_s) => {
                let at = |index: usize| view.near(view.times_s[index] - by_s);
                seen(view, &at, Orientation::Upright)
            }
            Self::Backwards => {
                let last = view.len() - 1;
                seen(view, &|index| last - index, Orientation::Upright)
            }
            Self::More(place_m) => {
                let mut shown = shows.clone();
                if let Some(walker) = view.people.first_mut() {
                    let more = walker.standing(*place_m, 0);
                    let contrast = drawn.contrast();
                    shown
                        .iter_mut()
                        .for_each(|image| add(image, &more, contrast));
                }
                shown
            }
            Self::Follower(by_s) => {
                let mut shown = shows.clone();
                let half = view.times_s.first().copied().unwrap_or_default() + by_s;
                for (index, image) in shown.iter_mut().enumerate() {
                    let time_s = view.times_s[index];
                    let other = view.near(if time_s < half {
                        time_s + by_s
                    } else {
                        time_s - by_s
                    });
                    if let Some(walker) = view.people.first() {
                        add(image, &walker.adds[other], drawn.contrast());
                    }
                }
                shown
            }
        }
    }
}

/// Consecutive parts of the time in which a person is in view, with as much of what it shows in each.
fn parts_in_view(warmth: &[f64], times_s: &[f64]) -> Vec<Range<usize>> {
    let part = squares(warmth) / count(PARTS);
    let mut all = Vec::new();
    let (mut first, mut sum) = (0, 0.0);
    for (index, warmth) in warmth.iter().enumerate() {
        sum += warmth * warmth;
        if sum > 0.999 * part && times_s[index] - times_s[first] > 0.999 * PART_S {
            all.push(first..index + 1);
            (first, sum) = (index + 1, 0.0);
        }
    }
    all
}

fn squares(of: &[f64]) -> f64 {
    of.iter().map(|warmth| warmth * warmth).sum()
}

/// Parts of the time, each half over the one before, in which a person shows something.
fn parts_of_time(warmth: &[f64], times_s: &[f64]) -> Vec<Range<usize>> {
    let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else {
        return Vec::new();
    };
    let part_s = (last - first) / count(PARTS);
    if part_s < PART_S {
        return Vec::new();
    }
    let part = |number: usize| {
        let from_s = first + 0.5 * part_s * count(number);
        let at = |time_s: f64| times_s.partition_point(|other| *other < time_s);
        at(from_s)..at(from_s + part_s)
    };
    let parts = (0..2 * PARTS - 1).map(part);
    parts
        .filter(|part| squares(&warmth[part.clone()]) > SHOWN_MIN * squares(warmth))
        .collect()
}

/// Places in view for one person more: the clearest of a coarse grid, away from people who stand.
fn free_places(view: &mut View) -> Vec<[f64; 2]> {
    const APART_M: f64 = 0.7;
    const MOST: usize = 6;
    const STEPS: i32 = 4;
    let standing: Vec<[f64; 2]> = view
        .people
        .iter()
        .filter(|walker| !walker.moves)
        .filter_map(|walker| walker.places.first().map(|place| [place.0, place.1]))
        .collect();
    let Some(walker) = view.people.first_mut() else {
        return Vec::new();
    };
    let clearest = walker.warmth();
    let warmest = (0..clearest.len()).max_by(|a, b| clearest[*a].total_cmp(&clearest[*b]));
    let Some(middle) = warmest.map(|index| walker.places[index]) else {
        return Vec::new();
    };
    let mut found: Vec<(f32, [f64; 2])> = Vec::new();
    for step_x in -STEPS..=STEPS {
        for step_y in -STEPS..=STEPS {
            let place_m = [
                middle.0 + APART_M * f64::from(step_x),
                middle.1 + APART_M * f64::from(step_y),
            ];
            let is_free =
                |[x, y]: &[f64; 2]| (place_m[0] - x).hypot(place_m[1] - y) > 0.9 * APART_M;
            if standing.iter().all(is_free) {
                let seen = walker.standing(place_m, 0);
                let sum: f32 = seen.iter().sum();
                let mean = sum / PIXEL_COUNT;
                let square: f32 = seen.iter().map(|celsius| (celsius - mean).powi(2)).sum();
                found.push((square, place_m));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = found.first().map_or(0.0, |found| found.0);
    found.retain(|found| found.0 > 0.4 * most);
    found.truncate(MOST);
    found.into_iter().map(|found| found.1).collect()
}
