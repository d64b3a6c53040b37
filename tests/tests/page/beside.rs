//! Real beside simulated on the page of the real program, live and played back: pictures, difference, clock, plan, scores
//! and verdict.

use grideye_recording::csv::Reader;
use grideye_tests::live_page::{
    Outcome, assert_quiet, batch, color_in, drop_file, field, frame, keep_picture, pixels, set_up,
};
use grideye_tests::patience::WAIT_MAX;
use grideye_tests::programs::{RunningCollector, grideye, run};
use grideye_tests::webdriver::{Browser, Failure, left_out};
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

/// A keyboard's End (W3C WebDriver §17.4.2).
const END: &str = "\u{E010}";

/// Ana stands at a place.
fn still(x_mm: u32, y_mm: u32) -> String {
    format!("# Somebody stands still.\n{ROOM}{ANA}position_mm = [{x_mm}, {y_mm}, 0]\n{SENSOR}")
}

const ROOM: &str = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n";
const ANA: &str = "[[agent]]\nname = \"ana\"\nsize_mm = [300, 500, 1700]\ntemperature_c = 30\n";
const SENSOR: &str = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n";

/// Ana walks 3 m to the right at half a meter a second, for 6 s.
const WALK: &str = "trajectory = \"way.csv\"\nspeed_mm_per_s = 500\n";
const WAY: &str = "x_mm,y_mm,z_mm\n500,2000,0\n3500,2000,0\n";

/// Lets each room come half a second late.
const SLOW_ROOMS: &str = "const fetched = window.fetch;
window.fetch = async (...asked) => {
  if (String(asked[0]).includes('/room?')) await new Promise((done) => setTimeout(done, 500));
  return fetched(...asked);
};";

/// A collector with scenes, a browser on its page, and what a sensor in one of the scenes would send.
struct Room {
    collector: RunningCollector,
    browser: Browser,
    frames: Vec<Value>,
    sent: u64,
    _folder: tempfile::TempDir,
}

impl Room {
    /// With frames of `scene`, which `grideye simulate` makes with the sensor's noise.
    fn new(scene: &str, frames: u32) -> Result<Self, Failure> {
        let folder = tempfile::tempdir()?;
        let scenes = folder.path().join("scenes");
        std::fs::create_dir(&scenes)?;
        for (name, text) in [
            ("left", still(1200, 2800)),
            ("right", still(2800, 1200)),
            (
                "walk",
                format!("# Somebody walks.\n{ROOM}{ANA}{WALK}{SENSOR}"),
            ),
        ] {
            std::fs::write(scenes.join(format!("{name}.toml")), text)?;
        }
        std::fs::write(scenes.join("way.csv"), WAY)?;
        std::fs::write(scenes.join("broken.toml"), "[room]\n")?;
        let frames = simulated(&scenes.join(format!("{scene}.toml")), frames)?;
        let store = folder.path().join("store.sqlite");
        let arguments = ["--scenes".as_ref(), scenes.as_os_str()];
        let collector = RunningCollector::start_with(store, &arguments);
        let browser = Browser::start()?;
        let room = Self {
            collector,
            browser,
            frames,
            sent: 0,
            _folder: folder,
        };
        room.open()?;
        Ok(room)
    }

    fn open(&self) -> Outcome {
        self.browser.open(&format!("{}/", self.collector.url()))?;
        let connected = |text: &str| text == "connected";
        self.browser.wait_for_text("#link", connected).map(drop)
    }

    /// Sends the next frames, as if they had just been measured.
    fn send(&mut self, count: usize) -> Outcome {
        let from = usize::try_from(self.sent)?;
        let next: Vec<Value> = self
            .frames
            .iter()
            .cycle()
            .skip(from)
            .take(count)
            .cloned()
            .collect();
        let url = format!("{}/v1/frames", self.collector.url());
        ureq::post(url).send_json(batch("s1", self.sent, &next))?;
        self.sent += u64::try_from(count)?;
        let shown = format!("#{}", self.sent - 1);
        field(&self.browser, "seq", &shown)
    }

    fn choose(&self, scene: &str) -> Outcome {
        let option = format!("#beside [data-field=choice] option[value*={scene}]");
        self.browser.click(&option)
    }

    /// The sensor beside the scene in which nothing moves, until all three pictures are read.
    fn stand_beside_left(&mut self) -> Outcome {
        self.browser.click(".sensor [data-field=beside]")?;
        self.wait("choice", |text| text.contains("left"))?;
        self.choose("left")?;
        self.wait("clock", |text| text.starts_with("Nothing moves"))?;
        self.send(5)?;
        self.wait("cursor", |text| text.starts_with("Real − simulated: mean"))?;
        Ok(())
    }

    fn wait(&self, name: &str, is_right: impl Fn(&str) -> bool) -> Result<String, Failure> {
        let selector = format!("#beside [data-field={name}]");
        self.browser.wait_for_text(&selector, is_right)
    }

    /// What the canvas of the room says of its last drawing.
    fn drawn(&self, what: &str) -> Result<String, Failure> {
        let script =
            format!("return document.querySelector('#beside [data-field=room]').dataset.{what}");
        let said = self.browser.execute(&script)?;
        Ok(said.as_str().unwrap_or_default().to_owned())
    }

    /// Waits until the room of a second of the scene is drawn.
    fn wait_for_room(&self, second: &str) -> Outcome {
        let drawn = || self.drawn("second");
        let is_drawn = |drawn: &String| drawn == second;
        self.browser
            .wait_for("the room's second", drawn, is_drawn)
            .map(drop)
    }

    /// The room's image, after all that was asked for is drawn.
    fn picture(&self) -> Result<Value, Failure> {
        self.browser.execute(
            "return new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done))))
               .then(() => document.querySelector('#beside [data-field=room]').toDataURL());",
        )
    }

    /// Sends frames until the verdict satisfies: a comparison is made every two seconds.
    fn wait_for_verdict(&mut self, is_right: impl Fn(&str) -> bool) -> Result<String, Failure> {
        let since = Instant::now();
        loop {
            self.send(5)?;
            let verdict = self.browser.text("#beside [data-field=verdict]")?;
            if is_right(&verdict) {
                return Ok(verdict);
            }
            if since.elapsed() > WAIT_MAX {
                let said = self.browser.text("#beside .verdict")?;
                return Err(format!("no such verdict: {said}").into());
            }
            std::thread::sleep(Duration::from_millis(250));
        }
    }

    /// The numbers in °C of what is read of the cell under the cursor: real, simulated and their difference.
    fn reading(&self) -> Result<[f64; 3], Failure> {
        let text = self.wait("cursor", |text| text.contains("difference"))?;
        let text = text.replace('−', "-").replace('+', "");
        let numbers: Vec<f64> = text
            .split_whitespace()
            .filter(|word| word.contains('.'))
            .filter_map(|word| word.parse().ok())
            .collect();
        <[f64; 3]>::try_from(numbers).map_err(|found| format!("{text}: {found:?}").into())
    }
}

/// Raw frames of a scene's sensor, by the program that simulates.
fn simulated(scene: &Path, frames: u32) -> Result<Vec<Value>, Failure> {
    let out = scene.with_extension("csv");
    let ended = run(grideye()
        .arg("simulate")
        .arg(scene)
        .args(["--seed", "7", "--frames", &frames.to_string(), "--out"])
        .arg(&out));
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let mut all = Vec::new();
    for row in Reader::new(std::fs::File::open(out)?)? {
        let row = row?;
        let raw = row.record.reading.frame().ok_or("a frame is missing")?;
        let words: Vec<u16> = raw.pixels.iter().map(|word| word.0).collect();
        all.push(frame(&words, raw.thermistor.ok_or("no thermistor")?.0));
    }
    Ok(all)
}

/// C, EMI and IS are each read with both floors and the ceiling. Only C is held against them: in the few frames that are
/// compared shuffled pixels share nearly as much information, which is why EMI is never shown without its floor.
fn assert_scores(browser: &Browser, panel: &str) -> Outcome {
    let rows = format!(
        "return [...document.querySelectorAll('{panel} tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent))"
    );
    let rows: Vec<Vec<String>> = serde_json::from_value(browser.execute(&rows)?)?;
    for (title, unit, greatest) in [
        ("C, correlation", "", 1.0),
        // Six bits tell 64 pixels apart.
        ("EMI, mutual information", " bit", 6.0),
        ("IS, image similarity", " %", 100.0),
    ] {
        let row = rows.iter().find(|row| row[0] == title).ok_or(title)?;
        let number = |index: usize| {
            let text = row[index].replace('−', "-");
            let number = text.strip_suffix(unit).and_then(|text| text.parse().ok());
            number.ok_or_else(|| Failure::from(format!("{row:?}: {text}")))
        };
        let [now, shuffled, ceiling]: [f64; 3] = [number(1)?, number(3)?, number(4)?];
        let range = -1.0..=greatest;
        let are_scores = [now, shuffled, ceiling]
            .iter()
            .all(|score| range.contains(score));
        assert!(are_scores && now > 0.0 && ceiling > 0.0, "{row:?}");
        // A blank frame has no correlation that could be read, shares no information, and may well be alike.
        match title {
            "C, correlation" => assert!(
                now > 0.5 && shuffled.abs() < 0.3 && ceiling > 0.5,
                "{row:?}"
            ),
            "EMI, mutual information" => assert!(row[2] == "0.00 bit" && shuffled > 0.0, "{row:?}"),
            _ => assert!(range.contains(&number(2)?), "{row:?}"),
        }
    }
    Ok(())
}

#[test]
fn real_and_simulated_share_one_scale_of_colors() -> Outcome {
    if left_out("real_and_simulated_share_one_scale_of_colors") {
        return Ok(());
    }
    let mut room = Room::new("left", 5)?;
    // The real sensor sees 20 °C everywhere; in the scene somebody stands there.
    room.frames = vec![frame(&[80; 64], 402)];
    room.send(5)?;
    room.stand_beside_left()?;
    // Alone, a frame of 20 °C would lie in the middle of its own scale.
    let cells = |side: &str| {
        let canvas = format!("#beside [data-side={side}] .heat");
        let cells = (0..64).map(|cell| color_in(&room.browser, &canvas, cell));
        cells.collect::<Result<Vec<_>, _>>()
    };
    let light = |color: &Vec<u64>| color.iter().sum::<u64>();
    let (real, simulated) = (cells("real")?, cells("simulated")?);
    assert!(real.iter().all(|color| *color == real[0]), "{real:?}");
    let warmest = simulated.iter().map(light).max().ok_or("no cells")?;
    assert!(light(&real[0]) * 2 < warmest, "{real:?} and {simulated:?}");
    // Where the scene has the room's 20 °C as well, the color is the same.
    assert!(simulated.contains(&real[0]), "{real:?} and {simulated:?}");
    let ticks = room.browser.text("#beside [data-scale=temperature] ol")?;
    let numbers: Vec<f64> = ticks
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    let [hot, cold] = [numbers[0], numbers[numbers.len() - 1]];
    assert!(hot >= 23.0 && cold == 19.0, "{ticks}");
    assert_quiet(&room.browser, "")
}

#[test]
fn a_sensor_stands_beside_its_scene_with_difference_scores_and_verdict() -> Outcome {
    if left_out("a_sensor_stands_beside_its_scene_with_difference_scores_and_verdict") {
        return Ok(());
    }
    let mut room = Room::new("left", 50)?;
    room.send(5)?;
    room.stand_beside_left()?;
    room.wait("choice", |text| text.contains("broken (cannot be read)"))?;

    // What is warm there has its name.
    room.wait("names", |text| text == "ana")?;
    // The cursor reads all three pictures at once, and the third is the first less the second.
    room.browser
        .point_at("[data-side=difference] .heat", (5, 5))?;
    let [real, simulated, difference] = room.reading()?;
    assert!((real - simulated - difference).abs() < 0.011);
    assert!(difference.abs() < 1.5, "the same scene: {difference}");

    let verdict = room.wait_for_verdict(|verdict| verdict == "Agrees")?;
    assert_eq!(verdict, "Agrees");
    let scores = room.browser.text("#beside [data-field=scores]")?;
    assert!(scores.contains("C, correlation"), "{scores}");
    assert_scores(&room.browser, "#beside")?;
    keep_picture(&room.browser, "beside-agrees")?;

    // Another scene has her elsewhere.
    room.choose("right")?;
    room.wait_for_verdict(|verdict| verdict == "Disagrees")?;
    room.wait("meaning", |text| {
        text.contains("Based on ") && text.contains(" frames.")
    })?;
    room.wait("because", |text| text.starts_with("Next: Check "))?;

    // What was chosen for the sensor is chosen when the page comes again, and the key closes it.
    room.open()?;
    room.wait("about", |text| text.starts_with("Somebody stands"))?;
    let chosen = "return document.querySelector('#beside [data-field=choice]').value";
    assert_eq!(room.browser.execute(chosen)?, r#"["right","ceiling"]"#);
    room.browser.click("h1")?;
    room.browser.press("b")?;
    assert_eq!(room.browser.text("#beside")?, "");
    assert_quiet(&room.browser, "")
}

#[test]
fn a_scene_that_moves_begins_runs_ends_and_says_who_is_where() -> Outcome {
    if left_out("a_scene_that_moves_begins_runs_ends_and_says_who_is_where") {
        return Ok(());
    }
    let mut room = Room::new("walk", 61)?;
    room.send(1)?;
    room.browser.click(".sensor [data-field=beside]")?;
    room.wait("choice", |text| text.contains("walk"))?;
    room.choose("walk")?;
    // Frame 0 of the run was seen, so the scene begins with it unless somebody says otherwise.
    room.wait("clock", |text| text == "Second 0.0 of 6.0.")?;
    room.send(20)?;
    room.wait("clock", |text| text == "Second 2.0 of 6.0.")?;
    room.wait("places", |text| {
        text.starts_with("ana at 1.50 m from the left, 2.00 m")
    })?;
    // The room shows her where she is now, and what the sensor sees in the colors of either frame.
    room.wait_for_room("2")?;
    let of_real = room.picture()?;
    room.browser
        .click("#beside [data-field=footprints] option[value=simulated]")?;
    let of_simulated = room.picture()?;
    assert_ne!(of_simulated, of_real);
    // Also where the next frames come before the room of the one before them.
    room.browser.execute(SLOW_ROOMS)?;
    room.send(1)?;
    room.send(9)?;
    room.wait("places", |text| text.starts_with("ana at 2.00 m"))?;
    room.wait_for_room("3")?;
    assert_ne!(room.picture()?, of_simulated);
    // Keys turn it.
    let before = room.drawn("drawn")?;
    room.browser.type_into("#beside [data-field=room]", "+")?;
    let view = || room.drawn("drawn");
    room.browser
        .wait_for("a nearer view", view, |view| *view != before)?;
    room.send(29)?;
    room.wait("clock", |text| text == "Second 5.9 of 6.0.")?;
    room.wait_for_verdict(|verdict| verdict == "Agrees")?;

    // Its end is said, and its last moment is no picture of now.
    room.wait("clock", |text| text.starts_with("The scene ended"))?;
    let veil = "#beside [data-side=simulated] .veil";
    let ended = |text: &str| text == "The scene has ended. This is its last moment.";
    room.browser.wait_for_text(veil, ended)?;
    let blank = "return document.querySelector('#beside [data-side=difference]').dataset.blank";
    assert_eq!(room.browser.execute(blank)?, "true");
    room.wait("places", |text| {
        text.ends_with("(at the end of the scene).")
    })?;
    keep_picture(&room.browser, "beside-ended")?;

    // Again, by the box; or from the start, by the button.
    room.browser.click("#beside [data-field=again]")?;
    room.send(1)?;
    room.wait("clock", |text| text.contains("round 2"))?;
    room.browser.click("#beside [data-field=again]")?;
    room.browser.click("#beside [data-field=begin]")?;
    room.wait("clock", |text| text == "Second 0.0 of 6.0.")?;
    room.send(10)?;
    room.wait("clock", |text| text == "Second 1.0 of 6.0.")?;
    assert_quiet(&room.browser, "")
}

#[test]
fn every_picture_is_turned_alike_and_a_silent_sensor_is_not_shown_as_live() -> Outcome {
    if left_out("every_picture_is_turned_alike_and_a_silent_sensor_is_not_shown_as_live") {
        return Ok(());
    }
    let mut room = Room::new("left", 50)?;
    room.send(5)?;
    room.stand_beside_left()?;
    // The last cell of each picture is pixel 64, and after a mirror image pixel 57.
    let last = |side: &str, pixel: &str| {
        let canvas = format!("#beside [data-side={side}] .heat");
        room.browser.type_into(&canvas, END)?;
        room.wait("cursor", |text| text.starts_with(pixel))
            .map(drop)
    };
    for side in ["real", "simulated", "difference"] {
        last(side, "Pixel 64:")?;
    }
    room.browser.click(".sensor [data-field=mirror]")?;
    for side in ["real", "simulated", "difference"] {
        last(side, "Pixel 57:")?;
    }
    // Nothing more comes.
    let veil = "#beside [data-side=real] .veil";
    room.browser
        .wait_for_text(veil, |text| text.starts_with("Stale: last frame"))?;
    assert_quiet(&room.browser, "")
}

#[test]
fn a_recording_is_held_against_a_scene_at_the_frame_that_is_looked_at() -> Outcome {
    if left_out("a_recording_is_held_against_a_scene_at_the_frame_that_is_looked_at") {
        return Ok(());
    }
    let mut room = Room::new("walk", 61)?;
    let turned = SENSOR.replace("azimuth_deg = 0", "azimuth_deg = 90");
    let scene = room._folder.path().join("scenes/turned.toml");
    std::fs::write(scene, format!("{ROOM}{ANA}{WALK}{turned}"))?;
    let id = room.collector.start_recording("walk");
    room.send(61)?;
    let place = format!("{}/#recording={id}", room.collector.url());
    room.browser.open(&place)?;
    let seen = |name: &str, is_right: &dyn Fn(&str) -> bool| {
        let selector = format!("#played-beside [data-field={name}]");
        room.browser.wait_for_text(&selector, is_right)
    };
    let heat = "#played .sensor [data-field=seq]";
    room.browser.wait_for_text(heat, |text| text == "#0")?;
    room.browser.click("#played .sensor [data-field=beside]")?;
    seen("choice", &|text| text.contains("walk"))?;
    let option = |scene: &str| format!("#played-beside [data-field=choice] option[value*={scene}]");
    room.browser.click(&option("walk"))?;
    // As `grideye compare` does, the scene begins with the recording.
    seen("clock", &|text| text == "Second 0.0 of 6.0.")?;
    room.browser.type_into("#jump [name=place]", "#20")?;
    room.browser.click("#jump [type=submit]")?;
    seen("clock", &|text| text == "Second 2.0 of 6.0.")?;
    seen("places", &|text| {
        text.starts_with("ana at 1.50 m from the left")
    })?;
    room.browser.click("[data-does=last]")?;
    seen("clock", &|text| text == "Second 6.0 of 6.0.")?;
    seen("verdict", &|text| text == "Agrees")?;
    assert_scores(&room.browser, "#played-beside")?;
    keep_picture(&room.browser, "beside-played")?;
    // With the sensor turned by a quarter, the frames show another image.
    room.browser.click(&option("turned"))?;
    seen("verdict", &|text| text == "Disagrees")?;
    // A recording stays as it is, so there is time for the likeliest cause and what to do about it.
    seen("meaning", &|text| text.starts_with("Most likely "))?;
    seen("because", &|text| {
        text.starts_with("Next: ") && text.contains("agree")
    })?;
    // It is remembered, and the key closes it.
    room.browser.click("h1")?;
    room.browser.press("b")?;
    assert_eq!(room.browser.text("#played-beside")?, "");
    assert_quiet(&room.browser, "")
}

#[test]
fn a_file_that_is_dropped_is_held_against_a_scene_of_the_folder_and_not_kept() -> Outcome {
    if left_out("a_file_that_is_dropped_is_held_against_a_scene_of_the_folder_and_not_kept") {
        return Ok(());
    }
    let room = Room::new("walk", 61)?;
    let browser = &room.browser;
    let file = room._folder.path().join("scenes/walk.csv");
    browser.wait_for_text("#open-file", |text| text.contains("Open a file"))?;
    drop_file(browser, "walk.csv", &std::fs::read_to_string(file)?)?;
    browser.wait_for_text("#played-name", |text| text == "walk.csv")?;
    browser.click("#played .sensor [data-field=beside]")?;
    // The rooms of the folder are offered, each drawn.
    let offered = |scene: &str| format!("#played-beside .offers button:has([data-scene={scene}])");
    let drawn = "return document.querySelector('.offers [data-scene=walk]')?.dataset.drawn ?? null";
    let look = || browser.execute(drawn);
    browser.wait_for("the room that is offered", look, Value::is_string)?;
    browser.click(&offered("walk"))?;
    let seen = |name: &str, is_right: &dyn Fn(&str) -> bool| {
        let selector = format!("#played-beside [data-field={name}]");
        browser.wait_for_text(&selector, is_right)
    };
    // It plays by itself, and its scene with it.
    browser.wait_for_text("#time", |text| text == "0:06.0 / 0:06.0")?;
    seen("clock", &|text| text == "Second 6.0 of 6.0.")?;
    seen("verdict", &|text| text == "Agrees")?;
    // In a room where she stands still she is not where the frames have her.
    let option = "#played-beside [data-field=choice] option[value*=right]";
    browser.click(option)?;
    seen("verdict", &|text| text == "Disagrees")?;
    let url = format!("{}/v1/recordings", room.collector.url());
    let kept: Value = ureq::get(url).call()?.body_mut().read_json()?;
    assert_eq!(kept["recordings"], serde_json::json!([]));
    assert_quiet(browser, "")
}

/// A room with six sensors, a table and a person.
fn six_sensors() -> String {
    let sensors: String = (0..6)
        .map(|number| {
            let (x, y) = (1000 + 1500 * (number % 3), 1000 + 2000 * (number / 3));
            format!("[[sensor]]\nname = \"s{number}\"\npreset = \"grid-eye\"\nposition_mm = [{x}, {y}, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n")
        })
        .collect();
    format!(
        "[room]\nsize_mm = [5000, 4000, 2700]\nambient_c = 20\n[[object]]\nname = \"table\"\nsize_mm = [1200, 800, 700]\nposition_mm = [3500, 2500, 0]\ntemperature_c = 22\n[[agent]]\nname = \"ana\"\nposition_mm = [1500, 1500, 0]\nperson = {{}}\n{sensors}"
    )
}

/// Prints how many frames a second the room is drawn with; how many depends on the host.
#[test]
fn a_room_of_six_sensors_is_drawn_with_every_footprint() -> Outcome {
    if left_out("a_room_of_six_sensors_is_drawn_with_every_footprint") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let scenes = folder.path().join("scenes");
    std::fs::create_dir(&scenes)?;
    std::fs::write(scenes.join("six.toml"), six_sensors())?;
    let arguments = ["--scenes".as_ref(), scenes.as_os_str()];
    let collector = RunningCollector::start_with(folder.path().join("store.sqlite"), &arguments);
    let browser = Browser::start()?;
    browser.open(&format!("{}/", collector.url()))?;
    let drawn = browser.execute(
        "return (async () => {
           const { RoomView } = await import('/assets/room-view.js');
           const room = await (await fetch('/v1/scenes/six/room?at_s=0')).json();
           const canvas = Object.assign(document.createElement('canvas'), { width: 600, height: 600 });
           document.body.append(canvas);
           const view = new RoomView(canvas);
           const painted = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
           const drawn = async () => { await new Promise((done) => setTimeout(done, 50)); await painted(); };
           view.show(room, null);
           const dots = () => canvas.getContext('2d').getImageData(0, 0, 600, 600).data;
           const magenta = () => { let sum = 0; const all = dots(); for (let at = 0; at < all.length; at += 4) if (all[at] > 180 && all[at + 1] < 90 && all[at + 2] > 180) sum += 1; return sum; };
           await drawn();
           const without = magenta();
           view.color(room.drawing.sensors.map(() => Array(64).fill('rgb(255 0 255)')));
           await drawn();
           const seen = magenta();
           const views = new Set();
           const began = performance.now();
           for (let turn = 0; turn < 36; turn += 1) {
             canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }));
             await new Promise((done) => setTimeout(done, 1));
             await new Promise((done) => requestAnimationFrame(done));
             views.add(canvas.dataset.drawn);
           }
           return [without, seen, views.size, 36000 / (performance.now() - began)];
         })()",
    )?;
    let [without, seen, views, rate]: [f64; 4] = serde_json::from_value(drawn)?;
    assert_eq!(without, 0.0);
    // Six fields of view of 60 degrees cover most of the floor, which is a good part of the picture.
    assert!(seen > 20_000.0, "{seen} dots");
    // Each turn is drawn, however long that takes.
    assert!(views >= 34.0, "{views} of 36 turns were drawn");
    println!("a room with six sensors: {rate:.0} drawings a second");
    // Reading the dots back is what is measured.
    assert_quiet(&browser, "willReadFrequently")
}

#[test]
fn without_scenes_nothing_is_offered() -> Outcome {
    if left_out("without_scenes_nothing_is_offered") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    field(&browser, "max", "30.00 °C")?;
    assert_eq!(browser.text(".sensor [data-field=beside]")?, "");
    browser.press("b")?;
    assert_eq!(browser.text("#beside")?, "");
    assert_quiet(&browser, "")
}
