//! The page of the real program, `grideye demo`, in a real browser.

use grideye_tests::programs::{grideye, terminate, wait};
use grideye_tests::webdriver::{Browser, Failure, left_out};
use serde_json::Value;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Stdio};

/// A running demonstration; killed when dropped.
struct Demo {
    child: Child,
    messages: BufReader<std::process::ChildStderr>,
    page: String,
}

impl Demo {
    fn start(out: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        let mut command = grideye();
        command.arg("demo").args(arguments).arg("--out").arg(out);
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let mut messages = BufReader::new(child.stderr.take().ok_or("no standard error")?);
        let mut line = String::new();
        messages.read_line(&mut line)?;
        let page = line
            .strip_prefix("live page")
            .ok_or(format!("the demonstration said {line:?}"))?;
        Ok(Self {
            child,
            messages,
            page: page.trim().to_owned(),
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

    // The person of experiment 1 stands below the sensor: the hottest pixel is one of the middle.
    let frame = sensor(&demo.page)?["frame"]["pixels_celsius"].clone();
    let celsius: Vec<f64> = serde_json::from_value(frame)?;
    let hottest = (0..64)
        .max_by(|a, b| celsius[*a].total_cmp(&celsius[*b]))
        .ok_or("no pixel")?;
    assert!(
        (2..6).contains(&(hottest / 8)) && (2..6).contains(&(hottest % 8)),
        "pixel {}",
        hottest + 1
    );

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
