//! How many people there are, on the page of a collector that counts.

use grideye_tests::live_page::{
    Outcome, assert_quiet, batch, color, field, frame, keep_picture, person,
};
use grideye_tests::programs::RunningCollector;
use grideye_tests::webdriver::{Browser, left_out};
use serde_json::{Value, json};
use std::ffi::OsStr;

#[test]
fn a_card_says_how_many_people_there_are_and_outlines_them() -> Outcome {
    if left_out("a_card_says_how_many_people_there_are_and_outlines_them") {
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    let options = ["--count", "--line=-0.5,7,7.5,7"].map(OsStr::new);
    let collector = RunningCollector::start_with(folder.path().join("frames.sqlite"), &options);
    let post = |first: u64, frames: &[Value]| -> Outcome {
        let url = format!("{}/v1/frames", collector.url());
        ureq::post(&url).send_json(batch("s1", first, frames))?;
        Ok(())
    };
    let browser = Browser::start()?;
    browser.open(&format!("{}/", collector.url()))?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    let empty = frame(&[84; 64], 402);
    post(0, &vec![empty.clone(); 10])?;
    field(&browser, "people", "not yet")?;
    // Half a minute of the device's clock.
    post(10, &vec![empty.clone(); 300])?;
    field(&browser, "people", "0 (0 in, 0 out)")?;
    post(310, &vec![frame(&person(), 402); 10])?;
    field(&browser, "people", "1 (0 in, 0 out)")?;
    keep_picture(&browser, "people")?;
    // The edge between pixel 26, which is cold, and pixel 27, which is the person's, is white.
    let edge = "const canvas = document.querySelector('.heat');
        const [x, y] = [3 * canvas.width / 8, 2.5 * canvas.width / 8];
        const copy = Object.assign(document.createElement('canvas'), { width: 1, height: 1 });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, x, y, 1, 1, 0, 0, 1, 1);
        return Array.from(context.getImageData(0, 0, 1, 1).data.slice(0, 3));";
    assert_eq!(browser.execute(edge)?, json!([255, 255, 255]));
    assert_ne!(color(&browser, 27)?, [255, 255, 255]);
    let metrics = ureq::get(&format!("{}/metrics", collector.url()))
        .call()?
        .body_mut()
        .read_to_string()?;
    assert!(
        metrics.contains("grideye_people{device=\"pi-1\",sensor=\"s1\"} 1"),
        "{metrics}"
    );
    // They have left.
    post(320, &vec![empty; 20])?;
    field(&browser, "people", "0 (0 in, 0 out)")?;
    assert_quiet(&browser, "")
}
