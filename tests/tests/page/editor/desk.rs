//! The program on a folder of scenes, and a browser on its editor.

use grideye_recording::csv::Reader;
use grideye_tests::live_page::Outcome;
use grideye_tests::programs::{RunningCollector, grideye, run};
use grideye_tests::webdriver::{Browser, Failure, Screen};
use std::fs;
use std::path::PathBuf;

/// Keys of a keyboard (W3C WebDriver §17.4.2).
pub(crate) const CONTROL: &str = "\u{E009}";
pub(crate) const SHIFT: &str = "\u{E008}";
pub(crate) const DELETE: &str = "\u{E017}";
pub(crate) const ENTER: &str = "\u{E007}";
pub(crate) const TAB: &str = "\u{E004}";
pub(crate) const UP: &str = "\u{E013}";
pub(crate) const RIGHT: &str = "\u{E014}";
pub(crate) const PAGE_DOWN: &str = "\u{E00F}";

/// Without noise, so that what is simulated elsewhere is the same.
pub(crate) const ROOM: &str = "# A room, for trying the editor.
# Nobody lives here.

[room]
size_mm = [4000, 4000, 2700] # measured twice
ambient_c = 20

[[object]]
name = \"stove\"                 # in the middle
position_mm = [2000, 2000, 0]
size_mm = [800, 600, 1200]
temperature_c = 35             # guessed

# Walks along the front.
[[agent]]
name = \"ana\"
size_mm = [300, 500, 1700]
temperature_c = 30
trajectory = \"ways/ana.csv\"
speed_mm_per_s = 500

[[agent]]
name = \"bob\"
size_mm = [300, 500, 1700]
temperature_c = 30
position_mm = [800, 3000, 0]

[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
noise_sigma_c = 0
position_mm = [1200, 2400, 2700]
elevation_deg = 90
azimuth_deg = -90

[[sensor]]
name = \"wall\"
preset = \"grid-eye\"
noise_sigma_c = 0
position_mm = [2000, 4000, 2000]
elevation_deg = 30
azimuth_deg = -90
# The end.
";
pub(crate) const WAY: &str = "# from the door\nx_mm,y_mm,z_mm\n500,700,0\n3500,700,0\n";

/// To the right and to the back, in a room.
pub(crate) type Meters = (f64, f64);

/// The program on a folder of scenes, and a browser on the editor.
pub(crate) struct Desk {
    pub(crate) collector: RunningCollector,
    pub(crate) browser: Browser,
    pub(crate) folder: tempfile::TempDir,
}

impl Desk {
    pub(crate) fn new() -> Result<Self, Failure> {
        const BROKEN: &str = "# Half a room.\n[room]\nsize_mm = [4000, 4000]\n";
        Self::with(&[
            ("room.toml", ROOM),
            ("ways/ana.csv", WAY),
            ("broken.toml", BROKEN),
        ])
    }

    /// A folder of scenes with these files.
    pub(crate) fn with(files: &[(&str, &str)]) -> Result<Self, Failure> {
        let folder = tempfile::tempdir()?;
        let scenes = folder.path().join("scenes");
        fs::create_dir_all(scenes.join("ways"))?;
        for (name, text) in files {
            fs::write(scenes.join(name), text)?;
        }
        let arguments = ["--scenes".as_ref(), scenes.as_os_str()];
        let store = folder.path().join("store.sqlite");
        let desk = Self {
            collector: RunningCollector::start_with(store, &arguments),
            browser: Browser::start()?,
            folder,
        };
        desk.browser.set_screen(Screen {
            width: 1600,
            height: 1000,
            scale: 1.0,
            mobile: false,
        })?;
        Ok(desk)
    }

    /// Opens a scene in the editor.
    pub(crate) fn open(&self, scene: &str) -> Outcome {
        self.open_at(&format!("#scene={scene}"))
    }

    /// Opens the editor, with what follows its path.
    pub(crate) fn open_at(&self, hash: &str) -> Outcome {
        let url = format!("{}/editor{hash}", self.collector.url());
        self.browser.open(&url)?;
        let ready = || {
            self.browser
                .execute("return document.querySelector('main').dataset.ready")
        };
        self.browser
            .wait_for("the editor", ready, |is| is == "true")
            .map(drop)
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join("scenes").join(name)
    }

    pub(crate) fn disk(&self, name: &str) -> Result<String, Failure> {
        Ok(fs::read_to_string(self.file(name))?)
    }

    /// The text of the scene as the page has it.
    pub(crate) fn text(&self) -> Result<String, Failure> {
        let text = self
            .browser
            .execute("return document.querySelector('#text').value")?;
        Ok(text.as_str().unwrap_or_default().to_owned())
    }

    pub(crate) fn wait_for_text(&self, is_right: impl Fn(&str) -> bool) -> Result<String, Failure> {
        self.browser
            .wait_for("the scene's text", || self.text(), |text| is_right(text))
    }

    /// The degrees that a sensor's picture is drawn of.
    pub(crate) fn celsius(&self, sensor: &str) -> Result<Vec<f64>, Failure> {
        let script = format!(
            "return document.querySelector('#frames [data-sensor={sensor}]').dataset.celsius"
        );
        let all = self.browser.execute(&script)?;
        let all = all.as_str().ok_or("no picture")?.split(' ');
        Ok(all.map(str::parse).collect::<Result<_, _>>()?)
    }

    /// Waits until the pictures of both sensors are other than they were.
    pub(crate) fn wait_for_other_pictures(
        &self,
        before: &[Vec<f64>; 2],
    ) -> Result<[Vec<f64>; 2], Failure> {
        let look = || Ok([self.celsius("ceiling")?, self.celsius("wall")?]);
        let is_other = |now: &[Vec<f64>; 2]| now[0] != before[0] && now[1] != before[1];
        self.browser
            .wait_for("the pictures of both sensors", look, is_other)
    }

    pub(crate) fn pictures(&self) -> Result<[Vec<f64>; 2], Failure> {
        Ok([self.celsius("ceiling")?, self.celsius("wall")?])
    }

    /// Where the plan has the room's front left corner, and a meter, in pixels from the canvas's corner.
    pub(crate) fn plan(&self) -> Result<[f64; 3], Failure> {
        let script = "return document.querySelector('#plan').dataset.drawn.split(' ').map(Number)";
        Ok(serde_json::from_value(self.browser.execute(script)?)?)
    }

    /// A place in the room, meters, in pixels from the corner of the plan.
    pub(crate) fn on_plan(&self, (x, y): Meters) -> Result<(f64, f64), Failure> {
        let [left, top, meter] = self.plan()?;
        Ok((left + x * meter, top - y * meter))
    }

    /// Drags what is at a place of the plan by meters to the right and to the back.
    pub(crate) fn drag(&self, at: Meters, (right, back): Meters) -> Outcome {
        let to = self.on_plan((at.0 + right, at.1 + back))?;
        self.drag_in("#plan", self.on_plan(at)?, to)
    }

    /// Waits until the plan names what is at a place.
    pub(crate) fn wait_for_name(&self, at: Meters, name: &str) -> Outcome {
        let named = || -> Result<String, Failure> {
            self.browser
                .point_at("#plan", self.beside_middle("#plan", self.on_plan(at)?)?)?;
            let title = self
                .browser
                .execute("return document.querySelector('#plan').title")?;
            Ok(title.as_str().unwrap_or_default().to_owned())
        };
        let what = format!("{name} at {at:?}");
        self.browser
            .wait_for(&what, named, |named| named == name)
            .map(drop)
    }

    /// Whether the plan's floor has lines of a hatch at 0.3 m from the left and 0.8 m from the front of the room.
    pub(crate) fn is_hatched(&self) -> Result<bool, Failure> {
        let script =
            "return new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)))).then(() => {
               const plan = document.querySelector('#plan');
               const [left, top, meter] = plan.dataset.drawn.split(' ').map(Number);
               const copy = Object.assign(document.createElement('canvas'), { width: 12, height: 12 });
               const context = copy.getContext('2d', { willReadFrequently: true });
               context.drawImage(plan, left + 0.3 * meter, top - 0.8 * meter, 12, 12, 0, 0, 12, 12);
               const dots = new Uint32Array(context.getImageData(0, 0, 12, 12).data.buffer);
               return new Set(dots).size > 1;
             })";
        Ok(self.browser.execute(script)? == true)
    }

    /// Where a pane's round handle is drawn, in pixels from the canvas's corner.
    pub(crate) fn handle(&self, pane: &str) -> Result<Option<(f64, f64)>, Failure> {
        let script = format!(
            "return (document.querySelector('{pane}').dataset.handle ?? '').split(' ').filter(Boolean).map(Number)"
        );
        let place: Vec<f64> = serde_json::from_value(self.browser.execute(&script)?)?;
        Ok(place.first().copied().zip(place.get(1).copied()))
    }

    pub(crate) fn handle_other_than(
        &self,
        pane: &str,
        before: Option<(f64, f64)>,
    ) -> Result<(f64, f64), Failure> {
        let is_other = |now: &Option<(f64, f64)>| now.is_some() && *now != before;
        let look = || self.handle(pane);
        let found = self.browser.wait_for("another handle", look, is_other)?;
        found.ok_or_else(|| "no handle".into())
    }

    pub(crate) fn handle_at(&self, pane: &str, place: (f64, f64)) -> Outcome {
        let is_there = |now: &Option<(f64, f64)>| *now == Some(place);
        let look = || self.handle(pane);
        self.browser
            .wait_for("the handle", look, is_there)
            .map(drop)
    }

    /// A place in pixels from a canvas's corner, as whole pixels from its middle.
    pub(crate) fn beside_middle(
        &self,
        pane: &str,
        (x, y): (f64, f64),
    ) -> Result<(i32, i32), Failure> {
        let middle = format!(
            "const pane = document.querySelector('{pane}');
             pane.scrollIntoView({{ block: 'center' }});
             return [pane.clientWidth / 2, pane.clientHeight / 2]"
        );
        let middle: [f64; 2] = serde_json::from_value(self.browser.execute(&middle)?)?;
        Ok((pixels(x - middle[0])?, pixels(y - middle[1])?))
    }

    /// Drags from one place of a canvas to another, in pixels from its corner.
    pub(crate) fn drag_in(&self, pane: &str, from: (f64, f64), to: (f64, f64)) -> Outcome {
        let [from, to] = [
            self.beside_middle(pane, from)?,
            self.beside_middle(pane, to)?,
        ];
        self.browser.drag(pane, from, to)
    }

    /// Goes to a field by its key, and writes.
    pub(crate) fn write(&self, key: &str, value: &str) -> Outcome {
        let selector = format!("#fields [data-key=\"{key}\"]");
        self.browser.execute(&format!(
            "const field = document.querySelector('{selector}'); field.focus(); field.select()"
        ))?;
        self.browser
            .type_into(&selector, &format!("{value}{ENTER}"))
    }

    pub(crate) fn choose(&self, name: &str) -> Outcome {
        let script = format!(
            "[...document.querySelectorAll('#things li')].find((one) => one.querySelector('.name').textContent === '{name}').click()"
        );
        self.browser.execute(&script).map(drop)
    }

    pub(crate) fn saved(&self) -> Outcome {
        self.browser
            .wait_for_text("#saved", |text| text == "saved")
            .map(drop)
    }

    /// Tab, until an element has the focus.
    pub(crate) fn tab_to(&self, id: &str) -> Outcome {
        let focus = || self.browser.execute("return document.activeElement.id");
        for _ in 0..40 {
            if focus()? == id {
                return Ok(());
            }
            self.browser.press(TAB)?;
        }
        Err(format!("Tab does not lead to {id}").into())
    }

    /// Ctrl Z, until the text is as it was opened.
    pub(crate) fn undo_all(&self) -> Outcome {
        let look = || {
            self.browser.press_together(&[CONTROL, "z"])?;
            self.text()
        };
        self.browser
            .wait_for("the first text", look, |text| text == ROOM)
            .map(drop)
    }

    /// What is behind a key, in the table of that name.
    pub(crate) fn value(text: &str, name: &str, key: &str) -> Result<toml::Value, Failure> {
        let scene: toml::Table = text.parse()?;
        let mut tables = scene.values().filter_map(toml::Value::as_array).flatten();
        let named =
            tables.find(|table| table.get("name").and_then(toml::Value::as_str) == Some(name));
        let value = named.and_then(|table| table.get(key)).cloned();
        value.ok_or_else(|| format!("no {key} of {name}").into())
    }

    pub(crate) fn number(&self, text: &str, name: &str, key: &str) -> Result<f64, Failure> {
        Ok(Self::value(text, name, key)?.to_string().parse()?)
    }

    /// Three numbers behind a key, in the table of that name.
    pub(crate) fn triple(&self, text: &str, name: &str, key: &str) -> Result<[f64; 3], Failure> {
        let list = Self::value(text, name, key)?;
        let numbers = list.as_array().into_iter().flatten();
        let numbers: Vec<f64> = numbers
            .filter_map(|one| one.to_string().parse().ok())
            .collect();
        <[f64; 3]>::try_from(numbers).map_err(|found| format!("{key}: {found:?}").into())
    }
}

/// A whole number of pixels.
pub(crate) fn pixels(length: f64) -> Result<i32, Failure> {
    Ok(format!("{length:.0}").parse()?)
}

pub(crate) fn near(found: f64, wanted: f64, by: f64) -> bool {
    (found - wanted).abs() <= by
}

/// What `grideye simulate` makes of a scene's first moment, in quarters of a degree.
pub(crate) fn simulated(desk: &Desk, scene: &str, sensor: &str) -> Result<Vec<f64>, Failure> {
    let out = desk.folder.path().join("frame.csv");
    let ended = run(grideye()
        .arg("simulate")
        .arg(desk.file(scene))
        .args(["--sensor", sensor, "--frames", "1", "--seed", "1", "--out"])
        .arg(&out));
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let first = Reader::new(fs::File::open(out)?)?
        .next()
        .ok_or("no frame")??;
    let raw = first.record.reading.frame().ok_or("a frame is missing")?;
    Ok(raw
        .pixels
        .iter()
        .map(|word| f64::from(word.0) / 4.0)
        .collect())
}
