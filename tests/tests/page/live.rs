//! The live page in a real browser, in front of a real collector.

use grideye_tests::live_page::{
    COLDEST, HOTTEST, Outcome, assert_quiet, batch, color, field, frame, is_like, keep_picture,
    person, pixels, set_up, wait_for_color,
};
use grideye_tests::webdriver::{Screen, left_out};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::io::Read as _;
use std::process::{Command, Stdio};

#[test]
fn frames_appear_as_colors_and_numbers() -> Outcome {
    if left_out("frames_appear_as_colors_and_numbers") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.wait_for_text("#empty", |text| text.contains("No frames yet"))?;
    let copies =
        "return [...document.querySelectorAll('#empty pre')].map((line) => line.textContent)";
    let lines = [
        "grideye enroll pi-1Copy",
        "grideye demo --openCopy",
        "grideye view FILE --openCopy",
    ];
    assert_eq!(browser.execute(copies)?, serde_json::json!(lines));
    // 20 °C, and 30 °C in pixel 11: row 2, column 3. The thermistor's 402 steps of 1/16 °C are 25.125 °C.
    server.post(&batch("i2c-1:0x69", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    wait_for_color(&browser, 10, HOTTEST)?;
    for cold in [0, 9, 11, 17, 63] {
        assert!(is_like(&color(&browser, cold)?, COLDEST), "cell {cold}");
    }
    for (name, wanted) in [
        ("name", "pi-1 · i2c-1:0x69"),
        ("state", "live"),
        ("min", "20.00 °C"),
        ("max", "30.00 °C"),
        ("mean", "20.16 °C"),
        ("thermistor", "25.1"),
        ("seq", "#0"),
        ("age", "s ago"),
        ("ticks", "31 °C"),
    ] {
        field(&browser, name, wanted)?;
    }
    let ticks = browser.text(".sensor [data-field=ticks]")?;
    assert!(
        ticks.starts_with("31 °C") && ticks.ends_with("19 °C"),
        "{ticks}"
    );
    assert!(browser.text(".orientation")?.contains("pixel 1 top left"));

    // The next batch replaces it, and the rate is that of the device's clock.
    let moved = frame(&pixels(80, 63, 120), 402);
    server.post(&batch("i2c-1:0x69", 1, &vec![moved; 11]))?;
    wait_for_color(&browser, 63, HOTTEST)?;
    assert!(is_like(&color(&browser, 10)?, COLDEST));
    field(&browser, "rate", "10.00 Hz")?;
    field(&browser, "seq", "#11")?;
    assert_quiet(&browser, "")
}

#[test]
fn the_cell_under_mouse_or_keys_is_read_out() -> Outcome {
    if left_out("the_cell_under_mouse_or_keys_is_read_out") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let ramp: Vec<u16> = (0..64).map(|index| 80 + index).collect();
    server.post(&batch("s1", 0, &[frame(&ramp, 402)]))?;
    field(&browser, "max", "35.75 °C")?;
    let cell: f64 = serde_json::from_value(
        browser.execute("return document.querySelector('.heat').clientWidth / 8")?,
    )?;
    // From the middle, the cell at the bottom right is 3.5 cells to the right and down.
    let corner = format!("{:.0}", cell * 3.5).parse()?;
    browser.point_at(".heat", (corner, corner))?;
    field(&browser, "cursor", "Pixel 64 (row 8, column 8): 35.75 °C")?;
    browser.point_at(".heat", (-corner, corner))?;
    field(&browser, "cursor", "Pixel 57 (row 8, column 1): 34.00 °C")?;
    // A new frame under a mouse that rests.
    server.post(&batch("s1", 1, &[frame(&pixels(80, 56, 101), 402)]))?;
    field(&browser, "cursor", "Pixel 57 (row 8, column 1): 25.25 °C")?;
    browser.point_at("h1", (0, 0))?;
    field(&browser, "cursor", "Point at a pixel")?;
    // Home, arrow right, arrow down (W3C WebDriver §17.4.2).
    browser.type_into(".heat", "\u{E011}\u{E014}\u{E015}")?;
    field(&browser, "cursor", "Pixel 10 (row 2, column 2): 20.00 °C")?;
    assert_quiet(&browser, "")
}

#[test]
fn faults_gaps_and_silence_are_said() -> Outcome {
    if left_out("faults_gaps_and_silence_are_said") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let good = frame(&pixels(80, 9, 120), 402);
    server.post(&batch("s1", 0, std::slice::from_ref(&good)))?;
    field(&browser, "state", "live")?;
    let mut counted = batch("s1", 4, &[json!({ "missing": "bus-timeout" })]);
    counted["sensors"][0]["account"] = json!({ "read": 6, "missing": 1, "dropped": { "spool-full": 3 }, "spooled": 2, "errors": { "bus-timeout": 7 } });
    server.post(&counted)?;
    field(&browser, "state", "no frame")?;
    field(&browser, "veil", "No frame: bus-timeout")?;
    for said in [
        "3 frames have not arrived. Latest gap: #1 to #3.",
        "1 frame could not be read",
        "Bus errors: bus-timeout 7.",
        "Dropped by the agent: spool-full 3.",
        "2 frames wait in the agent's spool.",
    ] {
        field(&browser, "troubles", said)?;
    }
    keep_picture(&browser, "missing")?;
    // The frame before is still drawn, and still the old one.
    assert!(is_like(&color(&browser, 9)?, HOTTEST));
    // A reason that is old itself is no news: then it is silence.
    field(&browser, "state", "stale")?;
    server.post(&batch("s1", 5, std::slice::from_ref(&good)))?;
    field(&browser, "state", "live")?;
    // Then nothing: after 3 s it is not called live any more.
    field(&browser, "state", "stale")?;
    field(&browser, "veil", "Stale: last frame")?;
    keep_picture(&browser, "stale")?;
    let age = browser.text(".sensor [data-field=age]")?;
    browser.wait_for_text(".sensor [data-field=age]", |later| later != age)?;
    // A backlog is counted and does not make it live.
    server.post(&batch("s1", 1, &[frame(&pixels(120, 0, 80), 402)]))?;
    field(&browser, "troubles", "2 frames have not arrived.")?;
    field(&browser, "state", "stale")?;
    assert!(is_like(&color(&browser, 9)?, HOTTEST));
    assert_quiet(&browser, "")
}

#[test]
fn recordings_are_started_and_stopped_by_hand() -> Outcome {
    if left_out("recordings_are_started_and_stopped_by_hand") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.wait_for_text("#none", |text| text.contains("No recordings yet"))?;
    browser.click("#start button")?;
    browser.wait_for_text("#trouble", |text| {
        text.starts_with("a recording needs a name")
    })?;
    // Enter, as most people would.
    browser.type_into("#name", "kitchen <b>\u{E007}")?;
    browser.wait_for_text("#trouble", |text| text.contains("may not contain '<'"))?;
    browser.execute("document.querySelector('#name').value = ''")?;
    browser.type_into("#name", "kitchen, evening")?;
    browser.click("#start button")?;
    browser.wait_for_text("#list", |text| {
        text.contains("kitchen, evening") && text.contains("recording for")
    })?;
    assert_eq!(browser.text("#trouble")?, "");
    let running = server.get("/v1/recordings")?["recordings"][0].clone();
    assert_eq!(
        (&running["name"], &running["running"]),
        (&json!("kitchen, evening"), &json!(true))
    );

    let three = vec![frame(&pixels(80, 9, 120), 402); 3];
    server.post(&batch("s1", 0, &three))?;
    browser.wait_for_text("#list", |text| text.contains("3 frames"))?;
    browser.type_into("#name", "kitchen, evening\u{E007}")?;
    browser.wait_for_text("#trouble", |text| {
        text.contains("is running") && text.contains("choose another name")
    })?;

    browser.click("#list button")?;
    browser.wait_for_text("#list a", |text| text == "CSV")?;
    let stopped = server.get("/v1/recordings")?["recordings"][0].clone();
    assert_eq!(
        (&stopped["running"], &stopped["frames"]),
        (&json!(false), &json!(3))
    );
    let link = browser.execute("return document.querySelector('#list a').href")?;
    let csv = ureq::get(link.as_str().unwrap_or_default())
        .call()?
        .body_mut()
        .read_to_string()?;
    assert_eq!(csv.lines().count(), 4, "{csv}");
    // Refusals are answers with a status of 4xx, which the browser notes by itself.
    assert_quiet(
        &browser,
        "Failed to load resource: the server responded with a status of 4",
    )
}

#[test]
fn the_page_comes_back_by_itself_when_the_collector_does() -> Outcome {
    if left_out("the_page_comes_back_by_itself_when_the_collector_does") {
        return Ok(());
    }
    let (mut server, browser, folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 9, 120), 402)]))?;
    wait_for_color(&browser, 9, HOTTEST)?;
    browser.execute("window.loadedOnce = true")?;
    server.end()?;
    browser.wait_for_text("#link", |text| text == "connection lost, retrying")?;
    field(&browser, "state", "stale")?;
    server.begin(&folder.path().join("frames.sqlite"))?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    // What it has from the store is old, and still said to be.
    field(&browser, "state", "stale")?;
    server.post(&batch("s1", 1, &[frame(&pixels(80, 54, 120), 402)]))?;
    wait_for_color(&browser, 54, HOTTEST)?;
    field(&browser, "state", "live")?;
    assert_eq!(
        browser.execute("return window.loadedOnce")?,
        json!(true),
        "the page was not loaded again"
    );
    assert_quiet(&browser, "ERR_CONNECTION_REFUSED")
}

#[test]
fn a_page_that_was_left_holds_no_connection() -> Outcome {
    if left_out("a_page_that_was_left_holds_no_connection") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // A browser keeps six connections to one host, and pages that were left for the way back.
    let followers = || Ok(server.get("/v1/health")?["live_clients"].clone());
    browser.open("about:blank")?;
    browser.wait_for("nobody to follow", followers, |followers| *followers == 0)?;
    browser.open(&server.url("/"))?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    assert_eq!(followers()?, 1);
    // Back, to a page that may have been kept: it follows again.
    browser.execute("history.go(-2)")?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 9, 120), 402)]))?;
    field(&browser, "state", "live")?;
    assert_quiet(&browser, "")
}

/// Holds the store's file until its standard input ends.
const HOLDER: &str = "import sqlite3, sys
store = sqlite3.connect(sys.argv[1], isolation_level=None)
store.execute('BEGIN IMMEDIATE')
print('held', flush=True)
sys.stdin.read()";

#[test]
fn a_store_that_takes_nothing_is_said_until_it_does() -> Outcome {
    if left_out("a_store_that_takes_nothing_is_said_until_it_does") {
        return Ok(());
    }
    let (server, browser, folder) = set_up()?;
    let good = frame(&pixels(80, 9, 120), 402);
    server.post(&batch("s1", 0, std::slice::from_ref(&good)))?;
    field(&browser, "state", "live")?;
    let mut holder = Command::new("python3")
        .args(["-c", HOLDER])
        .arg(folder.path().join("frames.sqlite"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut said = [0; 5];
    let output = holder.stdout.as_mut().ok_or("python3 has no output")?;
    output.read_exact(&mut said)?;
    let refused = server.post(&batch("s1", 1, std::slice::from_ref(&good)));
    assert!(refused.is_err_and(|error| error.to_string().contains("503")));
    browser.wait_for_text("#link", |text| {
        text == "connected, but the collector cannot store frames: the store's file is locked by another program"
    })?;
    drop(holder.stdin.take());
    holder.wait()?;
    server.post(&batch("s1", 1, std::slice::from_ref(&good)))?;
    browser.wait_for_text("#link", |text| text == "connected")?;
    assert_quiet(&browser, "")
}

#[test]
fn the_policy_forbids_what_the_page_does_not_need() -> Outcome {
    if left_out("the_policy_forbids_what_the_page_does_not_need") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let page = ureq::get(server.url("/")).call()?;
    let policy = page.headers()["content-security-policy"]
        .to_str()?
        .to_owned();
    assert!(
        policy.starts_with("default-src 'none'; script-src 'self'; style-src 'self';"),
        "{policy}"
    );
    // An injected script does not run.
    browser.execute(
        "const script = document.createElement('script');
         script.textContent = 'window.injected = true';
         document.body.append(script);",
    )?;
    assert_eq!(
        browser.execute("return window.injected ?? null")?,
        Value::Null
    );
    let said = browser.console()?.join("\n");
    assert!(said.contains("Content Security Policy"), "{said}");
    Ok(())
}

#[test]
fn it_fits_a_telephone_and_a_wall() -> Outcome {
    if left_out("it_fits_a_telephone_and_a_wall") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    for name in ["hall, morning", "kitchen, evening"] {
        ureq::post(server.url("/v1/recordings")).send_json(json!({ "name": name }))?;
    }
    ureq::post(server.url("/v1/recordings/1/stop")).send_empty()?;
    let sizes = [
        ("desktop-dark", 1280, 1.0, "dark"),
        ("desktop-light", 1280, 1.0, "light"),
        ("phone", 360, 3.0, "dark"),
    ];
    for (seq, (name, width, scale, scheme)) in (0..).zip(sizes) {
        browser.set_screen(Screen {
            width,
            height: 860,
            scale,
            mobile: width < 500,
        })?;
        browser.prefer_scheme(scheme)?;
        for sensor in ["i2c-1:0x68", "i2c-1:0x69"] {
            server.post(&batch(sensor, seq, &[frame(&person(), 402)]))?;
        }
        field(&browser, "seq", &format!("#{seq}"))?;
        browser.point_at(".heat", (20, -20))?;
        let wide = browser.execute("return document.documentElement.scrollWidth - innerWidth")?;
        assert!(
            wide.as_i64().unwrap_or(1) <= 0,
            "{name}: {wide} pixels too wide"
        );
        let scale = browser.execute(
            "return document.querySelector('.scale').offsetHeight - document.querySelector('.frame').offsetHeight",
        )?;
        assert_eq!(
            scale,
            json!(0),
            "{name}: the scale is as tall as the picture"
        );
        let cells = browser.execute("return document.querySelector('.heat').width % 8")?;
        assert_eq!(cells, json!(0), "{name}: cells of whole pixels");
        let small = browser.execute(
            "return [...document.querySelectorAll('button, input')].filter((it) => it.offsetHeight > 0 && it.offsetHeight < 40).length",
        )?;
        assert_eq!(small, json!(0), "{name}: what is touched is large enough");
        keep_picture(&browser, name)?;
    }
    assert_quiet(&browser, "")
}

#[test]
fn a_page_for_which_there_is_no_room_is_told_so_and_comes_in_when_there_is() -> Outcome {
    if left_out("a_page_for_which_there_is_no_room_is_told_so_and_comes_in_when_there_is") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open("about:blank")?;
    // As many as one address may have (half of `Limits::live_clients_max`), once the page that was left has gone.
    let others = RefCell::new(Vec::new());
    let all = grideye_collector::Limits::default().live_clients_max / 2;
    browser.wait_for(
        "all seats to be taken",
        || {
            let mut others = others.borrow_mut();
            others.extend(ureq::get(server.url("/v1/live")).call().ok());
            Ok(others.len() == all)
        },
        |is_full| *is_full,
    )?;
    browser.open(&server.url("/"))?;
    browser.wait_for_text("#link", |text| {
        text == "too many open pages, retrying: 64 live pages are already open"
    })?;
    drop(others);
    browser.wait_for_text("#link", |text| text == "connected")?;
    assert_quiet(&browser, "503")
}

#[test]
fn on_a_telephone_the_header_is_one_line_and_the_controls_fold() -> Outcome {
    if left_out("on_a_telephone_the_header_is_one_line_and_the_controls_fold") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.set_screen(Screen {
        width: 390,
        height: 844,
        scale: 1.0,
        mobile: true,
    })?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    field(&browser, "max", "30.00 °C")?;
    // As with a folder of scenes.
    browser.execute(
        "document.querySelector('nav').append(Object.assign(document.createElement('a'), { textContent: 'Scenes', href: '/editor' }));",
    )?;
    let header = "const tops = [...document.querySelectorAll('.top nav a')].map((link) => link.getBoundingClientRect().top);
        return [document.querySelector('.top').offsetHeight, new Set(tops).size, document.documentElement.scrollWidth];";
    let [height, lines, width]: [f64; 3] = serde_json::from_value(browser.execute(header)?)?;
    assert!(height < 56.0 && lines == 1.0, "{height} px, {lines} lines");
    assert!(width <= 390.0, "{width} px wide");
    assert_eq!(browser.text("#look")?, "");
    let top = "return document.querySelector('.heat').getBoundingClientRect().top";
    assert!(browser.execute(top)?.as_f64() < Some(260.0));
    browser.click("#unfold")?;
    browser.wait_for_text("#look", |text| text.contains("Palette"))?;
    browser.click("#unfold")?;
    browser.wait_for_text("#look", str::is_empty)?;
    assert_quiet(&browser, "")
}
