//! Whether the page can be read: the contrast of all its text in light and dark, and its views on a wall screen.

use grideye_tests::live_page::{
    Outcome, Server, assert_quiet, batch, frame, keep_picture, person, set_up,
};
use grideye_tests::webdriver::{Browser, Screen, left_out};
use serde_json::json;

/// What WCAG 2.2 asks of text of any size at level AA (success criterion 1.4.3).
const CONTRAST_MIN: f64 = 4.5;

/// Every text in sight with its contrast, least first: WCAG's relative luminances of the color of its letters and of all
/// that lies behind, as the browser computed them. A canvas of one pixel turns any notation of a color into bytes.
const CONTRASTS: &str = "
    const context = Object.assign(document.createElement('canvas'), { width: 1, height: 1 }).getContext('2d', { willReadFrequently: true });
    const over = (colors) => {
      context.clearRect(0, 0, 1, 1);
      for (const color of colors) { context.fillStyle = color; context.fillRect(0, 0, 1, 1); }
      return context.getImageData(0, 0, 1, 1).data;
    };
    const grounds = (element) => {
      const found = [];
      for (let at = element; at; at = at.parentElement) found.unshift(getComputedStyle(at).backgroundColor);
      return found;
    };
    const luminance = ([r, g, b]) => {
      const [red, green, blue] = [r, g, b].map((byte) => byte / 255).map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
      return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
    };
    const contrast = (behind, color) => {
      const [ground, ink] = [over(behind), over([...behind, color])].map(luminance);
      return (Math.max(ground, ink) + 0.05) / (Math.min(ground, ink) + 0.05);
    };
    const found = [];
    for (const element of document.body.querySelectorAll('*')) {
      const isSeen = element.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && element.getClientRects().length > 0;
      if (!isSeen || element.disabled) continue;
      const ownText = [...element.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE).map((node) => node.data.trim()).join(' ').trim();
      const inks = [];
      if (ownText !== '' && element.tagName !== 'OPTION') inks.push([ownText, getComputedStyle(element).color]);
      if (['INPUT', 'SELECT'].includes(element.tagName)) inks.push([`value of ${element.name}`, getComputedStyle(element).color]);
      if (element.placeholder) inks.push([element.placeholder, getComputedStyle(element, '::placeholder').color]);
      for (const [text, ink] of inks) found.push([contrast(grounds(element), ink), `${element.tagName} ${element.className} ${element.dataset.field ?? ''}: ${text.slice(0, 40)}`]);
    }
    return found.sort((one, other) => one[0] - other[0]);";

/// A live sensor, one without a frame and one that fell silent; a recording that runs and one with a gap.
fn furnish(server: &Server) -> Outcome {
    let people = vec![frame(&person(), 402); 30];
    for name in ["hall, morning", "kitchen, evening"] {
        ureq::post(server.url("/v1/recordings")).send_json(json!({ "name": name }))?;
    }
    server.post(&batch("silent", 0, &people))?;
    let mut troubled = batch("missing", 0, &people[..5]);
    troubled["device"] = "pi-2".into();
    troubled["sensors"][0]["account"] = json!({
        "read": 12, "missing": 0, "dropped": { "ring-full": 3 }, "spooled": 9, "errors": { "nack": 7 }
    });
    server.post(&troubled)?;
    server.post(&batch("gap", 0, &people))?;
    server.post(&batch("gap", 60, &people))?;
    let span =
        json!({ "device": "pi-1", "sensor": "gap", "boot": "b1", "first_seq": 3, "last_seq": 9 });
    let label = json!({ "name": "two people", "spans": [span] });
    ureq::post(server.url("/v1/recordings/1/labels")).send_json(label)?;
    ureq::post(server.url("/v1/recordings/1/stop")).send_empty()?;
    Ok(())
}

/// The views, and what each must show before it is judged.
const VIEWS: [(&str, &str, &str); 4] = [
    ("live", "", "pi-2 · missing"),
    ("recordings", "#recordings", "hall, morning"),
    ("playback", "#recording=1", "two people"),
    ("devices", "#devices", "does not answer at its address"),
];

/// Opens a view again, with a sensor that is live and one that has no frame.
fn open(
    server: &Server,
    browser: &Browser,
    seq: u64,
    (_, address, wanted): (&str, &str, &str),
) -> Outcome {
    browser.open("about:blank")?;
    browser.open(&server.url(&format!("/{address}")))?;
    server.post(&batch("live", seq, &[frame(&person(), 402)]))?;
    let mut missing = batch("missing", 5 + seq, &[json!({ "missing": "nack" })]);
    missing["device"] = "pi-2".into();
    server.post(&missing)?;
    browser
        .wait_for_text("main", |text| text.contains(wanted))
        .map(drop)
}

#[test]
fn all_text_has_the_contrast_that_reading_needs_in_light_and_dark() -> Outcome {
    if left_out("all_text_has_the_contrast_that_reading_needs_in_light_and_dark") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    furnish(&server)?;
    let mut seq = 0;
    for scheme in ["light", "dark"] {
        browser.prefer_scheme(scheme)?;
        for view in VIEWS {
            open(&server, &browser, seq, view)?;
            seq += 1;
            let found: Vec<(f64, String)> = serde_json::from_value(browser.execute(CONTRASTS)?)?;
            assert!(found.len() > 20, "{scheme}, {}: {found:?}", view.0);
            let poor: Vec<_> = found
                .iter()
                .filter(|(contrast, _)| *contrast < CONTRAST_MIN)
                .collect();
            assert!(poor.is_empty(), "{scheme}, {}: {poor:#?}", view.0);
            println!(
                "{scheme}, {}: {} texts, least {:?}",
                view.0,
                found.len(),
                found[0]
            );
        }
    }
    assert_quiet(&browser, "")
}

/// What reaches beyond the window, a part that reaches beyond the panel that it is in, and text that reaches into the next.
const BEYOND: &str = "
    const within = (inner, outer) => inner.left >= outer.left - 1 && inner.right <= outer.right + 1;
    const window = { left: 0, right: innerWidth };
    const found = [];
    for (const panel of document.querySelectorAll('.panel')) {
      if (panel.offsetWidth === 0) continue;
      const outer = panel.getBoundingClientRect();
      if (!within(outer, window)) found.push(panel.outerHTML.slice(0, 80));
      for (const part of panel.querySelectorAll('*')) {
        if (!part.checkVisibility() || part.closest('svg, .unseen')) continue;
        const isText = ['DT', 'DD', 'TH', 'TD', 'BUTTON', 'H2'].includes(part.tagName);
        const isCut = isText && part.scrollWidth > part.clientWidth + 1;
        if (isCut || !within(part.getBoundingClientRect(), outer)) found.push(part.outerHTML.slice(0, 80));
      }
    }
    return found;";

/// What a wall is for: it is filled, in letters that are read from further away.
const FILLED: &str = "
    const box = document.querySelector('main').getBoundingClientRect();
    return [box.width / innerWidth > 0.9, parseFloat(getComputedStyle(document.body).fontSize) >= 24];";

#[test]
fn every_view_fits_a_desk_and_fills_a_wall_of_3840_by_2160() -> Outcome {
    if left_out("every_view_fits_a_desk_and_fills_a_wall_of_3840_by_2160") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    furnish(&server)?;
    let mut seq = 0;
    for (width, height) in [(1280, 800), (1920, 1080), (3840, 2160)] {
        browser.set_screen(Screen {
            width,
            height,
            scale: 1.0,
            mobile: false,
        })?;
        for view in VIEWS {
            open(&server, &browser, seq, view)?;
            seq += 1;
            let what = format!("{} at {width}", view.0);
            let size = browser.execute("return [innerWidth, innerHeight]")?;
            assert_eq!(size, json!([width, height]));
            let wide =
                browser.execute("return document.documentElement.scrollWidth - innerWidth")?;
            assert!(
                wide.as_i64().is_some_and(|wide| wide <= 0),
                "{what}: {wide} pixels too wide"
            );
            assert_eq!(browser.execute(BEYOND)?, json!([]), "{what}");
            if width == 3840 {
                assert_eq!(browser.execute(FILLED)?, json!([true, true]), "{what}");
            }
            keep_picture(&browser, &format!("wall-{width}-{}", view.0))?;
        }
    }
    assert_quiet(&browser, "")
}
