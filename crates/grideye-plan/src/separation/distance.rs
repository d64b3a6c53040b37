//! The distance between situations, for each pair and each sensor.

use grideye_scene::{Image, Scene, SceneError, Simulator};
use std::time::Duration;

/// Situations at least this far apart count as distinguishable: one frame in 160 is mistaken for the other.
pub const D_PRIME_MIN: f64 = 5.0;
/// Limit on the compared situations.
pub const SITUATIONS_MAX: usize = 20;

/// Situations in one room, compared in pairs through each of its sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Names of the sensors.
    pub sensors: Vec<String>,
    /// Each pair of situations by index: first and second, first and third …
    pub pairs: Vec<Pair>,
}

/// Two situations.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Their indices in the list of situations.
    pub situations: (usize, usize),
    /// Each sensor's view of the difference, in the order of [`Separation::sensors`].
    pub distances: Vec<Distance>,
}

/// The difference between two images of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// d' of the images.
    pub d_prime: f64,
    /// d' without the change that all pixels share, which a sensor's accuracy (±2.5 °C for the Grid-EYE) leaves open.
    pub d_prime_of_shape: f64,
    /// Difference of the warmest pixels alone, in units of the noise.
    pub d_prime_of_warmest: f64,
}

/// Why situations cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SeparationError {
    /// The situations or their sensors cannot be compared: a sentence and a hint.
    #[error("{0}")]
    Refused(String),
    /// A sensor cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Compares situations at their start, each a name and a scene.
///
/// # Errors
/// [`SeparationError`].
pub fn separation(situations: &[(&str, &Scene)]) -> Result<Separation, SeparationError> {
    let (first_name, first) = match situations {
        [first, _, ..] if situations.len() <= SITUATIONS_MAX => *first,
        _ => {
            return Err(SeparationError::Refused(format!(
                "{} situations, expected 2 to {SITUATIONS_MAX}\nhint: name the scene files of one room, one for each situation",
                situations.len()
            )));
        }
    };
    for (name, scene) in situations {
        if scene.sensors() != first.sensors() {
            return Err(SeparationError::Refused(format!(
                "the sensors of {name} are not those of {first_name}\nhint: situations are compared through the same sensors in the same places"
            )));
        }
    }
    if first.sensors().is_empty() {
        let refused = "the scenes have no sensor\nhint: add [[sensor]] tables";
        return Err(SeparationError::Refused(refused.to_owned()));
    }
    if let Some(quiet) = first
        .sensors()
        .iter()
        .find(|sensor| sensor.noise_sigma <= 0.0)
    {
        return Err(SeparationError::Refused(format!(
            "sensor `{}` has no noise to compare with\nhint: give it a noise_sigma_c above 0",
            quiet.name
        )));
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
    /// The distance for several sensors together: the root of the sum of the squares.
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
    let sensors = scene.sensors().iter();
    sensors
        .map(|sensor| Ok(Simulator::new(scene, &sensor.name)?.image(Duration::ZERO)))
        .collect()
}

/// The root of the sum of squares of each pixel's difference, in units of its noise.
pub(crate) fn d_prime(one: &Image, other: &Image, noise_sigma_c: f64) -> f64 {
    let pairs = one.celsius.iter().zip(&other.celsius);
    let squares = pairs.map(|(one, other)| (other - one).powi(2));
    squares.sum::<f64>().sqrt() / noise_sigma_c
}

/// The distance between two images with the same noise on each pixel.
#[must_use]
pub fn distance(one: &Image, other: &Image, noise_sigma_c: f64) -> Distance {
    let pairs = one.celsius.iter().zip(&other.celsius);
    let differences: Vec<f64> = pairs
        .map(|(one, other)| (other - one) / noise_sigma_c)
        .collect();
    let count = grideye_scene::count::float(differences.len().max(1));
    let mean = differences.iter().sum::<f64>() / count;
    let apart = differences.iter().map(|difference| difference - mean);
    let warmest = |image: &Image| {
        image
            .celsius
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
    };
    Distance {
        d_prime: d_prime(one, other, noise_sigma_c),
        d_prime_of_shape: apart.map(|part| part * part).sum::<f64>().sqrt(),
        d_prime_of_warmest: ((warmest(other) - warmest(one)) / noise_sigma_c).abs(),
    }
}
