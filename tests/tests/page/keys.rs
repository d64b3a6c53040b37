//! Every key of the page with its effect, and one way through the page without a mouse.

use grideye_tests::live_page::{
    HOTTEST, Outcome, assert_quiet, batch, color, field, frame, is_like, keep_picture, pixels,
    wait_for_color,
};
use grideye_tests::programs::RunningCollector;
use grideye_tests::webdriver::{Browser, Failure, left_out};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeSet;

/// Keys without a letter (W3C WebDriver §17.4.2), by their names in the browser (UI Events, `KeyboardEvent.key`).
const NAMED: [(&str, &str); 8] = [
    ("Escape", "\u{E00C}"),
    (" ", "\u{E00D}"),
    ("PageUp", "\u{E00E}"),
    ("PageDown", "\u{E00F}"),
    ("End", "\u{E010}"),
    ("Home", "\u{E011}"),
    ("ArrowLeft", "\u{E012}"),
    ("ArrowRight", "\u{E014}"),
];
const TAB: &str = "\u{E004}";
const ENTER: &str = "\u{E007}";
/// More than there are places to stop at on any view.
const TABS_MAX: usize = 150;

/// Somebody walks 3 m to the right at half a meter a second, for 6 s.
const SCENE: &str = "# Somebody walks.
[room]
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

/// The real program with a scene, a browser on its page, and the keys that were pressed.
struct Desk {
    collector: RunningCollector,
    browser: Browser,
    pressed: RefCell<BTreeSet<String>>,
    folder: tempfile::TempDir,
}

impl Desk {
    fn new() -> Result<Self, Failure> {
        let folder = tempfile::tempdir()?;
        let scenes = folder.path().join("scenes");
        std::fs::create_dir(&scenes)?;
        std::fs::write(scenes.join("walk.toml"), SCENE)?;
        std::fs::write(scenes.join("way.csv"), WAY)?;
        let store = folder.path().join("store.sqlite");
        let arguments = ["--scenes".as_ref(), scenes.as_os_str()];
        let desk = Self {
            collector: RunningCollector::start_with(store, &arguments),
            browser: Browser::start()?,
            pressed: RefCell::default(),
            folder,
        };
        desk.browser.open(&format!("{}/", desk.collector.url()))?;
        let connected = |text: &str| text == "connected";
        desk.browser.wait_for_text("#link", connected)?;
        Ok(desk)
    }

    fn post(&self, path: &str, body: &Value) -> Outcome {
        ureq::post(format!("{}{path}", self.collector.url())).send_json(body)?;
        Ok(())
    }

    fn send(&self, sensor: &str, first_seq: u64, frames: &[Value]) -> Outcome {
        self.post("/v1/frames", &batch(sensor, first_seq, frames))
    }

    /// Presses a key by the name that it has in the browser, and notes it.
    fn press(&self, key: &str) -> Outcome {
        self.pressed.borrow_mut().insert(key.to_owned());
        let code = NAMED.iter().find(|(name, _)| *name == key);
        self.browser.press(code.map_or(key, |(_, code)| code))
    }

    fn says(&self, selector: &str, is_right: impl Fn(&str) -> bool) -> Outcome {
        self.browser.wait_for_text(selector, is_right).map(drop)
    }

    fn wait(&self, script: &str, wanted: &Value) -> Outcome {
        let look = || self.browser.execute(script);
        self.browser
            .wait_for(script, look, |seen| seen == wanted)
            .map(drop)
    }

    /// Goes on with Tab until the element that a selector finds has the focus.
    fn tab_to(&self, selector: &str) -> Outcome {
        let there = format!("return document.activeElement.matches('{selector}')");
        for _ in 0..TABS_MAX {
            self.browser.press(TAB)?;
            if self.browser.execute(&there)? == true {
                return Ok(());
            }
        }
        Err(format!("Tab never came to {selector}").into())
    }
}

/// The keys that `main.js` names, as its source has them: `p: {`, `"[": {`, `",": playing(`, and the digits; and those
/// that annexes bring.
fn keys_of_the_page() -> Result<BTreeSet<String>, Failure> {
    let source = include_str!("../../../crates/grideye-collector/assets/main.js");
    let list = source
        .split_once("\ncommands({\n")
        .and_then(|(_, after)| after.split_once("\n});\n"));
    let (list, _) = list.ok_or("main.js has no list of keys")?;
    let mut keys = BTreeSet::new();
    for line in list.lines() {
        if line.contains("...Object.fromEntries(DIGITS") {
            keys.extend((1..=9).map(|digit| digit.to_string()));
            continue;
        }
        let line = line.trim_start();
        if line.starts_with("...") {
            continue;
        }
        let key = match line.strip_prefix('"') {
            Some(quoted) => quoted.split_once("\": "),
            None => line.split_once(": "),
        };
        keys.insert(key.ok_or(line)?.0.to_owned());
    }
    for brought in [
        include_str!("../../../crates/grideye-studio/assets/beside.js"),
        include_str!("../../../crates/grideye-studio/assets/to-editor.js"),
    ] {
        let key = brought.split("key: \"").nth(1).ok_or("no key")?;
        keys.extend(key.chars().next().map(String::from));
    }
    Ok(keys)
}

#[test]
fn every_key_does_what_its_line_in_the_list_says() -> Outcome {
    if left_out("every_key_does_what_its_line_in_the_list_says") {
        return Ok(());
    }
    let desk = Desk::new()?;
    for sensor in ["s1", "s2"] {
        desk.send(sensor, 0, &[frame(&pixels(80, 1, 120), 402)])?;
    }
    desk.says("#sensors", |text| {
        text.contains("s1") && text.contains("s2")
    })?;
    keys_of_pictures(&desk)?;
    keys_of_views(&desk)?;
    keys_of_playing(&desk)?;
    keys_of_labels(&desk)?;
    desk.press("Escape")?;
    desk.says("#library", |text| text.contains("hall"))?;
    desk.press("e")?;
    desk.wait("return location.pathname", &json!("/editor"))?;
    assert_eq!(*desk.pressed.borrow(), keys_of_the_page()?);
    assert_quiet(&desk.browser, "")
}

fn keys_of_pictures(desk: &Desk) -> Outcome {
    let browser = &desk.browser;
    wait_for_color(browser, 1, HOTTEST)?;
    desk.press("p")?;
    // The hot end of ironbow.
    wait_for_color(browser, 1, [255, 255, 246])?;
    for _ in 0..4 {
        desk.press("p")?;
    }
    wait_for_color(browser, 1, HOTTEST)?;
    desk.press("i")?;
    field(browser, "invented", "only 64 pixels were measured")?;
    desk.press("i")?;
    desk.press("i")?;
    desk.says(".sensor [data-field=invented]", str::is_empty)?;

    desk.press("h")?;
    desk.send("s1", 1, &[frame(&pixels(80, 1, 160), 402)])?;
    field(browser, "max", "40.00 °C")?;
    let ticks = ".sensor [data-field=ticks]";
    assert!(browser.text(ticks)?.starts_with("31 °C"));
    desk.press("h")?;
    desk.says(ticks, |text| text.starts_with("41 °C"))?;

    // The second one large, and from there the first, and the second again.
    browser.execute("document.querySelector('.sensor:nth-child(2) .heat').focus()")?;
    desk.press("l")?;
    desk.wait(
        "return document.querySelectorAll('.sensor').length",
        &json!(1),
    )?;
    field(browser, "name", "pi-1 · s2")?;
    desk.press("[")?;
    field(browser, "name", "pi-1 · s1")?;
    desk.press("]")?;
    field(browser, "name", "pi-1 · s2")?;

    // A number is drawn in ink that no palette has in this cell.
    let inks = "const canvas = document.querySelector('.heat');
        const size = Math.floor(canvas.width / 8);
        const copy = Object.assign(document.createElement('canvas'), { width: size, height: size });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, 0, 0, size, size, 0, 0, size, size);
        const data = new Uint32Array(context.getImageData(2, 2, size - 4, size - 4).data.buffer);
        return new Set(data).size > 1;";
    desk.wait(inks, &json!(false))?;
    desk.press("n")?;
    desk.wait(inks, &json!(true))?;
    desk.press("n")?;
    desk.wait(inks, &json!(false))?;

    desk.press("t")?;
    field(browser, "orientation", "Drawn turned clockwise by 90°.")?;
    wait_for_color(browser, 15, HOTTEST)?;
    desk.press("m")?;
    field(browser, "orientation", "Drawn mirrored")?;
    wait_for_color(browser, 8, HOTTEST)?;
    browser.drag(".heat", (-5, -5), (5, 5))?;
    field(browser, "region", "Region of 4 pixels")?;
    desk.press("c")?;
    desk.says(".sensor [data-field=region]", str::is_empty)
}

fn keys_of_views(desk: &Desk) -> Outcome {
    desk.press("b")?;
    desk.says("#beside", |text| text.contains("Real beside simulated"))?;
    // The panel takes the focus to its choice of scenes, where letters choose.
    desk.browser.click("h1")?;
    desk.press("b")?;
    desk.says("#beside", str::is_empty)?;
    desk.press("Escape")?;
    desk.wait(
        "return document.querySelectorAll('.sensor').length",
        &json!(2),
    )?;
    desk.press("d")?;
    desk.says("#devices", |text| text.contains("pi-1"))?;
    desk.press("d")?;
    desk.says("#devices", str::is_empty)?;
    desk.says("#sensors", |text| text.contains("s2"))?;
    desk.press("r")?;
    desk.says("#recordings", |text| text.contains("No recordings yet"))?;
    desk.press("r")?;
    desk.says("#recordings", str::is_empty)
}

fn keys_of_playing(desk: &Desk) -> Outcome {
    let id = desk.collector.start_recording("hall");
    // Thirty seconds, of which the third ten never came.
    for first in [0, 100, 300] {
        let frames: Vec<Value> = (0..100)
            .map(|index| frame(&pixels(80, index % 64, 120), 402))
            .collect();
        desk.send("s3", first, &frames)?;
    }
    desk.post(&format!("/v1/recordings/{id}/stop"), &json!({}))?;
    desk.browser
        .open(&format!("{}/#recording={id}", desk.collector.url()))?;
    let time = |wanted: &str| {
        let wanted = format!("{wanted} / 0:39.9");
        desk.says("#time", |text| text == wanted)
    };
    time("0:00.0")?;
    for (key, at) in [
        (".", "0:00.1"),
        ("ArrowRight", "0:00.2"),
        (",", "0:00.1"),
        ("ArrowLeft", "0:00.0"),
        ("PageUp", "0:10.0"),
        ("PageDown", "0:00.0"),
        ("End", "0:39.9"),
        ("Home", "0:00.0"),
        // Where the last frame before the gap has had its time.
        ("g", "0:20.0"),
    ] {
        desk.press(key)?;
        time(at)?;
    }
    field(
        &desk.browser,
        "veil",
        "Gap: #200 to #299 are not in this recording",
    )?;
    desk.press("Home")?;
    time("0:00.0")?;
    let speed = "return document.querySelector('#speed').value";
    desk.press("-")?;
    desk.wait(speed, &json!("0.5"))?;
    desk.press("+")?;
    desk.wait(speed, &json!("1"))?;
    let button = "[data-does=play]";
    desk.press(" ")?;
    desk.says(button, |text| text == "Pause")?;
    desk.says("#time", |text| !text.starts_with("0:00.0"))?;
    desk.press(" ")?;
    desk.says(button, |text| text == "Play")?;
    desk.press("Home")?;
    time("0:00.0")
}

fn keys_of_labels(desk: &Desk) -> Outcome {
    desk.press("<")?;
    desk.says("#label-range", |text| text == "0:00.0 to 0:00.0")?;
    desk.press(".")?;
    desk.press(">")?;
    desk.says("#label-range", |text| text == "0:00.0 to 0:00.1")?;
    desk.press("a")?;
    desk.wait("return document.activeElement.name", &json!("name"))?;
    desk.browser
        .type_into("#label input", &format!("label 1{ENTER}"))?;
    desk.says("#label-list", |text| {
        text.contains("label 1") && text.contains("2 frames")
    })?;
    for digit in 2..=9 {
        let span = json!({ "device": "pi-1", "sensor": "s3", "boot": "b1", "first_seq": digit, "last_seq": digit });
        let label = json!({ "name": format!("label {digit}"), "spans": [span] });
        desk.post("/v1/recordings/1/labels", &label)?;
    }
    desk.says("#label-list", |text| text.contains("label 9"))?;
    for digit in 1..=9 {
        desk.press(&digit.to_string())?;
        let named = format!(
            "return [...document.querySelectorAll('#label-list li')].filter((row) => row.innerText.includes('label {digit}')).length"
        );
        desk.wait(&named, &json!(2))?;
    }
    Ok(())
}

#[test]
fn everything_is_reached_with_tab_and_enter_from_recording_to_the_devices() -> Outcome {
    if left_out("everything_is_reached_with_tab_and_enter_from_recording_to_the_devices") {
        return Ok(());
    }
    let desk = Desk::new()?;
    let browser = &desk.browser;
    let downloads = desk.folder.path().join("downloads");
    std::fs::create_dir(&downloads)?;
    browser.download_into(&downloads)?;
    desk.tab_to("#name")?;
    browser.press_text("kitchen")?;
    browser.press(ENTER)?;
    desk.says("#list", |text| text.contains("recording for"))?;
    let frames = vec![frame(&pixels(80, 9, 120), 402); 60];
    desk.send("s1", 0, &frames)?;
    desk.says("#list", |text| text.contains("60 frames"))?;
    desk.tab_to("#list [data-field=stop]")?;
    browser.press(ENTER)?;
    desk.says("#list [data-field=csv]", |text| text == "CSV")?;

    desk.tab_to("#list [data-field=play]")?;
    browser.press(ENTER)?;
    desk.says("#time", |text| text == "0:00.0 / 0:05.9")?;
    desk.tab_to("#transport [data-does=on]")?;
    browser.press(ENTER)?;
    desk.says("#time", |text| text == "0:00.1 / 0:05.9")?;
    desk.tab_to("#transport [data-does=play]")?;
    browser.press(ENTER)?;
    desk.says("#time", |text| text == "0:05.9 / 0:05.9")?;
    assert!(is_like(&color(browser, 9)?, HOTTEST));

    desk.tab_to("#played .sensor [data-field=beside]")?;
    browser.press(ENTER)?;
    // The first scene that is offered has the focus.
    desk.says("#played-beside [data-field=choice]", |text| {
        text.contains("walk")
    })?;
    let offered = "return document.activeElement.matches('#played-beside .offers button') && document.activeElement.textContent.startsWith('walk')";
    desk.wait(offered, &json!(true))?;
    browser.press(ENTER)?;
    desk.says("#played-beside [data-field=clock]", |text| {
        text == "Second 5.9 of 6.0."
    })?;
    desk.tab_to("#played-beside [data-field=begin]")?;
    browser.press(ENTER)?;
    desk.says("#played-beside [data-field=clock]", |text| {
        text == "Second 0.0 of 6.0."
    })?;
    keep_picture(browser, "tabbed")?;

    desk.tab_to("#downloads a")?;
    browser.press(ENTER)?;
    let file = downloads.join("kitchen.csv");
    browser.wait_for("the file", || Ok(file.exists()), |is_there| *is_there)?;
    let lines = std::fs::read_to_string(&file)?.lines().count();
    assert_eq!(lines, 61, "a heading and a line for each frame");
    desk.tab_to("nav [data-view=devices]")?;
    browser.press(ENTER)?;
    desk.says("#devices", |text| text.contains("pi-1"))?;
    assert_quiet(browser, "")
}
