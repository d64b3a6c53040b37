//! What a scene shows at the times of a recording, without noise.

use crate::decision::image::{Image, add, add_all, all_less, image, moment};
use crate::decision::person::{Nodes, Person};
use crate::numbers::{count, mean, median, single};
use grideye_frame::PIXELS;
use grideye_scene::uncertain::Uncertain;
use grideye_scene::{Scene, SceneError, Simulator};
use std::ops::Range;
use std::time::Duration;

/// Longest time within one picture that a person counts as standing still, seconds.
const STILL_S: f64 = 0.35;

/// A scene at the times of a recording's pictures.
pub(crate) struct Film {
    pub(crate) times_s: Vec<f64>,
    /// The scene without its subjects.
    pub(crate) room: Vec<Image>,
    pub(crate) people: Vec<Person>,
    /// How it looks with each uncertain number of the scene off.
    pub(crate) variations: Vec<Variation>,
    /// The subjects of a scene without people.
    pub(crate) objects: Option<Vec<Image>>,
    takes: Takes,
}

/// What one uncertain number of a scene adds, by its standard deviations `z`: `z` times `linear` and `z²` times `square`,
/// which is exact at -1 and 1.
pub(crate) struct Variation {
    pub(crate) key: String,
    /// The standard deviation, in the key's own unit.
    pub(crate) sd: f64,
    pub(crate) linear: Vec<Image>,
    pub(crate) square: Vec<Image>,
}

/// What was rendered of a scene at one of its sensors: the same for each recording of it.
#[derive(Default)]
pub(crate) struct Rendered {
    /// Of the times of the last recording.
    takes: Takes,
    /// By person.
    nodes: Vec<Nodes>,
}

/// Variants of the scene at the same times, in the order in which they are asked for.
#[derive(Default)]
struct Takes {
    times_s: Vec<f64>,
    /// The moments that each picture is the mean of, from its time.
    apart_s: Vec<f64>,
    films: Vec<Vec<Image>>,
}

impl Film {
    /// Renders the scene at these times, each picture the mean over `within_s`, but for what is rendered already.
    pub(crate) fn new(
        before: Rendered,
        (scene, sensor): (&Scene, &str),
        times_s: &[f64],
        within_s: f64,
    ) -> Result<Self, SceneError> {
        let mut simulator = Simulator::without_grid(&scene.without_agents(), sensor)?;
        let mut takes = Takes::new(times_s, within_s);
        let mut nodes = before.nodes.into_iter();
        let before = before.takes;
        let room = if scene.without_agents().is_static() {
            vec![image(&simulator.image(Duration::ZERO).celsius); times_s.len()]
        } else {
            takes.images(&simulator, &before)
        };
        // A step aside is the difference of two of its images.
        let quick = Simulator::of_outlines(&scene.without_agents(), sensor)?;
        let mut people = Vec::with_capacity(scene.agents().len());
        simulator.replace_agents(scene.agents().to_vec());
        let with = takes.images(&simulator, &before);
        for (number, agent) in scene.agents().iter().enumerate() {
            // With the others in the room, who may hide it.
            let mut others = scene.agents().to_vec();
            let _ = others.remove(number);
            let without = if others.is_empty() {
                room.clone()
            } else {
                simulator.replace_agents(others);
                takes.images(&simulator, &before)
            };
            let adds = all_less(&with, &without);
            people.push(Person::new(agent, adds, times_s, &quick, nodes.next()));
        }
        share_hidden(&mut people, &room, &with);
        let (room, objects) = if people.is_empty() {
            (vec![[0.0; PIXELS]; times_s.len()], Some(room))
        } else {
            (room, None)
        };
        let mut film = Self {
            times_s: times_s.to_vec(),
            room,
            people,
            objects,
            variations: Vec::new(),
            takes,
        };
        film.vary(scene, sensor, &before)?;
        Ok(film)
    }

    /// What was rendered, for the next.
    pub(crate) fn into_rendered(self) -> Rendered {
        Rendered {
            takes: self.takes,
            nodes: self.people.into_iter().map(Person::into_nodes).collect(),
        }
    }

    fn vary(&mut self, scene: &Scene, sensor: &str, before: &Takes) -> Result<(), SceneError> {
        let mut own = self.room.clone();
        for subject in self.subjects() {
            add_all(&mut own, &subject, 1.0);
        }
        for variant in scene.variants() {
            let mut seen = |varied: &Scene| {
                // A stride out of step would be no difference of height.
                let mut varied = varied.clone();
                varied.keep_strides_of(scene);
                let simulator = Simulator::without_grid(&varied, sensor)?;
                Ok::<_, SceneError>(self.takes.images(&simulator, before))
            };
            let (below, above) = (seen(&variant.below)?, seen(&variant.above)?);
            let half = |image: Image| image.map(|celsius| 0.5 * celsius);
            let (steps, curves) = (all_less(&above, &below), all_less(&above, &own));
            let back = all_less(&own, &below);
            let mut uncertain = scene.uncertain().iter();
            let own_law = uncertain.find(|one| one.key == variant.key);
            self.variations.push(Variation {
                key: variant.key.clone(),
                sd: own_law.and_then(Uncertain::known).map_or(0.0, |law| law.sd),
                linear: steps.into_iter().map(half).collect(),
                square: all_less(&curves, &back).into_iter().map(half).collect(),
            });
        }
        Ok(())
    }

    pub(crate) fn len(&self) -> usize {
        self.times_s.len()
    }

    /// What each subject adds where the scene has it: the people, or all objects together.
    pub(crate) fn subjects(&self) -> Vec<Vec<Image>> {
        let people = self.people.iter().map(|person| person.adds.clone());
        self.objects.iter().cloned().chain(people).collect()
    }

    /// The same with subjects of this many times the contrast.
    pub(crate) fn warmer(mut self, times: f32) -> Self {
        self.people
            .iter_mut()
            .for_each(|person| person.scale(times));
        for image in self.objects.iter_mut().flatten() {
            *image = image.map(|celsius| times * celsius);
        }
        self
    }

    /// How far the level runs away from the scene's over a recording, from its first third to its last, °C.
    pub(crate) fn drift_c(&self, pictures: &[Image]) -> f64 {
        let mut left = all_less(pictures, &self.room);
        for subject in self.subjects() {
            add_all(&mut left, &subject, -1.0);
        }
        let level = |left: &Image| median(&left.map(f64::from)).unwrap_or(0.0);
        let levels: Vec<f64> = left.iter().map(level).collect();
        let third = levels.len() / 3;
        let mean = |levels: &[f64]| mean(levels).unwrap_or(0.0);
        // A ramp rises by two thirds of its height between the middles of these.
        1.5 * (mean(&levels[levels.len() - third..]) - mean(&levels[..third])).abs()
    }

    pub(crate) fn has_movement(&self) -> bool {
        self.people.iter().any(|person| person.moves)
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

impl Takes {
    fn new(times_s: &[f64], within_s: f64) -> Self {
        const MOST: f64 = 8.0;
        let number = (within_s / STILL_S).ceil().clamp(1.0, MOST);
        let mut apart_s = Vec::new();
        let mut half = 0.5;
        while half < number {
            apart_s.push(within_s * (half / number - 0.5));
            half += 1.0;
        }
        Self {
            times_s: times_s.to_vec(),
            apart_s,
            films: Vec::new(),
        }
    }

    /// The next film, with the pictures that it shares with the same one `before`.
    fn images(&mut self, simulator: &Simulator, before: &Self) -> Vec<Image> {
        let before_it = before.films.get(self.films.len());
        let before_it = before_it.filter(|_| before.apart_s == self.apart_s);
        let share = single(1.0 / count(self.apart_s.len()));
        let picture = |time_s: &f64| {
            let place = before.times_s.binary_search_by(|at| at.total_cmp(time_s));
            let known = place.ok().and_then(|place| before_it?.get(place));
            known.copied().unwrap_or_else(|| {
                let mut mean = [0.0; PIXELS];
                for apart_s in &self.apart_s {
                    let seen = simulator.image(moment(time_s + apart_s)).celsius;
                    add(&mut mean, &image(&seen), share);
                }
                mean
            })
        };
        let images: Vec<Image> = self.times_s.iter().map(picture).collect();
        self.films.push(images.clone());
        images
    }
}

/// Who stands behind another adds nothing, and who hides somebody as warm adds as little: together they would show nobody.
/// What all show beyond what each adds is shared.
fn share_hidden(people: &mut [Person], room: &[Image], with: &[Image]) {
    if people.len() < 2 {
        return;
    }
    let share = single(1.0 / count(people.len()));
    let mut hidden = all_less(with, room);
    for person in people.iter() {
        add_all(&mut hidden, &person.adds, -1.0);
    }
    for person in people.iter_mut() {
        add_all(&mut person.adds, &hidden, share);
    }
}
