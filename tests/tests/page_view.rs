//! How the live page's pictures can be looked at: palettes, scales, turned, mirrored, large, smoothed, and a region.

use grideye_tests::live_page::{
    COLDEST, HOTTEST, Outcome, assert_quiet, batch, colour, field, frame, keep_picture, person,
    pixels, set_up, wait_for_colour,
};
use grideye_tests::webdriver::{Browser, Failure, left_out};

/// A keyboard's Escape, arrow left, right and down, and Shift (W3C WebDriver §17.4.2).
const ESCAPE: &str = "\u{E00C}";
const RIGHT: &str = "\u{E014}";
const DOWN: &str = "\u{E015}";
const SHIFT: &str = "\u{E008}";
const HOME: &str = "\u{E011}";

/// matplotlib's tables at 0, 128 and 255.
const INFERNO_MIDDLE: [u64; 3] = [188, 55, 84];
const VIRIDIS: [[u64; 3]; 2] = [[68, 1, 84], [253, 231, 37]];
const TURBO: [[u64; 3]; 2] = [[48, 18, 59], [122, 4, 3]];

fn choose(browser: &Browser, name: &str, option: &str) -> Outcome {
    browser.click(&format!("#look [name={name}] option[value={option}]"))
}

fn set_limit(browser: &Browser, name: &str, value: &str) -> Outcome {
    let select_all = "\u{E009}a\u{E000}";
    browser.type_into(
        &format!("#look [name={name}]"),
        &format!("{select_all}{value}\u{E004}"),
    )
}

fn ticks(browser: &Browser) -> Result<String, Failure> {
    browser.text(".sensor [data-field=ticks]")
}

#[test]
fn a_palette_gives_its_own_colours_and_is_remembered() -> Outcome {
    if left_out("a_palette_gives_its_own_colours_and_is_remembered") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    wait_for_colour(&browser, 10, HOTTEST)?;
    for (title, [cold, hot]) in [
        ("viridis", VIRIDIS),
        ("turbo", TURBO),
        ("grey", [[0; 3], [255; 3]]),
    ] {
        choose(&browser, "palette", title)?;
        wait_for_colour(&browser, 10, hot)?;
        assert_eq!(colour(&browser, 0)?, cold, "{title}");
    }
    browser.open(&server.url("/"))?;
    wait_for_colour(&browser, 10, [255; 3])?;
    // The key goes on from there: after the last comes the first.
    browser.click("h1")?;
    browser.press("p")?;
    wait_for_colour(&browser, 10, HOTTEST)?;
    assert_quiet(&browser, "")
}

#[test]
fn every_palette_gets_lighter_or_differs_towards_the_hot_end() -> Outcome {
    if left_out("every_palette_gets_lighter_or_differs_towards_the_hot_end") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let ramp: Vec<u16> = (0..64).map(|index| 80 + 4 * index).collect();
    server.post(&batch("s1", 0, &[frame(&ramp, 402)]))?;
    wait_for_colour(&browser, 63, HOTTEST)?;
    // Ironbow follows inferno. Rec. 709 luma, as an eye without colour would see it.
    browser.press("p")?;
    wait_for_colour(&browser, 63, [255, 255, 246])?;
    let mut last = 0;
    for cell in 0..64 {
        let seen = colour(&browser, cell)?;
        let luma = seen[0] * 2126 + seen[1] * 7152 + seen[2] * 722;
        assert!(
            cell == 0 || luma > last,
            "cell {cell} is no lighter: {seen:?}"
        );
        last = luma;
    }
    Ok(())
}

#[test]
fn a_scale_is_fixed_held_or_shared() -> Outcome {
    if left_out("a_scale_is_fixed_held_or_shared") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(100, 10, 120), 402)]))?;
    wait_for_colour(&browser, 10, HOTTEST)?;
    choose(&browser, "scale", "fixed")?;
    set_limit(&browser, "low", "20")?;
    set_limit(&browser, "high", "30")?;
    // 25 °C is in the middle of 20 to 30.
    wait_for_colour(&browser, 0, INFERNO_MIDDLE)?;
    set_limit(&browser, "low", "31")?;
    browser.wait_for_text("#look-trouble", |text| {
        text == "The cold end must be below the hot end."
    })?;
    assert_eq!(colour(&browser, 0)?, INFERNO_MIDDLE);
    set_limit(&browser, "low", "25")?;
    wait_for_colour(&browser, 0, COLDEST)?;
    assert_eq!(browser.text("#look-trouble")?, "");

    // Held: hotter frames do not move it.
    choose(&browser, "scale", "hold")?;
    server.post(&batch("s1", 1, &[frame(&pixels(100, 10, 400), 402)]))?;
    field(&browser, "max", "100.00 °C")?;
    assert!(
        ticks(&browser)?.starts_with("30 °C"),
        "{}",
        ticks(&browser)?
    );
    choose(&browser, "scale", "auto")?;
    browser.wait_for_text(".sensor [data-field=ticks]", |text| {
        text.starts_with("100 °C")
    })?;

    // Shared: the first sensor's scale reaches to what the second one sees.
    server.post(&batch("s2", 0, &[frame(&pixels(40, 10, 60), 402)]))?;
    browser.wait_for_text("#sensors", |text| text.contains("s2"))?;
    choose(&browser, "scale", "shared")?;
    browser.wait_for_text(".sensor [data-field=ticks]", |text| text.ends_with("10 °C"))?;
    assert_quiet(&browser, "")
}

#[test]
fn a_picture_is_turned_and_mirrored_and_its_pixels_keep_their_numbers() -> Outcome {
    if left_out("a_picture_is_turned_and_mirrored_and_its_pixels_keep_their_numbers") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // Pixel 2 is beside the upper left corner.
    server.post(&batch("s1", 0, &[frame(&pixels(80, 1, 120), 402)]))?;
    wait_for_colour(&browser, 1, HOTTEST)?;
    browser.click(".sensor [data-field=turn]")?;
    // Clockwise: the upper edge becomes the right one. Row 2, column 8.
    wait_for_colour(&browser, 15, HOTTEST)?;
    field(&browser, "orientation", "Drawn turned clockwise by 90°.")?;
    browser.press("m")?;
    wait_for_colour(&browser, 8, HOTTEST)?;
    field(
        &browser,
        "orientation",
        "Drawn mirrored, then turned clockwise by 270°.",
    )?;
    browser.open(&server.url("/"))?;
    wait_for_colour(&browser, 8, HOTTEST)?;
    browser.type_into(".heat", &format!("{HOME}{DOWN}"))?;
    field(&browser, "cursor", "Pixel 2 (row 1, column 2): 30.00 °C")?;
    for corner in [8, 1, 15, 62, 8] {
        assert_eq!(
            colour(&browser, corner)? == HOTTEST,
            corner == 8,
            "{corner}"
        );
    }
    assert_quiet(&browser, "")
}

#[test]
fn a_region_reads_its_own_least_mean_and_greatest() -> Outcome {
    if left_out("a_region_reads_its_own_least_mean_and_greatest") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 9, 120), 402)]))?;
    field(&browser, "max", "30.00 °C")?;
    let cell = browser.execute("return document.querySelector('.heat').clientWidth / 8")?;
    let cell = cell.as_f64().ok_or("no width")?;
    let at = |cells: f64| format!("{:.0}", cell * cells).parse::<i32>();
    // From pixel 1 to pixel 18: three rows of two.
    browser.drag(".heat", (at(-3.5)?, at(-3.5)?), (at(-2.5)?, at(-1.5)?))?;
    field(
        &browser,
        "region",
        "Region of 6 pixels (1 to 18): minimum 20.00 °C, mean 21.67 °C, maximum 30.00 °C",
    )?;
    server.post(&batch("s1", 1, &[frame(&pixels(80, 9, 104), 402)]))?;
    field(&browser, "region", "mean 21.00 °C, maximum 26.00 °C")?;
    keep_picture(&browser, "region")?;
    browser.open(&server.url("/"))?;
    field(&browser, "region", "Region of 6 pixels (1 to 18)")?;
    browser.type_into(".heat", ESCAPE)?;
    browser.wait_for_text(".sensor [data-field=region]", str::is_empty)?;
    // By keys: one cell to the right and one down from the first.
    browser.type_into(".heat", &format!("{HOME}{SHIFT}{RIGHT}{DOWN}"))?;
    field(&browser, "region", "Region of 4 pixels (1 to 10)")?;
    assert_quiet(&browser, "")
}

#[test]
fn what_is_interpolated_says_so() -> Outcome {
    if left_out("what_is_interpolated_says_so") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // The left half at 20 °C and the right half at 30 °C.
    let halves: Vec<u16> = (0..64)
        .map(|index| if index % 8 < 4 { 80 } else { 120 })
        .collect();
    server.post(&batch("s1", 0, &[frame(&halves, 402)]))?;
    wait_for_colour(&browser, 4, HOTTEST)?;
    let middle = "const canvas = document.querySelector('.heat');
        const copy = Object.assign(document.createElement('canvas'), { width: 1, height: 1 });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, canvas.width / 2 - 1, canvas.height / 2, 1, 1, 0, 0, 1, 1);
        return context.getImageData(0, 0, 1, 1).data[0];";
    assert_eq!(browser.execute(middle)?, 0, "cells have a sharp edge");
    assert_eq!(browser.text(".sensor [data-field=invented]")?, "");
    for method in ["bilinear", "bicubic"] {
        choose(&browser, "method", method)?;
        field(
            &browser,
            "invented",
            "what is between the 64 pixels was not measured",
        )?;
        let red = browser.execute(middle)?.as_u64().ok_or("no colour")?;
        // Half-way between the two: inferno's middle has a red of 188.
        assert!((170..=205).contains(&red), "{method}: {red}");
        assert_eq!(colour(&browser, 0)?, COLDEST, "{method}");
    }
    keep_picture(&browser, "interpolated")?;
    choose(&browser, "method", "cells")?;
    browser.wait_for_text(".sensor [data-field=invented]", str::is_empty)?;
    assert_eq!(browser.execute(middle)?, 0);
    assert_quiet(&browser, "")
}

#[test]
fn one_sensor_is_shown_large_and_the_address_keeps_it() -> Outcome {
    if left_out("one_sensor_is_shown_large_and_the_address_keeps_it") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    for sensor in ["s1", "s2", "s3"] {
        server.post(&batch(sensor, 0, &[frame(&person(), 402)]))?;
    }
    browser.wait_for_text("#sensors", |text| {
        ["s1", "s2", "s3"].iter().all(|name| text.contains(name))
    })?;
    let width = "return document.querySelector('.heat').clientWidth";
    let small = browser.execute(width)?.as_f64().ok_or("no width")?;
    browser.click(".sensor:nth-child(2) [data-field=large]")?;
    field(&browser, "name", "pi-1 · s2")?;
    let count = "return document.querySelectorAll('.sensor').length";
    assert_eq!(browser.execute(count)?, 1);
    let large = browser.execute(width)?.as_f64().ok_or("no width")?;
    assert!(large > small * 1.3, "{large} against {small} pixels");
    browser.press("]")?;
    field(&browser, "name", "pi-1 · s3")?;
    browser.press("n")?;
    keep_picture(&browser, "large")?;
    let address = browser.execute("return location.href")?;
    browser.open("about:blank")?;
    browser.open(address.as_str().ok_or("no address")?)?;
    field(&browser, "name", "pi-1 · s3")?;
    assert_eq!(browser.execute(count)?, 1);
    browser.press(ESCAPE)?;
    browser.wait_for(
        "all sensors again",
        || browser.execute(count),
        |seen| *seen == 3,
    )?;
    assert_quiet(&browser, "")
}

#[test]
fn the_last_minutes_are_a_strip_with_gaps() -> Outcome {
    if left_out("the_last_minutes_are_a_strip_with_gaps") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // Frame 0 is half a minute older than frame 300.
    server.post(&batch("s1", 0, &[frame(&pixels(80, 9, 120), 402)]))?;
    field(&browser, "max", "30.00 °C")?;
    server.post(&batch(
        "s1",
        300,
        &vec![frame(&pixels(80, 9, 160), 402); 20],
    ))?;
    field(&browser, "max", "40.00 °C")?;
    let label = "return document.querySelector('.history').getAttribute('aria-label')";
    browser.wait_for(
        "the strip's ends",
        || browser.execute(label),
        |said| {
            said.as_str()
                .is_some_and(|said| said.contains("20.00 °C to 40.00 °C in the last 5 minutes"))
        },
    )?;
    // Painted at the right end, and nothing in the minutes before.
    let painted = "const canvas = document.querySelector('.history');
        const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, 0, 0);
        const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
        const columns = new Set();
        for (let at = 3; at < data.length; at += 4) if (data[at] > 0) columns.add(Math.floor(at / 4) % canvas.width / canvas.width);
        return [Math.min(...columns), Math.max(...columns)];";
    let columns = browser.execute(painted)?;
    let ends: Vec<f64> = serde_json::from_value(columns)?;
    assert!(ends[0] > 0.8 && ends[1] > 0.95, "{ends:?}");
    // A page that is opened later has the minutes before it too, the oldest frame among them: 40 °C is not all.
    server.post(&batch("s1", 320, &[frame(&pixels(80, 9, 80), 402)]))?;
    browser.open("about:blank")?;
    browser.open(&server.url("/"))?;
    field(&browser, "max", "20.00 °C")?;
    browser.wait_for(
        "the minutes before the page was opened",
        || browser.execute(label),
        |said| {
            said.as_str()
                .is_some_and(|said| said.contains("20.00 °C to 40.00 °C in the last 5 minutes"))
        },
    )?;
    assert_quiet(&browser, "")
}

#[test]
fn a_hundred_sensors_fit_one_wall_and_every_key_is_listed() -> Outcome {
    if left_out("a_hundred_sensors_fit_one_wall_and_every_key_is_listed") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    for chunk in 0..10 {
        let mut body = batch("unused", 0, &[frame(&person(), 402)]);
        let part = body["sensors"][0].clone();
        body["device"] = format!("pi-{chunk}").into();
        body["sensors"] = (0..10)
            .map(|index| {
                let mut part = part.clone();
                part["sensor"] = format!("s{index}").into();
                part
            })
            .collect();
        server.post(&body)?;
    }
    let count = "return document.querySelectorAll('.sensor').length";
    browser.wait_for(
        "100 sensors",
        || browser.execute(count),
        |seen| *seen == 100,
    )?;
    let wide = browser.execute("return document.documentElement.scrollWidth - innerWidth")?;
    assert!(
        wide.as_i64().is_some_and(|wide| wide <= 0),
        "{wide} pixels too wide"
    );
    keep_picture(&browser, "hundred")?;
    browser.press("?")?;
    let keys = browser.wait_for_text("#keys", |text| text.contains("next palette"))?;
    for said in [
        "hold the scale",
        "turn the sensor",
        "mark a region",
        "all sensors",
        "this list",
    ] {
        assert!(keys.contains(said), "{said} is not in {keys}");
    }
    keep_picture(&browser, "keys")?;
    browser.press(ESCAPE)?;
    let open = "return document.querySelector('#keys').open";
    browser.wait_for(
        "the list to close",
        || browser.execute(open),
        |open| *open == false,
    )?;
    assert_quiet(&browser, "")
}
