//! A sensor beside its scene: frames, plan and verdict.

use crate::{app, ask, says};
use axum::http::Method;
use grideye_collector::{Clock, Routes};
use grideye_scene::{Scene, Simulator};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const STILL: &str = "# A warm cube below the sensor.
[room]
size_mm = [4000, 4000, 2700]
ambient_c = 20
[[object]]
name = \"cube\"
position_mm = [2000, 2000, 0]
size_mm = [700, 700, 1200]
temperature_c = 30
[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
[[sensor]]
name = \"fine\"
preset = \"grid-eye\"
resolution = [16, 16]
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
";

/// A person walks from left to right for 6 s.
const WALK: &str = "[room]
size_mm = [4000, 4000, 2700]
ambient_c = 20
[[agent]]
name = \"ana\"
size_mm = [300, 500, 1700]
temperature_c = 30
trajectory = \"way.csv\"
speed_mm_per_s = 500
[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
";

const WAY: &str = "x_mm,y_mm,z_mm\n500,2000,0\n3500,2000,0\n";

/// The same walk from second 2 on, in seconds and by UTC; frame 0 is of 1970-01-01T00:00:00.
const LATE_WAY: &str = "t_s,x_mm,y_mm\n2,500,2000\n8,3500,2000\n";
const UTC_WAY: &str =
    "x_mm,y_mm,utc\n500,2000,1970-01-01T00:00:02Z\n3500,2000,1970-01-01T01:00:08+01:00\n";

/// Parses a scene that may name the trajectory.
fn scene(text: &str) -> Scene {
    let beside = |name: &str| match name {
        "way.csv" => Ok(WAY.to_owned()),
        "late.csv" => Ok(LATE_WAY.to_owned()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    };
    Scene::parse(text, "scene", &beside).unwrap().scene
}

/// A clock that stands still unless advanced.
#[derive(Default)]
struct HandClock(AtomicU64);

impl Clock for HandClock {
    fn utc_ns(&self) -> i64 {
        0
    }

    fn monotonic(&self) -> Duration {
        Duration::from_millis(self.0.load(Ordering::SeqCst))
    }
}

struct Page {
    router: Routes,
    clock: Arc<HandClock>,
    folder: tempfile::TempDir,
}

impl Page {
    async fn new(scenes: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let clock = Arc::new(HandClock::default());
        let page = Self {
            router: app(folder.path(), clock.clone()).await,
            clock,
            folder,
        };
        page.write("way.csv", WAY);
        for (name, text) in scenes {
            page.write(name, text);
        }
        page
    }

    /// Advances the clock until a comparison may be computed again.
    fn rest(&self) {
        self.clock.0.fetch_add(2_000, Ordering::SeqCst);
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.path().join(name), text).unwrap();
    }

    async fn get(&self, path: &str) -> (u16, Value) {
        ask(&self.router, Method::GET, path, None).await
    }

    async fn send(&self, path: &str, body: &Value) -> (u16, Value) {
        ask(&self.router, Method::POST, path, Some(body)).await
    }

    /// Posts what a sensor would send that sees exactly the simulated scene, starting at a frame number.
    async fn post(&self, scene: &str, from_seq: u64, frames: u64) {
        let text = std::fs::read_to_string(self.folder.path().join(scene)).unwrap();
        let simulator = Simulator::new(&self::scene(&text), "ceiling").unwrap();
        let frames: Vec<Value> = (from_seq..from_seq + frames)
            .map(|seq| {
                let time = Duration::from_millis(100 * seq);
                let image = simulator.noisy(time, 5).celsius;
                // The datasheet's quarter of a degree, rounded.
                let words: Vec<i64> = image.iter().map(|celsius| quarters(*celsius)).collect();
                json!({
                    "seq": seq, "t_boot_ns": ORIGIN_NS + seq * 100_000_000, "t_utc_ns": seq * 100_000_000,
                    "clock": "synced", "pixels_raw": words, "thermistor_raw": 400,
                })
            })
            .collect();
        let batch = json!({
            "device": "pi-1", "boot": "b1",
            "sensors": [{ "sensor": "s1", "frames": frames }],
        });
        let (status, answer) = self.send("/v1/frames", &batch).await;
        assert_eq!(status, 200, "{answer}");
    }
}

/// The boot clock at frame 0.
const ORIGIN_NS: u64 = 50_000_000_000;

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "room temperatures"
)]
fn quarters(celsius: f64) -> i64 {
    (celsius * 4.0).round() as i64
}

const COMPARISON: &str = "sensors/ceiling/comparison?device=pi-1&of=s1";

#[tokio::test]
async fn scenes_are_listed_with_their_sensors_or_their_error() {
    let page = Page::new(&[
        ("still.toml", STILL),
        ("walk.toml", WALK),
        ("broken.toml", "[room]\nsize_mm = 3\n"),
        ("notes.txt", "no scene"),
    ])
    .await;
    let elsewhere = tempfile::tempdir().unwrap();
    let secret = elsewhere.path().join("secret.toml");
    std::fs::write(&secret, "secret").unwrap();
    std::os::unix::fs::symlink(&secret, page.folder.path().join("linked.toml")).unwrap();
    std::os::unix::fs::symlink(&secret, page.folder.path().join("linked.csv")).unwrap();
    page.write("sly.toml", &WALK.replace("way.csv", "linked.csv"));
    let (status, list) = page.get("/v1/scenes").await;
    assert_eq!(status, 200);
    let scenes = list["scenes"].as_array().unwrap();
    let names: Vec<&str> = scenes
        .iter()
        .map(|scene| scene["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["broken", "linked", "sly", "still", "walk"]);
    says(&scenes[0]["error"], "broken.toml:2");
    for linked in &scenes[1..3] {
        says(&linked["error"], "it is not a file in the scenes folder");
    }
    let scenes = &scenes[2..];
    assert_eq!(scenes[1]["title"], "A warm cube below the sensor.");
    assert_eq!(scenes[1]["moves"], false);
    let fits = |sensor: usize| scenes[1]["sensors"][sensor]["fits"].clone();
    assert_eq!((fits(0), fits(1)), (json!(true), json!(false)));
    assert_eq!(scenes[2]["moves"], true);
    assert_eq!(scenes[2]["seconds"], 6.0);
}

#[tokio::test]
async fn a_scene_that_changes_is_read_again() {
    let page = Page::new(&[("still.toml", STILL)]).await;
    let hottest = |(status, piece): (u16, Value)| {
        assert_eq!(status, 200, "{piece}");
        let frame = piece["frames"][0].as_array().unwrap().clone();
        let celsius = frame.iter().filter_map(Value::as_f64);
        celsius.fold(0.0, f64::max)
    };
    let path = "/v1/scenes/still/sensors/ceiling/frames?at_s=0";
    let before = hottest(page.get(path).await);
    page.write(
        "still.toml",
        &STILL.replace("temperature_c = 30", "temperature_c = 40.0"),
    );
    let after = hottest(page.get(path).await);
    assert!(after > before + 2.0, "{before} then {after}");
}

#[tokio::test]
async fn simulated_frames_come_in_pieces_with_the_agents_positions() {
    let page = Page::new(&[("walk.toml", WALK)]).await;
    let path = "/v1/scenes/walk/sensors/ceiling/frames?at_s=";
    let (_, first) = page.get(&format!("{path}0")).await;
    assert_eq!(first["first"], 0);
    assert_eq!(first["frames"].as_array().unwrap().len(), 50);
    assert_eq!(first["agents"][0]["at_m"][0], json!([0.5, 2.0]));
    // 500 mm per second.
    assert_eq!(first["agents"][0]["at_m"][20], json!([1.5, 2.0]));
    assert_eq!(first["agents"][0]["front_deg"][20], 0.0);
    // 6 s are 61 frames: 50 and 11; a request beyond the end gets the last piece.
    for second in ["5", "6", "600"] {
        let (_, last) = page.get(&format!("{path}{second}")).await;
        assert_eq!(last["first"], 50, "{second}");
        assert_eq!(last["frames"].as_array().unwrap().len(), 11, "{second}");
        assert_eq!(last["agents"][0]["at_m"][10], json!([3.5, 2.0]));
    }
    // Against the simulator itself, to the hundredth that is sent.
    let image = Simulator::new(&scene(WALK), "ceiling").unwrap();
    let image = image.image(Duration::from_millis(3100)).celsius;
    let sent = first["frames"][31].as_array().unwrap();
    for (sent, simulated) in sent.iter().zip(image) {
        assert!((sent.as_f64().unwrap() - simulated).abs() < 0.0051);
    }
}

#[tokio::test]
async fn missing_things_get_errors_with_hints() {
    let page = Page::new(&[("still.toml", STILL), ("walk.toml", WALK)]).await;
    for (status, code, path) in [
        (404, "no_such_scene", "none/room?at_s=0"),
        (404, "no_such_scene", "..%2Fstill/room?at_s=0"),
        (404, "no_such_sensor", "still/sensors/wall/frames?at_s=0"),
        (422, "unusable_scene", "still/sensors/fine/frames?at_s=0"),
        (422, "no_origin_ns", "walk/COMPARISON"),
        (422, "wrong_value", "still/COMPARISON&seconds=1e9"),
        (404, "no_such_recording", "still/COMPARISON&recording=7"),
    ] {
        let path = format!("/v1/scenes/{}", path.replace("COMPARISON", COMPARISON));
        let (found, answer) = page.get(&path).await;
        let told = (found, answer["error"]["code"].as_str());
        assert_eq!(told, (status, Some(code)), "{path}: {answer}");
    }
}

/// The tangent of half the view of 60 degrees times the height of 2.7 m: as far the sensor sees the floor to each side.
const REACH_M: f64 = 1.559;

#[tokio::test]
async fn a_room_has_who_is_where_and_what_each_pixel_sees() {
    let page = Page::new(&[("still.toml", STILL), ("walk.toml", WALK)]).await;
    let (_, still) = page.get("/v1/scenes/still/room?at_s=0").await;
    assert_eq!(still["room"]["outline_m"].as_array().unwrap().len(), 4);
    assert_eq!(still["items"][0]["at_m"], json!([2.0, 2.0, 2.7]));
    let shapes = still["drawing"]["shapes"].as_array().unwrap();
    assert!(shapes.iter().any(|shape| shape["name"] == "cube"));
    // The first pixel sees the corner of the field of view, and the sensor's columns run from +y.
    let floor = still["drawing"]["sides"].as_array().unwrap().iter();
    let footprints = floor.flat_map(|side| side["footprints"].as_array().unwrap());
    let corners: Vec<f64> = footprints
        .filter(|one| one[0] == 0)
        .flat_map(|one| one[2].as_array().unwrap())
        .map(|corner| (corner[0].as_f64().unwrap() - 2.0).abs())
        .collect();
    let far = corners.iter().copied().fold(0.0, f64::max);
    assert!((far - REACH_M).abs() < 0.002, "{far}");
    // 300 by 500 mm about its own position, half a meter on each second.
    for (at_s, x_m) in [(0, 0.5), (2, 1.5), (99, 3.5)] {
        let (_, walk) = page.get(&format!("/v1/scenes/walk/room?at_s={at_s}")).await;
        assert_eq!(walk["items"][0]["at_m"], json!([x_m, 2.0, 0.0]), "{at_s}");
    }
}

#[tokio::test]
async fn frames_of_the_scene_itself_agree_and_the_floors_stand_beside() {
    let page = Page::new(&[("still.toml", STILL), ("walk.toml", WALK)]).await;
    let path = format!("/v1/scenes/walk/{COMPARISON}&origin_ns={ORIGIN_NS}&seconds=20");
    let (_, none) = page.get(&path).await;
    assert_eq!(none["comparison"], Value::Null);
    says(&none["why"], "no frame");
    // The walk takes 6 s; frames after its end are not compared.
    page.post("walk.toml", 0, 90).await;
    page.rest();
    let (_, answer) = page.get(&path).await;
    assert_eq!(answer["frames"], 61, "{answer}");
    assert_eq!(
        (&answer["from_s"], &answer["to_s"]),
        (&json!(0.0), &json!(6.0))
    );
    let comparison = &answer["comparison"];
    assert_eq!(comparison["verdict"], "agrees", "{comparison:#}");
    let score = &comparison["scores"]["correlation"];
    let number = |score: &Value| score.as_f64().unwrap();
    assert!(number(&score["value"]) > 0.7, "{score}");
    assert!(number(&score["shuffled"]["mean"]).abs() < 0.3, "{score}");
    assert!(number(&score["ceiling"]) > 0.8, "{score}");
    assert!(number(&comparison["scores"]["image_similarity"]["blank"]) > 0.5);
}

#[tokio::test]
async fn a_scene_with_stamps_is_joined_by_time() {
    let walk = |way: &str| {
        WALK.replace("way.csv", way)
            .replace("speed_mm_per_s = 500\n", "")
    };
    let (late, stamped) = (walk("late.csv"), walk("utc.csv"));
    let page = Page::new(&[
        ("late.toml", &late),
        ("utc.toml", &stamped),
        ("late.csv", LATE_WAY),
        ("utc.csv", UTC_WAY),
    ])
    .await;
    let (_, scenes) = page.get("/v1/scenes").await;
    let starts: Vec<&Value> = scenes["scenes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|scene| &scene["starts_utc"])
        .collect();
    assert_eq!(starts, [&Value::Null, &json!("1970-01-01T00:00:02Z")]);

    let path = format!("/v1/scenes/utc/{COMPARISON}&seconds=20");
    let (_, none) = page.get(&path).await;
    says(&none["why"], "no frame with a set clock");
    page.post("late.toml", 0, 15).await;
    page.rest();
    let (_, early) = page.get(&path).await;
    says(
        &early["why"],
        "from 1970-01-01T00:00:00Z to 1970-01-01T00:00:01.4Z",
    );
    page.post("late.toml", 15, 105).await;
    page.rest();
    // A wrong start given by hand is not used.
    let (_, answer) = page.get(&format!("{path}&origin_ns=1")).await;
    assert_eq!(answer["frames"], 61, "{answer}");
    assert_eq!(
        (&answer["from_s"], &answer["to_s"]),
        (&json!(0.0), &json!(6.0))
    );
    assert_eq!(answer["origin_ns"], ORIGIN_NS + 2_000_000_000);
    assert_eq!(answer["comparison"]["verdict"], "agrees", "{answer:#}");
}

#[tokio::test]
async fn another_scene_than_the_one_that_was_there_does_not_agree() {
    let page = Page::new(&[("still.toml", STILL), ("walk.toml", WALK)]).await;
    let path = format!("/v1/scenes/still/{COMPARISON}");
    page.post("walk.toml", 0, 60).await;
    let (_, answer) = page.get(&path).await;
    assert_eq!(answer["frames"], 60, "{answer}");
    assert_ne!(answer["comparison"]["verdict"], "agrees", "{answer:#}");
}

#[tokio::test]
async fn frames_of_a_recording_are_compared_up_to_the_asked_one() {
    let page = Page::new(&[("walk.toml", WALK)]).await;
    let (_, recording) = page
        .send("/v1/recordings", &json!({ "name": "walk" }))
        .await;
    page.post("walk.toml", 0, 90).await;
    let id = &recording["id"];
    let path = format!("/v1/scenes/walk/{COMPARISON}&origin_ns={ORIGIN_NS}&recording={id}&boot=b1");
    let (_, answer) = page.get(&format!("{path}&through_seq=40&seconds=2")).await;
    assert_eq!(
        (&answer["frames"], &answer["to_s"]),
        (&json!(21), &json!(4.0))
    );
    let (status, answer) = page.get(&path.replace("b1", "b2")).await;
    assert_eq!(
        (status, &answer["error"]["code"]),
        (404, &json!("no_such_stream"))
    );
}

#[tokio::test]
async fn the_same_question_gets_the_same_answer_until_it_is_due_again() {
    let page = Page::new(&[("still.toml", STILL)]).await;
    let path = format!("/v1/scenes/still/{COMPARISON}");
    page.post("still.toml", 0, 20).await;
    let (_, first) = page.get(&path).await;
    assert_eq!(first["frames"], 20);
    page.post("still.toml", 20, 20).await;
    assert_eq!(page.get(&path).await.1, first);
    // A different question gets its own answer.
    let (_, other) = page.get(&format!("{path}&seconds=3")).await;
    assert_eq!(other["frames"], 31);
    page.rest();
    assert_eq!(page.get(&path).await.1["frames"], 40);
}

#[tokio::test]
async fn a_body_with_frames_to_compare_has_at_most_a_mebibyte() {
    let page = Page::new(&[("still.toml", STILL)]).await;
    let path = format!("/v1/scenes/still/{COMPARISON}");
    // A text as JSON: its quotation marks are part of the body.
    let body = |bytes: usize| Value::String("x".repeat(bytes - 2));
    let (longest, answer) = page.send(&path, &body(1 << 20)).await;
    assert_eq!(longest, 422, "{answer}");
    let (longer, answer) = page.send(&path, &body((1 << 20) + 1)).await;
    assert_eq!(longer, 413, "{answer}");
}
