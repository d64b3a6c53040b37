//! The repository's scenes and the example in their README.

use grideye_scene::{Loaded, Scene, Simulator, Unseen};
use std::path::{Path, PathBuf};
use std::time::Duration;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

fn load(text: &str, origin: &str) -> Loaded {
    let files = |relative: &str| std::fs::read_to_string(folder().join(relative));
    Scene::parse(text, origin, &files).unwrap_or_else(|error| panic!("{error}"))
}

fn shipped(name: &str) -> Scene {
    load(&std::fs::read_to_string(folder().join(name)).unwrap(), name).scene
}

#[test]
fn every_scene_renders_without_warnings() {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let loaded = load(&std::fs::read_to_string(&path).unwrap(), &name);
        if name != "collisions.toml" {
            assert_eq!(loaded.warnings, [], "{name}");
        }
        let scene = loaded.scene;
        for asked in scene
            .sensors()
            .iter()
            .map(|sensor| Some(&*sensor.name))
            .chain([None])
        {
            let mut unseen = scene.unseen(asked).into_iter();
            let doubtful = unseen.find(Unseen::is_doubtful);
            assert_eq!(doubtful, None, "{name}");
        }
        let mut is_seen = scene.agents().is_empty();
        for sensor in scene.sensors() {
            let simulator = Simulator::new(&scene, &sensor.name).unwrap();
            let middle = simulator.noisy(scene.duration() / 2, 1);
            assert_eq!(middle.celsius.len(), sensor.columns * sensor.rows, "{name}");
            let truth = simulator.truth(scene.duration() / 2);
            is_seen |= truth.share.iter().any(|share| *share > 0.1);
        }
        assert!(is_seen, "{name}: no agent");
        names.push(name);
    }
    names.sort();
    for number in 1..=5 {
        assert!(
            names.contains(&format!("experiment-{number}.toml")),
            "{names:?}"
        );
    }
}

#[test]
fn collisions_are_reported_at_their_computed_time_and_place() {
    let text = std::fs::read_to_string(folder().join("collisions.toml")).unwrap();
    let loaded = load(&text, "collisions.toml");
    let told: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    let contacts = loaded.scene.contacts();
    let of = |name: &str| {
        let found = contacts.iter().find(|contact| contact.names[0] == name);
        found.unwrap_or_else(|| panic!("{name}: {contacts:?}"))
    };
    // Half the depth of each body is 100 mm; by then they overlap by one millimeter.
    let (chest, pair) = (of("hurried"), of("from the left"));
    assert_eq!(chest.names[1], "chest");
    assert!((chest.time.as_secs_f64() - (3800.0 - 600.0 + 1.0) / 1000.0).abs() < 1e-4);
    assert!((chest.place_m.x - 3.8).abs() < 2e-3);
    assert_eq!(pair.names[1], "from the right");
    assert!((pair.time.as_secs_f64() - (4800.0 + 1.0) / 1500.0).abs() < 1e-4);
    assert!((pair.place_m.x - (0.6 + 0.6 * 3.2)).abs() < 2e-3);
}

#[test]
fn experiment_1_is_the_papers_table_1() {
    let scene = shipped("experiment-1.toml");
    assert!(scene.is_static());
    assert_eq!(scene.ambient().get(), 23.5);
    let agent = &scene.agents()[0];
    assert_eq!(
        (agent.position_m(Duration::ZERO) * 1000.0).to_array(),
        [1200.0, 1350.0, 0.0]
    );
    let [body] = agent.parts.as_slice() else {
        panic!("one body");
    };
    assert_eq!(body.surface.celsius, 28.0);
    let (low, high) = body.mesh.bounds_m();
    assert!((high - low).abs_diff_eq(glam::DVec3::new(0.5, 0.2, 1.75), 1e-12));
    let fan_coil = scene
        .objects()
        .iter()
        .find(|object| object.name == "fan-coil")
        .unwrap();
    assert_eq!(fan_coil.surface.celsius, 28.0);
    // Right below the sensor: warmest in the four middle pixels, the same in each.
    let image = Simulator::new(&scene, "ceiling")
        .unwrap()
        .image(Duration::ZERO);
    let middle = image.at(3, 3);
    for (row, column) in [(3, 4), (4, 3), (4, 4)] {
        assert!((image.at(row, column) - middle).abs() < 1e-6);
    }
    assert!(
        image
            .celsius
            .iter()
            .all(|celsius| *celsius <= middle + 1e-6)
    );
    assert!(
        image.at(4, 7) > 23.5,
        "the fan-coil, at the room's left, appears at the right"
    );
    assert_eq!(image.at(4, 0), 23.5, "nothing stands at the room's right");
}

#[test]
fn experiment_2_has_its_person_in_a_corner_of_the_view() {
    let scene = shipped("experiment-2.toml");
    let truth = Simulator::new(&scene, "ceiling")
        .unwrap()
        .truth(Duration::ZERO);
    let seen: Vec<usize> = (0..64).filter(|pixel| truth.share[*pixel] > 0.2).collect();
    assert!(!seen.is_empty());
    // The room's front right: top left of the image.
    assert!(
        seen.iter().all(|pixel| pixel / 8 < 4 && pixel % 8 < 4),
        "{seen:?}"
    );
}

#[test]
fn experiments_3_and_4_walk_from_end_to_end() {
    for name in ["experiment-3.toml", "experiment-4.toml"] {
        let scene = shipped(name);
        let agent = &scene.agents()[0];
        assert_eq!(
            (agent.position_m(Duration::ZERO) * 1000.0).to_array(),
            [300.0, 1340.0, 0.0]
        );
        assert_eq!(
            (agent.position_m(scene.duration()) * 1000.0).to_array(),
            [2800.0, 1340.0, 0.0]
        );
        assert_eq!(scene.duration(), Duration::from_secs(5));
        assert_eq!(
            scene.frame_count(&scene.sensors()[0]),
            51,
            "10 Hz, both ends"
        );
        let simulator = Simulator::new(&scene, "ceiling").unwrap();
        let centroid = |time| {
            let truth = simulator.truth(time);
            let total: f64 = truth.share.iter().sum();
            assert!(total > 0.0, "{name}: the person is seen all the way");
            let row: f64 = (0..64)
                .map(|pixel| truth.share[pixel] * (pixel / 8) as f64)
                .sum();
            let column: f64 = (0..64)
                .map(|pixel| truth.share[pixel] * (pixel % 8) as f64)
                .sum();
            (row / total, column / total)
        };
        let (start, end) = (centroid(Duration::ZERO), centroid(scene.duration()));
        if name == "experiment-3.toml" {
            assert!(
                start.1 > 5.0 && end.1 < 2.0,
                "left to right in the room, right to left in the image"
            );
        } else {
            assert!(start.0 > 5.0 && end.0 < 2.0, "away from the sensor is up");
        }
    }
}

/// The examples in TOML of the README and of the page on what varies.
#[test]
fn the_readmes_example_is_a_scene() {
    let read = |page: &str| std::fs::read_to_string(folder().join(page)).unwrap();
    let pages = ["README.md", "VARIES.md"].map(read).concat();
    let examples: Vec<&str> = pages
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .collect();
    let [example, uncertain, vary] = examples[..] else {
        panic!("{examples:?}");
    };
    let text = format!("{example}\n{vary}");
    let tables = Scene::vary_in(&text, "README.md").unwrap();
    assert_eq!(tables.len(), vary.matches("[[vary]]").count());
    let loaded = load(&format!("{example}\n{uncertain}"), "README.md");
    assert_eq!(loaded.warnings, []);
    let sensor = loaded.scene.sensor("ceiling").unwrap();
    assert_eq!((sensor.columns, sensor.rows), (8, 8));
    assert!((sensor.noise_sigma - 0.05 * 10_f64.sqrt()).abs() < 1e-12);
    assert_eq!(sensor.grid_points.to_array(), [300, 300]);
    // What the pages say of keys that are missing: written out, they change nothing.
    let body = "shape = \"cuboid\"\nyaw_deg = 0\nemissivity = 0.8\npresent = true\n";
    let preset = "resolution = [8, 8]\nfov_deg = 60\npixels_per_degree = 5\nnoise_sigma_c = 0.2\nsampling_hz = 10\n\
        operating_distance_mm = 5000\nroll_deg = 0\ntilt_deg = [0, 0]\nspill = 0\npixel_1 = \"top-left\"\n";
    let example = example.replace("\"physical\"", "\"paper\"");
    let without = example.replace("model = \"paper\"", "#");
    let stated = example
        .replace("temperature_c = 45", &format!("{body}temperature_c = 45"))
        .replace("elevation_deg", &format!("{preset}elevation_deg"))
        .replace("touches", "motion = \"constant\"\ntouches");
    let stated = format!("law = \"B\"\ncollisions = \"warning\"\n{stated}");
    let [stated, without] = [stated, without].map(|text| load(&text, "README.md").scene);
    assert!(stated == without, "{:?}", stated.sensors());
}
