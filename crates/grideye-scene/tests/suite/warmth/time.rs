//! Changing bodies, and warm prints.

use super::*;

#[test]
fn a_body_warms_up_and_cools_down_as_a_whole() {
    let thing = |celsius: f64| {
        object(
            "thing",
            [2300.0, 3100.0, 300.0],
            [600.0, 400.0, 900.0],
            30.0,
            celsius,
        )
    };
    // A cold agent in front, a warm object behind: the changing body hides one and is hidden by the other.
    let others = format!(
        "{}{}",
        object(
            "agent",
            [2200.0, 3100.0, 1400.0],
            [300.0, 300.0, 300.0],
            0.0,
            15.0
        )
        .replace("[[object]]", "[[agent]]"),
        object(
            "plate",
            [2300.0, 3000.0, 0.0],
            [1500.0, 1500.0, 20.0],
            0.0,
            40.0
        ),
    );
    let cooling = with(&format!("{}time_constant_s = 600\n{others}", thing(60.1)));
    let heated = with(&format!(
        "{}time_constant_s = 600\npower_w = 500\nheat_capacity_j_per_k = 10000\non_s = [[300, 900]]\n{others}",
        thing(20.1)
    ));
    for at_s in [0.0, 300.0, 1200.0] {
        let celsius = 20.1 + 40.0 * (-at_s / 600.0_f64).exp();
        assert_same(
            &cooling,
            at_s,
            &with(&format!("{}{others}", thing(celsius))),
            1e-9,
        );
    }
    // 500 W x 600 s / 10000 J/K = 30 °C in the end.
    for (at_s, excess_c) in [
        (0.0, 0.0),
        (600.0, 30.0 * (1.0 - (-0.5_f64).exp())),
        (1500.0, 30.0 * (1.0 - (-1.0_f64).exp()) * (-1.0_f64).exp()),
    ] {
        assert_same(
            &heated,
            at_s,
            &with(&format!("{}{others}", thing(20.1 + excess_c))),
            1e-9,
        );
    }
    let simulator = Simulator::new(&cooling, "ceiling").unwrap();
    let alone = Simulator::new(&with(&format!("{}{others}", thing(30.0))), "ceiling").unwrap();
    assert_eq!(
        simulator.truth(seconds(10.0)),
        alone.truth(Duration::ZERO),
        "a changing object is not an agent"
    );
}

#[test]
fn a_changing_part_changes_the_image_where_it_is() {
    let part = "[[agent]]\nname = \"a\"\nposition_mm = [2000, 3000, 0]\n[[agent.part]]\nname = \"cup\"\nposition_mm = [100, 0, 900]\nsize_mm = [300, 300, 300]\ntemperature_c = 80\ntime_constant_s = 100\n";
    let cup = object(
        "cup",
        [2100.0, 3000.0, 900.0],
        [300.0; 3],
        0.0,
        20.1 + 59.9 * (-2.0_f64).exp(),
    );
    assert_same(&with(part), 200.0, &with(&cup), 1e-9);
}

fn sofa_scene(material: &str, walk: &str, keys: &str) -> Scene {
    let sofa = object(
        "sofa",
        [2000.0, 3000.0, 0.0],
        [2200.0, 900.0, 450.0],
        0.0,
        20.1,
    );
    let text = format!(
        "{ROOM}{CEILING}{sofa}material = {material:?}\n[[agent]]\nname = \"a\"\nsize_mm = [800, 500, 250]\ntemperature_c = 30.1\ntrajectory = \"w.csv\"\n{keys}"
    );
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    Scene::parse(&text, "room.toml", &files)
        .unwrap_or_else(|error| panic!("{error}"))
        .scene
}

/// Leaves instantly at a given time, to a corner out of view.
fn leaves_after(contact_s: f64) -> String {
    format!(
        "t_s,x_mm,y_mm,z_mm,dwell_s\n0,2000,3000,450,{contact_s}\n{},500,600,450,0\n",
        contact_s + 0.001
    )
}

#[test]
fn a_print_fades_by_the_formula() {
    // (2/π) asin(√(tc / t)) · exp(x) erfc(√x) with x = (t - tc) / fading, by Python's math module.
    for (material, contact_s, after_s, share) in [
        ("wood", 60.0, 180.0, WOOD_180),
        ("foam", 30.0, 90.0, FOAM_90),
        ("textile", 600.0, 300.0, TEXTILE_300),
    ] {
        let left = sofa_scene(material, &leaves_after(contact_s), "");
        let sofa = object(
            "sofa",
            [2000.0, 3000.0, 0.0],
            [2200.0, 900.0, 450.0],
            0.0,
            20.1,
        );
        let print = object(
            "print",
            [2000.0, 3000.0, 449.9],
            [800.0, 500.0, 0.11],
            0.0,
            20.1 + 10.0 * share,
        );
        let expected = with(&format!("{sofa}{print}"));
        assert_same(&left, contact_s + after_s, &expected, 1e-3);
    }
}

const WOOD_180: f64 = 0.242906703509;
const FOAM_90: f64 = 0.104031066196;
const TEXTILE_300: f64 = 0.258930283434;

#[test]
fn a_print_appears_only_where_and_after_the_body_was_there() {
    let scene = sofa_scene("textile", &leaves_after(600.0), "");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let bare = sofa_scene(
        "textile",
        "x_mm,y_mm,z_mm\n500,600,450\n",
        "speed_mm_per_s = 1\n",
    );
    let bare = Simulator::new(&bare, "ceiling")
        .unwrap()
        .image(Duration::ZERO);
    let after = simulator.image(seconds(601.0));
    let warmer = |pixel: usize| after.celsius[pixel] - bare.celsius[pixel];
    assert!(warmer(27) > 0.5 && warmer(36) > 0.5, "{after:?}");
    assert!(warmer(24).abs() < 1e-9, "next to it");
    let truth = simulator.truth(seconds(601.0));
    assert!(
        truth.share.iter().all(|share| *share < 1e-9),
        "a print is not an agent"
    );
    // An agent who comes later has left no print before.
    let later = "t_s,x_mm,y_mm,z_mm,dwell_s\n0,500,600,450,100\n100.001,2000,3000,450,100\n200.1,500,600,450,0\n";
    let later = sofa_scene("textile", later, "");
    let later = Simulator::new(&later, "ceiling").unwrap();
    assert_eq!(later.image(seconds(99.0)).celsius, bare.celsius);
    assert_ne!(later.image(seconds(201.0)).celsius, bare.celsius);
}

#[test]
fn no_print_without_a_material_or_a_contact() {
    let above = leaves_after(600.0).replace(",450,", ",600,");
    let scene = sofa_scene("textile", &above, "");
    let image = Simulator::new(&scene, "ceiling")
        .unwrap()
        .image(seconds(601.0));
    assert!(
        image
            .celsius
            .iter()
            .all(|celsius| (celsius - 20.1).abs() < 1e-9)
    );
}

#[test]
fn no_print_on_top_of_objects_above_the_body() {
    // 250 mm of body below a top at 450 mm.
    let below = leaves_after(600.0).replace(",450,", ",0,");
    let scene = sofa_scene("textile", &below, "");
    let image = Simulator::new(&scene, "ceiling")
        .unwrap()
        .image(seconds(601.0));
    let warmest = image.celsius.iter().copied().fold(f64::MIN, f64::max);
    assert!((warmest - 20.1).abs() < 1e-9, "{warmest}");
}

#[test]
fn a_print_keeps_the_excess_at_the_start_of_contact_on_a_cooling_object() {
    // A plate of 60 °C that cools to the room's 20.1 °C in 100 s; a body of 30.1 °C is on it from 50 s to 110 s.
    let plate_c = |at_s: f64| 20.1 + 39.9 * (-at_s / 100.0).exp();
    let plate = |keys: &str, celsius: f64| {
        let size_mm = [2200.0, 900.0, 450.0];
        object("plate", [2000.0, 3000.0, 0.0], size_mm, 0.0, celsius) + keys
    };
    let walk = "t_s,x_mm,y_mm,z_mm,dwell_s\n0,500,600,450,49.999\n50,2000,3000,450,60\n110.001,500,600,450,0\n";
    let text = format!(
        "{ROOM}{CEILING}{}[[agent]]\nname = \"a\"\nsize_mm = [800, 500, 250]\ntemperature_c = 30.1\ntrajectory = \"w.csv\"\n",
        plate("material = \"wood\"\ntime_constant_s = 100\n", 60.0)
    );
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    // 180 s after a contact of 60 s: the share that the formula gives.
    let print_c = plate_c(290.0) + WOOD_180 * (30.1 - plate_c(50.0));
    let print = object(
        "print",
        [2000.0, 3000.0, 449.9],
        [800.0, 500.0, 0.11],
        0.0,
        print_c,
    );
    let expected = with(&format!("{}{print}", plate("", plate_c(290.0))));
    assert_same(&scene, 290.0, &expected, 1e-3);
}

#[test]
fn a_scene_lasts_for_its_duration() {
    let scene = |keys: &str| scene(&format!("{keys}{ROOM}{CEILING}"));
    assert_eq!(
        scene("duration_s = 90\n").duration(),
        Duration::from_secs(90)
    );
    assert!(!scene("duration_s = 90\n").is_static() && scene("").is_static());
    let longer = format!(
        "duration_s = 3\n{ROOM}{CEILING}[[agent]]\nname = \"a\"\nsize_mm = [200, 200, 200]\ntemperature_c = 20\ntrajectory = \"w.csv\"\nspeed_mm_per_s = 100\n"
    );
    let files = BTreeMap::from([(
        "w.csv".to_owned(),
        "x_mm,y_mm,z_mm\n1000,1000,0\n2000,1000,0\n".to_owned(),
    )]);
    let longer = Scene::parse(&longer, "room.toml", &files).unwrap().scene;
    assert_eq!(longer.duration(), Duration::from_secs(10));
}

/// Every second stop is a millimeter aside, so that each is a separate stop.
pub(super) fn moving(walk: &str) -> String {
    let rows = walk.lines().enumerate().map(|(index, row)| {
        let aside = if index % 2 == 0 { "2001" } else { "2000" };
        format!("{}\n", row.replace("2000", aside))
    });
    rows.collect()
}

fn shipped(name: &str) -> Scene {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |name: &str| std::fs::read_to_string(folder.join(name));
    let text = files(name).unwrap();
    Scene::parse(&text, name, &files).unwrap().scene
}

/// The scene's own numbers: 1000 W x 600 s / 15000 J/K.
#[test]
fn the_kitchen_warms_up_and_cools_down() {
    let kitchen = shipped("heating-and-cooling.toml");
    assert_eq!(kitchen.duration(), Duration::from_secs(1800));
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../scenes/heating-and-cooling.toml"),
    )
    .unwrap();
    let heating = [
        "time_constant_s",
        "power_w",
        "heat_capacity_j_per_k",
        "on_s",
        "temperature_c = 95",
    ];
    for at_s in [0.0_f64, 900.0, 1800.0] {
        let on_s = (at_s.min(1200.0) - 300.0).max(0.0);
        let off_s = (at_s - 1200.0).max(0.0);
        let radiator = 20.0 + 40.0 * (1.0 - (-on_s / 600.0).exp()) * (-off_s / 600.0).exp();
        let kettle = 20.0 + 75.0 * (-at_s / 3600.0).exp();
        let still: String = text
            .lines()
            .filter(|line| !heating.iter().any(|key| line.starts_with(key)))
            .map(|line| match line {
                "name = \"radiator\"" => format!("{line}\ntemperature_c = {radiator:?}\n"),
                "name = \"kettle\"" => format!("{line}\ntemperature_c = {kettle:?}\n"),
                _ => format!("{line}\n"),
            })
            .collect();
        assert_same(&kitchen, at_s, &scene(&still), 1e-9);
    }
}

#[test]
fn the_sofa_stays_warm_for_a_while() {
    let scene = shipped("warm-print.toml");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let warmest = |at_s: f64| {
        let image = simulator.image(seconds(at_s)).celsius;
        [27, 28, 35, 36]
            .map(|pixel| image[pixel] - 20.0)
            .into_iter()
            .fold(0.0, f64::max)
    };
    let (early, late) = (warmest(610.0), warmest(1200.0));
    // The formula's share after 600 s over that after 10 s, by Python's math module; the law is almost linear here.
    assert!(early > 0.4, "{early}");
    assert!((late / early - 0.221531).abs() < 0.02, "{early} {late}");
}

#[test]
fn a_near_agent_hides_a_far_one() {
    let both = shipped("two-people.toml");
    let simulator = Simulator::new(&both.on_grid(), "wall").unwrap();
    let exact = Simulator::new(&both, "wall").unwrap();
    let total = |simulator: &Simulator, agent: usize, at_s: f64| -> f64 {
        simulator.labeled(seconds(at_s), 1).2[agent].seen.pixels()
    };
    for simulator in [&simulator, &exact] {
        // 3 m at 600 mm/s: they cross after 2.5 s. At 1 s each is fully visible: 900 mm from the middle.
        assert!(total(simulator, 0, 2.5) > 1.0);
        assert!(total(simulator, 1, 2.5) < 1e-9, "hidden");
        assert!(total(simulator, 1, 1.2) > 0.3 && total(simulator, 1, 3.8) > 0.3);
        for step in 0..=50 {
            let at = seconds(f64::from(step) / 10.0);
            let (filled, any) = (simulator.labeled(at, 1).2, simulator.truth(at));
            for pixel in 0..64 {
                let sum: f64 = filled.iter().map(|of| of.seen.share[pixel]).sum();
                assert!((sum - any.share[pixel]).abs() < 1e-9, "each pixel once");
            }
        }
    }
    // The far one's outline seen by a pinhole: 0.2 m wide from 4.25 m on, and its side.
    let pixel = (2.0 * (std::f64::consts::PI / 6.0).tan() / 8.0).powi(2);
    let far_only = total(&exact, 1, 3.8) * pixel;
    let x_mm: f64 = 500.0 + 600.0 * 3.8 - 2000.0;
    let (left, right) = ((x_mm - 100.0) / 4750.0, (x_mm + 100.0) / 4250.0);
    // From its feet, 1.2 m below the sensor, to its head, 0.55 m above: the front, and next to it the narrowing side.
    let front = (200.0 / 4250.0) * (1750.0 / 4250.0);
    let side = ((x_mm - 100.0) / 4250.0 - left) * 0.5 * (1750.0 / 4250.0 + 1750.0 / 4750.0);
    assert!(right > left);
    assert!(
        (far_only / (front + side) - 1.0).abs() < 1e-6,
        "{far_only} {}",
        front + side
    );
}
