//! The scene editor of the real program in a real browser: what is dragged, turned, typed, undone and saved, by hand and by
//! keys, and what every sensor then sees.

use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::programs::{grideye, run};
use grideye_tests::webdriver::{Screen, left_out};
use serde_json::Value;
use std::fs;

pub(crate) mod desk;
mod layout;
mod nothing;
mod person;

use desk::*;

#[test]
fn what_is_dragged_on_the_plan_goes_there_and_every_sensor_sees_it() -> Outcome {
    if left_out("what_is_dragged_on_the_plan_goes_there_and_every_sensor_sees_it") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let before = desk.pictures()?;

    // A thing that both sensors see.
    desk.drag((2.0, 2.0), (0.6, -0.2))?;
    let text = desk.wait_for_text(|text| text != ROOM)?;
    let [x, y, z] = desk.triple(&text, "stove", "position_mm")?;
    assert!(
        near(x, 2600.0, 30.0) && near(y, 1800.0, 30.0) && z == 0.0,
        "{x} {y} {z}"
    );
    let pictures = desk.wait_for_other_pictures(&before)?;

    // A sensor sees other things from elsewhere, the other one what it saw.
    desk.drag((1.2, 2.4), (-0.5, 0.0))?;
    let text = desk.wait_for_text(|new| new != text)?;
    let [x, y, z] = desk.triple(&text, "ceiling", "position_mm")?;
    assert!(
        near(x, 700.0, 30.0) && near(y, 2400.0, 30.0) && z == 2700.0,
        "{x} {y} {z}"
    );
    let moved = desk.pictures()?;
    assert!(moved[0] != pictures[0] && moved[1] == pictures[1]);

    // People, and waypoints of those who walk; a whole way with the one who goes it.
    desk.drag((0.8, 3.0), (1.0, 0.0))?;
    let text = desk.wait_for_text(|new| new != text)?;
    assert!(
        near(desk.triple(&text, "bob", "position_mm")?[0], 1800.0, 30.0),
        "{text}"
    );
    desk.drag((3.5, 0.7), (-1.0, 0.5))?;
    desk.wait_for_name((2.5, 1.2), "waypoint 2 of ana")?;
    desk.wait_for_name((0.5, 0.7), "waypoint 1 of ana")?;
    // Beside the waypoint on which she stands.
    desk.drag((0.5, 0.9), (0.3, 0.0))?;
    desk.wait_for_name((0.8, 0.7), "waypoint 1 of ana")?;
    desk.wait_for_name((2.8, 1.2), "waypoint 2 of ana")?;
    desk.wait_for_name((0.8, 0.9), "ana")?;

    // Saved, it is what the command line simulates.
    desk.browser.click("#save")?;
    desk.saved()?;
    for sensor in ["ceiling", "wall"] {
        let (shown, made) = (
            desk.celsius(sensor)?,
            simulated(&desk, "room.toml", sensor)?,
        );
        let is_same = shown
            .iter()
            .zip(&made)
            .all(|(one, other)| near(*one, *other, 0.13));
        assert!(shown.len() == 64 && is_same, "{sensor}: {shown:?} {made:?}");
    }
    let way = desk.disk("ways/ana.csv")?;
    assert!(way.starts_with("# from the door\nx_mm,y_mm,z_mm\n") && way.lines().count() == 4);
    keep_picture(&desk.browser, "editor")?;
    assert_quiet(&desk.browser, "")
}

#[test]
fn what_is_turned_by_its_handle_and_dragged_in_the_view_goes_with_the_hand() -> Outcome {
    if left_out("what_is_turned_by_its_handle_and_dragged_in_the_view_goes_with_the_hand") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let before = desk.pictures()?;
    desk.choose("stove")?;
    // From the right, where it points at first, to the back: a quarter counter-clockwise.
    let handle = desk.handle_other_than("#plan", None)?;
    let (x, y) = desk.on_plan((2.0, 2.0))?;
    desk.drag_in("#plan", handle, (x, y - 120.0))?;
    let text = desk.wait_for_text(|text| text.contains("yaw_deg = 90"))?;
    desk.wait_for_other_pictures(&before)?;

    // A sensor turns about the vertical as well: its picture is another one, and that of the other is not.
    let before = desk.pictures()?;
    let of_stove = desk.handle("#plan")?;
    desk.choose("ceiling")?;
    let handle = desk.handle_other_than("#plan", of_stove)?;
    desk.drag_in("#plan", handle, (handle.0 + 150.0, handle.1 - 60.0))?;
    desk.wait_for_text(|new| new != text && !new.contains("azimuth_deg = -90\n\n[[sensor]]"))?;
    let after = desk.pictures()?;
    assert!(after[0] != before[0] && after[1] == before[1]);

    // The stove stands in the middle of the room, which is just above the middle of the view.
    let text = desk.text()?;
    desk.browser
        .execute("document.querySelector('#view').scrollIntoView({ block: 'center' })")?;
    desk.browser.drag("#view", (0, 30), (60, 30))?;
    let moved = desk.wait_for_text(|new| new != text)?;
    let [_, _, z] = desk.triple(&moved, "stove", "position_mm")?;
    assert!(z == 0.0 && desk.triple(&moved, "stove", "position_mm")? != [2000.0, 2000.0, 0.0]);
    assert_eq!(desk.browser.text("#fields-title")?, "Object stove");
    // Beside everything, the view itself turns; so it does by keys.
    let drawn = || {
        desk.browser
            .execute("return document.querySelector('#view').dataset.drawn")
    };
    let first = drawn()?;
    desk.browser.drag("#view", (-150, -90), (-100, -90))?;
    let second = desk
        .browser
        .wait_for("the view", drawn, |now| *now != first)?;
    desk.browser.press(RIGHT)?;
    desk.browser
        .wait_for("the view", drawn, |now| *now != second)?;
    assert_eq!(desk.text()?, moved);
    assert_quiet(&desk.browser, "")
}

#[test]
fn what_is_turned_by_its_handle_in_the_view_is_turned_as_on_the_plan() -> Outcome {
    if left_out("what_is_turned_by_its_handle_in_the_view_is_turned_as_on_the_plan") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let before = desk.pictures()?;
    assert_eq!(desk.handle("#view")?, None, "nothing is chosen");
    desk.choose("stove")?;
    let first = desk.handle_other_than("#view", None)?;
    // It points to the right; to the back is up, and counter-clockwise.
    desk.drag_in("#view", first, (first.0 - 60.0, first.1 - 60.0))?;
    let turned = desk.wait_for_text(|text| text.contains("yaw_deg = "))?;
    let yaw = desk.number(&turned, "stove", "yaw_deg")?;
    assert!((30.0..150.0).contains(&yaw), "{yaw}");
    assert_eq!(
        desk.triple(&turned, "stove", "position_mm")?,
        [2000.0, 2000.0, 0.0]
    );
    desk.wait_for_other_pictures(&before)?;
    let second = desk.handle_other_than("#view", Some(first))?;
    assert!(second.0 < first.0 && second.1 < first.1, "{second:?}");
    // The plan's handle points to where the view's does.
    let (x, y) = desk.on_plan((2.0, 2.0))?;
    let to = desk.handle("#plan")?.ok_or("no handle")?;
    let on_plan = (y - to.1).atan2(to.0 - x).to_degrees();
    assert!(near(on_plan, yaw, 0.1), "{on_plan} {yaw}");

    // Where the handle was, the stove stood as it does in the file; each turn is one step back.
    desk.drag_in("#view", second, first)?;
    let back = desk.wait_for_text(|text| text != turned)?;
    assert!(near(desk.number(&back, "stove", "yaw_deg")?, 0.0, 2.0));
    desk.browser.press_together(&[CONTROL, "z"])?;
    desk.wait_for_text(|text| text == turned)?;
    desk.browser.press_together(&[CONTROL, "z"])?;
    desk.wait_for_text(|text| text == ROOM)?;

    // A sensor likewise: the other one sees what it saw.
    desk.handle_at("#view", first)?;
    let before = desk.pictures()?;
    desk.choose("ceiling")?;
    let first = desk.handle_other_than("#view", Some(first))?;
    desk.drag_in("#view", first, (first.0 + 80.0, first.1 - 20.0))?;
    let turned = desk.wait_for_text(|text| text != ROOM)?;
    let azimuth = desk.number(&turned, "ceiling", "azimuth_deg")?;
    assert!((-80.0..60.0).contains(&azimuth), "{azimuth}");
    let after = desk.pictures()?;
    assert!(after[0] != before[0] && after[1] == before[1]);
    // And by key, from where the hand is.
    let focus = "return document.activeElement.id";
    assert_eq!(desk.browser.execute(focus)?, "view");
    desk.browser.press("[")?;
    let text = desk.wait_for_text(|text| text != turned)?;
    let further = desk.number(&text, "ceiling", "azimuth_deg")?;
    assert!(near(further, azimuth + 5.0, 0.01), "{azimuth} {further}");
    keep_picture(&desk.browser, "editor-turned")?;
    assert_quiet(&desk.browser, "")
}

#[test]
fn numbers_are_typed_undone_and_saved_with_every_remark() -> Outcome {
    if left_out("numbers_are_typed_undone_and_saved_with_every_remark") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    let before = desk.pictures()?;
    desk.choose("stove")?;
    desk.write("object 0 temperature_c", "60")?;
    let hot = ROOM.replace("temperature_c = 35 ", "temperature_c = 60 ");
    desk.wait_for_text(|text| text == hot)?;
    let warmer = desk.wait_for_other_pictures(&before)?;
    let hottest = |picture: &[f64]| picture.iter().copied().fold(f64::MIN, f64::max);
    assert!(
        hottest(&warmer[0]) > hottest(&before[0]) + 5.0,
        "{warmer:?}"
    );
    desk.write("object 0 size_mm 2", "600")?;
    let low = hot.replace("600, 1200]", "600, 600]");
    desk.wait_for_text(|text| text == low)?;
    desk.choose("ana")?;
    desk.write("way 1 1", "900")?;
    desk.wait_for_name((3.5, 0.9), "waypoint 2 of ana")?;

    // Back by key and by button, and forth again; a number that is typed is one step.
    desk.browser.press_together(&[CONTROL, "z"])?;
    desk.wait_for_name((3.5, 0.7), "waypoint 2 of ana")?;
    desk.browser.click("#undo")?;
    desk.wait_for_text(|text| text == hot)?;
    desk.browser.press_together(&[CONTROL, "z"])?;
    desk.wait_for_text(|text| text == ROOM)?;
    desk.browser
        .wait_for_text("#saved", |text| text == "saved")?;
    desk.browser.press_together(&[CONTROL, SHIFT, "z"])?;
    desk.wait_for_text(|text| text == hot)?;
    desk.browser.click("#redo")?;
    desk.wait_for_text(|text| text == low)?;

    // Saved is what was typed, and nothing else; the old one is kept.
    desk.browser
        .wait_for_text("#saved", |text| text == "not saved")?;
    desk.browser.press_together(&[CONTROL, "s"])?;
    desk.saved()?;
    assert_eq!(desk.disk("room.toml")?, low);
    assert_eq!(desk.disk("room.toml~")?, ROOM);
    assert_eq!(desk.disk("ways/ana.csv")?, WAY);
    assert_quiet(&desk.browser, "")
}

#[test]
fn a_scene_that_changed_on_the_disk_is_not_written_over() -> Outcome {
    if left_out("a_scene_that_changed_on_the_disk_is_not_written_over") {
        return Ok(());
    }
    let desk = Desk::new()?;
    desk.open("room")?;
    desk.choose("stove")?;
    desk.write("object 0 temperature_c", "50")?;
    desk.wait_for_text(|text| text.contains("temperature_c = 50"))?;
    let others = ROOM.replace("Nobody", "Somebody");
    fs::write(desk.file("room.toml"), &others)?;
    desk.browser.click("#save")?;
    desk.browser.wait_for_text("#fault", |text| {
        text.contains("changed on disk") && text.contains("another name")
    })?;
    assert_eq!(desk.disk("room.toml")?, others);
    // Under another name both are kept.
    desk.browser.click("#save-other")?;
    desk.browser
        .wait_for_text("#save-as", |text| text.contains("Name"))?;
    desk.browser.execute(
        "const field = document.querySelector('#save-name'); field.focus(); field.select()",
    )?;
    desk.browser.type_into("#save-name", "my room")?;
    desk.browser.click("#save-as [value=save]")?;
    desk.saved()?;
    assert_eq!(desk.disk("room.toml")?, others);
    assert_eq!(
        desk.disk("my room.toml")?,
        ROOM.replace("temperature_c = 35 ", "temperature_c = 50 ")
    );
    // The browser itself says that the first was refused.
    assert_quiet(&desk.browser, "409")
}

#[test]
fn a_scene_that_is_none_names_its_fault_and_the_place() -> Outcome {
    if left_out("a_scene_that_is_none_names_its_fault_and_the_place") {
        return Ok(());
    }
    let desk = Desk::new()?;
    // As it lies in the folder.
    desk.open("broken")?;
    desk.browser.wait_for_text("#fault", |text| {
        text.contains("size_mm") && text.contains("line 3, column 11")
    })?;
    assert!(desk.browser.text("#lines")?.contains("▶ 3"));

    // As it is typed: the pictures are said to be of before, and the place is a click away.
    desk.browser.execute("location.hash = 'scene=room'")?;
    desk.wait_for_text(|text| text == ROOM)?;
    desk.browser
        .wait_for_text("#saved", |text| text == "saved")?;
    desk.browser.execute("document.querySelector('#text-panel').open = true; document.querySelector('#text').focus(); document.querySelector('#text').setSelectionRange(0, 0)")?;
    desk.browser.type_into("#text", "color = 3\n")?;
    let fault = desk
        .browser
        .wait_for_text("#fault", |text| text.contains("color"))?;
    assert!(
        fault.contains("The scene has an error") && fault.contains("Hint"),
        "{fault}"
    );
    let stale = "return document.querySelector('#frames').dataset.stale";
    assert_eq!(desk.browser.execute(stale)?, "true");
    let place = desk.browser.text("#fault-place")?;
    desk.browser.click("#fault-place")?;
    let marked = "const text = document.querySelector('#text'); return text.value.slice(text.selectionStart, text.selectionEnd)";
    assert!(place.starts_with("line "), "{place}");
    desk.browser.wait_for(
        "the place",
        || desk.browser.execute(marked),
        |marked| {
            marked
                .as_str()
                .is_some_and(|marked| marked.contains("color"))
        },
    )?;
    keep_picture(&desk.browser, "editor-fault")?;
    desk.undo_all()?;
    desk.browser.wait_for(
        "no fault",
        || {
            desk.browser
                .execute("return document.querySelector('#fault').hidden")
        },
        |hidden| *hidden == Value::Bool(true),
    )?;

    // What would leave the room stays in it, and that is said.
    let lines = ROOM
        .lines()
        .take_while(|line| !line.contains("[1200, 2400"));
    let place = format!("line {}, column 15", lines.count() + 1);
    desk.drag((1.2, 2.4), (-2.2, 0.0))?;
    desk.browser.wait_for_text("#fault", |text| {
        text.contains("Not changed") && text.contains("outside the room") && text.contains(&place)
    })?;
    assert_eq!(desk.text()?, ROOM);
    // A number likewise, in the field where it is typed.
    desk.choose("ceiling")?;
    let field = "#fields [data-key=\"sensor 0 elevation_deg\"]";
    desk.browser.execute(&format!(
        "const field = document.querySelector('{field}'); field.focus(); field.select()"
    ))?;
    desk.browser.type_into(field, "900")?;
    desk.browser
        .wait_for_text("#fault", |text| text.contains("elevation_deg"))?;
    let marked = format!("return document.querySelector('{field}').getAttribute('aria-invalid')");
    assert_eq!(desk.browser.execute(&marked)?, "true");
    desk.browser.press(ENTER)?;
    // Of 9 and 90, which stood there on the way, the last one stays.
    desk.wait_for_text(|text| text == ROOM)?;
    assert_quiet(&desk.browser, "")
}

#[test]
fn the_map_of_where_a_person_is_seen_is_hatched_over_the_plan() -> Outcome {
    if left_out("the_map_of_where_a_person_is_seen_is_hatched_over_the_plan") {
        return Ok(());
    }
    let desk = Desk::new()?;
    // The sensors of the repository's bedroom have noise to be seen above.
    let bedroom = grideye_tests::programs::root().join("scenes/bedroom.toml");
    fs::copy(bedroom, desk.file("bedroom.toml"))?;
    desk.open("bedroom")?;
    assert!(!desk.is_hatched()?);
    desk.browser.click("#cover")?;
    let share =
        |text: &str| -> Option<u32> { text.split(", ").nth(1)?.split(' ').next()?.parse().ok() };
    let words = desk
        .browser
        .wait_for_text("#cover-words", |text| text.contains("is detected at"))?;
    // The legend has the hatches of the map.
    let kinds = "return [...document.querySelectorAll('#cover-legend .swatch')].map((swatch) => swatch.toDataURL()).filter((one, index, all) => all.indexOf(one) === index).length";
    assert_eq!(desk.browser.execute(kinds)?, 4);
    assert!(desk.is_hatched()?);
    // As `grideye coverage` counts, whose cells are the same.
    let told = run(grideye()
        .args(["coverage", "--json"])
        .arg(desk.file("bedroom.toml")));
    let told: Value =
        serde_json::from_str(&told.stdout).map_err(|error| format!("{error}: {told:?}"))?;
    let found = [&told["totals"]["detected"], &told["totals"]["places"]].map(Value::to_string);
    let shown = [6, 8].map(|word| words.split(' ').nth(word).unwrap_or_default().to_owned());
    assert_eq!(shown, found, "{words}");

    // In a corner the sensor sees less of the floor; the map follows.
    let first = share(&words).ok_or("no share")?;
    desk.drag((2.1, 1.8), (1.8, -1.5))?;
    desk.browser.wait_for_text("#cover-words", |text| {
        share(text).is_some_and(|now| now < first)
    })?;
    keep_picture(&desk.browser, "editor-coverage")?;
    desk.browser.click("#cover")?;
    assert!(!desk.is_hatched()?);
    assert_quiet(&desk.browser, "")
}

#[test]
fn everything_is_done_by_keys_alone() -> Outcome {
    if left_out("everything_is_done_by_keys_alone") {
        return Ok(());
    }
    let desk = Desk::new()?;
    let browser = &desk.browser;
    browser.open(&format!("{}/", desk.collector.url()))?;
    browser.wait_for_text("nav", |text| text.contains("Scenes"))?;
    browser.press("e")?;
    let ready = || browser.execute("return document.querySelector('main')?.dataset.ready ?? ''");
    browser.wait_for("the editor", ready, |is| is == "true")?;
    // The first of the folder is the broken one: the list of scenes is reached by Tab.
    desk.tab_to("scene")?;
    browser.press("r")?;
    desk.wait_for_text(|text| text == ROOM)?;
    browser.wait_for_text("#saved", |text| text == "saved")?;
    desk.tab_to("plan")?;

    // Room, stove: moved, raised, turned.
    browser.press(".")?;
    browser.press(".")?;
    browser.wait_for_text("#fields-title", |title| title == "Object stove")?;
    browser.press(RIGHT)?;
    desk.wait_for_text(|text| text.contains("[2050, 2000, 0]"))?;
    browser.press_together(&[SHIFT, UP])?;
    desk.wait_for_text(|text| text.contains("[2050, 2500, 0]"))?;
    browser.press("[")?;
    desk.wait_for_text(|text| text.contains("yaw_deg = 5\n"))?;
    // The one before the room is the last: the sensor at the wall, lowered and tilted.
    browser.press(",")?;
    browser.press(",")?;
    browser.wait_for_text("#fields-title", |title| title == "Sensor wall")?;
    browser.press(PAGE_DOWN)?;
    desk.wait_for_text(|text| text.contains("[2000, 4000, 1950]"))?;
    browser.press("t")?;
    desk.wait_for_text(|text| text.contains("elevation_deg = 35"))?;
    // Its numbers, and back.
    browser.press(ENTER)?;
    browser.wait_for(
        "the field",
        || browser.execute("return document.activeElement.dataset.key"),
        |key| key == "sensor 1 name",
    )?;
    browser.press(ENTER)?;

    // New things, the same once more, a way, and away with it.
    browser.press("n")?;
    browser.press("s")?;
    browser.wait_for_text("#fields-title", |title| title == "Sensor sensor-1")?;
    let frames = || browser.execute("return document.querySelectorAll('#frames figure').length");
    browser.wait_for("three pictures", frames, |count| *count == 3)?;
    browser.press("d")?;
    browser.wait_for("four pictures", frames, |count| *count == 4)?;
    browser.press(DELETE)?;
    browser.wait_for("three pictures", frames, |count| *count == 3)?;
    browser.press("n")?;
    browser.press("p")?;
    browser.wait_for_text("#fields-title", |title| title == "Person person 1")?;
    browser.press("w")?;
    browser.wait_for_text("#fields-title", |title| title == "Waypoint 2 of person 1")?;
    browser.press(RIGHT)?;
    let text = desk.wait_for_text(|text| text.contains("trajectories/room-person-1.csv"))?;
    browser.press("c")?;
    // These sensors have no noise, and that is said.
    browser.wait_for_text("#cover-words", |words| words.contains("no noise"))?;
    browser.press_together(&[CONTROL, "s"])?;
    desk.saved()?;
    assert_eq!(desk.disk("room.toml")?, text);
    assert_eq!(
        desk.disk("trajectories/room-person-1.csv")?.lines().count(),
        3
    );
    // The list of keys is there.
    browser.press("?")?;
    browser.wait_for_text("#keys", |text| {
        text.contains("Ctrl Shift Z") && text.contains("add a waypoint")
    })?;
    assert_quiet(browser, "")
}

#[test]
fn the_editor_fits_a_telephone_and_both_schemes() -> Outcome {
    if left_out("the_editor_fits_a_telephone_and_both_schemes") {
        return Ok(());
    }
    let desk = Desk::new()?;
    for (width, height, mobile) in [
        (390, 844, true),
        (820, 1180, true),
        (1600, 1000, false),
        (2560, 1440, false),
    ] {
        desk.browser.set_screen(Screen {
            width,
            height,
            scale: 1.0,
            mobile,
        })?;
        for scheme in ["light", "dark"] {
            desk.browser.prefer_scheme(scheme)?;
            desk.open("room")?;
            desk.choose("ceiling")?;
            let wide = desk
                .browser
                .execute("return document.documentElement.scrollWidth - innerWidth")?;
            assert!(
                wide.as_f64().is_some_and(|wide| wide <= 0.0),
                "{width} {scheme}: {wide}"
            );
            keep_picture(&desk.browser, &format!("editor-{width}-{scheme}"))?;
        }
    }
    assert_quiet(&desk.browser, "")
}
