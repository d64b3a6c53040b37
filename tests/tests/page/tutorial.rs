//! The room of `crates/grideye/tutorials/room.md`: drawn in the editor as the page says, it is the file that the page
//! shows. Takes the page's pictures; `GRIDEYE_PICTURES=1` writes them.

use crate::editor::desk::Desk;
use crate::pictures::{keep_or_compare, screenshot};
use grideye_tests::live_page::{Outcome, assert_quiet};
use grideye_tests::programs::root;
use grideye_tests::walkthrough::Walkthrough;
use grideye_tests::webdriver::{Browser, Screen, left_out};

const PAGE: &str = "crates/grideye/tutorials/room.md";
const WAY: &str = "trajectories/my-room-person-1.csv";

fn screen(width: u32, height: u32) -> Screen {
    Screen {
        width,
        height,
        scale: 1.0,
        mobile: false,
    }
}

#[test]
fn the_room_that_the_tutorial_draws_is_the_file_that_it_shows() -> Outcome {
    if left_out("the_room_that_the_tutorial_draws_is_the_file_that_it_shows") {
        return Ok(());
    }
    let page = Walkthrough::of(PAGE);
    let desk = Desk::with(&[])?;
    let browser = &desk.browser;
    browser.set_screen(screen(1280, 740))?;
    desk.open_at("")?;
    browser.execute(
        "for (const [axis, length] of [['x', 4], ['y', 3.5], ['z', 2.5]]) document.querySelector(`#room-${axis}`).value = length",
    )?;
    browser.click("#room [value=create]")?;
    desk.wait_for_text(|text| text.contains("[4000, 3500, 2500]"))?;
    browser.click("#save-other")?;
    browser.type_into("#save-name", "my-room")?;
    browser.click("#save-as [value=save]")?;
    desk.saved()?;

    browser.click("#add")?;
    browser.click("#new [data-kind=agent]")?;
    desk.wait_for_text(|text| text.contains("person = {}"))?;
    for points in 2..=4 {
        browser.click("#add-waypoint")?;
        let title = format!("Waypoint {points} of person 1");
        browser.wait_for_text("#fields-title", |text| text == title)?;
    }
    desk.choose("person 1")?;
    let way = page.file(&format!("scenes/{WAY}")).ok_or("no way")?;
    for (row, line) in way.lines().skip(1).enumerate() {
        for (axis, length) in line.split(',').take(2).enumerate() {
            desk.write(&format!("way {row} {axis}"), length)?;
        }
    }
    desk.write("agent 0 speed_mm_per_s", "500")?;
    let scene = page.file("scenes/my-room.toml").ok_or("no scene")?;
    desk.wait_for_text(|text| text == scene)?;
    browser.click("#save")?;
    desk.saved()?;
    assert_eq!(desk.disk("my-room.toml")?, scene);
    assert_eq!(desk.disk(WAY)?, way);
    // The person below the sensor.
    browser.execute(
        "scrollTo(0, 0);
         const second = document.querySelector('#second');
         second.value = 3;
         second.dispatchEvent(new Event('input', { bubbles: true }))",
    )?;
    let is_warm = |celsius: &Vec<f64>| celsius.iter().any(|celsius| *celsius > 22.0);
    browser.wait_for("the person", || desk.celsius("ceiling"), is_warm)?;
    keep_or_compare(&page.kept("editor.png"), &screenshot(browser)?)?;
    assert_quiet(browser, "")
}

#[test]
fn the_reports_of_the_tutorial_are_in_its_pictures() -> Outcome {
    if left_out("the_reports_of_the_tutorial_are_in_its_pictures") {
        return Ok(());
    }
    let page = Walkthrough::of(PAGE);
    let _printed = page.run(&[], &root());
    let browser = Browser::start()?;
    browser.set_screen(screen(1000, 650))?;
    for (name, verdict) in [("right", "Agrees"), ("wrong", "Disagrees")] {
        let report = page.here().join(name).with_extension("html");
        browser.open(&format!("file://{}", report.display()))?;
        browser.execute("document.documentElement.style.scrollbarWidth = 'none'")?;
        browser.wait_for_text("h1", |text| text.contains(verdict))?;
        keep_or_compare(&page.kept(&format!("{name}.png")), &screenshot(&browser)?)?;
    }
    Ok(())
}
