//! grideye 0.3 from crates.io and this package, with the emulated sensor in the test's own process: no device, no
//! waiting.

use std::cell::RefCell;
use std::time::Duration;

use amg8833_emulator::{Address, Bus, ManualClock, SharedBus};
use grideye::{Address as DriverAddress, Framerate, GridEye};
use grideye_frame::{Celsius, Frame};
use grideye_scene::{Scene, Simulator};
use presence::{picture, room_c, somebody};

type Source = Box<dyn FnMut(Duration) -> Frame>;
type Sensor = RefCell<Bus<ManualClock, Source>>;

const PERSON: [(usize, usize); 4] = [(2, 0), (2, 1), (3, 0), (3, 1)];

/// The sensor in `room.toml`.
fn in_the_room() -> Sensor {
    let text = include_str!("../../room.toml");
    let no_files = |name: &str| panic!("the scene asks for {name}");
    let scene = Scene::parse(text, "room.toml", &no_files).unwrap().scene;
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    showing(move |t| {
        let seen = simulator.noisy(t, 42);
        seen.to_frame(Celsius::new(24.0)).unwrap()
    })
}

fn showing(source: impl FnMut(Duration) -> Frame + 'static) -> Sensor {
    let source: Source = Box::new(source);
    let sensor = Bus::with_sensor(ManualClock::new(), Address::High, source);
    sensor.clock().set(Duration::from_millis(100)); // its first frame
    RefCell::new(sensor)
}

fn driver(sensor: &Sensor) -> GridEye<SharedBus<'_, ManualClock, Source>> {
    GridEye::new(SharedBus::new(sensor), DriverAddress::Standard)
}

#[test]
fn the_person_is_where_the_scene_has_them() {
    let sensor = in_the_room();
    let picture = picture(&mut driver(&sensor)).unwrap();
    assert!((room_c(&picture) - 19.5).abs() <= 0.5, "{picture:?}");
    assert_eq!(somebody(&picture), PERSON);
}

#[test]
fn nobody_is_in_an_empty_room() {
    let sensor = showing(|_| Frame::uniform(Celsius::new(19.5)));
    let picture = picture(&mut driver(&sensor)).unwrap();
    assert_eq!((room_c(&picture), somebody(&picture)), (19.5, vec![]));
}

/// An hour passes in no time.
#[test]
fn once_a_second_is_once_a_second() {
    let sensor = showing(|t| Frame::uniform(Celsius::new(t.as_secs() as f32 / 60.0)));
    let mut driver = driver(&sensor);
    driver.set_framerate(Framerate::Fps1).unwrap();
    for minute in 1..=60 {
        let now = Duration::from_secs(60 * minute);
        sensor.borrow().clock().set(now);
        let room = room_c(&picture(&mut driver).unwrap());
        assert!((room - minute as f32).abs() <= 0.5, "{room} at {now:?}");
    }
}

#[test]
fn a_sensor_at_the_other_address_is_an_error() {
    let sensor = in_the_room();
    let mut driver = GridEye::new(SharedBus::new(&sensor), DriverAddress::Alternate);
    assert!(picture(&mut driver).is_err());
}
