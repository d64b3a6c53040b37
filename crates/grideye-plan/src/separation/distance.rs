//! The distance of situations, pair by pair and sensor by sensor.

use grideye_scene::{Image, Scene, SceneError, Simulator};
use std::time::Duration;

/// From this distance on situations count as told apart: one frame in 160 is taken for the other.
pub const D_PRIME_MIN: f64 = 5.0;
/// Situations that are compared at most.
pub const SITUATIONS_MAX: usize = 20;

/// Situations in one room, compared two by two through each of its sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Names of the sensors.
    pub sensors: Vec<String>,
    /// Each pair of situations, by their places, the first with the second, then with the third …
    pub pairs: Vec<Pair>,
}

/// Two situations.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Their places in the list that was compared.
    pub situations: (usize, usize),
    /// What each sensor sees of the difference, in the order of [`Separation::sensors`].
    pub distances: Vec<Distance>,
}

/// The difference of two pictures of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// d' of the pictures.
    pub d_prime: f64,
    /// The same less what all pixels have in common: a sensor's accuracy, ±2.5 °C for the Grid-EYE, leaves that open.
    pub d_prime_of_shape: f64,
    /// Difference of the warmest pixels alone, in units of the noise.
    pub d_prime_of_warmest: f64,
    /// Pixels that differ by more than three times the noise.
    pub pixels_beyond_3_sigma: usize,
}

/// Why situations cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SeparationError {
    /// Fewer than two, or more than [`SITUATIONS_MAX`].
    #[error(
        "{found} situations, expected 2 to {SITUATIONS_MAX}\nhint: name the scene files of one room, one for each situation"
    )]
    Count {
        /// How many there are.
        found: usize,
    },
    /// A scene with other sensors than the first.
    #[error(
        "the sensors of {scene} are not those of {first}\nhint: situations are compared through the same sensors in the same places"
    )]
    OtherSensors {
        /// The scene.
        scene: String,
        /// The first scene.
        first: String,
    },
    /// A sensor without noise tells everything apart.
    #[error(
        "sensor `{sensor}` has no noise to compare with\nhint: give it a noise_sigma_c above 0"
    )]
    NoNoise {
        /// The sensor.
        sensor: String,
    },
    /// A scene without sensors.
    #[error("the scenes have no sensor\nhint: add [[sensor]] tables")]
    NoSensor,
    /// A sensor that cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Compares the situations, each a name and a scene, as they are at the start.
///
/// # Errors
/// [`SeparationError`].
pub fn separation(situations: &[(&str, &Scene)]) -> Result<Separation, SeparationError> {
    let (first_name, first) = match situations {
        [first, _, ..] if situations.len() <= SITUATIONS_MAX => *first,
        _ => {
            return Err(SeparationError::Count {
                found: situations.len(),
            });
        }
    };
    for (name, scene) in situations {
        if scene.sensors() != first.sensors() {
            return Err(SeparationError::OtherSensors {
                scene: (*name).to_owned(),
                first: first_name.to_owned(),
            });
        }
    }
    if first.sensors().is_empty() {
        return Err(SeparationError::NoSensor);
    }
    if let Some(quiet) = first
        .sensors()
        .iter()
        .find(|sensor| sensor.noise_sigma <= 0.0)
    {
        return Err(SeparationError::NoNoise {
            sensor: quiet.name.clone(),
        });
    }
    let pictures = situations
        .iter()
        .map(|(_, scene)| pictures(scene))
        .collect::<Result<Vec<_>, _>>()?;
    let mut pairs = Vec::new();
    for one in 0..pictures.len() {
        for other in one + 1..pictures.len() {
            let both = pictures[one].iter().zip(&pictures[other]);
            let distances = both
                .zip(first.sensors())
                .map(|((one, other), sensor)| distance(one, other, sensor.noise_sigma));
            pairs.push(Pair {
                situations: (one, other),
                distances: distances.collect(),
            });
        }
    }
    Ok(Separation {
        sensors: first
            .sensors()
            .iter()
            .map(|sensor| sensor.name.clone())
            .collect(),
        pairs,
    })
}

impl Pair {
    /// The distance that several sensors have together: the root of the sum of the squares.
    #[must_use]
    pub fn together(&self, sensors: &[usize], of: impl Fn(&Distance) -> f64) -> f64 {
        let squares = sensors
            .iter()
            .filter_map(|sensor| self.distances.get(*sensor))
            .map(|distance| of(distance).powi(2));
        squares.sum::<f64>().sqrt()
    }
}

fn pictures(scene: &Scene) -> Result<Vec<Image>, SceneError> {
    scene
        .sensors()
        .iter()
        .map(|sensor| Ok(Simulator::new(scene, &sensor.name)?.image(Duration::ZERO)))
        .collect()
}

/// The distance of two pictures with the same noise on each pixel.
#[must_use]
pub fn distance(one: &Image, other: &Image, noise_sigma_c: f64) -> Distance {
    let differences: Vec<f64> = one
        .celsius
        .iter()
        .zip(&other.celsius)
        .map(|(one, other)| (other - one) / noise_sigma_c)
        .collect();
    let count = grideye_scene::count::float(differences.len().max(1));
    let mean = differences.iter().sum::<f64>() / count;
    let norm = |less: f64| {
        let squares = differences
            .iter()
            .map(|difference| (difference - less).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let warmest = |image: &Image| {
        image
            .celsius
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
    };
    Distance {
        d_prime: norm(0.0),
        d_prime_of_shape: norm(mean),
        d_prime_of_warmest: ((warmest(other) - warmest(one)) / noise_sigma_c).abs(),
        pixels_beyond_3_sigma: differences
            .iter()
            .filter(|difference| difference.abs() > 3.0)
            .count(),
    }
}
