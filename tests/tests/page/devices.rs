//! The page's view of the devices: how each one does, and what to do about it.

use grideye_agent::{deliver, queue, sampler, spool};
use grideye_frame::NoData;
use grideye_recording::wire::{LOST_BY_COLLECTOR, LOST_IN_MEMORY};
use grideye_tests::live_page::{
    Outcome, Server, assert_quiet, batch, frame, keep_picture, person, set_up,
};
use grideye_tests::webdriver::{Failure, left_out};
use serde_json::{Value, json};
use std::cell::Cell;

/// What an agent counts beside the reasons of missing frames.
const COUNTED: [&str; 18] = [
    deliver::BACKLOG_FORBIDDEN,
    deliver::SPOOL_DISK_FULL,
    deliver::SPOOL_FAILED,
    deliver::SPOOL_READ_ONLY,
    deliver::SPOOL_SLOW,
    queue::OTHER_FAULTS,
    queue::RING_FULL,
    queue::ROWS_DROPPED,
    sampler::BUS_HUNG,
    sampler::COUNT_ESTIMATED,
    sampler::GAP_NOT_LISTED,
    sampler::GLITCH_PIXEL,
    sampler::OUT_OF_STEP,
    sampler::THERMISTOR_LATE,
    spool::SPOOL_DAMAGED,
    spool::SPOOL_FULL,
    LOST_BY_COLLECTOR,
    LOST_IN_MEMORY,
];

/// Every kind of fault with what the page's source says of it.
fn advised() -> Result<Vec<(String, String)>, Failure> {
    let source = include_str!("../../../crates/grideye-collector/assets/advice.js");
    let reasons = NoData::ALL.iter().map(|reason| reason.name());
    let sentence = |kind: &str| {
        let after = source.split_once(&format!("\n  \"{kind}\": \""));
        let sentence = after.and_then(|(_, after)| after.split_once("\",\n"));
        let (sentence, _) = sentence.ok_or_else(|| format!("nothing is said of {kind}"))?;
        Ok((kind.to_owned(), sentence.replace("\\\"", "\"")))
    };
    reasons.chain(COUNTED).map(sentence).collect()
}

/// Whatever an agent counts has a sentence for the person who sees it.
#[test]
fn every_fault_that_is_counted_has_its_advice() -> Outcome {
    for (kind, sentence) in advised()? {
        assert!(sentence.ends_with('.'), "{kind}: {sentence}");
    }
    Ok(())
}

/// Posts frames of the sensor, which has read so many, with these counts.
fn post_counts(
    server: &Server,
    device: &str,
    seq: u64,
    dropped: &Value,
    errors: &Value,
) -> Outcome {
    let mut body = batch("i2c-1:0x69", seq, &[frame(&person(), 402)]);
    body["device"] = device.into();
    let lost: u64 = dropped
        .as_object()
        .into_iter()
        .flatten()
        .filter_map(|(_, count)| count.as_u64())
        .sum();
    body["sensors"][0]["account"] = json!({
        "read": seq + 1 + lost, "missing": 0, "dropped": dropped, "spooled": 1, "errors": errors
    });
    server.post(&body)
}

#[test]
fn every_kind_of_fault_is_told_with_its_remedy_on_the_page() -> Outcome {
    if left_out("every_kind_of_fault_is_told_with_its_remedy_on_the_page") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open(&server.url("/#devices"))?;
    let all = advised()?;
    // A few devices, each with a few kinds: an account names only so many.
    for (index, kinds) in (0..).zip(all.chunks(6)) {
        let counts: Value = kinds
            .iter()
            .map(|(kind, _)| (kind.clone(), json!(1)))
            .collect();
        post_counts(&server, &format!("pi-{index}"), 0, &json!({}), &counts)?;
    }
    post_counts(&server, "pi-r", 0, &json!({ "refused-422": 1 }), &json!({}))?;
    for clock in ["unsynced", "stepped"] {
        let mut body = batch("i2c-1:0x69", 0, &[frame(&person(), 402)]);
        body["device"] = format!("pi-{clock}").into();
        body["sensors"][0]["frames"][0]["clock"] = clock.into();
        server.post(&body)?;
    }
    let mut waiting = batch("i2c-1:0x69", 0, &[frame(&person(), 402)]);
    waiting["device"] = "pi-w".into();
    waiting["sensors"][0]["account"] =
        json!({ "read": 500, "missing": 0, "dropped": {}, "spooled": 500, "errors": {} });
    server.post(&waiting)?;
    let others = [
        "The collector refused frames: the agent's spool folder lists them",
        "The device's clock was never set: give it a network with NTP",
        "The device's clock just jumped",
        "The device is sending spooled frames",
    ];
    let sentences = all.iter().map(|(_, sentence)| sentence.as_str());
    for sentence in sentences.chain(others) {
        browser.wait_for_text("#device-list", |text| text.contains(sentence))?;
    }
    assert_quiet(&browser, "")
}

#[test]
fn a_fault_of_before_is_past_and_the_same_fault_again_is_to_be_looked_at() -> Outcome {
    if left_out("a_fault_of_before_is_past_and_the_same_fault_again_is_to_be_looked_at") {
        return Ok(());
    }
    let (mut server, browser, folder) = set_up()?;
    browser.open(&server.url("/#devices"))?;
    let (none, remedy) = (json!({}), "The sensor does not answer at its address");
    let seq = Cell::new(0);
    // Posts again and again, as an agent does: a device that is silent for seconds is told as such.
    let wait_for = |server: &Server, nacks: u64, state: &str| {
        let look = || {
            post_counts(server, "pi-1", seq.get(), &none, &json!({ "nack": nacks }))?;
            seq.set(seq.get() + 1);
            browser.text(".device [data-field=state]")
        };
        browser
            .wait_for(state, look, |text| text == state)
            .map(drop)
    };
    wait_for(&server, 7, "needs attention")?;
    browser.wait_for_text(".device [data-field=advice]", |text| text.contains(remedy))?;
    assert_eq!(browser.text(".device [data-field=past]")?, "");

    // A collector that is started again knows the count, and that nothing was added to it since.
    server.end()?;
    server.begin(&folder.path().join("frames.sqlite"))?;
    wait_for(&server, 7, "OK")?;
    assert_eq!(
        browser.text(".device [data-field=past]")?,
        "Earlier, but not in the last 5 min: nack 7."
    );
    assert_eq!(browser.text(".device [data-field=errors]")?, "nack 7");
    keep_picture(&browser, "devices-past")?;
    wait_for(&server, 8, "needs attention")?;
    browser.wait_for_text(".device [data-field=advice]", |text| text.contains(remedy))?;
    assert_eq!(browser.text(".device [data-field=past]")?, "");
    assert_quiet(&browser, "ERR_CONNECTION_REFUSED")
}

#[test]
fn rate_age_version_and_configuration_are_those_that_the_agent_sent() -> Outcome {
    if left_out("rate_age_version_and_configuration_are_those_that_the_agent_sent") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.open(&server.url("/#devices"))?;
    let posted = Cell::new(0);
    let post = |spool: &str| -> Outcome {
        let set_up = json!({
            "post_every_ms": 500, "ring_frames": 10_000, "spool": spool,
            "sensors": { "i2c-1:0x69": { "part": "AMG8833", "rate_hz": 10, "moving_average": true } }
        });
        let body = batch("i2c-1:0x69", posted.get(), &vec![frame(&person(), 402); 5]);
        posted.set(posted.get() + 5);
        ureq::post(server.url("/v1/frames"))
            .header("user-agent", "grideye-agent/1.2.3")
            .header("grideye-configuration", set_up.to_string())
            .send_json(body)?;
        Ok(())
    };
    let says = |spool: &str, field: &str, wanted: &str| {
        let selector = format!(".device dl [data-field={field}]");
        let look = || {
            post(spool)?;
            browser.text(&selector)
        };
        browser
            .wait_for(field, look, |text| text == wanted)
            .map(drop)
    };
    says("outage", "rate", "10.00 Hz")?;
    says("outage", "version", "1.2.3")?;
    let set_up = |spool: &str| {
        format!("sends every 500 ms · spool: {spool} · i2c-1:0x69: AMG8833, 10 Hz, moving average")
    };
    says("outage", "configuration", &set_up("outage"))?;
    // The last one that was sent.
    says("always", "configuration", &set_up("always"))?;
    // From now on nothing comes, and the age grows by the second.
    let age = || -> Result<f64, Failure> {
        let text = browser.text(".device dl [data-field=age]")?;
        let seconds = text.strip_suffix(" s ago").ok_or_else(|| text.clone())?;
        Ok(seconds.parse()?)
    };
    let first = age()?;
    browser.wait_for("its age", age, |age| *age >= first + 2.0)?;
    assert_quiet(&browser, "")
}

#[test]
fn a_device_in_trouble_is_shown_with_what_to_do() -> Outcome {
    if left_out("a_device_in_trouble_is_shown_with_what_to_do") {
        return Ok(());
    }
    let (server, browser, _folder) = set_up()?;
    browser.click("nav [data-view=devices]")?;
    browser.wait_for_text("#devices", |text| {
        text.contains("No device has sent anything yet")
    })?;
    let mut body = batch("i2c-1:0x69", 0, &vec![frame(&person(), 402); 5]);
    // The agent counts as spooled what is on its way: four are left when these five have come.
    body["sensors"][0]["account"] = json!({
        "read": 12, "missing": 0, "dropped": { "ring-full": 3 }, "spooled": 9, "errors": { "nack": 7, "bus-timeout": 2 }
    });
    server.post(&body)?;
    browser.wait_for_text("#devices", |text| text.contains("pi-1"))?;
    let shown = browser.text("#devices")?;
    for said in [
        "needs attention",
        "i2c-1:0x69",
        "ring-full 3",
        "nack 7, bus-timeout 2",
        "synced",
        // The most frequent fault first, each with its remedy.
        "The sensor does not answer at its address",
        "Something holds the bus low",
        "Frames came faster than the agent could send or store them",
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
        text.starts_with("The device is silent: check that the agent runs")
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
    browser.wait_for_text(".device [data-field=state]", |text| text == "OK")?;
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
        text.contains("Two agents send as pi-1 (boots b1, b2): give each its own")
    })?;
    keep_picture(&browser, "rivals")?;
    assert_quiet(&browser, "")
}
