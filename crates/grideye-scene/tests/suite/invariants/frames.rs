//! Frames over time: walkers, truth, noise, and the bits of one frame.

use super::*;

const WALK: &str = "x_mm,y_mm,z_mm\n1000,3000,0\n3000,3000,0\n3000,4000,0\n";

fn walking() -> Scene {
    let agent = "[[agent]]\nname = \"person\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\n\
        trajectory = \"walk.csv\"\nspeed_mm_per_s = 800\n";
    let files = |name: &str| {
        assert_eq!(name, "walk.csv");
        Ok(WALK.to_owned())
    };
    Scene::parse(&format!("{ROOM}{CEILING}{agent}"), "room.toml", &files)
        .unwrap()
        .scene
}

#[test]
fn the_agent_is_where_its_speed_has_brought_it() {
    let scene = walking();
    assert!(!scene.is_static());
    assert_eq!(scene.duration(), Duration::from_millis(3750));
    let sensor = scene.sensor("ceiling").unwrap();
    assert_eq!(scene.frame_count(sensor), 38, "frames 0 to 37 at 10 Hz");
    assert_eq!(sensor.frame_time(37), Duration::from_millis(3700));
    let walking = Simulator::new(&scene, "ceiling").unwrap();
    for (millis, x, y) in [
        (0, 1000.0, 3000.0),
        (1250, 2000.0, 3000.0),
        (2500, 3000.0, 3000.0),
        (3125, 3000.0, 3500.0),
        (9000, 3000.0, 4000.0),
    ] {
        let standing = object("person", [x, y, 0.0], [200.0, 500.0, 1750.0], 0.0, 28.0)
            .replace("object", "agent");
        let standing = simulator(&format!("{ROOM}{CEILING}{standing}"));
        let time = Duration::from_millis(millis);
        assert_close(
            &walking.image(time).celsius,
            &standing.image(Duration::ZERO).celsius,
        );
        assert_close(
            &walking.truth(time).share,
            &standing.truth(Duration::ZERO).share,
        );
    }
}

#[test]
fn a_scene_without_a_trajectory_is_static() {
    let standing = object(
        "person",
        [2000.0, 3000.0, 0.0],
        [200.0, 500.0, 1750.0],
        0.0,
        28.0,
    )
    .replace("object", "agent");
    for text in [
        format!("{ROOM}{CEILING}"),
        format!("{ROOM}{CEILING}{standing}"),
    ] {
        let scene = scene(&text);
        assert!(scene.is_static());
        assert_eq!(scene.duration(), Duration::ZERO);
        assert_eq!(scene.frame_count(&scene.sensors()[0]), 1);
    }
}

#[test]
fn an_agent_and_an_object_of_the_same_shape_look_the_same() {
    let thing = object(
        "thing",
        [2300.0, 2800.0, 0.0],
        [500.0, 200.0, 1750.0],
        15.0,
        31.0,
    );
    let other = object(
        "other",
        [1800.0, 3000.0, 0.0],
        [500.0, 700.0, 900.0],
        15.0,
        41.0,
    );
    let as_object = picture(&format!("{ROOM}{CEILING}{other}{thing}"));
    assert_close(
        &picture(&format!(
            "{ROOM}{CEILING}{other}{}",
            thing.replace("object", "agent")
        )),
        &as_object,
    );
}

#[test]
fn truth_is_where_the_agent_changes_the_image() {
    let walking = walking();
    let with = Simulator::new(&walking, "ceiling").unwrap();
    for frame in 0..38 {
        let time = walking.sensors()[0].frame_time(frame);
        let (image, mask) = (with.image(time), with.truth(time));
        for (celsius, share) in image.celsius.iter().zip(&mask.share) {
            assert!((0.0..=1.0).contains(share));
            assert_eq!(*share > 0.0, *celsius != AMBIENT_C, "{share} {celsius}");
        }
        assert_eq!(
            mask.foreground(0.0),
            mask.share
                .iter()
                .map(|share| *share > 0.0)
                .collect::<Vec<_>>()
        );
        assert_eq!(
            mask.foreground(0.3).iter().filter(|pixel| **pixel).count(),
            mask.share.iter().filter(|share| **share >= 0.3).count()
        );
    }
    // An agent that fills the view is all there is to see.
    let close = object(
        "person",
        [2000.0, 3000.0, 0.0],
        [500.0, 500.0, 2650.0],
        0.0,
        28.0,
    )
    .replace("object", "agent");
    for share in simulator(&format!("{ROOM}{CEILING}{close}"))
        .truth(Duration::ZERO)
        .share
    {
        assert!((share - 1.0).abs() < 1e-12);
    }
}

#[test]
fn same_bytes_from_any_thread_in_any_order() {
    let scene = walking();
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let frame = |index: u32| simulator.noisy(scene.sensors()[0].frame_time(index), 7);
    let one_by_one: Vec<Image> = (0..38).map(frame).collect();
    let in_parallel: Vec<Vec<Image>> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..4)
            .map(|_| scope.spawn(|| (0..38).rev().map(frame).collect::<Vec<_>>()))
            .collect();
        handles
            .into_iter()
            .map(|handle| handle.join().unwrap())
            .collect()
    });
    for mut frames in in_parallel {
        frames.reverse();
        assert_eq!(frames, one_by_one);
    }
}

#[test]
fn noise_has_the_right_mean_and_spread() {
    let simulator = simulator(&format!("{ROOM}{CEILING}"));
    let draws: Vec<f64> = (0..2000)
        .flat_map(|frame| {
            simulator
                .noisy(Duration::from_millis(frame * 100), 1)
                .celsius
        })
        .map(|celsius| (celsius - AMBIENT_C) / 0.2)
        .collect();
    let count = draws.len() as f64;
    let moment = |power| draws.iter().map(|draw| draw.powi(power)).sum::<f64>() / count;
    // Five standard errors of each moment of 128,000 draws of N(0, 1).
    assert!(moment(1).abs() < 5.0 / count.sqrt(), "{}", moment(1));
    assert!(
        (moment(2) - 1.0).abs() < 5.0 * (2.0 / count).sqrt(),
        "{}",
        moment(2)
    );
    assert!(
        moment(3).abs() < 5.0 * (15.0 / count).sqrt(),
        "{}",
        moment(3)
    );
    assert!(
        (moment(4) - 3.0).abs() < 5.0 * (96.0 / count).sqrt(),
        "{}",
        moment(4)
    );
    // Neighbors in a frame, and a pixel in successive frames, are independent.
    let lagged = |lag: usize| {
        draws
            .iter()
            .zip(&draws[lag..])
            .map(|(one, other)| one * other)
            .sum::<f64>()
            / count
    };
    assert!(lagged(1).abs() < 5.0 / count.sqrt() && lagged(64).abs() < 5.0 / count.sqrt());
}

#[test]
fn noise_depends_only_on_seed_time_and_sensor() {
    let two = format!(
        "{ROOM}{CEILING}{}",
        CEILING.replace("\"ceiling\"", "\"other\"")
    );
    let noisy = |text: &str, sensor: &str, time, seed| {
        Simulator::new(&scene(text), sensor)
            .unwrap()
            .noisy(time, seed)
            .celsius
    };
    let second = Duration::from_secs(1);
    let base = noisy(&two, "ceiling", second, 1);
    assert_eq!(
        noisy(&format!("{ROOM}{CEILING}"), "ceiling", second, 1),
        base,
        "no other sensor shifts it"
    );
    assert_ne!(noisy(&two, "other", second, 1), base);
    assert_ne!(noisy(&two, "ceiling", second, 2), base);
    assert_ne!(
        noisy(&two, "ceiling", second + Duration::from_nanos(1), 1),
        base
    );
    assert_ne!(noisy(&two, "ceiling", Duration::MAX, 1), base);
    let silent = format!("{ROOM}{CEILING}noise_sigma_c = 0\n");
    assert_eq!(noisy(&silent, "ceiling", second, 1), picture(&silent));
}

#[test]
fn a_frame_keeps_the_images_order() {
    let image = Image {
        columns: 8,
        rows: 8,
        celsius: (0..64).map(f64::from).collect(),
    };
    let frame = image.to_frame(Celsius::new(24.5)).unwrap();
    assert_eq!(frame.thermistor, Celsius::new(24.5));
    for pixel in PixelIndex::all() {
        let expected = image.at(pixel.row(), pixel.column()) as f32;
        assert_eq!(frame.pixels[pixel.as_usize()].get(), expected);
    }
    let wide = Image {
        columns: 16,
        rows: 4,
        celsius: vec![0.0; 64],
    };
    assert_eq!(wide.to_frame(Celsius::new(0.0)), None);
}

#[test]
fn a_simulator_may_go_to_another_thread() {
    const fn assert_send_sync<T: Send + Sync>() {}
    assert_send_sync::<Simulator>();
    assert_send_sync::<Scene>();
}

fn is_sane(image: &Image, low: f64, high: f64) -> bool {
    image
        .celsius
        .iter()
        .all(|celsius| (low - 1e-9..=high + 1e-9).contains(celsius))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Sensors in, on and at corners of boxes, slivers of boxes, any opening, extreme temperatures.
    #[test]
    fn degenerate_scenes_give_temperatures_between_the_extremes(
        sensor_x in prop::sample::select(vec![0.0, 1000.0, 1500.0, 2000.0, 4000.0]),
        sensor_z in prop::sample::select(vec![0.0, 500.0, 1000.0, 2700.0]),
        elevation in prop::sample::select(vec![-90.0, -45.0, 0.0, 30.0, 90.0]),
        azimuth in prop::sample::select(vec![-90.0, 0.0, 17.0, 45.0, 180.0]),
        fov in prop::sample::select(vec![0.01, 1.0, 60.0, 179.0, 179.99]),
        width in prop::sample::select(vec![1e-9, 1.0, 1000.0, 2000.0]),
        height in prop::sample::select(vec![1e-9, 500.0, 1000.0, 2700.0]),
        yaw in prop::sample::select(vec![0.0, 45.0, 90.0]),
        celsius in prop::sample::select(vec![-273.0, 20.1, 5000.0]),
        as_agent: bool,
    ) {
        let points = if fov > 100.0 { 0.2 } else { 1.0 };
        let sensor = format!(
            "[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [{sensor_x:?}, 3000, {sensor_z:?}]\n\
             elevation_deg = {elevation:?}\nazimuth_deg = {azimuth:?}\nfov_deg = {fov:?}\npixels_per_degree = {points:?}\n"
        );
        let thing = object("thing", [2000.0, 3000.0, 0.0], [width, 1000.0, height], yaw, celsius);
        let thing = if as_agent { thing.replace("object", "agent") } else { thing };
        let scene = scene(&format!("{ROOM}{sensor}{thing}"));
        for simulator in [Simulator::new(&scene.on_grid(), "s"), Simulator::new(&scene, "s")] {
            let simulator = simulator.unwrap();
            let image = simulator.image(Duration::ZERO);
            prop_assert!(is_sane(&image, celsius.min(AMBIENT_C), celsius.max(AMBIENT_C)), "{:?}", image);
            prop_assert!(is_sane(&simulator.noisy(Duration::MAX, u64::MAX), -273.15, 6000.0));
            let truth = simulator.truth(Duration::ZERO);
            prop_assert!(truth.share.iter().all(|share| (0.0..=1.0).contains(share)), "{:?}", truth);
        }
    }

    #[test]
    fn a_warmer_object_makes_no_pixel_colder(
        x in 700.0..3300.0, y in 700.0..5300.0, turn in 0.0..360.0,
        celsius in -50.0..100.0, warmer in 0.0..50.0, law in prop::sample::select(vec!["A", "B"]),
    ) {
        let other = object("other", [2200.0, 2900.0, 0.0], [300.0, 400.0, 900.0], 10.0, 33.0);
        let with = |celsius| {
            let thing = object("thing", [x, y, 0.0], [600.0, 700.0, 1100.0], turn, celsius);
            picture(&format!("law = \"{law}\"\n{ROOM}{CEILING}{other}{thing}"))
        };
        for (cold, warm) in with(celsius).iter().zip(with(celsius + warmer)) {
            prop_assert!(warm >= cold - RULE_C);
        }
    }
}

#[test]
fn a_sensor_inside_a_body_sees_nothing_else() {
    let around = object(
        "cupboard",
        [2000.0, 3000.0, 1000.0],
        [900.0, 900.0, 1700.0],
        0.0,
        31.0,
    );
    assert_close(
        &picture(&format!("{ROOM}{CEILING}{around}").replace("3000, 2700]", "3000, 2000]")),
        &[31.0; 64],
    );
}

#[test]
fn a_sensor_barely_below_a_face_is_inside() {
    // Half a micrometer of the body is in front of the sensor: none of it can be projected.
    let level = CEILING
        .replace("elevation_deg = 90", "elevation_deg = 0")
        .replace("3000, 2700]", "2000.0005, 1350]");
    let wall = object(
        "wall",
        [2000.0, 3000.0, 0.0],
        [3000.0, 2000.0, 2700.0],
        0.0,
        31.0,
    );
    assert_close(&picture(&format!("{ROOM}{level}{wall}")), &[31.0; 64]);
    let before_it = level.replace("2000.0005", "1999.9995");
    assert_eq!(
        picture(&format!("{ROOM}{before_it}{wall}")),
        [AMBIENT_C; 64],
        "looking away from it"
    );
}

/// Pins the bits of one noisy frame: if they change, so does every recording simulated before.
#[test]
fn the_bits_of_one_frame_are_pinned() {
    let scene = walking();
    let frame = Simulator::new(&scene, "ceiling")
        .unwrap()
        .noisy(Duration::from_millis(1300), 42);
    let bits = frame.celsius.iter().fold(0_u64, |mixed, celsius| {
        mixed.rotate_left(7) ^ celsius.to_bits()
    });
    assert_eq!(bits, 0xff01_7e9b_74bf_c9af);
}
