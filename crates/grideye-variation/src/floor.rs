//! Places agents on the floor: draws places until nobody is in anybody's way.

use super::chance::{generator, share};
use super::target::{Edit, Placed};
use glam::DVec3;
use grideye_scene::Scene;
use rand_chacha::ChaCha12Rng;

/// The edits that place agents: the first of each agent sets its position, the others remove the keys of its walk.
pub(crate) fn edits(
    placed: &[Placed],
    places_m: impl Iterator<Item = DVec3>,
) -> Vec<(&Edit, String)> {
    let mut edits = Vec::new();
    for (placed, place_m) in placed.iter().zip(places_m) {
        let [x_mm, y_mm, z_mm] = (1000.0 * place_m).to_array();
        let position = format!("[{x_mm:?}, {y_mm:?}, {z_mm:?}]");
        let values = std::iter::once(position).chain(std::iter::repeat(String::new()));
        edits.extend(placed.edits.iter().zip(values));
    }
    edits
}

/// Agents on their way to free places.
pub(crate) struct Floor {
    scene: Scene,
    lotteries: Vec<Lottery>,
}

impl Floor {
    /// Starts with the first places drawn, wherever these agents stand in the scene.
    pub(crate) fn new(scene: Scene, placed: &[Placed], (seed, index): (u64, u64)) -> Self {
        let bounds_m = scene.room().bounds_m();
        let mut floor = Self {
            scene,
            lotteries: Vec::new(),
        };
        for placed in placed {
            let mut agents = floor.scene.agents().iter();
            let agent = agents.position(|agent| agent.name == placed.agent);
            let lottery = Lottery {
                generator: generator(seed, &format!("agent.{}.position", placed.agent), index),
                agent,
                low_m: bounds_m.0,
                size_m: bounds_m.1 - bounds_m.0,
                place_m: bounds_m.0,
                is_in_room: true,
                drawn: 0,
            };
            floor.lotteries.push(lottery);
            floor.draw(floor.lotteries.len() - 1);
        }
        floor
    }

    /// Draws a place anywhere on the bottom of the room's bounding box.
    pub(crate) fn draw(&mut self, number: usize) {
        let lottery = &mut self.lotteries[number];
        let generator = &mut lottery.generator;
        let (x, y) = (share(generator), share(generator));
        lottery.place_m = lottery.low_m + lottery.size_m * DVec3::new(x, y, 0.0);
        lottery.drawn += 1;
        if let Some(agent) = lottery.agent {
            lottery.is_in_room = self.scene.stand(agent, lottery.place_m);
        }
    }

    /// An agent that must move: the first in the scene that is not in the room; of two in each other's way, the one
    /// that is placed later.
    pub(crate) fn misplaced(&self) -> Option<usize> {
        let numbers = 0..self.lotteries.len();
        let outside = numbers.filter(|number| !self.lotteries[*number].is_in_room);
        let outside = outside.min_by_key(|number| self.lotteries[*number].agent);
        let number_of = |name: &String| {
            let is_it = |agent: usize| self.scene.agents()[agent].name == *name;
            let mut lotteries = self.lotteries.iter();
            lotteries.position(|lottery| lottery.agent.is_some_and(is_it))
        };
        outside.or_else(|| {
            let contacts = self.scene.contacts().into_iter();
            let mut misplaced =
                contacts.filter_map(|contact| contact.names.iter().filter_map(number_of).max());
            misplaced.next()
        })
    }

    pub(crate) fn places_m(&self) -> impl Iterator<Item = DVec3> {
        self.lotteries.iter().map(|lottery| lottery.place_m)
    }

    /// The number of the agent with the most places drawn.
    pub(crate) fn most_tried(&self) -> usize {
        let lotteries = self.lotteries.iter().enumerate();
        let most = lotteries.max_by_key(|(_, lottery)| lottery.drawn);
        most.map_or(0, |(number, _)| number)
    }
}

struct Lottery {
    generator: ChaCha12Rng,
    /// Its index in the scene; `None` if absent.
    agent: Option<usize>,
    low_m: DVec3,
    size_m: DVec3,
    place_m: DVec3,
    is_in_room: bool,
    drawn: usize,
}
