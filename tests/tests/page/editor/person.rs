//! People: added, changed field by field, turned, sent on a way and copied, by hand and by keys.

use super::desk::*;
use grideye_tests::live_page::{Outcome, assert_quiet, keep_picture};
use grideye_tests::webdriver::{Failure, left_out};
use serde_json::Value;

const DOWN: &str = "\u{E015}";

/// The person after the two of the room.
const BODY: &str = "agent 2 person";

/// Chooses the word that is `steps` below the one in a field, by keys.
fn step_down(desk: &Desk, key: &str, steps: usize) -> Outcome {
    desk.browser.execute(&format!(
        "document.querySelector('#fields [data-key=\"{key}\"]').focus()"
    ))?;
    for _ in 0..steps {
        desk.browser.press(DOWN)?;
    }
    Ok(())
}

fn value(desk: &Desk, key: &str) -> Result<Value, Failure> {
    desk.browser.execute(&format!(
        "return document.querySelector('#fields [data-key=\"{key}\"]')?.value ?? null"
    ))
}

/// A waypoint of the selection.
fn waypoint(desk: &Desk, row: usize) -> Result<Meters, Failure> {
    let meters = |axis: usize| -> Result<f64, Failure> {
        let value = value(desk, &format!("way {row} {axis}"))?;
        Ok(value.as_str().ok_or("no waypoint")?.parse::<f64>()? / 1000.0)
    };
    Ok((meters(0)?, meters(1)?))
}

/// Where the mark before the person with that name points, degrees.
fn faces(desk: &Desk, name: &str) -> Result<Option<f64>, Failure> {
    let faces = desk
        .browser
        .execute("return document.querySelector('#plan').dataset.faces")?;
    let mut lines = faces.as_str().unwrap_or_default().lines();
    let line = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
    Ok(line.and_then(|degrees| degrees.parse().ok()))
}

fn wait_for_faces(desk: &Desk, name: &str, degrees: f64) -> Outcome {
    let is_there = |now: &Option<f64>| now.is_some_and(|now| near(now, degrees, 0.01));
    desk.browser
        .wait_for("the front", || faces(desk, name), is_there)
        .map(drop)
}

/// Types a number that is not allowed: the error names the limits that the field has, and the text stays.
fn refuses(desk: &Desk, key: &str, number: &str) -> Outcome {
    let field = format!("#fields [data-key=\"{key}\"]");
    let limits = format!(
        "const field = document.querySelector('{field}'); field.focus(); field.select(); return `${{field.min}} to ${{field.max}}`"
    );
    let limits = desk.browser.execute(&limits)?;
    let limits = limits.as_str().ok_or("no limits")?;
    desk.browser.type_into(&field, number)?;
    desk.browser.wait_for_text("#fault", |fault| {
        fault.contains(limits) && fault.contains("Hint") && fault.contains("line ")
    })?;
    desk.browser.press(ENTER)
}

/// The room with a person in it, before the first sensor.
fn with_person(keys: &str) -> String {
    let agent = format!("[[agent]]\nname = \"person 1\"\n{keys}\n\n");
    ROOM.replacen("[[sensor]]", &format!("{agent}[[sensor]]"), 1)
}

/// Changes each key of a person with all defaults: the text by that key alone, and what both sensors see.
fn change_each(desk: &Desk, mut text: String) -> Result<String, Failure> {
    let mut body = "person = {}".to_owned();
    let mut pictures = desk.pictures()?;
    for (key, steps, written) in [
        ("height_mm", 0, "height_mm = 1500"),
        ("build", 1, "build = \"stout\""),
        ("posture", 2, "posture = \"sit\""),
        ("clothing", 1, "clothing = \"coat\""),
    ] {
        let field = format!("{BODY} {key}");
        if steps == 0 {
            desk.write(&field, "1500")?;
        }
        step_down(desk, &field, steps)?;
        let longer = match body.strip_suffix(" }") {
            Some(known) => format!("{known}, {written} }}"),
            None => format!("person = {{ {written} }}"),
        };
        text = text.replace(&body, &longer);
        body = longer;
        desk.wait_for_text(|now| now == text)?;
        pictures = desk.wait_for_other_pictures(&pictures)?;
    }
    desk.write("agent 2 yaw_deg", "90")?;
    text = text.replace(&body, &format!("{body}\nyaw_deg = 90"));
    desk.wait_for_text(|now| now == text)?;
    desk.wait_for_other_pictures(&pictures)?;
    Ok(text)
}

#[test]
fn a_person_is_added_and_every_field_changes_text_and_frames() -> Outcome {
    if left_out("a_person_is_added_and_every_field_changes_text_and_frames") {
        return Ok(());
    }
    let desk = Desk::new()?;
    let browser = &desk.browser;
    desk.open("room")?;
    browser.click("#add")?;
    browser.click("#new [data-kind=agent]")?;
    browser.wait_for_text("#fields-title", |title| title == "Person person 1")?;
    let added = desk.wait_for_text(|text| text != ROOM)?;
    let [x, y, _] = desk.triple(&added, "person 1", "position_mm")?;
    let wanted = with_person(&format!("position_mm = [{x}, {y}, 0]\nperson = {{}}"));
    assert_eq!(added, wanted);

    // Below the sensor at the ceiling, away from the stove and bob.
    desk.write("agent 2 position_mm 0", "1000")?;
    desk.write("agent 2 position_mm 1", "1500")?;
    let placed = with_person("position_mm = [1000, 1500, 0]\nperson = {}");
    desk.wait_for_text(|text| text == placed)?;
    let text = change_each(&desk, placed)?;
    wait_for_faces(&desk, "person 1", 90.0)?;
    // Her knees are ahead of her, and nothing is behind.
    desk.wait_for_name((1.0, 1.9), "person 1")?;
    desk.wait_for_name((1.0, 1.1), "")?;
    keep_picture(browser, "editor-person")?;

    // Reloaded, it is what was saved, and what the command line simulates.
    browser.press_together(&[CONTROL, "s"])?;
    desk.saved()?;
    assert_eq!(desk.disk("room.toml")?, text);
    desk.open("room")?;
    assert_eq!(desk.text()?, text);
    desk.choose("person 1")?;
    for (key, label, wanted) in [
        ("height_mm", "Height, mm", "1500"),
        ("build", "Build", "stout"),
        ("posture", "Posture", "sit"),
        ("clothing", "Clothing", "coat"),
    ] {
        let key = format!("{BODY} {key}");
        assert_eq!(value(&desk, &key)?, wanted);
        let named = browser.label(&format!("#fields [data-key=\"{key}\"]"))?;
        assert_eq!(named, label);
    }
    for sensor in ["ceiling", "wall"] {
        let shown = desk.celsius(sensor)?;
        let made = simulated(&desk, "room.toml", sensor)?;
        let mut pairs = shown.iter().zip(&made);
        assert!(
            pairs.all(|(one, other)| near(*one, *other, 0.13)),
            "{sensor}: {shown:?} {made:?}"
        );
    }
    assert_quiet(browser, "")
}

#[test]
fn words_of_a_person_become_numbers_and_defaults_within_the_limits() -> Outcome {
    if left_out("words_of_a_person_become_numbers_and_defaults_within_the_limits") {
        return Ok(());
    }
    let desk = Desk::new()?;
    let browser = &desk.browser;
    let text = with_person(
        "position_mm = [1000, 1500, 0]\nperson = { build = \"stout\", posture = \"sit\", clothing = \"coat\" }",
    );
    std::fs::write(desk.file("room.toml"), &text)?;
    desk.open("room")?;
    desk.choose("person 1")?;
    refuses(&desk, &format!("{BODY} height_mm"), "2900")?;
    desk.wait_for_text(|now| now == text)?;
    // The word that is the default needs no key.
    step_down(&desk, &format!("{BODY} posture"), 0)?;
    browser.press("s")?;
    desk.wait_for_text(|now| now == text.replace("posture = \"sit\", ", ""))?;
    browser.press_together(&[CONTROL, "z"])?;
    desk.wait_for_text(|now| now == text)?;

    // A number beside the word that it replaces, and back to the word.
    let [build, clothing] = ["build", "clothing"].map(|key| format!("{BODY} {key}"));
    step_down(&desk, &build, 1)?;
    desk.wait_for_text(|now| now == text.replace("\"stout\"", "1.15"))?;
    desk.write(&format!("{build} number"), "1.3")?;
    let stouter = text.replace("\"stout\"", "1.3");
    desk.wait_for_text(|now| now == stouter)?;
    assert_eq!(value(&desk, &build)?, "number");
    refuses(&desk, &format!("{build} number"), "2.1")?;
    step_down(&desk, &clothing, 1)?;
    let both = stouter.replace("\"coat\"", "2");
    desk.wait_for_text(|now| now == both)?;
    refuses(&desk, &format!("{clothing} number"), "4.1")?;
    browser.press_together(&[CONTROL, "s"])?;
    desk.saved()?;
    assert_eq!(desk.disk("room.toml")?, both);
    desk.open("room")?;
    desk.choose("person 1")?;
    assert_eq!(value(&desk, &format!("{build} number"))?, "1.3");
    step_down(&desk, &build, 0)?;
    browser.press("a")?;
    desk.wait_for_text(|now| now == both.replace("build = 1.3, ", ""))?;
    assert_quiet(browser, "")
}

#[test]
fn a_person_is_dragged_turned_sent_on_a_way_copied_and_deleted() -> Outcome {
    if left_out("a_person_is_dragged_turned_sent_on_a_way_copied_and_deleted") {
        return Ok(());
    }
    let desk = Desk::new()?;
    let browser = &desk.browser;
    // A table of its own keeps its comments.
    let person = "\n[agent.person] # Bob himself\nheight_mm = 1800 # with shoes\n";
    let bob = "size_mm = [300, 500, 1700]\ntemperature_c = 30\nposition_mm = [800, 3000, 0]\n";
    let first = ROOM.replace(
        bob,
        &format!("position_mm = [800, 2000, 0]\n{person}posture = \"stand\"\n"),
    );
    std::fs::write(desk.file("room.toml"), &first)?;
    desk.open("room")?;
    desk.choose("bob")?;
    desk.drag((0.8, 2.0), (0.4, -0.6))?;
    let text = desk.wait_for_text(|text| text != first)?;
    let [x, y, _] = desk.triple(&text, "bob", "position_mm")?;
    assert!(near(x, 1200.0, 30.0) && near(y, 1400.0, 30.0), "{x} {y}");
    wait_for_faces(&desk, "bob", 0.0)?;
    browser.press("}")?;
    browser.press("[")?;
    let text = desk.wait_for_text(|text| text.contains("yaw_deg = -40\n"))?;
    assert!(text.contains(person), "{text}");
    wait_for_faces(&desk, "bob", -40.0)?;

    // On a way it faces where it goes, and there is nothing to turn.
    browser.press("w")?;
    browser.wait_for_text("#fields-title", |title| title == "Waypoint 2 of bob")?;
    let text = desk.wait_for_text(|text| text.contains("trajectories/room-bob.csv"))?;
    assert!(text.contains(person) && !text.contains("posture"), "{text}");
    desk.choose("bob")?;
    assert_eq!(value(&desk, "agent 1 yaw_deg")?, Value::Null);
    assert_eq!(value(&desk, "agent 1 person posture")?, "walk");
    let no_handle = || desk.handle("#plan");
    browser.wait_for("no handle", no_handle, Option::is_none)?;
    let at = |row| waypoint(&desk, row);
    let first_at = at(0)?;
    let towards = |(x, y): Meters| (y - first_at.1).atan2(x - first_at.0).to_degrees();
    let second_at = at(1)?;
    wait_for_faces(&desk, "bob", towards(second_at))?;
    // Another waypoint, a step to the back of the second: there it has turned.
    desk.drag(second_at, (0.3, 0.1))?;
    desk.wait_for_text(|now| now == text)?;
    let turned = || Ok((faces(&desk, "bob")?, at(1)?));
    browser.wait_for(
        "the front along the way",
        turned,
        |(faces, at): &(Option<f64>, Meters)| {
            *at != second_at && faces.is_some_and(|faces| near(faces, towards(*at), 0.1))
        },
    )?;
    let before = faces(&desk, "bob")?.ok_or("no front")?;
    desk.choose("bob")?;
    desk.browser.press("w")?;
    browser.wait_for_text("#fields-title", |title| title == "Waypoint 3 of bob")?;
    browser.execute("const time = document.querySelector('#second'); time.value = time.max; time.dispatchEvent(new Event('input'))")?;
    let now = || faces(&desk, "bob");
    browser.wait_for("the front at the end", now, |now| {
        now.is_some_and(|now| !near(now, before, 5.0))
    })?;
    keep_picture(browser, "editor-person-walks")?;

    desk.choose("bob")?;
    browser.press("d")?;
    browser.wait_for_text("#fields-title", |title| title == "Person bob 1")?;
    let copied = desk.wait_for_text(|text| text.contains("trajectories/room-bob-1.csv"))?;
    assert_eq!(copied.matches(person.trim_start()).count(), 2, "{copied}");
    desk.write("agent 2 name", "rob")?;
    desk.wait_for_text(|now| now == copied.replace("\"bob 1\"", "\"rob\""))?;
    browser.click("#remove")?;
    desk.wait_for_text(|now| now == text)?;
    assert_quiet(browser, "")
}
