//! Invariants of random scenes, by either method, with moving agents of several parts, gradients, cooling objects and
//! warm prints.

use grideye_scene::{Image, Scene, Simulator};
use proptest::prelude::*;
use std::fmt::Write as _;
use std::time::Duration;

const AMBIENT_C: f64 = 20.1;
/// Everything stands around this place, below the sensor.
const MIDDLE_MM: f64 = 4000.0;

/// An object, or a part of an agent; lengths in millimeters from the middle, or from the agent.
#[derive(Debug, Clone)]
struct Thing {
    shape: &'static str,
    at: [f64; 3],
    size: [f64; 3],
    /// Yaw, pitch, roll.
    turned: [f64; 3],
    celsius: f64,
    gradient: [f64; 3],
    time_constant_s: Option<f64>,
    emissivity: f64,
}

#[derive(Debug, Clone)]
struct Walker {
    parts: Vec<Thing>,
    way: Vec<[f64; 2]>,
    underside: f64,
    turns: bool,
}

#[derive(Debug, Clone)]
struct Situation {
    objects: Vec<Thing>,
    walkers: Vec<Walker>,
    /// Whether a mat that keeps warm prints lies below the walkers.
    mat: bool,
    seconds: f64,
}

/// A change to the whole situation.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    mirrored: bool,
    quarter_turns: u8,
    moved_mm: [f64; 3],
    /// Added to the first object and the first walker's first part.
    warmer_c: f64,
    blank: bool,
    reversed: bool,
}

impl Change {
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let mut at = if self.mirrored { [-x, y] } else { [x, y] };
        for _ in 0..self.quarter_turns {
            at = [-at[1], at[0]];
        }
        at
    }

    /// As [`Self::place`], in the room.
    fn in_room(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [x, y] = self.place([x, y]);
        let [dx, dy, dz] = self.moved_mm;
        [MIDDLE_MM + x + dx, MIDDLE_MM + y + dy, z + dz]
    }

    fn keys(&self, thing: &Thing, at: [f64; 3], rides: bool) -> String {
        let (side, quarter) = (
            if self.mirrored { -1.0 } else { 1.0 },
            if rides {
                0.0
            } else {
                90.0 * f64::from(self.quarter_turns)
            },
        );
        let [yaw, pitch, roll] = thing.turned;
        // A mirror across x keeps rotations about x and reverses the others. A mirror across y, for parts carried along
        // their own x, keeps those about y.
        let (pitch, roll) = if rides {
            (pitch, side * roll)
        } else {
            (side * pitch, roll)
        };
        let [gx, gy, gz] = thing.gradient;
        let gradient = if rides {
            [gx, side * gy, gz]
        } else {
            [side * gx, gy, gz]
        };
        let celsius = if self.blank { AMBIENT_C } else { thing.celsius };
        let mut keys = format!(
            "shape = \"{}\"\nposition_mm = {at:?}\nsize_mm = {:?}\nyaw_deg = {:?}\npitch_deg = {pitch:?}\nroll_deg = {roll:?}\ntemperature_c = {celsius:?}\nemissivity = {:?}\n",
            thing.shape,
            thing.size,
            (side * yaw + quarter) % 360.0,
            thing.emissivity
        );
        if gradient != [0.0; 3] && !self.blank {
            let _ = writeln!(keys, "gradient_c_per_m = {gradient:?}");
        }
        if let Some(seconds) = thing.time_constant_s {
            let _ = writeln!(keys, "time_constant_s = {seconds:?}");
        }
        keys
    }
}

impl Situation {
    fn scene(&self, change: Change) -> Scene {
        let mut text = format!(
            "collisions = \"ignore\"\n[room]\nsize_mm = [9000, 9000, 4000]\nambient_c = {AMBIENT_C}\n\
             [[sensor]]\nname = \"eye\"\npreset = \"grid-eye\"\npixels_per_degree = 1\nposition_mm = {:?}\nelevation_deg = 90\nazimuth_deg = {:?}\n",
            change.in_room([0.0, 0.0, 2700.0]),
            90.0 * f64::from(change.quarter_turns) - 90.0
        );
        if self.mat {
            let _ = writeln!(
                text,
                "[[object]]\nname = \"mat\"\nposition_mm = {:?}\nsize_mm = [2400, 2400, 200]\nmaterial = \"textile\"\n{}",
                change.in_room([0.0; 3]),
                if change.blank {
                    ""
                } else {
                    "temperature_c = 19"
                }
            );
        }
        let mut objects: Vec<String> = Vec::new();
        for (index, object) in self.objects.iter().enumerate() {
            let mut object = object.clone();
            object.celsius += if index == 0 { change.warmer_c } else { 0.0 };
            let keys = change.keys(&object, change.in_room(object.at), false);
            objects.push(format!("[[object]]\nname = \"object {index}\"\n{keys}"));
        }
        let mut agents: Vec<String> = Vec::new();
        for (index, walker) in self.walkers.iter().enumerate() {
            let mut agent = format!(
                "[[agent]]\nname = \"walker {index}\"\ntrajectory = \"{index}.csv\"\nspeed_mm_per_s = 700\nfaces = \"{}\"\n",
                if walker.turns { "way" } else { "fixed" }
            );
            for (number, part) in walker.parts.iter().enumerate() {
                let mut part = part.clone();
                part.celsius += if index + number == 0 {
                    change.warmer_c
                } else {
                    0.0
                };
                let [x, y, z] = part.at;
                let at = if walker.turns {
                    [x, if change.mirrored { -y } else { y }, z]
                } else {
                    let [x, y] = change.place([x, y]);
                    [x, y, z]
                };
                let keys = change.keys(&part, at, walker.turns);
                let _ = write!(agent, "[[agent.part]]\nname = \"part {number}\"\n{keys}");
            }
            agents.push(agent);
        }
        if change.reversed {
            objects.reverse();
            agents.reverse();
        }
        text.extend(objects);
        text.extend(agents);
        let files = |name: &str| {
            let index: usize = name.trim_end_matches(".csv").parse().unwrap();
            let walker = &self.walkers[index];
            let mut way = "x_mm,y_mm,z_mm,dwell_s\n".to_owned();
            for point in &walker.way {
                let [x, y, z] = change.in_room([point[0], point[1], walker.underside]);
                let _ = writeln!(way, "{x:?},{y:?},{z:?},1");
            }
            Ok(way)
        };
        let loaded = Scene::parse(&text, "room.toml", &files)
            .unwrap_or_else(|error| panic!("{error}\nin\n{text}"));
        assert_eq!(loaded.warnings, [], "{text}");
        loaded.scene
    }

    /// The image by the grid and without it.
    fn pictures(&self, change: Change) -> [Image; 2] {
        let scene = self.scene(change);
        let time = Duration::from_secs_f64(self.seconds);
        both(&scene).map(|simulator| simulator.image(time))
    }
}

fn both(scene: &Scene) -> [Simulator; 2] {
    [
        Simulator::new(&scene.on_grid(), "eye").unwrap(),
        Simulator::new(scene, "eye").unwrap(),
    ]
}

fn thing(reach_mm: f64, smallest_mm: f64, largest_mm: f64) -> impl Strategy<Value = Thing> {
    let side = move || smallest_mm..largest_mm;
    (
        prop::sample::select(vec!["cuboid", "cuboid", "pyramid"]),
        (-reach_mm..reach_mm, -reach_mm..reach_mm, 0.0_f64..300.0),
        (side(), side(), side()),
        (-180.0_f64..180.0, 0.0_f64..1.0, 0.0_f64..1.0),
        -5.0_f64..60.0,
        (any::<bool>(), -1.5_f64..1.5, -1.5_f64..1.5),
        (prop::option::of(1.0_f64..50.0), 0.3_f64..1.0),
    )
        .prop_map(
            |(
                shape,
                (x, y, z),
                (a, b, c),
                (yaw, pitch, roll),
                celsius,
                (is_even, gx, gy),
                (time_constant_s, emissivity),
            )| {
                Thing {
                    shape,
                    // Rotated bodies must not reach through the floor.
                    at: [x, y, z + 500.0],
                    size: [a, b, c],
                    turned: [yaw, 20.0 * pitch - 10.0, 20.0 * roll - 10.0],
                    celsius,
                    gradient: if is_even { [0.0; 3] } else { [gx, gy, 0.0] },
                    time_constant_s,
                    emissivity,
                }
            },
        )
}

fn walker() -> impl Strategy<Value = Walker> {
    let point = || (-1200.0_f64..1200.0, -1200.0_f64..1200.0).prop_map(|(x, y)| [x, y]);
    (
        prop::collection::vec(thing(200.0, 60.0, 400.0), 1..3),
        prop::collection::vec(point(), 2..4),
        any::<bool>(),
    )
        .prop_map(|(mut parts, way, turns)| {
            for (index, part) in parts.iter_mut().enumerate() {
                // The first lies flat on the mat, so that it leaves a print.
                if index == 0 {
                    part.at[2] = 0.0;
                    part.turned = [part.turned[0], 0.0, 0.0];
                }
            }
            Walker {
                parts,
                way,
                underside: 200.0,
                turns,
            }
        })
}

fn situation() -> impl Strategy<Value = Situation> {
    (
        prop::collection::vec(thing(1300.0, 100.0, 700.0), 1..4),
        prop::collection::vec(walker(), 0..3),
        any::<bool>(),
        0.0_f64..8.0,
    )
        .prop_map(|(objects, walkers, mat, seconds)| Situation {
            objects,
            walkers,
            mat,
            seconds,
        })
}

/// Largest difference between two images, °C.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    let pairs = one.iter().zip(other);
    pairs
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f64::max)
}

/// With the grid, only rounding differs, because the rays are the same. Without it, faces are cut elsewhere, and the
/// Gauss rule is not exact.
const TOLERANCES_C: [f64; 2] = [1e-8, 1e-5];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_mirrored_scene_gives_a_mirrored_image(situation in situation()) {
        let mirrored = Change { mirrored: true, ..Change::default() };
        let pairs = situation.pictures(Change::default()).into_iter().zip(situation.pictures(mirrored));
        for ((one, other), tolerance_c) in pairs.zip(TOLERANCES_C) {
            let back: Vec<f64> = other.celsius.chunks_exact(8).flat_map(|row| row.iter().rev()).copied().collect();
            prop_assert!(apart(&one.celsius, &back) < tolerance_c, "{}", apart(&one.celsius, &back));
        }
    }

    #[test]
    fn a_scene_turned_with_its_sensor_looks_the_same(situation in situation(), quarter_turns in 1_u8..4) {
        let turned = Change { quarter_turns, ..Change::default() };
        let pairs = situation.pictures(Change::default()).into_iter().zip(situation.pictures(turned));
        for ((one, other), tolerance_c) in pairs.zip(TOLERANCES_C) {
            prop_assert!(apart(&one.celsius, &other.celsius) < tolerance_c, "{}", apart(&one.celsius, &other.celsius));
        }
    }

    #[test]
    fn a_scene_moved_with_its_sensor_looks_the_same(situation in situation(), x in 0.0_f64..900.0, y in 0.0_f64..900.0, z in 0.0_f64..1200.0) {
        let moved = Change { moved_mm: [x, y, z], ..Change::default() };
        let along_the_axis = Change { moved_mm: [0.0, 0.0, z], ..Change::default() };
        for change in [moved, along_the_axis] {
            let pairs = situation.pictures(Change::default()).into_iter().zip(situation.pictures(change));
            for ((one, other), tolerance_c) in pairs.zip(TOLERANCES_C) {
                prop_assert!(apart(&one.celsius, &other.celsius) < tolerance_c, "{}", apart(&one.celsius, &other.celsius));
            }
        }
    }

    #[test]
    fn warming_an_object_makes_no_pixel_colder(situation in situation(), warmer_c in 0.1_f64..40.0) {
        let warmer = Change { warmer_c, ..Change::default() };
        let pairs = situation.pictures(Change::default()).into_iter().zip(situation.pictures(warmer));
        for ((cold, warm), tolerance_c) in pairs.zip(TOLERANCES_C) {
            for (cold, warm) in cold.celsius.iter().zip(&warm.celsius) {
                prop_assert!(*warm > cold - tolerance_c, "{} after {}", warm, cold);
            }
        }
    }

    #[test]
    fn a_room_where_all_is_at_ambient_is_blank(situation in situation()) {
        for image in situation.pictures(Change { blank: true, ..Change::default() }) {
            prop_assert!(image.celsius.iter().all(|celsius| *celsius == AMBIENT_C), "{:?}", image);
        }
    }

    #[test]
    fn the_order_in_the_file_is_irrelevant(situation in situation()) {
        let reversed = Change { reversed: true, ..Change::default() };
        let pairs = situation.pictures(Change::default()).into_iter().zip(situation.pictures(reversed));
        for ((one, other), tolerance_c) in pairs.zip(TOLERANCES_C) {
            prop_assert!(apart(&one.celsius, &other.celsius) < tolerance_c, "{}", apart(&one.celsius, &other.celsius));
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bytes(situation in situation(), threads in 1_usize..6, seed: u64) {
        let scene = situation.scene(Change::default());
        for simulator in both(&scene) {
            let frame = |index: u32| simulator.noisy(Duration::from_millis(u64::from(index) * 700), seed);
            let alone: Vec<Image> = (0..6).map(frame).collect();
            let shared: Vec<Vec<Image>> = std::thread::scope(|scope| {
                let handles: Vec<_> = (0..threads)
                    .map(|_| scope.spawn(|| (0..6).rev().map(frame).collect::<Vec<_>>()))
                    .collect();
                handles.into_iter().map(|handle| handle.join().unwrap()).collect()
            });
            for mut frames in shared {
                frames.reverse();
                let bits = |frames: &[Image]| -> Vec<u64> {
                    frames.iter().flat_map(|frame| frame.celsius.iter().map(|celsius| celsius.to_bits())).collect()
                };
                prop_assert_eq!(bits(&frames), bits(&alone));
            }
        }
    }
}

/// The random situations show visible people and visible prints.
#[test]
fn the_situations_are_not_empty() {
    let flat = Thing {
        shape: "cuboid",
        at: [0.0; 3],
        size: [400.0, 300.0, 200.0],
        turned: [0.0; 3],
        celsius: 35.0,
        gradient: [0.0; 3],
        time_constant_s: None,
        emissivity: 0.9,
    };
    let walker = Walker {
        parts: vec![flat],
        way: vec![[0.0, 0.0], [1000.0, 0.0]],
        underside: 200.0,
        turns: true,
    };
    let mut situation = Situation {
        objects: Vec::new(),
        walkers: vec![walker],
        mat: true,
        seconds: 8.0,
    };
    let [with, _] = situation.pictures(Change::default());
    situation.walkers[0].way = vec![[1000.0, 0.0], [1000.0, 0.001]];
    let [without, _] = situation.pictures(Change::default());
    assert!(
        with.at(3, 3) > without.at(3, 3) + 0.05,
        "a print in the middle"
    );
    assert!(
        with.at(3, 0) > without.at(3, 4) + 0.5,
        "the walker at the right, which appears left"
    );
}

/// Strips that start in a corner of a face have two corners at one place. Only rounding directs the side between them,
/// which once removed whole strips from the grid's image: 0.07 °C here.
#[test]
fn a_gradient_leaves_no_holes_in_the_grid() {
    let strips = Thing {
        shape: "pyramid",
        at: [-563.1221151509994, 794.3063441670082, 500.0],
        size: [100.0, 531.4875677884426, 609.3844406708552],
        turned: [93.21322582594229, 5.7742207076939, -4.501003598551685],
        celsius: 0.0,
        gradient: [-1.466094688663767, -0.19246669554107992, 0.0],
        time_constant_s: None,
        emissivity: 0.3,
    };
    let situation = Situation {
        objects: vec![strips],
        walkers: Vec::new(),
        mat: false,
        seconds: 0.0,
    };
    let [grid, exact] = situation.pictures(Change::default());
    assert!(apart(&grid.celsius, &exact.celsius) < 0.01);
}
