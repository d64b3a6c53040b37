//! How the live page's pictures can be looked at: palettes, scales, turned, mirrored, large, smoothed, and a region.

use grideye_tests::live_page::{
    COLDEST, HOTTEST, Outcome, assert_quiet, batch, color, color_in, field, frame, is_like,
    keep_picture, person, pixels, set_up, wait_for_color,
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
/// No maker publishes a table: black with a breath of blue, and white with one of yellow.
const IRONBOW: [[u64; 3]; 2] = [[0, 0, 12], [255, 255, 246]];
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

/// A scale of 20 to 30 °C, whatever is measured.
fn fix(browser: &Browser) -> Outcome {
    choose(browser, "scale", "fixed")?;
    set_limit(browser, "low", "20")?;
    set_limit(browser, "high", "30")
}

#[test]
fn a_palette_gives_its_own_colors_and_is_remembered() -> Outcome {
    if left_out("a_palette_gives_its_own_colors_and_is_remembered") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    server.post(&batch("s1", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    wait_for_color(&browser, 10, HOTTEST)?;
    fix(&browser)?;
    for (title, [cold, hot]) in [
        ("ironbow", IRONBOW),
        ("viridis", VIRIDIS),
        ("turbo", TURBO),
        ("grey", [[0; 3], [255; 3]]),
    ] {
        choose(&browser, "palette", title)?;
        let look = || color(&browser, 10);
        browser.wait_for(title, look, |seen| *seen == hot)?;
        assert_eq!(color(&browser, 0)?, cold, "{title}");
    }
    browser.open(&server.url("/"))?;
    wait_for_color(&browser, 10, [255; 3])?;
    // The key goes on from there: after the last comes the first.
    browser.click("h1")?;
    browser.press("p")?;
    wait_for_color(&browser, 10, HOTTEST)?;
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
    wait_for_color(&browser, 63, HOTTEST)?;
    // Ironbow follows inferno. Rec. 709 luma, as an eye without color would see it.
    browser.press("p")?;
    wait_for_color(&browser, 63, [255, 255, 246])?;
    let mut last = 0;
    // The coldest twentieth has the color of the scale's end.
    for cell in 3..64 {
        let seen = color(&browser, cell)?;
        let luma = seen[0] * 2126 + seen[1] * 7152 + seen[2] * 722;
        assert!(
            cell == 3 || luma > last,
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
    wait_for_color(&browser, 10, HOTTEST)?;
    fix(&browser)?;
    // 25 °C is in the middle of 20 to 30.
    let look = || color(&browser, 0);
    browser.wait_for("the middle", look, |seen| *seen == INFERNO_MIDDLE)?;
    set_limit(&browser, "low", "31")?;
    browser.wait_for_text("#look-trouble", |text| {
        text == "The lower limit must be below the upper limit."
    })?;
    assert_eq!(color(&browser, 0)?, INFERNO_MIDDLE);
    set_limit(&browser, "low", "25")?;
    wait_for_color(&browser, 0, COLDEST)?;
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
        text.starts_with("101 °C")
    })?;

    // Shared: the first sensor's scale reaches to what the second one sees.
    server.post(&batch("s2", 0, &[frame(&pixels(40, 10, 60), 402)]))?;
    browser.wait_for_text("#sensors", |text| text.contains("s2"))?;
    choose(&browser, "scale", "shared")?;
    browser.wait_for_text(".sensor [data-field=ticks]", |text| {
        text.ends_with("\n9 °C")
    })?;
    assert_quiet(&browser, "")
}

#[test]
fn a_flat_frame_is_shown_on_the_least_span_and_its_noise_is_no_heat() -> Outcome {
    if left_out("a_flat_frame_is_shown_on_the_least_span_and_its_noise_is_no_heat") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    // 22.25 °C everywhere, but for a quarter of a degree in one pixel.
    server.post(&batch("s1", 0, &[frame(&pixels(89, 10, 90), 402)]))?;
    field(&browser, "max", "22.50 °C")?;
    let ends = ticks(&browser)?;
    assert!(
        ends.starts_with("25 °C") && ends.ends_with("21 °C"),
        "{ends}"
    );
    // One step of 0.25 °C in 4 °C is a sixteenth of the colors.
    let [flat, step] = [color(&browser, 0)?, color(&browser, 10)?];
    assert!(flat != step && step != HOTTEST, "{flat:?} and {step:?}");
    assert_quiet(&browser, "")
}

#[test]
fn the_center_is_the_mean_of_the_four_pixels_in_the_middle() -> Outcome {
    if left_out("the_center_is_the_mean_of_the_four_pixels_in_the_middle") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let mut around = vec![80; 64];
    // Pixels 28, 29, 36 and 37 at 25, 26, 27 and 29 °C, and 20 °C around them.
    for (pixel, word) in [(28, 100), (29, 104), (36, 108), (37, 116)] {
        around[pixel - 1] = word;
    }
    server.post(&batch("s1", 0, &[frame(&around, 402)]))?;
    field(&browser, "center", "26.75 °C")?;
    field(&browser, "max", "29.00 °C")?;
    assert_quiet(&browser, "")
}

#[test]
fn every_sensor_is_held_at_its_own_scale() -> Outcome {
    if left_out("every_sensor_is_held_at_its_own_scale") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let ticks_of = |place: u32, ends: [&str; 2]| {
        let selector = format!(".sensor:nth-child({place}) [data-field=ticks]");
        browser
            .wait_for_text(&selector, |text| {
                text.starts_with(ends[0]) && text.ends_with(ends[1])
            })
            .map(drop)
    };
    server.post(&batch("s1", 0, &[frame(&pixels(80, 10, 120), 402)]))?;
    server.post(&batch("s2", 0, &[frame(&pixels(40, 10, 60), 402)]))?;
    ticks_of(1, ["31 °C", "\n19 °C"])?;
    ticks_of(2, ["16 °C", "\n9 °C"])?;
    choose(&browser, "scale", "hold")?;
    for sensor in ["s1", "s2"] {
        server.post(&batch(sensor, 1, &[frame(&pixels(100, 10, 400), 402)]))?;
    }
    for place in [1, 2] {
        let selector = format!(".sensor:nth-child({place}) [data-field=max]");
        browser.wait_for_text(&selector, |text| text == "100.00 °C")?;
    }
    ticks_of(1, ["31 °C", "\n19 °C"])?;
    ticks_of(2, ["16 °C", "\n9 °C"])?;
    choose(&browser, "scale", "auto")?;
    // What each showed within the last five seconds is on its scale too.
    ticks_of(1, ["101 °C", "\n19 °C"])?;
    ticks_of(2, ["101 °C", "\n9 °C"])?;
    assert_quiet(&browser, "")
}

#[test]
fn turning_one_sensor_leaves_the_other_upright() -> Outcome {
    if left_out("turning_one_sensor_leaves_the_other_upright") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    for sensor in ["s1", "s2"] {
        server.post(&batch(sensor, 0, &[frame(&pixels(80, 1, 120), 402)]))?;
    }
    let second = ".sensor:nth-child(2)";
    let canvas = format!("{second} .heat");
    let is_hot = |cell: usize| {
        let look = || color_in(&browser, &canvas, cell);
        browser
            .wait_for("the second sensor", look, |seen| is_like(seen, HOTTEST))
            .map(drop)
    };
    is_hot(1)?;
    browser.click(".sensor:first-child [data-field=turn]")?;
    browser.click(".sensor:first-child [data-field=mirror]")?;
    field(&browser, "orientation", "Drawn mirrored, then turned")?;
    server.post(&batch("s2", 1, &[frame(&pixels(80, 1, 124), 402)]))?;
    browser.wait_for_text(&format!("{second} [data-field=max]"), |text| {
        text == "31.00 °C"
    })?;
    is_hot(1)?;
    let said = format!("{second} [data-field=orientation]");
    assert_eq!(browser.text(&said)?, "");
    // And so it is when the page comes again.
    browser.open("about:blank")?;
    browser.open(&server.url("/"))?;
    field(&browser, "orientation", "Drawn mirrored, then turned")?;
    is_hot(1)?;
    assert_eq!(browser.text(&said)?, "");
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
    wait_for_color(&browser, 1, HOTTEST)?;
    browser.click(".sensor [data-field=turn]")?;
    // Clockwise: the upper edge becomes the right one. Row 2, column 8.
    wait_for_color(&browser, 15, HOTTEST)?;
    field(&browser, "orientation", "Drawn turned clockwise by 90°.")?;
    browser.press("m")?;
    wait_for_color(&browser, 8, HOTTEST)?;
    field(
        &browser,
        "orientation",
        "Drawn mirrored, then turned clockwise by 270°.",
    )?;
    browser.open(&server.url("/"))?;
    wait_for_color(&browser, 8, HOTTEST)?;
    browser.type_into(".heat", &format!("{HOME}{DOWN}"))?;
    field(&browser, "cursor", "Pixel 2 (row 1, column 2): 30.00 °C")?;
    for corner in [8, 1, 15, 62, 8] {
        assert_eq!(
            is_like(&color(&browser, corner)?, HOTTEST),
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
    wait_for_color(&browser, 4, HOTTEST)?;
    fix(&browser)?;
    browser.wait_for_text(".sensor [data-field=ticks]", |text| {
        text.starts_with("30 °C")
    })?;
    let middle = "const canvas = document.querySelector('.heat');
        const copy = Object.assign(document.createElement('canvas'), { width: 1, height: 1 });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, canvas.width / 2 - 1, canvas.height / 2, 1, 1, 0, 0, 1, 1);
        return context.getImageData(0, 0, 1, 1).data[0];";
    assert_eq!(browser.execute(middle)?, 0, "cells have a sharp edge");
    assert_eq!(browser.text(".sensor [data-field=invented]")?, "");
    for method in ["bilinear", "bicubic"] {
        choose(&browser, "method", method)?;
        field(&browser, "invented", "only 64 pixels were measured")?;
        let red = browser.execute(middle)?.as_u64().ok_or("no color")?;
        // Half-way between the two: inferno's middle has a red of 188.
        assert!((170..=205).contains(&red), "{method}: {red}");
        assert_eq!(color(&browser, 0)?, COLDEST, "{method}");
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
    let label = "return document.querySelector('.history canvas').getAttribute('aria-label')";
    browser.wait_for(
        "the strip's ends",
        || browser.execute(label),
        |said| {
            said.as_str()
                .is_some_and(|said| said == "History of the last 1 min: 20.00 °C to 40.00 °C")
        },
    )?;
    // Painted at the right end, and nothing in the half minute before.
    let painted = "const canvas = document.querySelector('.history canvas');
        const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, 0, 0);
        const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
        const columns = new Set();
        for (let at = 3; at < data.length; at += 4) if (data[at] > 0) columns.add(Math.floor(at / 4) % canvas.width / canvas.width);
        return [Math.min(...columns), Math.max(...columns)];";
    let columns = browser.execute(painted)?;
    let ends: Vec<f64> = serde_json::from_value(columns)?;
    assert!(ends[0] > 0.5 && ends[1] > 0.95, "{ends:?}");
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
                .is_some_and(|said| said == "History of the last 1 min: 20.00 °C to 40.00 °C")
        },
    )?;
    assert_quiet(&browser, "")
}

#[test]
fn the_history_has_degrees_and_a_time_scale() -> Outcome {
    if left_out("the_history_has_degrees_and_a_time_scale") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    let axis = |name: &str, wanted: &[&str]| {
        let texts = format!(
            "return [...document.querySelectorAll('.history .{name}-axis li')].map((tick) => tick.innerText)"
        );
        let look = || browser.execute(&texts);
        browser
            .wait_for(name, look, |seen| *seen == serde_json::json!(wanted))
            .map(drop)
    };
    server.post(&batch("s1", 0, &[frame(&pixels(80, 9, 120), 402)]))?;
    axis("degree", &["30 °C", "25 °C", "20 °C"])?;
    axis("time", &["−1 min", "−45 s", "−30 s", "−15 s", "now"])?;
    let caption = browser.text(".history figcaption")?;
    assert!(
        caption.starts_with("Last 1 min") && caption.contains("mean"),
        "{caption}"
    );
    // Half of the span is in the middle.
    let middle = "const center = (element) => { const box = element.getBoundingClientRect(); return (box.left + box.right) / 2; };
        return center(document.querySelector('.time-axis li:nth-child(3)')) - center(document.querySelector('.history canvas'));";
    assert!(browser.execute(middle)?.as_f64().map(f64::abs) < Some(1.0));
    // Older frames need a longer span.
    server.post(&batch(
        "s1",
        900,
        &vec![frame(&pixels(80, 9, 120), 402); 20],
    ))?;
    browser.open("about:blank")?;
    browser.open(&server.url("/"))?;
    axis("time", &["−2 min", "−90 s", "−1 min", "−30 s", "now"])?;
    assert_quiet(&browser, "")
}

#[test]
fn between_two_bursts_the_strip_is_empty() -> Outcome {
    if left_out("between_two_bursts_the_strip_is_empty") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open("about:blank")?;
    // Ten seconds, a minute of nothing, and ten seconds.
    for first in [0, 700] {
        let frames = vec![frame(&pixels(80, 9, 120), 402); 100];
        server.post(&batch("s1", first, &frames))?;
    }
    browser.open(&server.url("/"))?;
    field(&browser, "max", "30.00 °C")?;
    let painted = "const canvas = document.querySelector('.history canvas');
        const copy = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
        const context = copy.getContext('2d', { willReadFrequently: true });
        context.drawImage(canvas, 0, 0);
        const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
        const columns = new Set();
        for (let at = 3; at < data.length; at += 4) if (data[at] > 0) columns.add(Math.floor(at / 4) % canvas.width);
        return [...columns].sort((one, other) => one - other).map((column) => column / canvas.width);";
    let columns =
        || -> Result<Vec<f64>, Failure> { Ok(serde_json::from_value(browser.execute(painted)?)?) };
    let widest = |columns: &[f64]| {
        let pairs = columns.windows(2).map(|pair| pair[1] - pair[0]);
        pairs.fold(0.0, f64::max)
    };
    // 80 s need the span of two minutes, of which 60 s are half.
    let seen = browser.wait_for("both bursts", columns, |columns| widest(columns) > 0.4)?;
    assert!((0.47..0.53).contains(&widest(&seen)), "{seen:?}");
    let empty = seen.windows(2).position(|pair| pair[1] - pair[0] > 0.4);
    let empty = empty.ok_or("no gap")?;
    let [before, after] = [
        seen[empty] - seen[0],
        seen[seen.len() - 1] - seen[empty + 1],
    ];
    for burst in [before, after] {
        assert!((0.06..0.11).contains(&burst), "{before} and {after}");
    }
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
        "hold or release the scale",
        "turn the image",
        "mark a region",
        "show all sensors",
        "show this list",
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
