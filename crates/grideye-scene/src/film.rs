//! The frames of a sensor at any times, each rendered once.

use crate::model::{Scene, SceneError};
use crate::picture::Image;
use crate::simulator::Simulator;
use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// What a sensor sees of a scene. Frames stay for whoever asks for the same time again, up to a number of bytes; the oldest
/// make room.
#[derive(Debug)]
pub struct Film {
    simulator: Simulator,
    is_still: bool,
    frames_max: usize,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    /// What the sensor receives, by time.
    frames: HashMap<Duration, Image>,
    /// The oldest first.
    times: VecDeque<Duration>,
}

/// Bytes of a frame besides its pixels: the image, and its time in both collections.
const FRAME_BYTES: usize = 128;

impl Film {
    /// A film of the sensor with this name that keeps up to `bytes`, and one frame at least.
    ///
    /// # Errors
    /// [`SceneError::UnknownSensor`].
    pub fn new(scene: &Scene, sensor: &str, bytes: usize) -> Result<Self, SceneError> {
        let simulator = Simulator::new(scene, sensor)?;
        let pixels = simulator.sensor().columns * simulator.sensor().rows;
        Ok(Self {
            simulator,
            is_still: scene.is_static(),
            frames_max: (bytes / (FRAME_BYTES + pixels * size_of::<f64>())).max(1),
            kept: Mutex::default(),
        })
    }

    /// What renders it.
    #[must_use]
    pub const fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// The same as [`Simulator::image`].
    #[must_use]
    pub fn image(&self, time: Duration) -> Image {
        self.simulator.detected(self.received(time))
    }

    /// The same as [`Simulator::noisy`].
    #[must_use]
    pub fn noisy(&self, time: Duration, seed: u64) -> Image {
        let received = self.received(time);
        self.simulator.with_noise(received, time, seed)
    }

    fn received(&self, time: Duration) -> Image {
        // Of a scene in which nothing changes there is one frame.
        let time = if self.is_still { Duration::ZERO } else { time };
        let known = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(image) = known().frames.get(&time) {
            return image.clone();
        }
        let image = self.simulator.received(time);
        let mut kept = known();
        if kept.frames.insert(time, image.clone()).is_none() {
            kept.times.push_back(time);
        }
        while kept.times.len() > self.frames_max {
            let oldest = kept.times.pop_front();
            oldest.and_then(|oldest| kept.frames.remove(&oldest));
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20\n[[agent]]\nname = \"person\"\n\
        size_mm = [200, 500, 1750]\ntemperature_c = 31\nPATH[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\n\
        position_mm = [2000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

    fn scene(path: &str) -> Scene {
        let files = |_: &str| Ok("x_mm,y_mm,z_mm\n1000,3000,0\n3000,3000,0\n".to_owned());
        let text = SCENE.replace("PATH", path);
        Scene::parse(&text, "film", &files).unwrap().scene
    }

    fn walk() -> Scene {
        scene("trajectory = \"walk.csv\"\nspeed_mm_per_s = 800\n")
    }

    fn at(step: u32) -> Duration {
        Duration::from_millis(100) * step
    }

    #[test]
    fn frames_are_the_simulators_and_the_oldest_make_room() {
        let simulator = Simulator::new(&walk(), "ceiling").unwrap();
        let film = Film::new(&walk(), "ceiling", 5 * (FRAME_BYTES + 512)).unwrap();
        for step in [0, 1, 2, 1, 3, 4, 5, 6, 0] {
            let time = at(step);
            assert_eq!(film.image(time), simulator.image(time), "{step}");
            assert_eq!(film.noisy(time, 7), simulator.noisy(time, 7), "{step}");
        }
        let kept = film.kept.into_inner().unwrap();
        assert_eq!(kept.times, [3, 4, 5, 6, 0].map(at));
        assert_eq!(kept.frames.len(), 5);
    }

    #[test]
    fn where_nothing_moves_there_is_one_frame_and_the_noise_of_each_moment() {
        let still = scene("position_mm = [2000, 3000, 0]\n");
        let simulator = Simulator::new(&still, "ceiling").unwrap();
        let film = Film::new(&still, "ceiling", 0).unwrap();
        for step in 0..4 {
            let time = at(step);
            assert_eq!(film.image(time), simulator.image(time), "{step}");
            assert_eq!(film.noisy(time, 7), simulator.noisy(time, 7), "{step}");
        }
        assert_eq!(film.kept.into_inner().unwrap().times, [Duration::ZERO]);
    }
}
