//! What the editor draws where: fields of view on the plan, panes on one screen, and the names of controls.

use super::desk::*;
use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::webdriver::{Failure, Screen, left_out};
use serde_json::Value;

/// Pixels by which a drawn edge may be off: half of the widest stroke, and one of rounding.
const OFF_PX: f64 = 4.0;

/// The room of the test scene, meters.
const SIDE_M: f64 = 4.0;

/// Left, front, right and back of a shape on the plan, meters.
pub(crate) fn box_of(desk: &Desk, shape: &str) -> Result<[f64; 4], Failure> {
    let script = format!(
        "const [shape, room] = ['{shape}', '.room'].map((one) => document.querySelector(`#plan ${{one}}`).getBoundingClientRect());
         const meter = room.width / {SIDE_M};
         return [shape.left - room.left, room.bottom - shape.bottom, shape.right - room.left, room.bottom - shape.top].map((side) => side / meter)"
    );
    Ok(serde_json::from_value(desk.browser.execute(&script)?)?)
}

fn wait_for_box(desk: &Desk, shape: &str, wanted: [f64; 4]) -> Outcome {
    let off_m = OFF_PX / desk.pixels_per_meter()?;
    let is_there = |found: &[f64; 4]| {
        let mut sides = found.iter().zip(wanted);
        sides.all(|(found, wanted)| near(*found, wanted, off_m))
    };
    let what = format!("{shape} at {wanted:?}");
    desk.browser
        .wait_for(&what, || box_of(desk, shape), is_there)
        .map(drop)
}

/// The square on the floor that a sensor of 60 by 60 degrees sees from 2.7 m straight above, within the room.
fn below(x_m: f64, y_m: f64) -> [f64; 4] {
    let half_m = 2.7 * 30.0_f64.to_radians().tan();
    [x_m - half_m, y_m - half_m, x_m + half_m, y_m + half_m].map(|side| side.clamp(0.0, SIDE_M))
}

#[test]
fn the_plan_shows_what_each_sensor_has_in_view_and_follows_the_hand() -> Outcome {
    if left_out("the_plan_shows_what_each_sensor_has_in_view_and_follows_the_hand") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let ceiling = ".view[data-sensor=ceiling]";
    wait_for_box(&desk, ceiling, below(1.2, 2.4))?;
    wait_for_box(&desk, ".reach[data-sensor=ceiling]", below(1.2, 2.4))?;
    // The wall's sensor is 2 m up and sees 0 to 60 degrees below the horizon: the wedge begins at the sensor, the floor where
    // the steepest ray meets it.
    let from_wall_m = 2.0 / 60.0_f64.to_radians().tan();
    let floor = [0.0, 0.0, SIDE_M, SIDE_M - from_wall_m];
    wait_for_box(&desk, ".view[data-sensor=wall]", floor)?;
    wait_for_box(
        &desk,
        ".reach[data-sensor=wall]",
        [0.0, 0.0, SIDE_M, SIDE_M],
    )?;

    // It goes along before the hand lets go.
    let scale = desk.pixels_per_meter()?;
    let middle = "const [thing, plan] = ['#plan .sensor[data-name=ceiling] rect', '#plan'].map((one) => document.querySelector(one).getBoundingClientRect());
        return [thing.x + thing.width / 2 - plan.x - plan.width / 2, thing.y + thing.height / 2 - plan.y - plan.height / 2]";
    let [x, y]: [f64; 2] = serde_json::from_value(desk.browser.execute(middle)?)?;
    let from = (pixels(x)?, pixels(y)?);
    let to = (pixels(x + 0.8 * scale)?, pixels(y + 0.4 * scale)?);
    desk.browser.hold("#plan", from, to)?;
    wait_for_box(&desk, ceiling, below(2.0, 2.0))?;
    assert_eq!(desk.text()?, ROOM, "the gesture has not ended");
    desk.browser.release()?;
    desk.wait_for_text(|text| text != ROOM)?;
    wait_for_box(&desk, ceiling, below(2.0, 2.0))?;

    // The selected sensor's stands out.
    let chosen = "return [...document.querySelectorAll('#plan .view.chosen')].map((view) => view.dataset.sensor)";
    assert_eq!(
        desk.browser.execute(chosen)?,
        serde_json::json!(["ceiling"])
    );
    let strokes = "return ['ceiling', 'wall'].map((name) => getComputedStyle(document.querySelector(`#plan .view[data-sensor=${name}]`)).stroke)";
    let strokes: [String; 2] = serde_json::from_value(desk.browser.execute(strokes)?)?;
    assert_ne!(strokes[0], strokes[1]);
    keep_picture(&desk.browser, "editor-in-view")?;

    // On its corner, the square reaches all four walls.
    desk.browser.press("{")?;
    wait_for_box(&desk, ceiling, [0.0, 0.0, SIDE_M, SIDE_M])?;
    assert_quiet(&desk.browser, "")
}

/// Left, top, right and bottom of elements in the window, pixels.
fn boxes(desk: &Desk, selector: &str) -> Result<Vec<[f64; 4]>, Failure> {
    let script = format!(
        "return [...document.querySelectorAll('{selector}')].map((one) => one.getBoundingClientRect()).map(({{ left, top, right, bottom }}) => [left, top, right, bottom])"
    );
    let boxes: Vec<[f64; 4]> = serde_json::from_value(desk.browser.execute(&script)?)?;
    assert!(!boxes.is_empty(), "{selector}");
    Ok(boxes)
}

#[test]
fn plan_frames_and_view_are_on_one_screen_and_on_a_phone_below_one_another() -> Outcome {
    if left_out("plan_frames_and_view_are_on_one_screen_and_on_a_phone_below_one_another") {
        return Ok(());
    }
    let desk = Desk::new()?;
    for (width, height) in [(1400, 900), (1920, 1080)] {
        desk.browser.set_screen(Screen {
            width,
            height,
            scale: 1.0,
            mobile: false,
        })?;
        desk.open("room")?;
        for pane in ["#plan", "#frames .frame", "#view", "#things"] {
            for [left, top, right, bottom] in boxes(&desk, pane)? {
                let is_inside = left >= 0.0
                    && top >= 0.0
                    && right <= f64::from(width)
                    && bottom <= f64::from(height);
                let is_large = right - left >= 140.0 && bottom - top >= 140.0;
                assert!(
                    is_inside && is_large,
                    "{pane} {width}: {left} {top} {right} {bottom}"
                );
            }
        }
        let scrolls = "const { scrollHeight, scrollWidth } = document.documentElement; return scrollHeight > innerHeight || scrollWidth > innerWidth";
        assert_eq!(desk.browser.execute(scrolls)?, Value::Bool(false));
    }
    keep_picture(&desk.browser, "editor-panes")?;
    desk.browser.set_screen(Screen {
        width: 390,
        height: 844,
        scale: 1.0,
        mobile: true,
    })?;
    desk.open("room")?;
    let [plan, frames, view] = ["#plan", "#frames", "#view"].map(|pane| boxes(&desk, pane));
    let [plan, frames, view] = [plan?[0], frames?[0], view?[0]];
    assert!(
        plan[3] <= frames[1] && frames[3] <= view[1],
        "{plan:?} {frames:?} {view:?}"
    );
    assert_quiet(&desk.browser, "")
}

#[test]
fn buttons_say_what_they_do_and_every_control_has_a_name() -> Outcome {
    if left_out("buttons_say_what_they_do_and_every_control_has_a_name") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    desk.choose("wall")?;
    let texts = |selector: &str| -> Result<String, Failure> {
        let script = format!(
            "return [...document.querySelectorAll('{selector}')].map((one) => one.textContent.trim()).join(', ')"
        );
        let texts = desk.browser.execute(&script)?;
        Ok(texts.as_str().unwrap_or_default().to_owned())
    };
    assert_eq!(
        texts(".toolbar button")?,
        "New room…, Save, Save as…, Undo, Redo, Add…, Waypoint, Duplicate, Delete, Coverage"
    );
    assert_eq!(
        texts("#stage h2")?,
        "Plan, Frames, 3-D view, Objects, Sensor wall"
    );
    // The names are those of the accessibility tree.
    let number = "const shown = [...document.querySelectorAll('main :is(button, input, select, textarea, summary, canvas, [tabindex])')].filter((one) => one.checkVisibility());
        shown.forEach((one, index) => { one.dataset.control = index; });
        return shown.length";
    let count = desk.browser.execute(number)?.as_u64().unwrap_or_default();
    assert!(count > 30, "{count}");
    let mut names = Vec::new();
    for index in 0..count {
        let name = desk.browser.label(&format!("[data-control='{index}']"))?;
        assert!(!name.is_empty(), "control {index} after {names:?}");
        names.push(name);
    }
    for name in ["Zoom in", "Objects", "Time", "Elevation (90 down), °"] {
        assert!(names.iter().any(|one| one == name), "{name}: {names:?}");
    }
    assert_quiet(&desk.browser, "")
}
