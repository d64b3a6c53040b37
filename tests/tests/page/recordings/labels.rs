//! Labels on a recording, put, listed and removed on the page.

use super::*;

/// Name and ranges of the labels of the first recording, as the collector has them.
fn labels(server: &Server) -> Result<Value, Failure> {
    let labels = server.get("/v1/recordings/1/labels")?["labels"].clone();
    let short = labels.as_array().into_iter().flatten().map(|label| {
        let spans = label["spans"].as_array().into_iter().flatten();
        let spans: Vec<Value> = spans
            .map(|span| json!([span["sensor"], span["first_seq"], span["last_seq"]]))
            .collect();
        json!([label["name"], spans])
    });
    Ok(short.collect())
}

/// One key after the other.
fn press_all(browser: &Browser, keys: &str) -> Outcome {
    keys.chars()
        .try_for_each(|key| browser.press(&key.to_string()))
}

#[test]
fn labels_are_put_on_ranges_and_frames_by_keys_listed_and_taken_away() -> Outcome {
    if left_out("labels_are_put_on_ranges_and_frames_by_keys_listed_and_taken_away") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let posts = [measured("s1", 0, 0, &marked_frames(0..30)?)];
    let id = record(&server, "hall", &posts)?;
    open(&server, &browser, id)?;
    shows(&browser, 0)?;
    browser.press("5")?;
    browser.wait_for_text("#label-trouble", |text| {
        text.contains("Key 5 has no label yet")
    })?;

    // A range by keys, its name by hand.
    press_all(&browser, "...<")?;
    browser.wait_for_text("#label-range", |text| text == "0:00.3 to 0:00.3")?;
    press_all(&browser, "......>")?;
    browser.wait_for_text("#label-range", |text| text == "0:00.3 to 0:00.9")?;
    keep_picture(&browser, "labels-range")?;
    browser.press("a")?;
    let focus = browser.execute("return document.activeElement.name")?;
    assert_eq!(focus, "name");
    browser.type_into("#label input", &format!("two people{ENTER}"))?;
    browser.wait_for_text("#label-list", |text| {
        text.contains("two people") && text.contains("0:00.3 to 0:00.9 · 7 frames")
    })?;
    assert_eq!(labels(&server)?, json!([["two people", [["s1", 3, 9]]]]));

    // The same again by its key, on the frame that is looked at.
    press_all(&browser, ".1")?;
    browser.wait_for_text("#label-list", |text| text.contains("0:01.0 · 1 frame"))?;
    let both = json!([
        ["two people", [["s1", 3, 9]]],
        ["two people", [["s1", 10, 10]]]
    ]);
    assert_eq!(labels(&server)?, both);

    // What another person adds is seen, and what was kept is there after a reload.
    let other = json!({ "name": "nobody", "spans": [{ "device": "pi-1", "sensor": "s1", "boot": "b1", "first_seq": 20, "last_seq": 29 }] });
    let other = ureq::post(server.url("/v1/recordings/1/labels")).send_json(other);
    assert_eq!(other?.status(), 201);
    browser.wait_for_text("#label-list", |text| text.contains("nobody"))?;
    browser.open("about:blank")?;
    open(&server, &browser, id)?;
    browser.wait_for_text("#label-list", |text| {
        text.contains("0:02.0 to 0:02.9 · 10 frames")
    })?;
    keep_picture(&browser, "labels")?;
    browser.click("#label-list li:nth-child(3) button")?;
    shows(&browser, 20)?;

    browser.click("#label-list li:first-child button:last-child")?;
    browser.wait_for_text("#label-list", |text| !text.contains("7 frames"))?;
    assert_eq!(
        labels(&server)?,
        json!([
            ["two people", [["s1", 10, 10]]],
            ["nobody", [["s1", 20, 29]]]
        ])
    );
    let file = browser.execute("return document.querySelector('#label-csv').href")?;
    let file = ureq::get(file.as_str().ok_or("no link")?)
        .call()?
        .body_mut()
        .read_to_string()?;
    assert!(file.ends_with("\n3,nobody,pi-1,s1,b1,20,29\n"), "{file}");
    assert_quiet(&browser, "")
}
