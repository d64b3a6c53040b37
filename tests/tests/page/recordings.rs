//! The page's view of recordings: the list with notes, and one recording played back.

mod labels;

use grideye_tests::live_page::{
    HOTTEST, Outcome, Server, assert_quiet, batch, boot_ns, color, field, frame, is_like,
    keep_picture, person, pixels, set_up, wait_for_color,
};
use grideye_tests::webdriver::{Browser, Failure, Screen, left_out};
use serde_json::{Value, json};
use std::time::Duration;

/// A keyboard's Enter, Escape, Space, End, Home and arrow right (W3C WebDriver §17.4.2).
const ENTER: &str = "\u{E007}";
const ESCAPE: &str = "\u{E00C}";
const SPACE: &str = "\u{E00D}";
const END: &str = "\u{E010}";
const HOME: &str = "\u{E011}";
const RIGHT: &str = "\u{E014}";

/// When the first frame of the tests was measured: 2021-07-01 18:07:27 UTC.
const BEGAN_NS: u64 = 1_625_163_247_000_000_000;

/// A frame whose pixel of the same number is warm.
fn marked(seq: u64) -> Result<Value, Failure> {
    Ok(frame(&pixels(80, usize::try_from(seq % 64)?, 120), 402))
}

fn marked_frames(seqs: std::ops::Range<u64>) -> Result<Vec<Value>, Failure> {
    seqs.map(marked).collect()
}

/// Frames with the wall clock that belongs to their numbers, `late_ns` after the first frame of the tests.
fn measured(sensor: &str, first_seq: u64, late_ns: u64, frames: &[Value]) -> Value {
    let mut body = batch(sensor, first_seq, frames);
    let records = body["sensors"][0]["frames"].as_array_mut();
    for (seq, record) in (first_seq..).zip(records.into_iter().flatten()) {
        record["t_utc_ns"] = (BEGAN_NS + late_ns + boot_ns(seq) - boot_ns(0)).into();
    }
    body
}

/// A stopped recording of these posts.
fn record(server: &Server, name: &str, posts: &[Value]) -> Result<u64, Failure> {
    let started: Value = ureq::post(server.url("/v1/recordings"))
        .send_json(json!({ "name": name }))?
        .body_mut()
        .read_json()?;
    let id = started["id"].as_u64().ok_or("no number")?;
    for post in posts {
        server.post(post)?;
    }
    ureq::post(server.url(&format!("/v1/recordings/{id}/stop"))).send_empty()?;
    Ok(id)
}

fn open(server: &Server, browser: &Browser, id: u64) -> Outcome {
    browser.open(&server.url(&format!("/#recording={id}")))?;
    browser
        .wait_for_text("#time", |text| text.starts_with("0:00.0 / "))
        .map(drop)
}

/// Waits for the frame of that number, in words and in colors.
fn shows(browser: &Browser, seq: u64) -> Outcome {
    field(browser, "seq", &format!("#{seq}"))?;
    wait_for_color(browser, usize::try_from(seq % 64)?, HOTTEST)
}

/// Waits for a gap: its words, and neither a color nor a number of another frame.
fn shows_gap(browser: &Browser, words: &str) -> Outcome {
    field(browser, "veil", words)?;
    field(browser, "state", "no frame")?;
    for name in ["min", "mean", "max", "seq"] {
        field(browser, name, "–")?;
    }
    let painted = browser.execute(
        "const canvas = document.querySelector('#played .heat');
         const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
         const context = copy.getContext('2d', { willReadFrequently: true });
         context.drawImage(canvas, 0, 0);
         return context.getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value > 0);",
    )?;
    assert_eq!(painted, false, "{words}: a picture is painted");
    Ok(())
}

#[test]
fn recordings_are_started_noted_and_stopped_from_their_list() -> Outcome {
    if left_out("recordings_are_started_noted_and_stopped_from_their_list") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.click("nav [data-view=recordings]")?;
    browser.wait_for_text("#recordings", |text| text.contains("No recordings yet"))?;
    browser.type_into("#name", &format!("kitchen, evening{ENTER}"))?;
    browser.wait_for_text("#library", |text| {
        text.contains("kitchen, evening") && text.contains("recording for")
    })?;
    server.post(&batch("s1", 0, &marked_frames(0..3)?))?;
    server.post(&batch("s1", 3, &[json!({ "missing": "nack" })]))?;
    server.post(&batch("s2", 0, &[frame(&person(), 402)]))?;
    for (name, wanted) in [("frames", "4"), ("gaps", "1 missing"), ("sensors", "2")] {
        let selector = format!("#library [data-field={name}]");
        browser.wait_for_text(&selector, |text| text == wanted)?;
    }

    // A note is kept when the field is left, and Escape leaves it as it was.
    let note = "#library [data-field=note]";
    browser.type_into(note, &format!("two people, é{ENTER}"))?;
    let noted = || Ok(server.get("/v1/recordings/1")?["note"].clone());
    browser.wait_for("the note", noted, |note| *note == "two people, é")?;
    browser.type_into(note, &format!(" and a cat{ESCAPE}"))?;
    let shown = format!("return document.querySelector('{note}').value");
    assert_eq!(browser.execute(&shown)?, "two people, é");
    assert_eq!(noted()?, "two people, é");
    keep_picture(&browser, "recordings")?;

    browser.click("#library [data-field=stop]")?;
    browser.wait_for_text("#library [data-field=csv]", |text| text == "CSV")?;
    assert_eq!(server.get("/v1/recordings/1")?["running"], false);
    browser.open("about:blank")?;
    browser.open(&server.url("/#recordings"))?;
    browser.wait_for(
        "the note after a reload",
        || browser.execute(&shown),
        |seen| *seen == "two people, é",
    )?;
    // From its start to its stop, as the page writes a length.
    let kept = server.get("/v1/recordings/1")?;
    let at = |key: &str| kept[key].as_i64().ok_or("no time");
    let length = Duration::from_nanos(u64::try_from(at("t_stop_ns")? - at("t_start_ns")?)?);
    let seconds = length.as_secs_f64();
    let wanted = if seconds < 9.95 {
        format!("{seconds:.1} s")
    } else {
        format!("{seconds:.0} s")
    };
    browser.wait_for_text("#library [data-field=length]", |text| text == wanted)?;
    // The key leads to the pictures, and back.
    browser.press("r")?;
    browser.wait_for_text("#wall", |text| text.contains("pi-1 · s1"))?;
    browser.press("r")?;
    browser.wait_for_text("#library", |text| text.contains("kitchen, evening"))?;
    assert_quiet(&browser, "")
}

#[test]
fn a_recording_is_stepped_through_by_keys_buttons_and_numbers() -> Outcome {
    if left_out("a_recording_is_stepped_through_by_keys_buttons_and_numbers") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let posts = [measured("s1", 0, 0, &marked_frames(0..30)?)];
    record(&server, "hall", &posts)?;
    browser.open(&server.url("/#recordings"))?;
    browser.wait_for_text("#library [data-field=play]", |text| text == "Play")?;
    browser.click("#library [data-field=play]")?;
    browser.wait_for_text("#time", |text| text == "0:00.0 / 0:02.9")?;
    shows(&browser, 0)?;
    field(&browser, "state", "recorded")?;
    field(&browser, "max", "30.00 °C")?;
    field(&browser, "thermistor", "25.1")?;
    for (key, seq) in [
        (".", 1),
        (".", 2),
        (",", 1),
        (RIGHT, 2),
        (END, 29),
        (",", 28),
        (HOME, 0),
        (",", 0),
    ] {
        browser.press(key)?;
        shows(&browser, seq)?;
    }
    for (button, seq) in [("on", 1), ("last", 29), ("back", 28), ("first", 0)] {
        browser.click(&format!("#transport [data-does={button}]"))?;
        shows(&browser, seq)?;
    }
    let select_all = "\u{E009}a\u{E000}";
    for (place, seq) in [("#17", 17), ("0:00.3", 3), ("2.5", 25)] {
        browser.type_into("#jump input", &format!("{select_all}{place}{ENTER}"))?;
        shows(&browser, seq)?;
    }
    for (place, fault) in [
        ("#99", "Frame #99 is not in this recording."),
        ("1:00", "The recording lasts 0:02.9"),
        ("noon", "Enter a time as 1:30 or 90, or a frame as #900."),
    ] {
        browser.type_into("#jump input", &format!("{select_all}{place}{ENTER}"))?;
        browser.wait_for_text("#jump-trouble", |text| text.starts_with(fault))?;
        field(&browser, "seq", "#25")?;
    }
    // The strip is moved in by mouse, and by the keys of a slider.
    let width = browser.execute("return document.querySelector('#scrub').clientWidth")?;
    let width = width.as_f64().ok_or("no width")?;
    let at = |seconds: f64| format!("{:.0}", width * (seconds / 2.9 - 0.5)).parse::<i32>();
    browser.drag("#scrub", (at(0.55)?, 0), (at(1.05)?, 0))?;
    shows(&browser, 10)?;
    browser.type_into("#scrub", RIGHT)?;
    shows(&browser, 11)?;
    let said = browser.execute("return document.querySelector('#scrub').ariaValueText")?;
    assert_eq!(said, "0:01.1 of 0:02.9. Frame #11");
    browser.press(ESCAPE)?;
    browser.wait_for_text("#library", |text| text.contains("hall"))?;
    assert_quiet(&browser, "")
}

/// An hour at the sensor's ten frames a second, and how many of them are posted at once.
const HOUR: u64 = 36_000;
const POSTED: u64 = 1_000;

/// The number of the frame that is shown, and the tenths of a second of the place in the strip.
fn frame_and_place(browser: &Browser) -> Result<(u64, u64), Failure> {
    let digits = |text: &str| {
        text.chars()
            .filter(char::is_ascii_digit)
            .collect::<String>()
    };
    let seq = digits(&browser.text("#played [data-field=seq]")?).parse()?;
    let place = browser.text("#time")?;
    let place = place.split(" / ").next().unwrap_or_default();
    let (minutes, tenths) = place.split_once(':').ok_or("no place")?;
    let tenths: u64 = digits(tenths).parse()?;
    Ok((seq, minutes.parse::<u64>()? * 600 + tenths))
}

#[test]
fn an_hour_opens_from_the_list_and_every_place_in_its_strip_shows_its_own_frame() -> Outcome {
    if left_out("an_hour_opens_from_the_list_and_every_place_in_its_strip_shows_its_own_frame") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    ureq::post(server.url("/v1/recordings")).send_json(json!({ "name": "an hour" }))?;
    for first in (0..HOUR).step_by(usize::try_from(POSTED)?) {
        let frames = marked_frames(first..first + POSTED)?;
        server.post(&measured("s1", first, 0, &frames))?;
    }
    ureq::post(server.url("/v1/recordings/1/stop")).send_empty()?;
    browser.open(&server.url("/#recordings"))?;
    browser.wait_for_text("#library [data-field=frames]", |text| text == "36,000")?;
    browser.click("#library [data-field=play]")?;
    browser.wait_for_text("#time", |text| text == "0:00.0 / 59:59.9")?;
    shows(&browser, 0)?;

    let width = browser.execute("return document.querySelector('#scrub').clientWidth")?;
    let width = width.as_f64().ok_or("no width")?;
    for share in [3, 12, 25, 36, 47, 58, 64, 76, 89, 97] {
        let share = f64::from(share) / 100.0;
        let offset = format!("{:.0}", width * (share - 0.5)).parse()?;
        browser.drag("#scrub", (0, 0), (offset, 0))?;
        // The mouse points at whole pixels, each of which is some thirty frames wide.
        let near = |(_, tenths): &(u64, u64)| {
            let wanted = f64::from(u32::try_from(HOUR).unwrap_or(0)) * share;
            let found = f64::from(u32::try_from(*tenths).unwrap_or(0));
            (found - wanted).abs() <= 36_000.0 / width * 1.5
        };
        let what = format!("the place at {share}");
        let (seq, tenths) = browser.wait_for(&what, || frame_and_place(&browser), near)?;
        assert_eq!(seq, tenths, "the frame that was measured there");
        let cell = usize::try_from(seq % 64)?;
        wait_for_color(&browser, cell, HOTTEST)?;
        assert!(!is_like(&color(&browser, (cell + 1) % 64)?, HOTTEST));
        browser.press(".")?;
        wait_for_color(&browser, (cell + 1) % 64, HOTTEST)?;
        assert_eq!(frame_and_place(&browser)?.0, seq + 1);
    }
    assert_quiet(&browser, "")
}

#[test]
fn a_gap_is_shown_as_a_gap_and_never_as_the_frame_before_it() -> Outcome {
    if left_out("a_gap_is_shown_as_a_gap_and_never_as_the_frame_before_it") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let posts = [
        measured("s1", 0, 0, &marked_frames(0..5)?),
        measured("s1", 5, 0, &[json!({ "missing": "nack" })]),
        measured("s1", 6, 0, &marked_frames(6..8)?),
        measured("s1", 20, 0, &marked_frames(20..25)?),
    ];
    let id = record(&server, "gaps", &posts)?;
    open(&server, &browser, id)?;
    shows(&browser, 0)?;
    browser.press("g")?;
    shows_gap(&browser, "Gap: #5 could not be read (nack).")?;
    browser.press(".")?;
    shows(&browser, 6)?;
    browser.press(".")?;
    shows(&browser, 7)?;
    browser.press(".")?;
    shows_gap(&browser, "Gap: #8 to #19 are not in this recording")?;
    keep_picture(&browser, "gap")?;
    browser.press(".")?;
    shows(&browser, 20)?;
    browser.press("g")?;
    browser.wait_for_text("#jump-trouble", |text| text == "There is no later gap.")?;
    shows(&browser, 20)?;

    // From 0.8 to 2.0 s of 2.4: pointed at in the strip, where the gap is drawn as one and frames are not.
    let width = browser.execute("return document.querySelector('#scrub').clientWidth")?;
    let width = width.as_f64().ok_or("no width")?;
    let in_the_gap = format!("{:.0}", width * (1.4 / 2.4 - 0.5)).parse()?;
    browser.drag("#scrub", (0, 0), (in_the_gap, 0))?;
    shows_gap(&browser, "Gap: #8 to #19 are not in this recording")?;
    let edge = |seconds: f64| {
        browser.execute(&format!(
            "const canvas = document.querySelector('#timeline');
             const copy = Object.assign(document.createElement('canvas'), {{ width: 2, height: 1 }});
             const context = copy.getContext('2d', {{ willReadFrequently: true }});
             context.drawImage(canvas, canvas.width * {seconds} / 2.4, 2, 1, 1, 0, 0, 1, 1);
             context.fillStyle = getComputedStyle(canvas).columnRuleColor;
             context.fillRect(1, 0, 1, 1);
             const [seen, gap] = [0, 1].map((x) => context.getImageData(x, 0, 1, 1).data.join());
             return seen === gap;"
        ))
    };
    for (seconds, is_gap) in [
        (0.25, false),
        (0.505, true),
        (0.7, false),
        (0.9, true),
        (1.9, true),
        (2.2, false),
    ] {
        assert_eq!(edge(seconds)?, is_gap, "{seconds} s");
    }
    assert_quiet(&browser, "")
}

#[test]
fn playing_goes_on_to_the_end_at_any_speed_and_pauses() -> Outcome {
    if left_out("playing_goes_on_to_the_end_at_any_speed_and_pauses") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let posts = [measured("s1", 0, 0, &marked_frames(0..64)?)];
    let id = record(&server, "walk", &posts)?;
    open(&server, &browser, id)?;
    let speed = "return document.querySelector('#speed').value";
    for (key, wanted) in [("+", "2"), ("+", "4"), ("+", "8"), ("+", "16"), ("+", "16")] {
        browser.press(key)?;
        assert_eq!(browser.execute(speed)?, wanted);
    }
    browser.press(SPACE)?;
    shows(&browser, 63)?;
    browser.wait_for_text("[data-does=play]", |text| text == "Play")?;
    // From the end it begins again; at the slowest it is far from there when it is paused.
    for wanted in ["8", "4", "2", "1", "0.5", "0.25", "0.25"] {
        browser.press("-")?;
        assert_eq!(browser.execute(speed)?, wanted);
    }
    browser.click("[data-does=play]")?;
    browser.wait_for_text("[data-does=play]", |text| text == "Pause")?;
    field(&browser, "seq", "#1")?;
    browser.click("[data-does=play]")?;
    browser.wait_for_text("[data-does=play]", |text| text == "Play")?;
    let at = browser.text("#time")?;
    assert!(
        at.ends_with(" / 0:06.3") && !at.starts_with("0:06.3"),
        "{at}"
    );
    let options = "return [...document.querySelectorAll('#speed option')].map((it) => it.value)";
    let speeds = json!(["0.25", "0.5", "1", "2", "4", "8", "16"]);
    assert_eq!(browser.execute(options)?, speeds);
    browser.click("#speed option[value='2']")?;
    assert_eq!(browser.execute(speed)?, "2");
    assert_quiet(&browser, "")
}

#[test]
fn sensors_and_runs_share_one_time_whatever_their_clocks_say() -> Outcome {
    if left_out("sensors_and_runs_share_one_time_whatever_their_clocks_say") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // A second sensor that ends after a second, and a second run ten seconds after the first began.
    let mut again = measured("s1", 0, 10_000_000_000, &marked_frames(40..50)?);
    again["boot"] = "b2".into();
    let posts = [
        measured("s1", 0, 0, &marked_frames(0..30)?),
        measured("s2", 0, 0, &marked_frames(0..10)?),
        again,
    ];
    let id = record(&server, "two", &posts)?;
    open(&server, &browser, id)?;
    browser.wait_for_text("#time", |text| text == "0:00.0 / 0:10.9")?;
    let second = "#played .sensor:nth-child(2)";
    let says = |name: &str, wanted: &str| {
        let selector = format!("{second} [data-field={name}]");
        browser.wait_for_text(&selector, |text| text.contains(wanted))
    };
    says("name", "pi-1 · s2")?;
    browser.type_into("#jump input", &format!("0.5{ENTER}"))?;
    shows(&browser, 5)?;
    says("seq", "#5")?;
    field(&browser, "boot", "b1")?;
    browser.click("#played h2")?;
    browser.press("g")?;
    shows_gap(&browser, "Gap: the agent restarted.")?;
    says("veil", "No more frames of this sensor.")?;
    browser.press(".")?;
    wait_for_color(&browser, 40, HOTTEST)?;
    field(&browser, "boot", "b2")?;

    // What a picture looks like is that of the live ones.
    browser.press("p")?;
    wait_for_color(&browser, 40, [255, 255, 246])?;
    browser.click("#played .sensor [data-field=turn]")?;
    // Row 6, column 1, turned clockwise by a quarter: row 1, column 3.
    wait_for_color(&browser, 2, [255, 255, 246])?;
    assert_quiet(&browser, "")
}

#[test]
fn a_device_that_never_knew_the_time_is_placed_by_its_arrivals() -> Outcome {
    if left_out("a_device_that_never_knew_the_time_is_placed_by_its_arrivals") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let mut post = batch("s1", 0, &marked_frames(0..10)?);
    let records = post["sensors"][0]["frames"].as_array_mut();
    for record in records.into_iter().flatten() {
        record["t_utc_ns"] = 5.into();
        record["clock"] = "unsynced".into();
    }
    let id = record(&server, "no clock", &[post])?;
    open(&server, &browser, id)?;
    browser.wait_for_text("#time", |text| text == "0:00.0 / 0:00.9")?;
    field(&browser, "clock", "unsynced")?;
    let year = browser.execute("return String(new Date().getFullYear())")?;
    let year = year.as_str().unwrap_or("?").to_owned();
    browser.wait_for_text("#wall-time", |text| text.contains(&year))?;
    assert_quiet(&browser, "")
}

#[test]
fn what_cannot_be_played_says_why() -> Outcome {
    if left_out("what_cannot_be_played_says_why") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let id = record(&server, "empty", &[])?;
    for (id, why) in [
        (id.to_string(), "This recording has no frames."),
        ("77".to_owned(), "there is no recording 77. Hint:"),
        ("x".to_owned(), "recordings are known by number. Hint:"),
    ] {
        browser.open(&server.url(&format!("/#recording={id}")))?;
        browser.wait_for_text("#loading", |text| text.starts_with(why))?;
        assert_eq!(browser.text("#transport")?, "");
    }
    // One that runs is played as far as it has come, and says so.
    let started = ureq::post(server.url("/v1/recordings"));
    started.send_json(json!({ "name": "running" }))?;
    server.post(&measured("s1", 0, 0, &marked_frames(0..5)?))?;
    open(&server, &browser, 2)?;
    browser.wait_for_text("#played-facts", |text| {
        text.ends_with("reopen it to see newer frames")
    })?;
    browser.press(END)?;
    shows(&browser, 4)?;
    assert_quiet(
        &browser,
        "Failed to load resource: the server responded with a status of 4",
    )
}

#[test]
fn a_recording_is_deleted_by_the_second_click_on_its_button() -> Outcome {
    if left_out("a_recording_is_deleted_by_the_second_click_on_its_button") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let posts = [measured("s1", 0, 0, &marked_frames(0..3)?)];
    record(&server, "attic", &posts)?;
    browser.open(&server.url("/#recordings"))?;
    let button = "#library [data-field=remove]";
    browser.wait_for_text(button, |text| text == "Delete")?;
    browser.click(button)?;
    browser.wait_for_text(button, |text| text == "Delete for good")?;
    // Whoever looks elsewhere has not decided.
    browser.execute("document.activeElement.blur()")?;
    browser.wait_for_text(button, |text| text == "Delete")?;
    browser.click(button)?;
    browser.wait_for_text(button, |text| text == "Delete for good")?;
    assert_eq!(server.get("/v1/recordings/1")?["name"], "attic");
    browser.click(button)?;
    browser.wait_for_text("#recordings", |text| text.contains("No recordings yet"))?;
    assert_eq!(server.get("/v1/recordings")?["recordings"], json!([]));
    assert_quiet(&browser, "")
}

#[test]
fn recordings_fit_a_telephone_and_a_wall_in_light_and_dark() -> Outcome {
    if left_out("recordings_fit_a_telephone_and_a_wall_in_light_and_dark") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let people = vec![frame(&person(), 402); 40];
    let posts = [
        measured("i2c-1:0x68", 0, 0, &people),
        measured("i2c-1:0x69", 0, 0, &people[..10]),
        measured("i2c-1:0x69", 20, 0, &people[..20]),
    ];
    let id = record(&server, "a rather long name of a recording", &posts)?;
    for (name, width, scheme) in [
        ("wide-light", 1280, "light"),
        ("wide-dark", 1280, "dark"),
        ("phone-dark", 360, "dark"),
    ] {
        let screen = Screen {
            width,
            height: 860,
            scale: 1.0,
            mobile: width < 500,
        };
        browser.set_screen(screen)?;
        browser.prefer_scheme(scheme)?;
        for view in ["recordings".to_owned(), format!("recording={id}")] {
            browser.open("about:blank")?;
            browser.open(&server.url(&format!("/#{view}")))?;
            browser.wait_for_text("main", |text| text.contains("a rather long name"))?;
            if view != "recordings" {
                field(&browser, "max", "°C")?;
            }
            let wide =
                browser.execute("return document.documentElement.scrollWidth - innerWidth")?;
            assert!(
                wide.as_i64().unwrap_or(1) <= 0,
                "{name}, {view}: {wide} pixels too wide"
            );
            let small = browser.execute(
                "return [...document.querySelectorAll('button, input, select, .button')].filter((it) => it.offsetHeight > 0 && it.offsetHeight < 40).map((it) => it.outerHTML)",
            )?;
            assert_eq!(small, json!([]), "{name}, {view}: too small to be touched");
            let unnamed = browser.execute(
                "return [...document.querySelectorAll('button, input, select')].filter((it) => it.offsetHeight > 0 && !it.ariaLabel && !it.labels?.length && !it.innerText).map((it) => it.outerHTML)",
            )?;
            assert_eq!(unnamed, json!([]), "{name}, {view}: without a name");
            keep_picture(&browser, &format!("{name}-{}", view.replace('=', "-")))?;
        }
    }
    assert_quiet(&browser, "")
}
