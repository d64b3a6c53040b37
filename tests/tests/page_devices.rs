//! The page's view of the devices: how each one does, and what to do about it.

use grideye_agent::{courier, keeper, ring, sampler, spool};
use grideye_frame::NoData;
use grideye_recording::wire::LOST_IN_MEMORY;
use grideye_tests::live_page::{Outcome, assert_quiet, batch, frame, keep_picture, person, set_up};
use grideye_tests::webdriver::left_out;
use serde_json::json;

/// Whatever an agent counts has a sentence for the person who sees it.
#[test]
fn every_fault_that_is_counted_has_its_advice() {
    let advice = include_str!("../../crates/grideye-collector/assets/advice.js");
    let counts = [
        courier::BACKLOG_FORBIDDEN,
        keeper::SPOOL_DISK_FULL,
        keeper::SPOOL_FAILED,
        keeper::SPOOL_READ_ONLY,
        ring::OTHER_FAULTS,
        ring::RING_FULL,
        ring::ROWS_DROPPED,
        sampler::BUS_HUNG,
        sampler::COUNT_ESTIMATED,
        sampler::GAP_NOT_LISTED,
        sampler::GLITCH_PIXEL,
        sampler::OUT_OF_STEP,
        sampler::THERMISTOR_LATE,
        spool::SPOOL_DAMAGED,
        spool::SPOOL_FULL,
        LOST_IN_MEMORY,
    ];
    let reasons = NoData::ALL.iter().map(|reason| reason.name());
    for name in reasons.chain(counts) {
        assert!(advice.contains(&format!("\n  \"{name}\": \"")), "{name}");
    }
}

#[test]
fn a_device_in_trouble_is_shown_with_what_to_do() -> Outcome {
    if left_out("a_device_in_trouble_is_shown_with_what_to_do") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.click("nav [data-view=devices]")?;
    browser.wait_for_text("#devices", |text| text.contains("No device has posted yet"))?;
    let mut body = batch("i2c-1:0x69", 0, &vec![frame(&person(), 402); 5]);
    // The agent counts as spooled what is on its way: four are left when these five have come.
    body["sensors"][0]["account"] = json!({
        "read": 12, "missing": 0, "dropped": { "ring-full": 3 }, "spooled": 9, "errors": { "nack": 7, "bus-timeout": 2 }
    });
    server.post(&body)?;
    browser.wait_for_text("#devices", |text| text.contains("pi-1"))?;
    let shown = browser.text("#devices")?;
    for said in [
        "look at this",
        "i2c-1:0x69",
        "ring-full 3",
        "nack 7, bus-timeout 2",
        "synced",
        // The most frequent fault first, each with its remedy.
        "The sensor does not answer at its address",
        "Something holds the bus low",
        "Frames came faster than they could be sent or kept",
    ] {
        assert!(shown.contains(said), "`{said}` is not in {shown}");
    }
    let (wiring, shorted) = (
        shown.find("does not answer at its address"),
        shown.find("holds the bus low"),
    );
    assert!(wiring < shorted, "{shown}");
    for (field, wanted) in [
        ("read", "12"),
        ("stored", "5"),
        ("backlog", "4"),
        ("clock", "synced"),
    ] {
        let selector = format!(".device dl [data-field={field}]");
        browser.wait_for_text(&selector, |text| text == wanted)?;
    }
    keep_picture(&browser, "devices")?;
    // Silence is told as such, and nothing of it looks well.
    browser.wait_for_text(".device [data-field=state]", |text| text == "silent")?;
    browser.wait_for_text(".device [data-field=advice]", |text| {
        text.starts_with("It is silent: see that the agent runs")
    })?;
    // The key leads back to the pictures.
    browser.press("d")?;
    browser.wait_for_text("#wall", |text| text.contains("i2c-1:0x69"))?;
    assert_eq!(browser.text("#devices")?, "");
    assert_quiet(&browser, "")
}

#[test]
fn a_device_that_does_well_has_nothing_to_do() -> Outcome {
    if left_out("a_device_that_does_well_has_nothing_to_do") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open(&server.url("/#devices"))?;
    let mut body = batch("i2c-1:0x69", 0, &vec![frame(&person(), 402); 5]);
    body["sensors"][0]["account"] =
        json!({ "read": 5, "missing": 0, "dropped": {}, "spooled": 0, "errors": {} });
    server.post(&body)?;
    browser.wait_for_text(".device [data-field=state]", |text| text == "well")?;
    assert_eq!(browser.text(".device [data-field=advice]")?, "");
    for none in ["dropped", "errors"] {
        assert_eq!(
            browser.text(&format!(".device [data-field={none}]"))?,
            "none"
        );
    }
    assert_quiet(&browser, "")
}

#[test]
fn two_machines_of_one_name_are_told_with_their_runs() -> Outcome {
    if left_out("two_machines_of_one_name_are_told_with_their_runs") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open(&server.url("/#devices"))?;
    // Turn by turn, as two agents would post.
    for seq in 0..6 {
        for boot in ["b1", "b2"] {
            let mut body = batch("i2c-1:0x69", seq, &[frame(&person(), 402)]);
            body["boot"] = boot.into();
            body["sensors"][0]["account"] =
                json!({ "read": seq + 1, "missing": 0, "dropped": {}, "spooled": 1, "errors": {} });
            server.post(&body)?;
        }
    }
    browser.wait_for_text(".device [data-field=advice]", |text| {
        text.contains("Two agents send as pi-1 (runs b1, b2): give each its own")
    })?;
    keep_picture(&browser, "rivals")?;
    assert_quiet(&browser, "")
}
