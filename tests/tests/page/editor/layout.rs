//! What the editor draws where: fields of view on the plan, panes on one screen, and the names of controls.

use super::desk::*;
use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::webdriver::{Failure, Screen, left_out};
use serde_json::Value;

/// Pixels by which a drawn edge may be off: half of the widest stroke, and one of rounding.
const OFF_PX: f64 = 4.0;

/// The room of the test scene, meters.
const SIDE_M: f64 = 4.0;

/// Left, front, right and back of all that the plan draws in the color of the selection, meters.
fn box_of_chosen(desk: &Desk) -> Result<[f64; 4], Failure> {
    let [left, top, meter] = desk.plan()?;
    let script = "const plan = document.querySelector('#plan');
         const copy = Object.assign(document.createElement('canvas'), { width: plan.width, height: plan.height });
         const context = copy.getContext('2d', { willReadFrequently: true });
         context.drawImage(plan, 0, 0);
         const wanted = getComputedStyle(plan).caretColor.match(/[0-9]+/g).map(Number);
         const { data } = context.getImageData(0, 0, copy.width, copy.height);
         const box = [Infinity, -Infinity, -Infinity, Infinity];
         for (let dot = 0; dot < copy.width * copy.height; dot += 1) {
           if (wanted.some((part, index) => Math.abs(data[4 * dot + index] - part) > 6)) continue;
           const [x, y] = [dot % copy.width, Math.floor(dot / copy.width)];
           box[0] = Math.min(box[0], x); box[1] = Math.max(box[1], y + 1); box[2] = Math.max(box[2], x + 1); box[3] = Math.min(box[3], y);
         }
         return box";
    let found = desk.browser.execute(script)?;
    let [low_x, low_y, high_x, high_y]: [f64; 4] = serde_json::from_value(found)?;
    Ok([low_x - left, top - low_y, high_x - left, top - high_y].map(|side| side / meter))
}

fn wait_for_box(desk: &Desk, wanted: &[f64]) -> Outcome {
    let off_m = OFF_PX / desk.plan()?[2];
    let is_there = |found: &[f64; 4]| {
        let mut sides = found.iter().zip(wanted);
        sides.all(|(found, wanted)| near(*found, *wanted, off_m))
    };
    let what = format!("the selection at {wanted:?}");
    desk.browser
        .wait_for(&what, || box_of_chosen(desk), is_there)
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
    // The wall's sensor is 2 m up and sees 0 to 60 degrees below the horizon, as far as the opposite wall; behind it is its name.
    desk.choose("wall")?;
    wait_for_box(&desk, &[0.0, 0.0, SIDE_M])?;
    desk.choose("ceiling")?;
    wait_for_box(&desk, &below(1.2, 2.4))?;

    // It goes along before the hand lets go.
    let [from, to] = [(1.2, 2.4), (2.0, 2.0)].map(|at| desk.on_plan(at));
    let from = desk.beside_middle("#plan", from?)?;
    let to = desk.beside_middle("#plan", to?)?;
    desk.browser.hold("#plan", from, to)?;
    wait_for_box(&desk, &below(2.0, 2.0))?;
    assert_eq!(desk.text()?, ROOM, "the gesture has not ended");
    desk.browser.release()?;
    desk.wait_for_text(|text| text != ROOM)?;
    wait_for_box(&desk, &below(2.0, 2.0))?;
    keep_picture(&desk.browser, "editor-in-view")?;

    // On its corner, the square reaches all four walls.
    desk.browser.press("{")?;
    wait_for_box(&desk, &[0.0, 0.0, SIDE_M, SIDE_M])?;
    assert_quiet(&desk.browser, "")
}

#[test]
fn the_plan_is_dragged_along_zoomed_and_fitted() -> Outcome {
    if left_out("the_plan_is_dragged_along_zoomed_and_fitted") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let wait_for = |what: &str, wanted: [f64; 3]| {
        let is_there = |now: &[f64; 3]| now.iter().zip(wanted).all(|(is, to)| near(*is, to, 1.1));
        let look = || desk.plan();
        desk.browser.wait_for(what, look, is_there).map(drop)
    };
    let first @ [left, top, meter] = desk.plan()?;
    // From a place where nothing is.
    desk.drag((3.3, 2.8), (-0.5, 0.25))?;
    let along = [left - 0.5 * meter, top - 0.25 * meter, meter];
    wait_for("the plan dragged along", along)?;
    let along = desk.plan()?;
    assert_eq!(desk.text()?, ROOM);
    // What is in the middle of the canvas stays there.
    desk.browser.click("#nearer")?;
    let middle = desk.beside_middle("#plan", (along[0], along[1]))?;
    let nearer = |side: f64, from_middle: i32| side + 0.15 * f64::from(from_middle);
    let wanted = [
        nearer(along[0], middle.0),
        nearer(along[1], middle.1),
        1.15 * meter,
    ];
    wait_for("the plan nearer", wanted)?;
    desk.browser.click("#home")?;
    wait_for("the plan fitted", first)?;
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
        "New room…, Save, Save as…, Undo, Redo, Add…, Waypoint, Duplicate, Delete, Detection"
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
