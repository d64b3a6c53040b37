//! Places agents on the floor: draws places until nobody is in anybody's way.

use super::chance::{generator, share};
use super::target::{Edit, Placed, edited};
use glam::DVec3;
use grideye_scene::{Files, Scene, SceneError};
use rand_chacha::ChaCha12Rng;

/// A draw's text and where the positions of placed agents belong in it.
pub(crate) struct Floors<'a> {
    /// The scene file's name in messages.
    pub(crate) origin: &'a str,
    pub(crate) placed: &'a [Placed],
    pub(crate) text: String,
    /// Per agent: the first edit sets its position, the others remove the keys of its walk.
    pub(crate) edits: Vec<Vec<Edit>>,
    pub(crate) silence: Option<Edit>,
}

impl Floors<'_> {
    pub(crate) fn edits(&self, places: &[Lottery]) -> Vec<(&Edit, String)> {
        let mut edits = Vec::new();
        for (place, of_agent) in places.iter().zip(&self.edits) {
            let [x_mm, y_mm, z_mm] = (1000.0 * place.place_m).to_array();
            let position = format!("[{x_mm:?}, {y_mm:?}, {z_mm:?}]");
            let values = std::iter::once(position).chain(std::iter::repeat(String::new()));
            edits.extend(of_agent.iter().zip(values));
        }
        edits
    }

    fn silent(&self) -> impl Iterator<Item = (&Edit, String)> {
        let edits = self.silence.iter();
        edits.map(|edit| (edit, "\"ignore\"".to_owned()))
    }

    pub(crate) fn room_m(&self, files: &dyn Files) -> Result<(DVec3, DVec3), SceneError> {
        let text = edited(&self.text, self.silent().collect());
        let loaded = Scene::parse(&text, self.origin, files)?;
        Ok(loaded.scene.room().bounds_m())
    }

    pub(crate) fn misplaced(
        &self,
        places: &[Lottery],
        files: &dyn Files,
    ) -> Result<Option<usize>, SceneError> {
        let mut edits = self.edits(places);
        edits.extend(self.silent());
        let text = edited(&self.text, edits);
        let number_of = |name: &str| {
            let mut placed = self.placed.iter();
            placed.position(|placed| placed.agent == name)
        };
        let scene = match Scene::parse(&text, self.origin, files) {
            Ok(loaded) => loaded.scene,
            Err(SceneError::AgentLeavesRoom { name, .. }) if number_of(&name).is_some() => {
                return Ok(number_of(&name));
            }
            Err(error) => return Err(error),
        };
        // Of two agents in each other's way, the later one moves.
        let contacts = scene.contacts().into_iter();
        let mut misplaced = contacts.filter_map(|contact| {
            let names = contact.names.iter();
            names.filter_map(|name| number_of(name)).max()
        });
        Ok(misplaced.next())
    }
}

pub(crate) struct Lottery {
    generator: ChaCha12Rng,
    low_m: DVec3,
    size_m: DVec3,
    pub(crate) place_m: DVec3,
    pub(crate) drawn: usize,
}

impl Lottery {
    pub(crate) fn new(seed: u64, agent: &str, index: u64, (low_m, high_m): (DVec3, DVec3)) -> Self {
        let mut lottery = Self {
            generator: generator(seed, &format!("agent.{agent}.position"), index),
            low_m,
            size_m: high_m - low_m,
            place_m: low_m,
            drawn: 0,
        };
        lottery.next();
        lottery
    }

    /// Draws a place anywhere on the bottom of the room's bounding box; the room refuses places outside it.
    pub(crate) fn next(&mut self) {
        let (x, y) = (share(&mut self.generator), share(&mut self.generator));
        self.place_m = self.low_m + self.size_m * DVec3::new(x, y, 0.0);
        self.drawn += 1;
    }
}
