//! The editor of a folder without scenes: from nothing to a saved room with somebody who walks.

use super::desk::*;
use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::webdriver::left_out;
use serde_json::{Value, json};

#[test]
fn an_empty_folder_asks_for_a_room_and_ends_with_a_scene_that_the_command_line_reads() -> Outcome {
    if left_out("an_empty_folder_asks_for_a_room_and_ends_with_a_scene_that_the_command_line_reads")
    {
        return Ok(());
    }
    let desk = Desk::with(&[])?;
    let browser = &desk.browser;
    desk.open_at("")?;
    let is_asked = "return document.querySelector('#room').open";
    assert_eq!(browser.execute(is_asked)?, Value::Bool(true));
    browser.execute(
        "for (const [axis, length] of [['x', 5], ['y', 3.5], ['z', 2.4]]) document.querySelector(`#room-${axis}`).value = length",
    )?;
    browser.click("#room [value=create]")?;

    // The room is the selection: it is in the list and has fields.
    let fields = "return ['x', 'y', 'z'].map((_, axis) => document.querySelector(`#fields [data-key='room size_mm ${axis}']`)?.value)";
    let is_room = |values: &Value| *values == json!(["5000", "3500", "2400"]);
    browser.wait_for("the room's fields", || browser.execute(fields), is_room)?;
    let listed =
        "return [...document.querySelectorAll('#things .kind')].map((kind) => kind.textContent)";
    assert_eq!(browser.execute(listed)?, json!(["room", "sensor"]));
    assert_eq!(desk.celsius("ceiling")?, vec![21.0; 64]);

    // What is added is in view: somebody who walks is seen, and the time runs.
    browser.click("#add")?;
    browser.click("#new [data-kind=agent]")?;
    desk.wait_for_text(|text| text.contains("person = {"))?;
    browser.click("#add-waypoint")?;
    desk.wait_for_text(|text| text.contains("trajectory"))?;
    let warmest = |celsius: &Vec<f64>| celsius.iter().any(|celsius| *celsius > 22.0);
    browser.wait_for("a person in view", || desk.celsius("ceiling"), warmest)?;
    let second = "return document.querySelector('#second').valueAsNumber";
    assert_eq!(browser.execute(second)?.as_f64(), Some(0.0));
    browser.click("#play")?;
    let runs = |now: &Value| now.as_f64() > Some(0.0);
    browser.wait_for("the time", || browser.execute(second), runs)?;
    browser.click("#play")?;
    keep_picture(browser, "editor-from-nothing")?;

    // No name covers a person: it stands elsewhere, or not at all.
    let named = "return import('/assets/names.js').then(({ withRoom }) => {
        const person = { left: 0, right: 100, top: 0, bottom: 100 };
        const [inside, below] = [[50, 50], [50, 120]];
        return [[inside, [below]], [inside, []]].map(([at, others]) => withRoom([{ words: 'ana', weight: 1, at, others }], 12, [person]).map(({ at }) => at));
      })";
    assert_eq!(browser.execute(named)?, json!([[[50, 120]], []]));

    browser.click("#save-other")?;
    browser.type_into("#save-name", "first")?;
    browser.click("#save-as [value=save]")?;
    desk.saved()?;
    assert_eq!(simulated(&desk, "first.toml", "ceiling")?.len(), 64);
    assert_quiet(browser, "")
}
