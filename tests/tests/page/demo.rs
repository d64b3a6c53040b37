//! The page of the real program, `grideye demo`, in a real browser.

use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::programs::{grideye, run, terminate, wait};
use grideye_tests::webdriver::{Browser, Failure, Screen, left_out};
use serde_json::Value;
use std::ffi::OsString;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running demonstration; killed when dropped.
pub(crate) struct Demo {
    child: Child,
    messages: BufReader<std::process::ChildStderr>,
    pub(crate) page: String,
}

impl Demo {
    fn start(out: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        Self::start_as(grideye(), out, arguments)
    }

    pub(crate) fn start_as(
        mut command: Command,
        out: &Path,
        arguments: &[&str],
    ) -> Result<Self, Failure> {
        command.arg("demo").args(arguments).arg("--out").arg(out);
        Self::of(command, "live page")
    }

    /// A program that prints its page's address on standard error, after this word.
    fn of(mut command: Command, word: &str) -> Result<Self, Failure> {
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let mut messages = BufReader::new(child.stderr.take().ok_or("no standard error")?);
        let mut said = String::new();
        let page = loop {
            let mut line = String::new();
            if messages.read_line(&mut line)? == 0 {
                return Err(format!("the program said {said:?}").into());
            }
            if let Some(page) = line.strip_prefix(word) {
                break page.trim().to_owned();
            }
            said += &line;
        };
        Ok(Self {
            child,
            messages,
            page,
        })
    }

    /// Ends it as Ctrl-C does; exit code, standard output, and standard error.
    fn end(mut self) -> Result<(i32, String, String), Failure> {
        terminate(&self.child);
        let code = wait(&mut self.child);
        let (mut said, mut messages) = (String::new(), String::new());
        self.child
            .stdout
            .take()
            .ok_or("no standard output")?
            .read_to_string(&mut said)?;
        self.messages.read_to_string(&mut messages)?;
        Ok((code, said, messages))
    }
}

impl Drop for Demo {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn sensor(page: &str) -> Result<Value, Failure> {
    let sensors: Value = ureq::get(format!("{page}v1/sensors"))
        .call()?
        .body_mut()
        .read_json()?;
    Ok(sensors["sensors"][0].clone())
}

#[test]
fn the_demonstration_shows_its_sensor_live_until_it_is_interrupted() -> Result<(), Failure> {
    if left_out("the_demonstration_shows_its_sensor_live_until_it_is_interrupted") {
        return Ok(());
    }
    let out = tempfile::tempdir()?;
    let demo = Demo::start(out.path(), &[])?;
    let browser = Browser::start()?;
    browser.open(&demo.page)?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    browser.wait_for_text(".sensor [data-field=name]", |text| {
        text == "demo · i2c-1:0x69"
    })?;
    browser.wait_for_text(".sensor [data-field=state]", |text| text == "live")?;
    // The sensor's period is exact here, and the rate is told by the device's clock.
    browser.wait_for_text(".sensor [data-field=rate]", |text| text == "10.00 Hz")?;
    let seq = browser.text(".sensor [data-field=seq]")?;
    browser.wait_for_text(".sensor [data-field=seq]", |later| later != seq)?;

    // The radiator is the hottest, and the room's front is at the top.
    let frame = sensor(&demo.page)?["frame"]["pixels_celsius"].clone();
    let celsius: Vec<f64> = serde_json::from_value(frame)?;
    let hottest = (0..64)
        .max_by(|a, b| celsius[*a].total_cmp(&celsius[*b]))
        .ok_or("no pixel")?;
    assert_eq!(hottest / 8, 0, "pixel {}", hottest + 1);

    // The ten seconds are recorded and downloadable while the page goes on.
    browser.wait_for_text("#list a", |text| text == "CSV")?;
    browser.wait_for_text("#list", |text| text.contains("frames"))?;
    if let Some(folder) = std::env::var_os("GRIDEYE_SCREENSHOTS") {
        std::fs::write(Path::new(&folder).join("demo.png"), browser.screenshot()?)?;
    }
    assert_eq!(browser.console()?, Vec::<String>::new());
    drop(browser);

    let (code, said, messages) = demo.end()?;
    assert_eq!(code, 0, "{said}{messages}");
    assert!(
        said.contains("delivery") && said.contains("verdict   Agrees: "),
        "{said}{messages}"
    );
    assert!(
        messages.contains("the live page stays until Ctrl-C"),
        "{messages}"
    );
    assert!(out.path().join("report.html").exists());
    Ok(())
}

#[test]
fn an_interrupted_recording_says_so_and_gives_no_verdict() -> Result<(), Failure> {
    let out = tempfile::tempdir()?;
    let demo = Demo::start(out.path(), &["--once"])?;
    let (code, said, messages) = demo.end()?;
    assert_eq!((code, said.as_str()), (3, ""), "{messages}");
    assert!(
        messages.contains("interrupted before the recording was complete"),
        "{messages}"
    );
    assert!(!out.path().join("report.html").exists());
    Ok(())
}

/// Whether an element begins in the window as it opened.
fn is_in_sight(browser: &Browser, selector: &str) -> Result<bool, Failure> {
    let script = format!(
        "const {{ top, height }} = document.querySelector('{selector}').getBoundingClientRect();
         return scrollY === 0 && height > 0 && top < innerHeight;"
    );
    Ok(browser.execute(&script)? == true)
}

/// No two places of the page give the verdict: they would not always give the same one.
fn assert_one_verdict(browser: &Browser) -> Outcome {
    let script = "return document.body.innerText.match(/\\b(agrees|disagrees|cannot tell|no verdict yet)\\b/gi)";
    let said: Vec<String> = serde_json::from_value(browser.execute(script)?)?;
    assert_eq!(said.len(), 1, "{said:?}");
    Ok(())
}

#[test]
fn the_page_opens_with_its_scene_beside_the_sensor_and_ends_with_the_report() -> Outcome {
    if left_out("the_page_opens_with_its_scene_beside_the_sensor_and_ends_with_the_report") {
        return Ok(());
    }
    let out = tempfile::tempdir()?;
    let demo = Demo::start(out.path(), &[])?;
    let browser = Browser::start()?;
    browser.open(&demo.page)?;
    let says = |name: &str, wanted: &str| {
        let selector = format!("#beside [data-field={name}]");
        browser
            .wait_for_text(&selector, |text| text.starts_with(wanted))
            .map(drop)
    };
    browser.wait_for_text("#beside [data-field=verdict]", |text| !text.is_empty())?;
    assert_one_verdict(&browser)?;
    says("verdict", "Agrees")?;
    says("cursor", "Emulated sensor − simulated: mean")?;
    says("places", "person at ")?;
    let places = browser.text("#beside [data-field=places]")?;
    browser.wait_for_text("#beside [data-field=places]", |later| {
        later.starts_with("person at ") && later != places
    })?;
    let chosen = "return document.querySelector('#beside [data-field=choice]').value";
    assert_eq!(browser.execute(chosen)?, r#"["living-room","ceiling"]"#);
    for part in [
        "[data-side=simulated] .heat",
        "[data-side=difference] .heat",
        ".plan canvas",
        "[data-field=verdict]",
        "[data-field=meaning]",
        "tbody tr",
    ] {
        assert!(
            is_in_sight(&browser, &format!("#beside {part}"))?,
            "{part} is out of sight"
        );
    }
    let recorded = browser.wait_for_text("#recorded", |text| {
        text.starts_with("Recorded demo-") && text.contains("Open the report")
    })?;
    // A busy host stops the recording later than after its hundred frames.
    let frames = recorded.split_once(" frames").ok_or("no count")?.0;
    let frames: u16 = frames.rsplit(' ').next().ok_or("no count")?.parse()?;
    assert!(frames >= 100, "{recorded}");
    // The walk goes on, beside its simulation.
    says("verdict", "Agrees")?;
    says("meaning", "person is where and when the scene says.")?;
    assert_one_verdict(&browser)?;
    let goes_on = |text: &str| text.starts_with("Second ") && text.contains(", round ");
    browser.wait_for_text("#beside [data-field=clock]", goes_on)?;
    keep_picture(&browser, "demo-recorded")?;

    // The links lead to the recording and to the report, which may use its own styles and nothing else.
    browser.click("#recorded a[href^='#recording']")?;
    let time = browser.wait_for_text("#time", |text| text.starts_with("0:00.0 / "))?;
    let length = time.rsplit([' ', ':']).next().ok_or("no length")?;
    let (length_s, wanted_s): (f64, f64) = (length.parse()?, f64::from(frames) / 10.0);
    assert!(
        (length_s - wanted_s % 60.0).abs() < 0.5,
        "{time}: {frames} frames"
    );
    browser.open(&demo.page)?;
    browser.wait_for_text("#recorded a", |text| text == "Open the report")?;
    browser.click("#recorded a")?;
    browser.wait_for_text("body", |text| text.contains("would have been noticed"))?;
    let width = "return parseFloat(getComputedStyle(document.querySelector('main')).maxWidth)";
    assert!(browser.execute(width)?.as_f64() > Some(0.0));
    assert_report_begins_with_what_counts(&browser)?;
    assert_quiet(&browser, "")
}

/// Verdict, four images in one row and the beginning of the film are on the first screen; all that is not folded on three.
fn assert_report_begins_with_what_counts(browser: &Browser) -> Outcome {
    browser.set_screen(Screen {
        width: 1400,
        height: 900,
        scale: 1.0,
        mobile: false,
    })?;
    let ends = browser.execute(
        "const boxes = (selector) => [...document.querySelectorAll(selector)].map((one) => one.getBoundingClientRect());
         const figures = boxes('.frames > figure').slice(0, 4);
         return [boxes('.verdict h1')[0].bottom, figures.length, new Set(figures.map(({ top }) => top)).size, Math.max(...figures.map(({ bottom }) => bottom)), boxes('.film')[0].top, document.documentElement.scrollHeight];",
    )?;
    let [verdict, images, rows, images_end, film, height]: [f64; 6] = serde_json::from_value(ends)?;
    assert!(verdict < 200.0, "the verdict ends at {verdict}");
    assert_eq!((images, rows), (4.0, 1.0));
    assert!(images_end < 900.0, "the images end at {images_end}");
    assert!(film < 900.0, "the film begins at {film}");
    assert!(height <= 2700.0, "{height} pixels");
    Ok(())
}

#[test]
fn a_recording_that_is_replayed_has_the_plain_page() -> Outcome {
    if left_out("a_recording_that_is_replayed_has_the_plain_page") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let recording = folder.path().join("walk.csv");
    let arguments = ["simulate", "scenes/experiment-1.toml", "--frames", "50"];
    let simulated = run(grideye().args(arguments).arg("--out").arg(&recording));
    assert_eq!(simulated.code, 0, "{simulated:?}");
    let path = recording.to_str().ok_or("a path that is no text")?;
    let demo = Demo::start(&folder.path().join("out"), &["--replay", path])?;
    let browser = Browser::start()?;
    browser.open(&demo.page)?;
    // On a busy host the recording, of five seconds, has ended before the browser is there.
    let shown = |text: &str| ["live", "stale"].contains(&text);
    browser.wait_for_text(".sensor [data-field=state]", shown)?;
    let opened = "return document.querySelector('#recorded, #beside > *')";
    assert_eq!(browser.execute(opened)?, Value::Null);
    assert_quiet(&browser, "")
}

#[test]
fn any_recording_is_played_and_nothing_is_kept() -> Outcome {
    if left_out("any_recording_is_played_and_nothing_is_kept") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    // As somebody's logger prints it: a line for each row of the sensor.
    let frame = "20.00 20.25 20.00 20.25 31.50 20.00 20.25 20.00\n".repeat(8);
    let recording = folder.path().join("hall.txt");
    std::fs::write(&recording, format!("{frame}\n").repeat(25))?;
    let mut command = grideye();
    command
        .args(["view", "--listen", "127.0.0.1:0"])
        .arg(&recording);
    let temporary = folder.path().join("temporary");
    std::fs::create_dir(&temporary)?;
    command.env("TMPDIR", &temporary);
    let viewed = Demo::of(command, "page ")?;
    let browser = Browser::start()?;
    browser.open(&viewed.page)?;
    browser.wait_for_text("#played-name", |text| text == "hall")?;
    // It plays by itself.
    browser.wait_for_text("#time", |text| {
        text.ends_with(" / 0:02.4") && !text.starts_with("0:00.0")
    })?;
    browser.wait_for_text("#played [data-field=max]", |text| text == "31.50 °C")?;
    assert_quiet(&browser, "")?;
    drop(browser);
    let (code, _, messages) = viewed.end()?;
    assert_eq!(code, 0, "{messages}");
    assert_eq!(std::fs::read_dir(&temporary)?.count(), 0);
    Ok(())
}

/// A folder to search for programs first, with one that writes down which address it should open.
fn with_opener(folder: &Path) -> Result<OsString, Failure> {
    let name = if cfg!(target_os = "macos") {
        "open"
    } else {
        "xdg-open"
    };
    let opener = folder.join(name);
    let opened = folder.join("opened");
    let script = format!("#!/bin/sh\nprintf %s \"$1\" > \"{}\"\n", opened.display());
    std::fs::write(&opener, script)?;
    std::fs::set_permissions(&opener, std::fs::Permissions::from_mode(0o755))?;
    let mut path = folder.as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    Ok(path)
}

#[test]
fn open_hands_the_address_to_the_opener_and_goes_on_without_one() -> Outcome {
    let folder = tempfile::tempdir()?;
    let mut command = grideye();
    command.env("PATH", with_opener(folder.path())?);
    let arguments = ["--once", "--speed", "10", "--open"];
    let mut demo = Demo::start_as(command, &folder.path().join("out"), &arguments)?;
    assert_eq!(wait(&mut demo.child), 0);
    let opened = std::fs::read_to_string(folder.path().join("opened"))?;
    assert_eq!(opened, demo.page);

    let mut command = grideye();
    command.env("PATH", folder.path().join("nothing"));
    let mut demo = Demo::start_as(command, &folder.path().join("out"), &arguments)?;
    assert_eq!(wait(&mut demo.child), 0);
    let mut messages = String::new();
    demo.messages.read_to_string(&mut messages)?;
    assert!(
        messages.contains("warning: cannot run ") && messages.contains("hint: open the address"),
        "{messages}"
    );
    Ok(())
}
