//! The cost of the reference work and what it depends on: five boxes, 60°, 300 x 300 points, law B, 8 x 8 pixels, one
//! walker. Wall time, best of many rounds, so that other work counts little.
//!
//! `cargo bench -p grideye-scene --bench speed [-- PART]...`, with parts `reference`, `limit`, `cores`, `growth`.

use glam::DVec3;
use grideye_scene::{Scene, Simulator};
use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;
use std::time::{Duration, Instant};

const SCENE: &str = include_str!("reference.toml");
const WAY: &str = include_str!("way.csv");
const ROUNDS: u32 = 400;

type Part = fn(&Scene) -> Result<(), Box<dyn Error>>;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    let is_wanted = |part: &str| wanted.is_empty() || wanted.iter().any(|word| word == part);
    let scene = parse(SCENE)?;
    let parts: [(&str, Part); 4] = [
        ("reference", reference),
        ("limit", limit),
        ("cores", cores),
        ("growth", growth),
    ];
    for (part, run) in parts {
        if is_wanted(part) {
            run(&scene)?;
            println!();
        }
    }
    Ok(())
}

fn parse(text: &str) -> Result<Scene, Box<dyn Error>> {
    let files = |_: &str| Ok(WAY.to_owned());
    let loaded = Scene::parse(text, "reference.toml", &files)?;
    for warning in &loaded.warnings {
        println!("{warning}");
    }
    Ok(loaded.scene)
}

/// The times of the walk's frames.
fn moments(scene: &Scene) -> Vec<Duration> {
    let sensor = &scene.sensors()[0];
    let frames = u32::try_from(scene.frame_count(sensor)).unwrap_or(u32::MAX);
    (0..frames).map(|frame| sensor.frame_time(frame)).collect()
}

/// Microseconds of the fastest of several rounds.
fn best_us<T>(rounds: u32, work: impl Fn() -> T) -> f64 {
    let fastest = (0..rounds).map(|_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed()
    });
    1e6 * fastest.min().unwrap_or_default().as_secs_f64()
}

/// Microseconds of the fastest of [`ROUNDS`] rounds for each time. A round covers all times, so that a slow phase of
/// the machine affects some rounds rather than some times.
fn best_of_each<T>(moments: &[Duration], frame: impl Fn(Duration) -> T) -> Vec<f64> {
    let mut fastest = vec![f64::INFINITY; moments.len()];
    for _ in 0..ROUNDS {
        for (fastest, moment) in fastest.iter_mut().zip(moments) {
            *fastest = fastest.min(best_us(1, || frame(*moment)));
        }
    }
    fastest
}

/// The median and the maximum of several figures.
fn median_and_worst(mut figures: Vec<f64>) -> (f64, f64) {
    figures.sort_by(f64::total_cmp);
    let middle = figures.get(figures.len() / 2).copied().unwrap_or(0.0);
    (middle, figures.last().copied().unwrap_or(0.0))
}

fn reference(scene: &Scene) -> Result<(), Box<dyn Error>> {
    let (moments, sensor) = (moments(scene), &scene.sensors()[0]);
    println!(
        "the reference work, {} frames of a walk, microseconds per frame, best of {ROUNDS} rounds each",
        moments.len()
    );
    println!(
        "             median   worst   median by the distance of the head: < 1 m    1 to 2 m    > 2 m"
    );
    let simulator = Simulator::new(scene, &sensor.name)?;
    let costs: Vec<(f64, f64)> = moments
        .iter()
        .map(|moment| {
            let head_m = scene.agents()[0].position_m(*moment) + DVec3::new(0.0, 0.0, 1.75);
            (head_m - sensor.pose.position_m).length()
        })
        .zip(best_of_each(&moments, |moment| simulator.image(moment)))
        .collect();
    let (median, worst) = median_and_worst(costs.iter().map(|(_, cost)| *cost).collect());
    let between = |low: f64, high: f64| {
        let chosen = costs.iter().filter(|(at_m, _)| (low..high).contains(at_m));
        median_and_worst(chosen.map(|(_, cost)| *cost).collect()).0
    };
    println!(
        "{:10} {median:8.1} {worst:7.1} {:43.1} {:11.1} {:8.1}",
        "ours",
        between(0.0, 1.0),
        between(1.0, 2.0),
        between(2.0, f64::INFINITY)
    );
    let covered = moments.iter().map(|moment| {
        let share: f64 = simulator.truth(*moment).share.iter().sum();
        share / 64.0 * 90_000.0
    });
    let (median, worst) = median_and_worst(covered.collect());
    println!("points that show the person: median {median:.0}, at most {worst:.0} of 90000");
    Ok(())
}

/// The difference of the paper's grid and of exact areas from the finest possible grid.
fn limit(scene: &Scene) -> Result<(), Box<dyn Error>> {
    let sensor = &scene.sensors()[0].name;
    let finest = format!("{SCENE}pixels_per_degree = 34.1\n");
    let limit = Simulator::new(&parse(&finest)?.on_grid(), sensor)?;
    println!("from the grid of 2046 points on each axis, degrees   root mean square    largest");
    for (name, scene) in [("grid", &scene.on_grid()), ("area", scene)] {
        let simulator = Simulator::new(scene, sensor)?;
        let (mut squares, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
        for moment in moments(scene).into_iter().step_by(3) {
            let (one, other) = (simulator.image(moment), limit.image(moment));
            for (one, other) in one.celsius.iter().zip(&other.celsius) {
                squares += (one - other) * (one - other);
                count += 1.0;
                largest = largest.max((one - other).abs());
            }
        }
        println!(
            "{name:50} {:18.2e} {largest:10.2e}",
            f64::sqrt(squares / count)
        );
    }
    Ok(())
}

fn cores(scene: &Scene) -> Result<(), Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let moments = moments(scene);
    println!("frames per second, threads that share one simulator, best of {ROUNDS} rounds");
    let simulator = Simulator::new(scene, &scene.sensors()[0].name)?;
    // Every thread makes all frames of the walk twice; rounds with one thread and with all alternate.
    let seconds = |threads: usize| {
        1e-6 * best_us(1, || {
            std::thread::scope(|scope| {
                for _ in 0..threads {
                    scope.spawn(|| {
                        for moment in moments.iter().chain(&moments) {
                            black_box(simulator.image(*moment));
                        }
                    });
                }
            });
        })
    };
    let mut fastest = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        fastest = (fastest.0.min(seconds(1)), fastest.1.min(seconds(threads)));
    }
    let frames = 2.0 * float(moments.len());
    let (one, all) = (frames / fastest.0, float(threads) * frames / fastest.1);
    println!(
        "1 thread {one:9.0}   {threads} threads {all:9.0}   ratio {:.2}",
        all / one
    );
    Ok(())
}

/// `boxes` boxes that together cover the same part of the floor, and a walker.
fn room(boxes: u32, sensor: &str) -> String {
    let mut text = SCENE
        .split("[[object]]")
        .next()
        .unwrap_or_default()
        .to_owned();
    let across = f64::sqrt(f64::from(boxes)).ceil();
    let (pitch_mm, side_mm) = (1600.0 / across, 1000.0 / f64::sqrt(f64::from(boxes)));
    for index in 0..boxes {
        let (column, row) = (
            f64::from(index) % across,
            (f64::from(index) / across).floor(),
        );
        let _ = write!(
            text,
            "[[object]]\nname = \"box {index}\"\nposition_mm = [{:?}, {:?}, 0]\nsize_mm = [{side_mm:?}, {side_mm:?}, 400]\n\
             yaw_deg = {}\ntemperature_c = {}\n",
            2000.0 + pitch_mm * (column + 0.5),
            3200.0 + pitch_mm * (row + 0.5),
            index % 30,
            22 + index % 7
        );
    }
    let walker = SCENE.split("[[agent]]").nth(1).unwrap_or_default();
    let walker = walker.split("[[sensor]]").next().unwrap_or_default();
    let _ = write!(
        text,
        "[[agent]]{walker}[[sensor]]\nname = \"ceiling\"\nposition_mm = [2200, 3000, 2700]\nelevation_deg = 90\n\
         azimuth_deg = -90\nnoise_sigma_c = 0\nsampling_hz = 1\npixels_per_degree = 5\n{sensor}"
    );
    text
}

fn growth(_: &Scene) -> Result<(), Box<dyn Error>> {
    println!(
        "boxes that share 1 m2 of floor, microseconds: setup, and one frame of the walk (median)"
    );
    println!("sensor           boxes      setup   frame");
    for (name, sensor) in [
        ("8 x 8, 60", "resolution = [8, 8]\nfov_deg = [60, 60]\n"),
        ("32 x 24, 60", "resolution = [32, 24]\nfov_deg = [60, 45]\n"),
        (
            "80 x 60, 50",
            "resolution = [80, 60]\nfov_deg = [50, 37.5]\n",
        ),
    ] {
        for boxes in [1, 5, 50, 500, 1056] {
            let scene = parse(&room(boxes, sensor))?;
            let fresh = best_us(5, || Simulator::new(&scene, "ceiling"));
            let simulator = Simulator::new(&scene, "ceiling")?;
            let frames: Vec<f64> = moments(&scene)
                .iter()
                .map(|moment| best_us(10, || simulator.image(*moment)))
                .collect();
            let frame = median_and_worst(frames).0;
            println!("{name:14} {boxes:7} {fresh:10.0} {frame:7.1}");
        }
    }
    Ok(())
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of frames and points, far below 2^52"
)]
fn float(count: usize) -> f64 {
    count as f64
}
