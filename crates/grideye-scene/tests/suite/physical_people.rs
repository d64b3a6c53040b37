//! People, noise, profiles, steps and keys under the physical model, and the numbers of `scenes/PHYSICS.md`.

use crate::physical::{CEILING, ROOM, filled, pixels, sheet};
use crate::{object, parse, scene, simulator};
use grideye_frame::Celsius;
use grideye_scene::profile::Profile;
use grideye_scene::{Filled, Model, Scene, Simulator};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

const WALK: &str = "[[agent]]\nname = \"one\"\nsize_mm = [250, 500, 1750]\nsurface = \"clothed\"\ntrajectory = \"walk.csv\"\nspeed_mm_per_s = 1000\n\
    [[agent]]\nname = \"two\"\nposition_mm = [2300, 2100, 0]\n[[agent.part]]\nname = \"head\"\nshape = \"ellipsoid\"\nposition_mm = [0, 0, 1500]\nsize_mm = [200, 160, 240]\nsurface = \"skin\"\n\
    [[agent.part]]\nname = \"trunk\"\nshape = \"capsule\"\nposition_mm = [0, 0, 700]\nsize_mm = [250, 400, 780]\nsurface = \"coat\"\n";

fn walking(keys: &str) -> Scene {
    let files = BTreeMap::from([
        (
            "walk.csv".to_owned(),
            "x_mm,y_mm,z_mm\n600,1700,0\n3400,1700,0\n".to_owned(),
        ),
        ("unit.toml".to_owned(), UNIT.to_owned()),
    ]);
    let lamp = object(
        "lamp",
        [1500.0, 2000.0, 0.0],
        [300.0, 200.0, 900.0],
        30.0,
        40.0,
    );
    let text = format!("collisions = \"ignore\"\n{ROOM}{lamp}{WALK}{CEILING}{keys}");
    Scene::parse(&text, "room.toml", &files)
        .unwrap_or_else(|error| panic!("{error}"))
        .scene
}

const UNIT: &str = "[noise]\nsigma_c = 0.3\n[common_mode]\ncycle_depth_c = 0.5\n[fixed_pattern]\noffset_c = [\
    1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,\
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -9]\n";

/// A frame of moving bodies over still ones equals the frame in which everything moves or everything stands.
#[test]
fn a_moving_agent_looks_like_a_standing_one_there() {
    let scene = walking("");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    for tenth in [0, 7, 13, 21] {
        let time = Duration::from_millis(100 * tenth);
        let moved = simulator.image(time);
        let x = 600.0 + 100.0 * tenth as f64;
        let lamp = object(
            "lamp",
            [1500.0, 2000.0, 0.0],
            [300.0, 200.0, 900.0],
            30.0,
            40.0,
        );
        let one = object(
            "one",
            [x, 1700.0, 0.0],
            [250.0, 500.0, 1750.0],
            0.0,
            20.0 + 0.22 * 13.0,
        );
        let part = |name: &str, shape: &str, z: f64, size: [f64; 3], celsius: f64| {
            format!(
                "{}shape = \"{shape}\"\n",
                object(name, [2300.0, 2100.0, z], size, 0.0, celsius)
            )
        };
        let head = part(
            "head",
            "ellipsoid",
            1500.0,
            [200.0, 160.0, 240.0],
            20.0 + 0.85 * 13.0,
        );
        let trunk = part(
            "trunk",
            "capsule",
            700.0,
            [250.0, 400.0, 780.0],
            20.0 + 0.14 * 13.0,
        );
        let still = pixels(&format!(
            "{ROOM}{lamp}{one}emissivity = 0.93\n{head}emissivity = 0.98\n{trunk}emissivity = 0.93\n{CEILING}"
        ));
        for (moved, still) in moved.celsius.iter().zip(&still) {
            assert!((moved - still).abs() < 2e-3, "{tenth}: {moved} {still}");
        }
    }
}

/// A person of uniform temperature in an empty room: radiance and share agree.
#[test]
fn truth_is_the_share_of_radiance() {
    let alone = "[[agent]]\nname = \"one\"\nsize_mm = [250, 500, 1750]\nposition_mm = [2200, 1800, 0]\ntemperature_c = 24\nemissivity = 0.9\n";
    let simulator = simulator(&format!("{ROOM}{alone}{CEILING}"));
    let image = simulator.image(Duration::ZERO);
    let truth = simulator.truth(Duration::ZERO);
    assert!(truth.share.iter().any(|share| *share > 0.5));
    for (celsius, share) in image.celsius.iter().zip(&truth.share) {
        assert!((celsius - filled(*share, 24.0, 0.9, 20.0)).abs() < 1e-9);
    }
    let scene = walking("");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let time = Duration::from_millis(1500);
    let (all, filled) = (simulator.truth(time), simulator.labeled(time, 1).2);
    for pixel in 0..64 {
        let sum: f64 = filled.iter().map(|of| of.seen.share[pixel]).sum();
        assert!((all.share[pixel] - sum).abs() < 1e-7);
        assert!((0.0..=1.0).contains(&all.share[pixel]));
    }
    let is_in_view = |of: &Filled| of.seen.share.iter().any(|share| *share > 0.1);
    assert!(filled.len() == 2 && filled.iter().all(is_in_view));
}

/// Labels come from the image's own lines; the truth of the agent alone in the room comes from lines of its own.
#[test]
fn an_unhidden_agent_fills_what_it_fills_alone() {
    let person = |name: &str, x_mm: u32| {
        format!(
            "[[agent]]\nname = \"{name}\"\nposition_mm = [{x_mm}, 2000, 0]\nyaw_deg = 40\nperson = {{ posture = \"sit\" }}\n"
        )
    };
    let part = |name: &str, z_mm: u32| {
        format!(
            "[[agent.part]]\nname = \"{name}\"\nposition_mm = [0, 0, {z_mm}]\nsize_mm = [350, 420, 600]\ntemperature_c = 30\n"
        )
    };
    let parts = format!(
        "[[agent]]\nname = \"parts\"\nposition_mm = [1600, 2150, 0]\n{}{}",
        part("low", 0),
        part("high", 900)
    );
    let agents = [person("one", 1850), parts, person("two", 2050)];
    let shelf = object(
        "shelf",
        [1900.0, 1950.0, 1900.0],
        [150.0, 150.0, 60.0],
        20.0,
        25.0,
    );
    let top = format!("collisions = \"ignore\"\n{ROOM}");
    // The edges of boxes cut the lines of all agents, which moves a few shares a little.
    for shelf in ["", &shelf] {
        let all = simulator(&format!("{top}{shelf}{}{CEILING}", agents.concat()));
        let (image, noisy, filled) = all.labeled(Duration::ZERO, 7);
        assert_eq!(image, all.image(Duration::ZERO));
        assert_eq!(noisy, all.noisy(Duration::ZERO, 7));
        for (agent, of) in agents.iter().zip(&filled) {
            let alone = simulator(&format!("{top}{agent}{CEILING}")).truth(Duration::ZERO);
            let both = of.unhidden.share.iter().zip(&alone.share);
            for (unhidden, alone) in both {
                assert!(
                    (unhidden - alone).abs() <= 1e-3,
                    "{agent}: {unhidden} {alone}"
                );
            }
            let (seen, whole) = (of.seen.pixels(), alone.pixels());
            assert!(
                seen > 0.05 && seen < whole - 0.05,
                "{agent}: {seen} {whole}"
            );
        }
    }
}

#[test]
fn frames_are_the_same_on_any_thread() {
    let scene = walking("profile = \"unit.toml\"\nstep_c = 0.25\n");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let time = |frame: u64| Duration::from_millis(100 * frame);
    let expected: Vec<_> = (0..8)
        .map(|frame| simulator.noisy(time(frame), 5))
        .collect();
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                for frame in (0..8).rev() {
                    assert_eq!(simulator.noisy(time(frame), 5), expected[frame as usize]);
                }
            });
        }
    });
    assert_ne!(simulator.noisy(time(0), 6), expected[0]);
}

/// Pins the bits of one image: if they change, so does every data set made by the physical model.
#[test]
fn the_bits_of_one_picture_are_pinned() {
    let image = Simulator::new(&walking(""), "ceiling")
        .unwrap()
        .image(Duration::from_millis(1300));
    let bits = image.celsius.iter().fold(0_u64, |mixed, celsius| {
        mixed.rotate_left(7) ^ celsius.to_bits()
    });
    assert_eq!(bits, 0x507d_e6f3_9225_bd86, "{bits:#018x}");
}

/// What many frames are drawn with; beside a sheet 40 °C above the room, whose edges show most.
#[test]
fn coarse_lines_change_pixels_by_less_than_a_step() {
    let hot = sheet([0.31, -0.27], [0.23, 0.41], 1.9, 60.0, 0.95);
    let scene = walking(&hot);
    let [fine, coarse] =
        [Simulator::new, Simulator::coarse].map(|of| of(&scene, "ceiling").unwrap());
    let (mut squares, mut most) = (0.0, 0.0_f64);
    for tenth in 0..40 {
        let time = Duration::from_millis(100 * tenth);
        let (fine, coarse) = (fine.image(time).celsius, coarse.image(time).celsius);
        for (one, other) in fine.iter().zip(&coarse) {
            squares += (one - other).powi(2);
            most = most.max((one - other).abs());
        }
    }
    let rms = (squares / 2560.0).sqrt();
    assert!(rms > 0.0 && rms < 0.01 && most < 0.25, "{rms} {most}");
}

#[test]
fn noise_is_the_specifications_at_each_rate() {
    for (keys, expected) in [
        ("", 0.158),
        ("sampling_hz = 1\n", 0.05),
        ("noise_sigma_c = 0.3\n", 0.3),
    ] {
        let text = format!("{ROOM}{CEILING}{keys}");
        let simulator = simulator(&text);
        let mut squares = 0.0;
        for frame in 0..200 {
            let frame = simulator.noisy(Duration::from_millis(1000 * frame), 3);
            squares += frame
                .celsius
                .iter()
                .map(|celsius| (celsius - 20.0).powi(2))
                .sum::<f64>();
        }
        let sigma = (squares / 12_800.0).sqrt();
        // The error of a standard deviation from 12,800 draws is 0.6 %.
        assert!((sigma / expected - 1.0).abs() < 0.03, "{keys}: {sigma}");
    }
    let lepton = scene(&format!("{ROOM}{}", CEILING.replace("grid-eye", "lepton")));
    assert_eq!(
        lepton.sensors()[0].noise_sigma,
        1.6,
        "the default of the preset"
    );
}

#[test]
fn a_profile_makes_its_units_frames() {
    let scene = walking("profile = \"unit.toml\"\n");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let profile = Profile::parse(UNIT, "unit.toml").unwrap();
    assert!((simulator.sensor().noise_sigma - 0.3).abs() < 1e-12);
    for frame in [0_u32, 3, 29] {
        let time = simulator.sensor().frame_time(frame);
        let seen = simulator.image(time).to_frame(Celsius::new(0.0)).unwrap();
        let expected = profile.apply(9, frame.into(), time, seen);
        let found = simulator.noisy(time, 9);
        for (found, expected) in found.celsius.iter().zip(&expected.pixels) {
            assert_eq!(*found, f64::from(expected.get()));
        }
    }
    // Its pattern is what remains in the mean.
    let mean = |pixel: usize| {
        let frames = (0..400).map(|frame| {
            let time = simulator.sensor().frame_time(frame);
            simulator.noisy(time, 9).celsius[pixel] - simulator.image(time).celsius[pixel]
        });
        frames.sum::<f64>() / 400.0
    };
    for (pixel, offset) in [(0, 1.0), (7, 8.0), (20, 0.0), (63, -9.0)] {
        // One frame in five is 0.5 °C colder.
        assert!(
            (mean(pixel) - (offset - 0.1)).abs() < 0.06,
            "{pixel}: {}",
            mean(pixel)
        );
    }
    let slow = Simulator::new(
        &walking("profile = \"unit.toml\"\nsampling_hz = 1\n"),
        "ceiling",
    )
    .unwrap();
    let time = Duration::from_secs(3);
    let frames: Vec<_> = (30..40)
        .map(|tick| {
            let seen = slow.image(time).to_frame(Celsius::new(0.0)).unwrap();
            profile.apply(9, tick, Duration::from_millis(100 * tick), seen)
        })
        .collect();
    let found = slow.noisy(time, 9).celsius[40];
    let expected = frames
        .iter()
        .map(|frame| f64::from(frame.pixels[40].get()))
        .sum::<f64>()
        / 10.0;
    assert!((found - expected).abs() < 1e-12, "the mean of ten ticks");
}

#[test]
fn temperatures_are_multiples_of_the_step() {
    let scene = walking("step_c = 0.25\n");
    let fine = Simulator::new(&walking(""), "ceiling").unwrap();
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let time = Duration::from_millis(900);
    let (stepped, any) = (simulator.noisy(time, 1), fine.noisy(time, 1));
    for (stepped, any) in stepped.celsius.iter().zip(&any.celsius) {
        assert_eq!((stepped * 4.0).fract(), 0.0);
        assert!((stepped - any).abs() <= 0.125);
    }
    assert_eq!(
        simulator.image(time),
        fine.image(time),
        "the image itself has no steps"
    );
}

#[test]
fn people_look_as_warm_as_their_clothes() {
    for ambient_c in [19.0, 20.0] {
        let room = ROOM.replace("= 20", &format!("= {ambient_c:?}"));
        let looks = |surface: &str, model: Option<Model>| {
            let agent = format!(
                "[[agent]]\nname = \"a\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [500, 500, 1700]\nsurface = \"{surface}\"\n"
            );
            let loaded = Scene::parse_as(
                model,
                &format!("{room}{agent}{CEILING}"),
                "room.toml",
                &crate::no_files,
            )
            .unwrap();
            assert_eq!(loaded.warnings, []);
            loaded.scene.agents()[0].parts[0].surface
        };
        let [hair, clothed, coat] = ["hair", "clothed", "coat"].map(|surface| looks(surface, None));
        for one in [hair, clothed] {
            assert!((21.0..=24.5).contains(&one.celsius), "{one:?}");
            assert!((0.9..=0.95).contains(&one.emissivity));
        }
        assert!(
            hair.celsius > clothed.celsius
                && (0.8..1.3).contains(&(clothed.celsius - coat.celsius))
        );
        let skin = looks("skin", None);
        assert!(
            (30.5..=31.5).contains(&skin.celsius) && skin.emissivity == 0.98,
            "{skin:?}"
        );
        let paper = looks("clothed", Some(Model::Paper));
        assert_eq!(
            (paper.celsius, paper.emissivity),
            (29.0, 0.8),
            "the paper's model has no clothes"
        );
    }
}

#[test]
fn a_person_as_warm_as_skin_is_warned_about() {
    let agent = |keys: &str| {
        format!(
            "{ROOM}[[agent]]\nname = \"she\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [500, 500, 1700]\n{keys}\n{CEILING}"
        )
    };
    let warnings = |text: &str, model| {
        Scene::parse_as(model, text, "room.toml", &crate::no_files)
            .unwrap()
            .warnings
    };
    let told = warnings(&agent("temperature_c = 28"), None);
    assert_eq!(
        told.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "room.toml:9:17: agent `she` radiates like a surface of 28 °C, but clothed people look like 21 to 24 °C in a room of 20\n\
          hint: write surface = \"clothed\" (or \"skin\", \"hair\", \"coat\"), or add the emissivity if this temperature is intended"
        ]
    );
    assert_eq!(
        warnings(&agent("temperature_c = 28"), Some(Model::Paper)),
        []
    );
    assert_eq!(
        warnings(&agent("temperature_c = 28\nemissivity = 0.98"), None),
        []
    );
    assert_eq!(warnings(&agent("temperature_c = 24"), None), []);
    assert_eq!(
        warnings(&agent("temperature_c = 28\nsurface = \"coat\""), None),
        []
    );
}

#[test]
fn the_model_of_the_file_can_be_overruled() {
    let sheet = sheet([0.0, 0.0], [1.0, 1.0], 1.5, 30.0, 0.9);
    let text = format!("{ROOM}{sheet}{CEILING}");
    let by = |text: &str, model| {
        let scene = Scene::parse_as(model, text, "room.toml", &crate::no_files)
            .unwrap()
            .scene;
        (
            scene.model(),
            Simulator::new(&scene, "ceiling")
                .unwrap()
                .image(Duration::ZERO),
        )
    };
    let paper = text.replace("model = \"physical\"\n", "");
    assert_eq!(by(&text, None).0, Model::Physical);
    assert_eq!(by(&paper, None).0, Model::Paper);
    assert_eq!(by(&text, Some(Model::Paper)), by(&paper, None));
    assert_eq!(by(&paper, Some(Model::Physical)), by(&text, None));
    assert_ne!(by(&text, None), by(&paper, None));
}

/// Keys of the sensor and what follows it, keys at the top, and the message.
const KEYS: &[(&str, &str, &str)] = &[
    (
        "optics = \"lens\"",
        "",
        "room.toml:11:10: `optics` is \"lens\", expected \"datasheet\" or \"pinhole\"\nhint: datasheet uses the pixel directions of an AMG88, pinhole even steps on the image plane",
    ),
    (
        "optics = \"datasheet\"\nresolution = [16, 16]",
        "",
        "room.toml:11:10: `optics` is \"datasheet\", expected \"pinhole\" for a sensor without 8 x 8 pixels and 60°\nhint: the datasheet's map is for the AMG88 with the 60° lens; omit optics, or omit resolution and fov_deg",
    ),
    (
        "optics = \"datasheet\"\nfov_deg = 90",
        "",
        "room.toml:11:10: `optics` is \"datasheet\", expected \"pinhole\" for a sensor without 8 x 8 pixels and 60°\nhint: the datasheet's map is for the AMG88 with the 60° lens; omit optics, or omit resolution and fov_deg",
    ),
    (
        "blur_px = 1\nblur_deg = 8",
        "",
        "room.toml:11:11: sensor `ceiling` has both `blur_px` and `blur_deg`\nhint: give the width of the point spread in pixels or in degrees",
    ),
    (
        "blur_px = -1",
        "",
        "room.toml:11:11: `blur_px` is -1, expected 0 to 10\nhint: the full width at half height of the point spread, in pixels; 0 for none",
    ),
    (
        "blur_deg = [1, 91]",
        "",
        "room.toml:11:12: `blur_deg` is [1, 91], expected 0 to 90\nhint: the full width at half height of the point spread; 0 for none",
    ),
    (
        "pixel_width_deg = 0",
        "",
        "room.toml:11:19: `pixel_width_deg` is 0, expected 0.01 to 90\nhint: the full angle within which a pixel has more than half its response: about 8 for a Grid-EYE",
    ),
    (
        "step_c = nan",
        "",
        "room.toml:11:10: `step_c` is nan, expected 0 to 100 °C\nhint: the Grid-EYE has steps of 0.25; 0 for none",
    ),
    (
        "pixel_1 = \"top-right\"",
        "",
        "room.toml:11:11: `pixel_1` is \"top-right\", expected \"top-left\" or \"bottom-right\"\nhint: where pixel 1 is in the image; a lens rotates an image but never mirrors it",
    ),
    (
        "profile = \"unit.toml\"\nnoise_sigma_c = 0.1",
        "",
        "room.toml:12:17: sensor `ceiling` has both `noise_sigma_c` and `profile`\nhint: a profile includes all of the sensor's noise",
    ),
    (
        "profile = \"unit.toml\"\nresolution = [16, 8]",
        "",
        "room.toml:11:11: `profile` is \"unit.toml\", expected no profile for a sensor without 8 x 8 pixels\nhint: profiles are for the Grid-EYE; give noise_sigma_c instead",
    ),
    (
        "profile = \"../unit.toml\"",
        "",
        "room.toml:11:11: `profile` is \"../unit.toml\", expected a path with / below the scene file's folder\nhint: put the file beside the scene, as in trajectory = \"trajectories/walk.csv\"",
    ),
    (
        "",
        "band_um = [14, 8]\n",
        "room.toml:1:11: `band_um` is [14, 8], expected [from, to], rising, each 0.1 to 1000 µm\nhint: thermal sensors detect about [8, 14]; omit it for all wavelengths",
    ),
    (
        "[[object]]\nname = \"x\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [1, 1, 1]\nsurface = \"wool\"",
        "",
        "room.toml:15:11: `surface` is \"wool\", expected \"skin\", \"hair\", \"clothed\" or \"coat\"\nhint: the outermost layer; for anything else give temperature_c and emissivity",
    ),
    (
        "[[object]]\nname = \"x\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [1, 1, 1]\nemissivity = -0.1",
        "",
        "room.toml:15:14: `emissivity` is -0.1, expected a number from 0 to 1\nhint: skin has 0.98, cloth 0.9 to 0.95, a mirror for heat 0",
    ),
];

#[test]
fn invalid_physical_keys_are_refused() {
    let refused = |sensor: &str, head: &str| {
        parse(&format!("{head}{ROOM}{CEILING}{sensor}\n"))
            .map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
    };
    for (sensor, head, message) in KEYS {
        assert_eq!(refused(sensor, head), *message, "{head}{sensor}");
    }
    let cold = parse(&ROOM.replace("ambient_c = 20", "ambient_c = 20\nreflected_c = -274"))
        .unwrap_err()
        .to_string();
    assert!(
        cold.starts_with("room.toml:5:15: `reflected_c` is -274, expected °C above absolute zero"),
        "{cold}"
    );
    let files = BTreeMap::from([("unit.toml".to_owned(), "[noise]\nsigma = 1\n".to_owned())]);
    let wrong = Scene::parse(
        &format!("{ROOM}{CEILING}profile = \"unit.toml\"\n"),
        "room.toml",
        &files,
    );
    let wrong = wrong.unwrap_err().to_string();
    assert!(
        wrong.starts_with("room.toml:11:11: the sensor's profile was refused: unit.toml:2:1: "),
        "{wrong}"
    );
}

/// The table of `scenes/PHYSICS.md`: one walk in both models, beside what real sensors saw.
#[test]
fn the_readme_has_the_numbers_of_one_scene_in_both_models() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
    let text = files("clothed-walk.toml").unwrap();
    let simulator = |model| {
        let scene = Scene::parse_as(Some(model), &text, "clothed-walk.toml", &files)
            .unwrap()
            .scene;
        Simulator::new(&scene, "ceiling").unwrap()
    };
    let models = [simulator(Model::Paper), simulator(Model::Physical)];
    let readme = files("PHYSICS.md").unwrap();
    let mut missing = Vec::new();
    for (meters, measured) in [
        (0.0, "2.5 to 3.9 °C, 5 to 7 pixels"),
        (0.5, "2.5 to 3.9 °C"),
        (1.1, "1.9 °C"),
        (1.4, "1.1 °C"),
        (2.0, "hardly any"),
    ] {
        // On the way back, beyond the sensor: far from the radiator.
        let time = Duration::from_secs_f64((4.0 + meters) / 0.8);
        let [paper, physical] = [0, 1].map(|model| {
            let simulator: &Simulator = &models[model];
            let (image, truth) = (simulator.image(time), simulator.truth(time));
            let persons = image
                .celsius
                .iter()
                .zip(&truth.share)
                .filter(|(_, share)| **share > 0.01);
            let above: Vec<f64> = persons.map(|(celsius, _)| celsius - 19.5).collect();
            let warmest = above
                .iter()
                .fold(0.0_f64, |warmest, above| warmest.max(*above));
            format!(
                "{warmest:.1} °C, {} pixels",
                above.iter().filter(|above| **above > 1.0).count()
            )
        });
        let row = format!("| {meters} m | {paper} | {physical} | {measured} |");
        println!("{row}");
        if !readme.contains(&row) {
            missing.push(row);
        }
    }
    assert_eq!(missing, Vec::<String>::new());
}
