//! The editor's routes: open, draft, save, coverage.

use crate::{app, ask, says};
use axum::http::Method;
use grideye_collector::{Routes, SystemClock};
use grideye_scene::{Scene, Simulator};
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

const ROOM: &str = "# A room, for trying.
[room]
size_mm = [4000, 4000, 2700] # measured
ambient_c = 20

[[object]]
name = \"cube\"
position_mm = [2000, 2000, 0]
size_mm = [700, 700, 1200]
temperature_c = 30

[[agent]]
name = \"ana\"
size_mm = [300, 500, 1700]
temperature_c = 30
trajectory = \"ways/way.csv\"
speed_mm_per_s = 500

[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
";
const WAY: &str = "# to the window\nx_mm,y_mm,z_mm\n500,1000,0\n3500,1000,0\n";

/// A folder with one scene and its trajectory, and the collector's routes on it.
struct Page {
    folder: tempfile::TempDir,
    app: Routes,
}

impl Page {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("scenes/ways")).unwrap();
        fs::write(folder.path().join("scenes/room.toml"), ROOM).unwrap();
        fs::write(folder.path().join("scenes/ways/way.csv"), WAY).unwrap();
        let scenes = folder.path().join("scenes");
        let app = app(&scenes, Arc::new(SystemClock::new())).await;
        Self { folder, app }
    }

    fn scene(&self, file: &str) -> PathBuf {
        self.folder.path().join("scenes").join(file)
    }

    async fn post(&self, what: &str, body: Value) -> (u16, Value) {
        let path = format!("/v1/editor/{what}");
        ask(&self.app, Method::POST, &path, Some(&body)).await
    }

    async fn draft(&self, text: &str, edits: Value) -> Value {
        let (status, answer) = self
            .post("draft", json!({ "text": text, "edits": edits }))
            .await;
        assert_eq!(status, 200, "{answer}");
        answer
    }

    async fn open(&self, name: &str) -> (u16, Value) {
        let path = format!("/v1/editor/scenes/{name}");
        ask(&self.app, Method::GET, &path, None).await
    }

    async fn save(&self, name: &str, body: Value) -> (u16, Value) {
        let path = format!("/v1/editor/scenes/{name}");
        ask(&self.app, Method::PUT, &path, Some(&body)).await
    }
}

/// The status and code of an error response.
fn code((status, answer): &(u16, Value)) -> (u16, &str) {
    (
        *status,
        answer["error"]["code"].as_str().unwrap_or_default(),
    )
}

/// What the simulator itself gives for a text.
fn simulated(text: &str, way: &str, second: u64) -> Vec<f64> {
    let files = |_: &str| Ok(way.to_owned());
    let scene = Scene::parse(text, "scene", &files).unwrap().scene;
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    simulator.image(Duration::from_secs(second)).celsius
}

fn celsius(answer: &Value) -> Vec<f64> {
    serde_json::from_value(answer["frames"][0]["celsius"].clone()).unwrap()
}

fn assert_near(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len());
    for (one, other) in found.iter().zip(wanted) {
        assert!((one - other).abs() <= 0.005 + 1e-9, "{found:?} {wanted:?}");
    }
}

#[tokio::test]
async fn a_draft_shows_what_is_where_and_what_every_sensor_sees() {
    let page = Page::new().await;
    let answer = page.draft(ROOM, json!([])).await;
    assert_eq!(answer["text"], ROOM);
    assert_eq!(answer["fault"], Value::Null);
    assert_near(&celsius(&answer), &simulated(ROOM, WAY, 0));
    assert_eq!(answer["read"]["ways/way.csv"]["text"], WAY);
    let items = answer["scene"]["items"].as_array().unwrap();
    let names: Vec<&str> = items
        .iter()
        .filter_map(|item| item["name"].as_str())
        .collect();
    assert_eq!(names, ["cube", "ana", "ceiling"]);
    let square = json!([[1.65, 1.65], [2.35, 1.65], [2.35, 2.35], [1.65, 2.35]]);
    assert_eq!(items[0]["bodies"][0]["outline_m"], square);
    assert_eq!(
        items[1]["way"]["points_m"],
        json!([[0.5, 1.0, 0.0], [3.5, 1.0, 0.0]])
    );
    assert_eq!(answer["scene"]["seconds"], 6.0);
}

#[tokio::test]
async fn edits_change_the_frames_and_keep_every_comment() {
    let page = Page::new().await;
    let edits = json!([
        { "does": "set", "path": ["sensor", 0, "position_mm"], "to": [1500, 2000, 2700] },
        { "does": "move-way-point", "file": "ways/way.csv", "row": 0, "to_mm": [500, 3000, 0] },
    ]);
    let answer = page.draft(ROOM, edits).await;
    let text = ROOM.replace("[2000, 2000, 2700]", "[1500, 2000, 2700]");
    let way = WAY.replace("500,1000,0\n3", "500,3000,0\n3");
    assert_eq!(answer["text"], text);
    assert_eq!(answer["files"]["ways/way.csv"], way);
    assert_near(&celsius(&answer), &simulated(&text, &way, 0));
}

#[tokio::test]
async fn another_second_has_people_elsewhere_and_one_beyond_the_end_is_the_last() {
    let page = Page::new().await;
    for (at_s, second, x) in [(3.0, 3, 2.0), (1e9, 6, 3.5), (-1.0, 0, 0.5)] {
        let body = json!({ "text": ROOM, "at_s": at_s });
        let (_, answer) = page.post("draft", body).await;
        assert_near(&celsius(&answer), &simulated(ROOM, WAY, second));
        assert_eq!(answer["scene"]["items"][1]["at_m"][0], x);
    }
}

/// Each key of a person changes its text by that key alone, and the frames as the simulator has them.
#[tokio::test]
async fn a_person_is_added_and_changed_key_by_key() {
    let page = Page::new().await;
    let add = json!([{ "does": "add", "kind": "agent", "name": "eve", "at_mm": [2000, 3000, 0] }]);
    let answer = page.draft(ROOM, add).await;
    let eve = "[[agent]]\nname = \"eve\"\nposition_mm = [2000, 3000, 0]\nperson = {}\n\n[[sensor]]";
    let mut text = ROOM.replace("[[sensor]]", eve);
    assert_eq!(answer["text"], text);
    let mut before = celsius(&answer);
    assert_near(&before, &simulated(&text, WAY, 0));
    assert_eq!(answer["scene"]["items"][2]["keys"]["person"], json!({}));
    let person = |key: &str| json!(["agent", 1, "person", key]);
    let (mut keys, mut old) = (Vec::new(), "person = {}".to_owned());
    for (path, to, written) in [
        (person("height_mm"), json!(1500), "height_mm = 1500"),
        (person("build"), json!("stout"), "build = \"stout\""),
        (person("posture"), json!("sit"), "posture = \"sit\""),
        (person("clothing"), json!("coat"), "clothing = \"coat\""),
        (json!(["agent", 1, "yaw_deg"]), json!(135), ""),
    ] {
        let edits = json!([{ "does": "set", "path": path, "to": to }]);
        let answer = page.draft(&text, edits).await;
        keys.extend(Some(written).filter(|written| !written.is_empty()));
        let yaw = if written.is_empty() {
            "\nyaw_deg = 135"
        } else {
            ""
        };
        let new = format!("person = {{ {} }}{yaw}", keys.join(", "));
        text = text.replace(&old, &new);
        old = new;
        assert_eq!(answer["text"], text);
        let now = celsius(&answer);
        assert_near(&now, &simulated(&text, WAY, 0));
        assert_ne!(now, before, "{path}");
        before = now;
    }
    let answer = page.draft(&text, json!([])).await;
    let item = &answer["scene"]["items"][2];
    assert_eq!(item["faces_deg"], 135.0);
    assert_eq!(
        item["keys"]["person"],
        json!({ "height_mm": 1500, "build": "stout", "posture": "sit", "clothing": "coat" })
    );
    // A number in place of a word, and the number that a word stands for.
    assert_eq!(item["person"], json!({ "build": 1.15, "clothing": 2.0 }));
    let edits = json!([{ "does": "set", "path": person("clothing"), "to": 1 }]);
    let answer = page.draft(&text, edits).await;
    let lighter = text.replace("\"coat\"", "1");
    assert_eq!(answer["text"], lighter);
    assert_near(&celsius(&answer), &simulated(&lighter, WAY, 0));
    // Beyond the rule's limits, nothing changes, and the answer names the place.
    let edits = json!([{ "does": "set", "path": person("height_mm"), "to": 2801 }]);
    let answer = page.draft(&text, edits).await;
    says(&answer["fault"]["message"], "500 to 2800 mm");
    says(&answer["fault"]["hint"], "height when standing");
    assert_eq!(answer["fault"]["place"]["line"], 22);
}

/// A walker's outline turns with its way; a box around its segments on the plan is as long ahead as aside is wide.
#[tokio::test]
async fn a_walking_person_faces_where_it_goes() {
    let page = Page::new().await;
    let text = ROOM.replace(
        "size_mm = [300, 500, 1700]\ntemperature_c = 30\n",
        "person = { posture = \"stand\" }\nyaw_deg = 45\n",
    );
    let corner = "x_mm,y_mm,z_mm\n500,500,0\n3500,500,0\n3500,3500,0\n";
    for (at_s, faces_deg, across, along) in [(3.0, 0.0, 0, 1), (9.0, 90.0, 1, 0)] {
        let body = json!({ "text": text, "files": { "ways/way.csv": corner }, "at_s": at_s });
        let (_, answer) = page.post("draft", body).await;
        let item = &answer["scene"]["items"][1];
        assert_eq!(item["faces_deg"], faces_deg, "{answer}");
        let bodies = item["bodies"].as_array().unwrap();
        assert_eq!(bodies.len(), 18);
        let side = |axis: usize| {
            let points = bodies
                .iter()
                .flat_map(|body| body["outline_m"].as_array().unwrap());
            let ends = points.map(|point| point[axis].as_f64().unwrap());
            let (low, high) = ends.fold((f64::MAX, f64::MIN), |(low, high), end| {
                (low.min(end), high.max(end))
            });
            high - low
        };
        // Shoulders of ANSUR II's mean adult, 0.52 m wide at 1.75 m, in clothes; feet and belly are shorter.
        assert!(side(along) > 0.48 && side(along) < 0.56, "{}", side(along));
        assert!(side(across) < 0.36, "{}", side(across));
    }
}

#[tokio::test]
async fn an_invalid_draft_names_its_error_and_place() {
    let page = Page::new().await;
    let outside =
        json!([{ "does": "set", "path": ["sensor", 0, "position_mm"], "to": [9000, 2000, 2700] }]);
    let answer = page.draft(ROOM, outside).await;
    let fault = &answer["fault"];
    says(&fault["message"], "sensor `ceiling`");
    assert_eq!(
        fault["place"],
        json!({ "file": "scene", "line": 22, "column": 15 })
    );
    says(&fault["hint"], "move the sensor");
    let misspelt = ROOM.replace("azimuth_deg", "azimut_deg");
    let fault = &page.draft(&misspelt, json!([])).await["fault"];
    says(&fault["message"], "azimut_deg");
    assert_eq!(fault["place"]["line"], 24);
    let broken = format!("{ROOM}[[sensor");
    let fault = &page.draft(&broken, json!([])).await["fault"];
    assert_eq!(fault["place"]["line"], 25);
    let body = json!({ "text": ROOM, "files": { "ways/way.csv": "x_mm,y_mm,z_mm\n500,b,0\n" } });
    let (_, answer) = page.post("draft", body).await;
    assert_eq!(
        answer["fault"]["place"],
        json!({ "file": "ways/way.csv", "line": 2, "column": 5 })
    );
}

#[tokio::test]
async fn who_is_never_in_view_is_among_the_remarks() {
    let page = Page::new().await;
    let shown = page.draft(ROOM, json!([])).await;
    assert_eq!(shown["warnings"], json!([]));
    let turned = ROOM.replace("elevation_deg = 90", "elevation_deg = -90");
    let warnings = page.draft(&turned, json!([])).await["warnings"].clone();
    says(&warnings[0]["message"], "is never in view of any sensor");
    says(&warnings[0]["hint"], "move it");
    assert_eq!(warnings[0]["place"]["file"], "scene");
}

#[tokio::test]
async fn a_scene_is_opened_changed_and_saved_with_the_old_one_kept() {
    let page = Page::new().await;
    let (_, opened) = page.open("room").await;
    assert_eq!(opened["text"], ROOM);
    let read = page.draft(ROOM, json!([])).await["read"]["ways/way.csv"].clone();
    let (text, way) = (
        ROOM.replace("= 20\n", "= 21\n"),
        WAY.replace("3500", "3000"),
    );
    let body = json!({
        "text": text,
        "version": opened["version"],
        "files": { "ways/way.csv": { "text": way, "version": read["version"] } },
    });
    let (status, saved) = page.save("room", body.clone()).await;
    assert_eq!(status, 200, "{saved}");
    let disk = |file: &str| fs::read_to_string(page.scene(file)).unwrap();
    assert_eq!(
        [disk("room.toml"), disk("ways/way.csv")],
        [text.clone(), way.clone()]
    );
    assert_eq!([disk("room.toml~"), disk("ways/way.csv~")], [ROOM, WAY]);
    assert_eq!(page.open("room").await.1["version"], saved["version"]);
    // A second save based on the first version: the file has changed meanwhile.
    let refused = page.save("room", body).await;
    assert_eq!(code(&refused), (409, "changed_meanwhile"));
    assert_eq!(disk("room.toml"), text);
}

#[tokio::test]
async fn another_persons_changes_are_never_overwritten() {
    let page = Page::new().await;
    let (_, opened) = page.open("room").await;
    let new = ROOM.replace("= 20\n", "= 22\n");
    // With a name that is taken.
    let (status, _) = page
        .save("room", json!({ "text": new, "version": null }))
        .await;
    assert_eq!(status, 409);
    // A trajectory that changed on the disk blocks saving the scene too.
    fs::write(page.scene("ways/way.csv"), WAY.replace("500", "600")).unwrap();
    let files = json!({ "ways/way.csv": { "text": WAY.replace("500", "700"), "version": "old" } });
    let body = json!({ "text": new, "version": opened["version"], "files": files });
    let (status, refused) = page.save("room", body).await;
    assert_eq!(
        (status, &refused["error"]["field"]),
        (409, &json!("ways/way.csv"))
    );
    assert_eq!(fs::read_to_string(page.scene("room.toml")).unwrap(), ROOM);
    fs::remove_file(page.scene("room.toml")).unwrap();
    let (status, refused) = page
        .save("room", json!({ "text": new, "version": opened["version"] }))
        .await;
    assert!(
        status == 409
            && refused["error"]["message"]
                .as_str()
                .unwrap()
                .contains("deleted")
    );
    assert!(!page.scene("room.toml").exists());
}

#[tokio::test]
async fn a_link_out_of_the_folder_is_followed_neither_to_read_nor_to_write() {
    let page = Page::new().await;
    let links = [
        ("secret.toml", "linked.toml"),
        ("secret.csv", "ways/linked.csv"),
    ];
    for (outside, link) in links {
        fs::write(page.folder.path().join(outside), "secret").unwrap();
        std::os::unix::fs::symlink(page.folder.path().join(outside), page.scene(link)).unwrap();
    }
    // The first half of the text's SHA-256.
    let version = "2bb80d537b1da3e38bd30361aa855686";
    let (status, said) = page.open("linked").await;
    assert_eq!(status, 422, "{said}");
    let message = said["error"]["message"].as_str().unwrap();
    assert!(
        message.ends_with("linked.toml: it is not a file in the scenes folder"),
        "{said}"
    );
    for version in [json!(null), json!(version)] {
        let text = json!({ "text": ROOM, "version": version });
        assert_eq!(page.save("linked", text).await.0, 422);
        let files = json!({ "ways/linked.csv": { "text": WAY, "version": version } });
        let text = json!({ "text": ROOM, "version": null, "files": files });
        assert_eq!(page.save("new", text).await.0, 422);
    }
    for (outside, _) in links {
        let text = fs::read_to_string(page.folder.path().join(outside)).unwrap();
        assert_eq!(text, "secret");
    }
    let sly = ROOM.replace("ways/way.csv", "ways/linked.csv");
    let fault = page.draft(&sly, json!([])).await["fault"].clone();
    says(&fault["message"], "it is not a file in the scenes folder");
    // A link to nothing is no way to make a file elsewhere, and one to another scene of the folder is fine.
    std::os::unix::fs::symlink(
        page.folder.path().join("made.toml"),
        page.scene("made.toml"),
    )
    .unwrap();
    let text = json!({ "text": ROOM, "version": null });
    assert_eq!(page.save("made", text).await.0, 200);
    assert!(!page.folder.path().join("made.toml").exists());
    assert!(!page.scene("made.toml").is_symlink());
    std::os::unix::fs::symlink("room.toml", page.scene("same.toml")).unwrap();
    assert_eq!(page.open("same").await.0, 200);
}

#[tokio::test]
async fn names_that_lead_out_of_the_folder_are_refused() {
    let page = Page::new().await;
    let secret = page.folder.path().join("secret.toml");
    fs::write(&secret, "secret").unwrap();
    std::os::unix::fs::symlink(page.folder.path(), page.scene("out")).unwrap();
    let long = "a".repeat(101);
    for name in [
        "..%2Fsecret",
        "%2Fetc%2Fpasswd",
        "a%5Cb",
        ".hidden",
        "a%00b",
        &long,
    ] {
        let (status, said) = page.open(name).await;
        assert_eq!(status, 422, "{name} {said}");
        let (status, _) = page
            .save(name, json!({ "text": ROOM, "version": null }))
            .await;
        assert_eq!(status, 422, "{name}");
    }
    let files = "../way.csv /tmp/way.csv out/way.csv a/../../way.csv .way.csv way.toml a\\b.csv";
    for file in files.split(' ').chain([""]) {
        let files = json!({ file: { "text": WAY, "version": null } });
        let (status, said) = page
            .save(
                "new",
                json!({ "text": ROOM, "version": null, "files": files }),
            )
            .await;
        assert_eq!(status, 422, "{file} {said}");
    }
    assert_eq!(fs::read_to_string(secret).unwrap(), "secret");
    assert!(!page.scene("new.toml").exists());
    // A scene that names such a file gets an error without the file's contents.
    let sly = ROOM.replace("ways/way.csv", "out/secret.csv");
    let fault = page.draft(&sly, json!([])).await["fault"].clone();
    says(&fault["message"], "cannot read");
}

#[tokio::test]
async fn an_invalid_or_too_long_scene_is_not_saved() {
    let page = Page::new().await;
    let refused = page
        .save("new", json!({ "text": "[room]\n", "version": null }))
        .await;
    assert_eq!(code(&refused), (422, "unusable_scene"));
    let long = format!("{ROOM}#{}\n", " ".repeat(512 * 1024));
    let refused = page
        .save("new", json!({ "text": long, "version": null }))
        .await;
    assert_eq!(code(&refused), (422, "too_much"));
    fs::write(page.scene("long.toml"), &long).unwrap();
    assert_eq!(page.open("long").await.0, 422);
    fs::write(page.scene("bytes.toml"), [0xff, 0xfe]).unwrap();
    assert_eq!(page.open("bytes").await.0, 422);
    assert_eq!(page.open("nothing").await.0, 404);
    let edits: Vec<Value> = (0..65)
        .map(|_| json!({ "does": "unset", "path": ["a"] }))
        .collect();
    let body = json!({ "text": ROOM, "edits": edits });
    assert_eq!(page.post("draft", body).await.0, 422);
    let huge = json!({ "text": " ".repeat(5 << 20) });
    assert_eq!(page.post("draft", huge).await.0, 413);
}

#[tokio::test]
async fn the_map_says_where_a_person_is_seen() {
    let page = Page::new().await;
    // A wall of wardrobe between the sensor and the other half of the room.
    let text = "[room]\nsize_mm = [4000, 4000, 2500]\nambient_c = 20\n[[object]]\nname = \"wall\"\nposition_mm = [2000, 2000, 0]\nsize_mm = [200, 4000, 2500]\n[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [1000, 2000, 2500]\nelevation_deg = 90\nazimuth_deg = 0\n";
    let body = json!({ "text": text });
    let (status, answer) = page.post("coverage", body).await;
    assert_eq!(status, 200, "{answer}");
    let map = &answer["map"];
    let (columns, rows) = (
        map["columns"].as_u64().unwrap(),
        map["rows"].as_u64().unwrap(),
    );
    assert_eq!((columns, rows), (20, 20));
    let cells: Vec<char> = map["cells"].as_str().unwrap().chars().collect();
    let at = |column: usize, row: usize| cells[row * 20 + column];
    assert_eq!(at(5, 10), 'd', "right below the sensor");
    assert!(
        matches!(at(15, 10), 'h' | 'o'),
        "behind the wall: {}",
        at(15, 10)
    );
    assert_eq!(at(9, 10), 'f');
    let detected = cells.iter().filter(|cell| **cell == 'd').count();
    assert_eq!(map["detected"], detected);
    let none = json!({ "text": text.split("[[sensor]]").next() });
    let (_, answer) = page.post("coverage", none).await;
    assert_eq!(answer["map"]["detected"], 0, "{answer}");
    let (_, answer) = page.post("coverage", json!({ "text": "[room" })).await;
    assert_eq!(answer["fault"]["place"]["line"], 1);
}

#[tokio::test]
async fn scenes_with_shared_trajectories_are_named() {
    let page = Page::new().await;
    fs::write(page.scene("other.toml"), ROOM.replace("cube", "box")).unwrap();
    assert_eq!(page.open("room").await.1["shared"], json!(["other"]));
}

/// Every scene of the repository can be opened, shown, and changed in one number, with all its comments.
#[tokio::test]
async fn every_scene_of_the_repository_is_shown_and_changed() {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes"));
    let app = app(&folder, Arc::new(SystemClock::new())).await;
    let files = fs::read_dir(&folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
    let paths: Vec<PathBuf> = files.filter(is_scene).collect();
    assert!(paths.len() > 20);
    for path in paths {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).unwrap();
        let edits = json!([{ "does": "set", "path": ["room", "ambient_c"], "to": 19.25 }]);
        let draft = json!({ "text": text, "edits": edits });
        let (status, answer) = ask(&app, Method::POST, "/v1/editor/draft", Some(&draft)).await;
        assert_eq!(status, 200, "{name}");
        assert_eq!(answer["fault"], Value::Null, "{name}");
        let made = answer["text"].as_str().unwrap();
        let lines = text
            .lines()
            .zip(made.lines())
            .filter(|(old, new)| old != new);
        assert_eq!(
            (lines.count(), made.lines().count()),
            (1, text.lines().count()),
            "{name}"
        );
        let items = answer["scene"]["items"].as_array().unwrap().len();
        assert!(items > 0, "{name}");
        assert!(
            !answer["frames"][0]["celsius"]
                .as_array()
                .unwrap()
                .is_empty(),
            "{name}"
        );
    }
}

/// Thirty-two sensors above a false ceiling, below which somebody walks for ten minutes: 192,000 images tell that nobody
/// is ever in view. Each draft is answered in time all the same, so that the next page waits only for that.
#[tokio::test]
async fn a_draft_that_would_take_long_is_answered_in_time() {
    let page = Page::new().await;
    let mut text = ROOM.split("[[sensor]]").next().unwrap().to_owned();
    text.push_str("[[object]]\nname = \"false ceiling\"\nposition_mm = [2000, 2000, 2200]\nsize_mm = [4000, 4000, 100]\n");
    let sensor = ROOM.split_once("[[sensor]]").unwrap().1;
    for number in 0..32 {
        let named = sensor.replace("ceiling", &format!("s{number}"));
        let named = named.replace("grid-eye", "lepton");
        text.push_str(&format!("[[sensor]]{named}"));
    }
    let trips = "500,1000,0\n3500,1000,0\n".repeat(50);
    let way = format!("x_mm,y_mm,z_mm\n{trips}");
    let body = json!({ "text": text, "files": { "ways/way.csv": way }, "edits": [] });
    assert!(body.to_string().len() < 11 * 1024);
    let began = std::time::Instant::now();
    let drafts = async {
        [
            page.post("draft", body.clone()).await,
            page.post("draft", body.clone()).await,
        ]
    };
    let [first, second] = drafts.await;
    let took = began.elapsed();
    println!("two drafts in {took:?}");
    assert!(took < Duration::from_secs(15), "{took:?}");
    for (status, answer) in [first, second] {
        assert_eq!((status, &answer["fault"]), (200, &Value::Null), "{answer}");
        assert_eq!(answer["frames"].as_array().unwrap().len(), 32);
        assert_eq!(celsius(&answer).len(), 80 * 60);
    }
}
