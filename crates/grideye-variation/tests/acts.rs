//! What people do one after another: how fast, where, and what is refused.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use glam::DVec3;
use grideye_scene::{Agent, Doing, Scene};
use grideye_variation::Recipe;
use std::collections::BTreeMap;
use std::time::Duration;

const ROOM: &str = "collisions = \"error\"\n[room]\nsize_mm = [5000, 6000, 2700]\nambient_c = 20\n\
    [[object]]\nname = \"table\"\nposition_mm = [2500, 3000, 0]\nsize_mm = [1200, 800, 750]\n\
    [[agent]]\nname = \"lamp\"\nposition_mm = [400, 400, 0]\nsize_mm = [300, 300, 1800]\ntemperature_c = 30\n\
    [[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2500, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

fn person(name: &str) -> String {
    let y_mm = 1000 * name.len() - 2000;
    format!(
        "[[agent]]\nname = \"{name}\"\nposition_mm = [1000, {y_mm}, 0]\nyaw_deg = 10\nperson = {{ height_mm = 1700 }}\n"
    )
}

fn no_files(_: &str) -> std::io::Result<String> {
    Err(std::io::ErrorKind::NotFound.into())
}

fn recipe(text: &str, asked: &[&str]) -> Result<Recipe, String> {
    let asked: Vec<String> = asked.iter().map(|asked| (*asked).to_owned()).collect();
    let recipe = Recipe::new(text, "room.toml", &asked).map_err(|error| error.to_string())?;
    recipe.check(&no_files).map_err(|error| error.to_string())?;
    Ok(recipe)
}

fn drawn(recipe: &Recipe, seed: u64, index: u64) -> Scene {
    let draw = recipe.draw(seed, index);
    recipe.scene(seed, index, &draw, &no_files).unwrap().scene
}

fn agent<'a>(scene: &'a Scene, name: &str) -> &'a Agent {
    scene
        .agents()
        .iter()
        .find(|agent| agent.name == name)
        .unwrap()
}

/// What a person does, and for how many seconds, seen every hundredth of a second.
fn seen(agent: &Agent) -> Vec<(Option<Doing>, f64)> {
    let mut seen: Vec<(Option<Doing>, f64)> = Vec::new();
    let moment = |hundredth: u32| Duration::from_millis(10 * u64::from(hundredth) + 5);
    let end = agent.duration();
    for time in (0..).map(moment).take_while(|time| *time < end) {
        let doing = agent.doing(time);
        match seen.last_mut() {
            Some((last, seconds)) if *last == doing => *seconds += 0.01,
            _ => seen.push((doing, 0.01)),
        }
    }
    seen
}

fn order(agent: &Agent) -> String {
    let seen = seen(agent);
    let words = seen
        .iter()
        .map(|(doing, _)| doing.map_or("away", Doing::name));
    words.collect::<Vec<_>>().join(" ")
}

const EVERYTHING: &str = "away:1 enter stand:2 sit:3..4 walk fall:2 walk lie:2 leave away:1";

/// Falls take 0.5 to 1 s (0.58 and 0.72 s on the mean: Choi 2015, Robinovitch 2005), sitting down and standing up 1 to
/// 2 s (1.97 and 1.91 s: Kerr 1997), and people indoors walk at 0.4 to 1.2 m/s.
#[test]
fn movements_take_as_long_as_those_of_people() {
    let recipe = recipe(
        &format!("{ROOM}{}", person("anna")),
        &[&format!("agent.anna.acts={EVERYTHING}")],
    )
    .unwrap();
    let mut seconds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for index in 0..30 {
        let scene = drawn(&recipe, 1, index);
        let anna = agent(&scene, "anna");
        assert_eq!(
            order(anna),
            "away enter stand sit-down sit stand-up walk fall lie get-up walk sit-down lie-down lie sit-up stand-up leave away"
        );
        for (doing, took_s) in seen(anna) {
            seconds
                .entry(doing.map_or("away", Doing::name))
                .or_default()
                .push(took_s);
        }
        let way = anna.trajectory.as_ref().unwrap();
        let step = Duration::from_millis(100);
        let walks = (0..)
            .map(|step| Duration::from_millis(100 * step))
            .take_while(|time| *time < way.duration());
        let is_walking = |time: &Duration| {
            [*time, *time + step]
                .iter()
                .all(|time| anna.doing(*time) == Some(Doing::Walk))
        };
        for time in walks.filter(is_walking) {
            let speed = way.position_m(time).distance(way.position_m(time + step)) / 0.1;
            assert!(
                (0.39..1.21).contains(&speed),
                "{index} {time:?}: {speed} m/s"
            );
        }
    }
    for (doing, low_s, high_s) in [
        ("fall", 0.5, 1.0),
        ("sit-down", 1.0, 2.0),
        ("stand-up", 1.0, 2.0),
        ("sit", 3.0, 4.0),
        ("lie", 2.0, 2.0),
    ] {
        let all = &seconds[doing];
        let few = |took_s: &&f64| !(low_s - 0.03..high_s + 0.03).contains(*took_s);
        assert_eq!(all.iter().find(few), None, "{doing}: {all:?}");
        let spread =
            all.iter().copied().fold(0.0, f64::max) - all.iter().copied().fold(9.0, f64::min);
        assert!(spread >= 0.6 * (high_s - low_s), "{doing}: {all:?}");
    }
}

/// By the scene's own search for collisions, of standing bodies over the whole path, and by the bodies' boxes.
#[test]
fn nobody_runs_into_anything_or_leaves_the_room() {
    let people = ["anna", "bob", "carla"].map(person).concat();
    let recipe = recipe(
        &format!("{ROOM}{people}"),
        &[
            "agent.anna.acts=enter walk sit leave,walk fall walk",
            "agent.bob.acts=walk lie walk,enter walk fall",
            "agent.carla.acts=sit walk stand walk leave away enter,fall",
        ],
    )
    .unwrap();
    let mut fell = 0;
    for index in 0..40 {
        let draw = recipe.draw(3, index);
        let loaded = recipe.scene(3, index, &draw, &no_files).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let scene = loaded.scene;
        assert_eq!(scene.contacts(), []);
        let (low, high) = scene.room().bounds_m();
        let steps = (0..).map(|step| Duration::from_millis(100 * step));
        for time in steps.take_while(|time| *time < scene.duration()) {
            let mut boxes = Vec::new();
            for agent in scene.agents() {
                let bodies = agent.bodies_at(time);
                let bounds = bodies.iter().map(|body| body.mesh.bounds_m());
                let around = bounds.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |all, one| {
                    (all.0.min(one.0), all.1.max(one.1))
                });
                fell += usize::from(agent.doing(time) == Some(Doing::Fall));
                if !bodies.is_empty() {
                    // A foot of who walks beside a wall may be through the door already, by half a step less the
                    // body's radius (at most 0.17 m here); nobody else moves its feet apart.
                    let walks = matches!(
                        agent.doing(time),
                        Some(Doing::Walk | Doing::Enter | Doing::Leave)
                    );
                    let beyond = if walks { 0.2 } else { 0.01 };
                    assert!(
                        around.0.truncate().cmpge(low.truncate() - beyond).all()
                            && around.1.truncate().cmple(high.truncate() + beyond).all(),
                        "{index} {} {:?} at {time:?}: {around:?}",
                        agent.name,
                        agent.doing(time)
                    );
                    boxes.push((agent, bodies));
                }
            }
            for (number, (one, bodies)) in boxes.iter().enumerate() {
                for (other, others) in &boxes[..number] {
                    let centers = |bodies: &[grideye_scene::Body]| {
                        let centers = bodies.iter().map(|body| {
                            let (low, high) = body.mesh.bounds_m();
                            0.5 * (low + high)
                        });
                        centers.collect::<Vec<_>>()
                    };
                    for one_m in centers(bodies) {
                        for other_m in centers(others) {
                            assert!(
                                one_m.distance(other_m) > 0.05,
                                "{index} {} {} at {time:?}",
                                one.name,
                                other.name
                            );
                        }
                    }
                }
            }
        }
    }
    assert!(fell > 10, "{fell}");
}

#[test]
fn ways_depend_on_seed_and_number_alone() {
    let text = format!("{ROOM}{}{}", person("anna"), person("bob"));
    let asked = ["agent.anna.acts=walk sit,fall", "agent.bob.acts=enter walk"];
    let recipe = recipe(&text, &asked).unwrap();
    let way = |seed, index| {
        agent(&drawn(&recipe, seed, index), "anna")
            .trajectory
            .clone()
    };
    assert_eq!(way(1, 5), way(1, 5));
    assert_ne!(way(1, 5), way(1, 6));
    assert_ne!(way(1, 5), way(2, 5));
    // The chosen acts are a column, and each choice comes.
    assert_eq!(recipe.columns()[0].name, "agent.anna.acts");
    let values: Vec<String> = (0..40)
        .map(|index| format!("{:?}", recipe.draw(1, index).values[0]))
        .collect();
    for choice in ["walk sit", "fall"] {
        let count = values
            .iter()
            .filter(|value| value.contains(&format!("\"{choice}\"")))
            .count();
        assert!((8..33).contains(&count), "{choice}: {count}");
    }
}

/// A clip starts at a drawn moment, and is over by when everything is done, if it is shorter than that.
#[test]
fn clips_are_consecutive_and_show_all_of_what_is_done() {
    let recipe = recipe(
        &format!("{ROOM}{}", person("anna")),
        &["agent.anna.acts=walk walk fall"],
    )
    .unwrap();
    let (mut starts, mut falls) = (Vec::new(), 0);
    for index in 0..60 {
        let draw = recipe.draw(1, index);
        let scene = drawn(&recipe, 1, index);
        let sensor = scene.sensor("ceiling").unwrap();
        let times = recipe.times((1, index, 30), &draw, &scene, sensor);
        assert_eq!(times.len(), 30);
        for pair in times.windows(2) {
            assert_eq!((pair[1] - pair[0]).as_millis(), 100);
        }
        assert!(times[29] <= scene.duration());
        starts.push(times[0].as_secs_f64() / (scene.duration().as_secs_f64() - 2.9));
        falls += usize::from(
            times
                .iter()
                .any(|time| scene.agents()[1].doing(*time) == Some(Doing::Fall)),
        );
        let long = recipe.times((1, index, 3000), &draw, &scene, sensor);
        assert_eq!(long[0], Duration::ZERO);
    }
    // Uniform: the mean of 60 is within three standard errors of a half.
    let mean = starts.iter().sum::<f64>() / 60.0;
    assert!(
        (mean - 0.5).abs() < 3.0 * (1.0_f64 / 12.0 / 60.0).sqrt(),
        "{mean}"
    );
    assert!((5..55).contains(&falls), "{falls}");
}

#[test]
fn mistakes_are_refused_with_what_to_write() {
    let text = format!("{ROOM}{}", person("anna"));
    for (asked, words) in [
        (
            "agent.anna.acts=run",
            "`run` is no act\nhint: write enter, walk",
        ),
        ("agent.anna.acts=walk enter", "in the room already"),
        ("agent.lamp.acts=walk", "only a person can do something"),
        ("agent.berta.acts=walk", "no agent `berta`"),
        ("agent.anna.acts=sit:long", "how many seconds"),
    ] {
        let refused = recipe(&text, &[asked]).unwrap_err();
        assert!(refused.contains(words), "{asked}: {refused}");
    }
    for also in ["agent.anna.position=floor", "agent.anna.yaw_deg=0..90"] {
        let refused = recipe(&text, &["agent.anna.acts=walk", also]).unwrap_err();
        assert!(
            refused.contains("it overlaps with `agent.anna.acts=walk`: acts place the person"),
            "{refused}"
        );
    }
    let both = [
        "agent.anna.position=floor",
        "agent.anna.position_mm=[1, 2, 0]",
    ];
    let refused = recipe(&text, &both).unwrap_err();
    assert!(
        refused.contains(": position=floor places the agent\nhint: "),
        "{refused}"
    );
    // No walk of 0.8 m fits into a closet.
    let closet = text
        .replace("[5000, 6000, 2700]", "[900, 900, 2700]")
        .replace("[2500, 3000, 2700]", "[450, 450, 2700]")
        .replace("[1000, 2000, 0]", "[450, 450, 0]")
        .replace(
            "[400, 400, 0]\nsize_mm = [300, 300, 1800]",
            "[850, 850, 0]\nsize_mm = [10, 10, 10]",
        );
    let recipe = recipe(&closet, &["agent.anna.acts=walk"]);
    let recipe = recipe.unwrap();
    let draw = recipe.draw(1, 0);
    let refused = recipe
        .scene(1, 0, &draw, &no_files)
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("frame 0: no free way for `anna` to walk in 10000 tries\nhint: "),
        "{refused}"
    );
}
