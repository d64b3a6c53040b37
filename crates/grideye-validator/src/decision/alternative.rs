//! What else a recording could show.

use crate::align::Orientation;
use crate::decision::film::{Film, Image};
use crate::decision::world::{Drawn, add};

/// Another story for the recording than the scene's.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Alternative {
    /// Nobody is there.
    Nobody,
    /// This person is not there.
    Missing(usize),
    /// One more stands there all the time.
    More {
        place_m: [f64; 2],
    },
    /// The image is mirrored or turned.
    Turned(Orientation),
    /// This person is this far aside, meters.
    Aside(usize, [f64; 2]),
    /// Everything happens this much later, seconds.
    Later(f64),
    /// The recording runs backwards.
    Backwards,
}

/// How far aside a person must be told from the scene, meters.
pub(crate) const ASIDE_M: f64 = 0.5;

impl Alternative {
    /// Those of a scene; what alignment may undo is no alternative.
    pub(crate) fn of(film: &mut Film, lag_max_s: f64) -> Vec<Self> {
        let mut all = vec![Self::Nobody];
        let people = film.people.len();
        if people > 1 {
            all.extend((0..people).map(Self::Missing));
        }
        for person in 0..people {
            let ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            all.extend(ways.map(|way| Self::Aside(person, way.map(|part| ASIDE_M * part))));
        }
        all.extend(Orientation::ALL.into_iter().skip(1).map(Self::Turned));
        if film.people.iter().any(|walker| walker.moves) {
            let delays = [lag_max_s + 1.0, 5.0, 20.0];
            all.extend(delays.into_iter().flat_map(|by_s| [Self::Later(by_s), Self::Later(-by_s)]));
            all.push(Self::Backwards);
        }
        all.extend(free_places(film).into_iter().map(|place_m| Self::More { place_m }));
        all
    }

    /// What is seen in a world of the alternative that otherwise draws as `drawn`.
    pub(crate) fn shown(&self, film: &mut Film, drawn: &Drawn) -> Vec<Image> {
        let same = |_: &Film, index: usize| index;
        match self {
            Self::Nobody => film.empty.clone(),
            Self::Missing(person) => drawn.clone().without(*person).shown(film, same),
            Self::Aside(person, by_m) => drawn.clone().moved(*person, *by_m).shown(film, same),
            Self::Turned(orientation) => {
                let mut shown = drawn.shown(film, same);
                for image in &mut shown {
                    *image = orientation.apply(image);
                }
                shown
            }
            Self::Later(by_s) => drawn.shown(film, |film, index| film.near(film.times_s[index] - by_s)),
            Self::Backwards => drawn.shown(film, |film, index| film.len() - 1 - index),
            Self::More { place_m } => {
                let mut shown = drawn.shown(film, same);
                let contrast = drawn.contrast();
                if let Some(walker) = film.people.first_mut() {
                    let more = walker.standing(*place_m, 0);
                    shown.iter_mut().for_each(|image| add(image, &more, contrast));
                }
                shown
            }
        }
    }
}

/// Places in view, for one person more: the clearest of a coarse grid.
fn free_places(film: &mut Film) -> Vec<[f64; 2]> {
    const APART_M: f64 = 0.7;
    const MOST: usize = 6;
    let Some(walker) = film.people.first_mut() else { return Vec::new() };
    let range = |of: fn(&(f64, f64, u8)) -> f64| {
        let all = walker.places.iter().map(of);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
    };
    let (x, y) = (range(|place| place.0), range(|place| place.1));
    let mut found: Vec<(f32, [f64; 2])> = Vec::new();
    let middle = [0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1)];
    for step_x in -4..=4 {
        for step_y in -4..=4 {
            let place_m = [
                middle[0] + APART_M * f64::from(step_x),
                middle[1] + APART_M * f64::from(step_y),
            ];
            let warmth: f32 = walker.standing(place_m, 0).iter().sum();
            found.push((warmth, place_m));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let clearest = found.first().map_or(0.0, |found| found.0);
    found.retain(|found| found.0 > 0.5 * clearest);
    found.truncate(MOST);
    found.into_iter().map(|found| found.1).collect()
}
