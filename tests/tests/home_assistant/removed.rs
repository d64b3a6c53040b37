//! What remains on the broker after a kill, a restart, silence or a removal.

use crate::feed::{Feed, ID, collector, varied};
use crate::kept::{
    config_topics, is_availability, state_topic, wait_for_availability, wait_until_kept,
};
use grideye_tests::broker::Broker;
use grideye_tests::patience::wait_for;
use grideye_tests::programs::{grideye, run};
use serde_json::Value;

#[test]
fn a_killed_collectors_last_will_is_published_and_the_next_one_finds_its_messages() {
    let what = "a_killed_collectors_last_will_is_published_and_the_next_one_finds_its_messages";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let mut first = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&first, 0, vec![varied()]);
    wait_until_kept(&broker, Some("online"));
    let subscriber = broker.subscribe();
    wait_for_availability(&subscriber, "bridge", "online");
    first.kill();
    let will = wait_for_availability(&subscriber, "bridge", "offline");
    assert!(!will.retained, "it was said now");
    let seq = feed.stop();
    // Nobody sends to the next collector: the bridge is online, the sensor is not, although the broker still said so.
    let second = collector(at.path(), &broker.url(), &["--mqtt-silent-after", "2"]);
    wait_until_kept(&broker, Some("offline"));
    let _feed = Feed::start(&second, seq, vec![varied()]);
    wait_until_kept(&broker, Some("online"));
    assert_eq!(second.stop().code, 0);
    wait_for("the end of the bridge", || {
        let kept = broker.kept();
        kept.iter()
            .any(|heard| is_availability(heard, "bridge", "offline"))
            .then_some(())
    });
}

#[test]
fn a_broker_that_lost_everything_gets_everything_again() {
    let what = "a_broker_that_lost_everything_gets_everything_again";
    let Some(mut broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let collector = collector(at.path(), &broker.url(), &[]);
    let _feed = Feed::start(&collector, 0, vec![varied()]);
    wait_until_kept(&broker, Some("online"));
    broker.kill();
    let fault = wait_for("the loss of the broker", || {
        let status = collector.json("/v1/mqtt");
        status["fault"].is_object().then_some(status)
    });
    assert_eq!(fault["connected"], false);
    assert!(broker.resume(), "mosquitto does not start again");
    wait_until_kept(&broker, Some("online"));
    let subscriber = broker.subscribe();
    subscriber.wait_for("a state", |heard| heard.topic == state_topic());
    // When Home Assistant restarts, it gets the configuration and the values at once.
    broker.publish("homeassistant/status", b"online", false);
    let camera = config_topics().remove(1);
    subscriber.wait_for_next("the configuration once more", |heard| {
        heard.topic == camera && !heard.retained && !heard.payload.is_empty()
    });
    let status = collector.json("/v1/mqtt");
    assert_eq!(
        (&status["connected"], &status["fault"]),
        (&true.into(), &Value::Null)
    );
}

#[test]
fn a_sensor_that_is_removed_leaves_nothing_behind() {
    let what = "a_sensor_that_is_removed_leaves_nothing_behind";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let collector = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&collector, 0, vec![varied()]);
    wait_until_kept(&broker, Some("online"));
    let forget = |sensor: &str| {
        run(grideye().args(["mqtt", "forget", "pi-1", sensor, "--mqtt", &broker.url()]))
    };
    let unknown = forget("s2");
    assert_eq!(unknown.code, 1, "{unknown:?}");
    assert!(
        unknown
            .stderr
            .contains("keeps nothing of the sensor s2 of pi-1\nhint: "),
        "{unknown:?}"
    );
    let forgotten = forget("s1");
    assert_eq!(forgotten.code, 0, "{forgotten:?}");
    assert!(
        forgotten.stdout.contains("removed the sensor s1 of pi-1"),
        "{forgotten:?}"
    );
    wait_until_kept(&broker, None);
    // The agent keeps sending, and the sensor stays removed.
    let subscriber = broker.subscribe();
    let stored = || {
        collector.json("/v1/sensors")["sensors"][0]["stored"]
            .as_u64()
            .unwrap()
    };
    let before = stored();
    wait_for("more frames", || (stored() > before + 20).then_some(()));
    assert_eq!(subscriber.find(|heard| heard.topic.contains(ID)), None);
    feed.stop();
}

#[test]
fn a_sensor_that_is_silent_is_unavailable_and_in_time_removed() {
    let what = "a_sensor_that_is_silent_is_unavailable_and_in_time_removed";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    // 0.0001 days are 8.64 s.
    let bounds = ["--mqtt-silent-after", "2", "--mqtt-forget-after", "0.0001"];
    let collector = collector(at.path(), &broker.url(), &bounds);
    let feed = Feed::start(&collector, 0, vec![varied()]);
    wait_until_kept(&broker, Some("online"));
    let subscriber = broker.subscribe();
    feed.stop();
    subscriber.wait_for("the silence", |heard| is_availability(heard, ID, "offline"));
    wait_until_kept(&broker, None);
}
