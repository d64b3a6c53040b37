//! The paper's scenarios A and B as scene files.

use crate::{ROOM, scene};
use grideye_plan::fusion::{Method, SensorArray};
use grideye_plan::separation::{D_PRIME_MIN, Distance, Pair, SITUATIONS_MAX, distance, separation};
use grideye_scene::{Image, Scene, Sensor, Simulator};
use std::path::Path;
use std::time::Duration;

fn shipped(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    Scene::parse(&text, name, &files)
        .unwrap_or_else(|error| panic!("{error}"))
        .scene
}

fn fused_error(name: &str, method: Method, seed: Option<u64>) -> f64 {
    let scene = shipped(name);
    let sensors: Vec<&Sensor> = scene.sensors().iter().collect();
    let array = SensorArray::new(&sensors).unwrap();
    let frames: Vec<Image> = sensors
        .iter()
        .map(|sensor| {
            let simulator = Simulator::new(&scene, &sensor.name).unwrap();
            seed.map_or_else(
                || simulator.image(Duration::ZERO),
                |seed| simulator.noisy(Duration::ZERO, seed),
            )
        })
        .collect();
    let fused = array.fuse(method, &frames, if seed.is_some() { 0.2 } else { 0.0 });
    let truth = array.truth(&scene).unwrap().image(Duration::ZERO);
    let squares = fused
        .celsius
        .iter()
        .zip(&truth.celsius)
        .map(|(one, other)| (one - other).powi(2));
    (squares.sum::<f64>() / truth.celsius.len() as f64).sqrt()
}

#[test]
fn scenario_a_is_sharper_by_least_squares_than_by_the_mean() {
    for (name, cells) in [
        ("scenario-a-3x3.toml", (26, 26)),
        ("scenario-a-3x2.toml", (26, 18)),
    ] {
        let scene = shipped(name);
        let sensors: Vec<&Sensor> = scene.sensors().iter().collect();
        let array = SensorArray::new(&sensors).unwrap();
        assert_eq!(
            (array.across().union_cells(), array.down().union_cells()),
            cells
        );
        for seed in [None, Some(1), Some(2)] {
            let mean = fused_error(name, Method::Mean, seed);
            let least_squares = fused_error(name, Method::LeastSquares, seed);
            // One noisy frame per sensor reveals little that is narrower than a pixel.
            let share = if seed.is_some() { 0.95 } else { 0.6 };
            assert!(
                least_squares < share * mean,
                "{name}, {seed:?}: {least_squares} against {mean}"
            );
        }
    }
}

#[test]
fn scenario_bs_situations_share_a_room_and_the_fall_connects_them() {
    let [before, after, standing, fall] = ["before", "after", "standing", "fall"]
        .map(|name| shipped(&format!("scenario-b-{name}.toml")));
    for other in [&after, &standing, &fall] {
        assert_eq!(before.sensors(), other.sensors());
        assert_eq!(before.objects(), other.objects());
        assert_eq!(before.room(), other.room());
    }
    for sensor in before.sensors() {
        let picture =
            |scene: &Scene, time| Simulator::new(scene, &sensor.name).unwrap().image(time);
        let difference = |one: &Image, other: &Image| {
            one.celsius
                .iter()
                .zip(&other.celsius)
                .map(|(one, other)| (one - other).abs())
                .fold(0.0, f64::max)
        };
        assert!(
            difference(
                &picture(&fall, Duration::ZERO),
                &picture(&before, Duration::ZERO)
            ) < 1e-9
        );
        assert!(
            difference(
                &picture(&fall, fall.duration()),
                &picture(&after, Duration::ZERO)
            ) < 1e-9
        );
    }
}

#[test]
fn scenario_bs_sensors_distinguish_its_situations_but_one_temperature_does_not() {
    let scenes =
        ["before", "after", "standing"].map(|name| shipped(&format!("scenario-b-{name}.toml")));
    let situations: Vec<(&str, &Scene)> = ["before", "after", "standing"]
        .into_iter()
        .zip(&scenes)
        .collect();
    let found = separation(&situations).unwrap();
    assert_eq!(found.sensors, ["A", "B", "C"]);
    assert_eq!(found.pairs.len(), 3);
    for pair in &found.pairs {
        assert!(pair.together(&[0, 1, 2], |distance| distance.d_prime_of_shape) > D_PRIME_MIN);
    }
    // The paper: the change in height alone is no reliable sign for the sensor above the bed.
    let fallen = &found.pairs[0];
    assert_eq!(fallen.situations, (0, 1));
    assert!(
        fallen.distances[1].d_prime_of_warmest < D_PRIME_MIN,
        "{fallen:?}"
    );
}

#[test]
fn distances_are_in_units_of_each_sensors_noise() {
    let ceiling = format!("{}noise_sigma_c = 0.2\n", crate::CEILING);
    let loud = ceiling.replace("\"ceiling\"", "\"loud\"");
    let loud = loud.replace("noise_sigma_c = 0.2", "noise_sigma_c = 0.4");
    let person = "[[agent]]\nname = \"a\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [2000, 3000, 0]\n";
    let [empty, occupied] =
        ["", person].map(|agent| scene(&format!("{ROOM}{ceiling}{loud}{agent}")));
    let found = separation(&[("empty", &empty), ("occupied", &occupied)]).unwrap();
    let [quiet, loud] = found.pairs[0].distances[..] else {
        panic!("two sensors");
    };
    assert!(quiet.d_prime > 5.0, "{quiet:?}");
    assert!((quiet.d_prime - 2.0 * loud.d_prime).abs() < 1e-9 * quiet.d_prime);
}

#[test]
fn incomparable_situations_are_refused() {
    let before = shipped("scenario-b-before.toml");
    let one = [("before", &before)];
    let refused = |situations: &[(&str, &Scene)]| separation(situations).unwrap_err().to_string();
    let few = refused(&one);
    assert!(few.starts_with("1 situations, expected 2 to 20"), "{few}");
    let many = vec![("before", &before); SITUATIONS_MAX + 1];
    let more = refused(&many);
    assert!(
        more.starts_with("21 situations, expected 2 to 20"),
        "{more}"
    );
    assert!(separation(&many[..SITUATIONS_MAX]).is_ok());
    let other = shipped("experiment-1.toml");
    let message = refused(&[("before", &before), ("other", &other)]);
    assert!(
        message.starts_with("the sensors of other are not those of before"),
        "{message}"
    );
    let quiet = scene(&format!("{ROOM}{}noise_sigma_c = 0\n", crate::CEILING));
    let message = refused(&[("a", &quiet), ("b", &quiet)]);
    assert!(
        message.starts_with("sensor `ceiling` has no noise"),
        "{message}"
    );
    let blind = scene(ROOM);
    let message = refused(&[("a", &blind), ("b", &blind)]);
    assert!(
        message.starts_with("the scenes have no sensor"),
        "{message}"
    );
}

fn image(celsius: &[f64]) -> Image {
    Image {
        columns: celsius.len(),
        rows: 1,
        celsius: celsius.to_vec(),
    }
}

#[test]
fn the_distance_is_the_root_of_the_sum_of_squares() {
    // Differences of 3, 4, 0 and 0 times the noise of 0.5: 5; about their mean, 1.75: root of 25 - 4 * 1.75².
    let found = distance(&image(&[20.0; 4]), &image(&[21.5, 22.0, 20.0, 20.0]), 0.5);
    assert!((found.d_prime - 5.0).abs() < 1e-12);
    assert!((found.d_prime_of_shape - (25.0_f64 - 12.25).sqrt()).abs() < 1e-12);
    assert!((found.d_prime_of_warmest - 4.0).abs() < 1e-12);
    // A common offset is a distance, but not one of shape.
    let offset = distance(&image(&[20.0, 25.0]), &image(&[22.0, 27.0]), 1.0);
    assert!((offset.d_prime - 8.0_f64.sqrt()).abs() < 1e-12 && offset.d_prime_of_shape < 1e-12);
}

#[test]
fn sensors_add_by_their_squares() {
    let of = |d_prime| Distance {
        d_prime,
        d_prime_of_shape: 0.0,
        d_prime_of_warmest: 0.0,
    };
    let pair = Pair {
        situations: (0, 1),
        distances: vec![of(3.0), of(7.0), of(4.0)],
    };
    assert!((pair.together(&[0, 2], |distance| distance.d_prime) - 5.0).abs() < 1e-12);
}
