//! A recording downloaded from the page, as CSV and as what other programs read, held against `grideye convert`.

use grideye_tests::live_page::{Outcome, assert_quiet, batch, frame, keep_picture, person};
use grideye_tests::programs::{RunningCollector, grideye, run};
use grideye_tests::webdriver::{Browser, left_out};
use serde_json::json;
use std::path::Path;

/// Clicks, and waits for a whole file: a browser holds its name by an empty one, and puts it there when it has all of it.
fn downloaded(
    browser: &Browser,
    link: &str,
    file: &Path,
) -> Result<Vec<u8>, grideye_tests::webdriver::Failure> {
    let what = file.display().to_string();
    let look = || Ok(std::fs::read(file)?);
    browser.click(link)?;
    browser.wait_for(&what, look, |bytes: &Vec<u8>| !bytes.is_empty())
}

#[test]
fn a_recording_is_downloaded_from_the_page_in_every_form_as_convert_writes_it() -> Outcome {
    if left_out("a_recording_is_downloaded_from_the_page_in_every_form_as_convert_writes_it") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let collector = RunningCollector::start(folder.path());
    let frames_at = format!("{}/v1/frames", collector.url());
    let id = collector.start_recording("kitchen, evening");
    // More than one page of the store, and in it what is missing.
    for (first, sensor) in (0..6000).step_by(1000).map(|first| (first, "s1")) {
        let some = vec![frame(&person(), 402); 990];
        ureq::post(&frames_at).send_json(batch(sensor, first, &some))?;
    }
    let missing = vec![json!({ "missing": "nack" }); 3];
    ureq::post(&frames_at).send_json(batch("s2", 0, &missing))?;
    let csv = folder.path().join("recording.csv");
    std::fs::write(&csv, collector.recording_csv(id))?;

    let browser = Browser::start()?;
    let downloads = folder.path().join("downloads");
    std::fs::create_dir(&downloads)?;
    browser.download_into(&downloads)?;
    browser.open(&format!("{}/#recording={id}", collector.url()))?;
    browser.wait_for_text("#downloads", |text| {
        text.starts_with("Download CSV NPZ Parquet MCAP PNG GIF")
    })?;
    keep_picture(&browser, "exports")?;
    let forms = ["csv", "npz", "parquet", "mcap", "png", "gif"];
    for (place, end) in (1..).zip(forms) {
        let link = format!("#downloads a:nth-child({place})");
        let file = downloads.join(format!("kitchen, evening.{end}"));
        let taken = downloaded(&browser, &link, &file)?;
        let written = folder.path().join(format!("written.{end}"));
        let mut convert = grideye();
        convert.arg("convert").arg(&csv).arg(&written);
        if ["png", "gif"].contains(&end) {
            // A picture is of the sensor that is chosen beside it: the first, unless somebody says otherwise.
            convert.args(["--sensor", "pi-1/s1"]);
        }
        let converted = run(&mut convert);
        assert_eq!(converted.code, 0, "{converted:?}");
        assert!(taken == std::fs::read(&written)?, "{end} differs");
    }

    // Of the other sensor there is no frame, and the page says so where it is; the next picture takes that back.
    browser.click("#downloads option:nth-child(2)")?;
    browser.click("#downloads a:nth-child(5)")?;
    browser.wait_for_text("#played-trouble", |text| {
        text.starts_with("the recording holds no frame. Hint: all of its rows say")
    })?;
    browser.click("#downloads option:nth-child(1)")?;
    browser.click("#downloads a:nth-child(5)")?;
    browser.wait_for_text("#played-trouble", str::is_empty)?;
    assert_quiet(
        &browser,
        "Failed to load resource: the server responded with a status of 422",
    )
}
