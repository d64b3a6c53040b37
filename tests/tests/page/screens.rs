//! What fits one screen of 1400 x 900: several sensors, live and recorded, and a file that is dropped on the page.

use grideye_tests::live_page::{
    Outcome, Server, assert_quiet, batch, drop_file, frame, keep_picture, person, pixels, set_up,
};
use grideye_tests::webdriver::{Browser, Failure, Screen, left_out};
use serde_json::{Value, json};

const DESK: Screen = Screen {
    width: 1400,
    height: 900,
    scale: 1.0,
    mobile: false,
};

/// One frame of each of so many sensors of one device.
fn sensors(count: usize, words: &[u16]) -> Value {
    let mut body = batch("unused", 0, &[frame(words, 402)]);
    let part = body["sensors"][0].clone();
    body["sensors"] = (0..count)
        .map(|index| {
            let mut part = part.clone();
            part["sensor"] = format!("s{index}").into();
            part
        })
        .collect();
    body
}

/// Where the lowest card ends, where the widest ends, and how wide the smallest image is.
fn cards(browser: &Browser, wall: &str, count: usize) -> Result<[f64; 3], Failure> {
    let script = format!(
        "const boxes = (selector) => [...document.querySelectorAll(`{wall} ${{selector}}`)].map((one) => one.getBoundingClientRect());
         const cards = boxes('.sensor');
         return [cards.length, Math.max(...cards.map(({{ bottom }}) => bottom)), Math.max(...cards.map(({{ right }}) => right)), Math.min(...boxes('.heat').map(({{ width }}) => width))];"
    );
    let found = browser.wait_for(
        "the cards",
        || browser.execute(&script),
        |found| found[0] == count,
    )?;
    let [_, bottom, right, image]: [f64; 4] = serde_json::from_value(found)?;
    Ok([bottom, right, image])
}

#[test]
fn six_and_nine_sensors_are_on_one_screen_live_and_recorded() -> Outcome {
    if left_out("six_and_nine_sensors_are_on_one_screen_live_and_recorded") {
        return Ok(());
    }
    for count in [6, 9] {
        let (server, browser, _folder) = set_up()?;
        browser.set_screen(DESK)?;
        ureq::post(server.url("/v1/recordings")).send_json(json!({ "name": "hall" }))?;
        server.post(&sensors(count, &person()))?;
        ureq::post(server.url("/v1/recordings/1/stop")).send_empty()?;
        let [bottom, right, image] = cards(&browser, "#sensors", count)?;
        assert!(
            bottom <= 900.0 && right <= 1400.0,
            "{count}: {bottom}, {right}"
        );
        assert!(image >= 140.0, "{count}: {image}");
        keep_picture(&browser, &format!("sensors-{count}"))?;

        browser.open(&server.url("/#recording=1"))?;
        browser.wait_for_text("#time", |text| text.starts_with("0:00.0"))?;
        let [bottom, right, image] = cards(&browser, "#played", count)?;
        let controls = "return document.querySelector('#transport').getBoundingClientRect().top";
        let controls = browser.execute(controls)?.as_f64().ok_or("no controls")?;
        assert!(
            bottom <= controls && right <= 1400.0,
            "{count}: {bottom}, {controls}"
        );
        assert!(image >= 140.0, "{count}: {image}");
        keep_picture(&browser, &format!("played-{count}"))?;
        assert_quiet(&browser, "")?;
    }
    Ok(())
}

/// Where somebody is and where nobody is, the same color is the same temperature, and noise does not change that.
#[test]
fn sensors_of_one_room_begin_at_the_same_degrees() -> Outcome {
    if left_out("sensors_of_one_room_begin_at_the_same_degrees") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // 21 °C; in one of them a hand of 31 °C, in the other a single cold pixel of 19.5 °C and noise of half a degree.
    let warm = batch("warm", 0, &[frame(&pixels(84, 20, 124), 402)]);
    let noisy: Vec<u16> = (0..64)
        .map(|index| if index == 20 { 78 } else { 82 + index % 5 })
        .collect();
    let cold = batch("cold", 0, &[frame(&noisy, 402)]);
    for one in [&warm, &cold] {
        server.post(one)?;
    }
    let ends = "return [...document.querySelectorAll('[data-field=ticks]')].map((ticks) => ticks.lastElementChild?.textContent)";
    browser.wait_for(
        "both scales",
        || browser.execute(ends),
        |ends| *ends == json!(["20 °C", "20 °C"]),
    )?;
    assert_quiet(&browser, "")
}

/// As somebody's logger prints it: a line for each row of the sensor.
fn logged(frames: usize) -> String {
    let frame = "20.00 20.25 20.00 20.25 31.50 20.00 20.25 20.00\n".repeat(8);
    format!("{frame}\n").repeat(frames)
}

fn listed(server: &Server) -> Result<Value, Failure> {
    Ok(server.get("/v1/recordings")?["recordings"].clone())
}

#[test]
fn a_file_that_is_dropped_plays_within_three_seconds_and_is_not_stored() -> Outcome {
    if left_out("a_file_that_is_dropped_plays_within_three_seconds_and_is_not_stored") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.set_screen(DESK)?;
    browser.wait_for_text("#open-file", |text| text.contains("Open a file"))?;
    let since = std::time::Instant::now();
    drop_file(&browser, "hall.txt", &logged(100))?;
    browser.wait_for_text("#played-name", |text| text == "hall.txt")?;
    browser.wait_for_text("#played [data-field=max]", |text| text == "31.50 °C")?;
    browser.wait_for_text("#time", |text| {
        text.ends_with("/ 0:09.9") && !text.starts_with("0:00.0")
    })?;
    let took_s = since.elapsed().as_secs_f64();
    assert!(took_s < 3.0, "{took_s} s");
    browser.wait_for_text("#played-facts", |text| text.ends_with("not stored"))?;
    keep_picture(&browser, "dropped")?;
    assert_eq!(listed(&server)?, json!([]));

    // Another takes its place; one that is no recording says so.
    drop_file(&browser, "short.txt", &logged(3))?;
    browser.wait_for_text("#played-name", |text| text == "short.txt")?;
    browser.wait_for_text("#time", |text| text.ends_with("/ 0:00.2"))?;
    drop_file(&browser, "cat.txt", "meow")?;
    browser.wait_for_text("#loading", |text| {
        text.contains("cat.txt") && text.contains("Hint: ")
    })?;
    // After a reload it is gone.
    browser.open("about:blank")?;
    browser.open(&server.url("/#file=hall.txt"))?;
    browser.wait_for_text("#loading", |text| {
        text.contains("Drop it on the page again")
    })?;
    assert_quiet(&browser, "the server responded with a status of 422")
}
