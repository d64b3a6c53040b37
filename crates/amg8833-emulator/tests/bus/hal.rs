//! The emulated sensor on the traits of embedded-hal-async and embedded-hal 0.2.

use amg8833_emulator::{
    Address, Bus, BusError, Clock, IntPin, ManualClock, Mux, MuxAddress, PinError, SharedBus,
    WAIT_MAX,
};
use core::time::Duration;
use grideye_frame::{Celsius, Frame};
use std::cell::RefCell;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

type Source = fn(Duration) -> Frame;
type Sensor<'c> = RefCell<Bus<&'c ManualClock, Source>>;

/// -0.25 degrees; 31 degrees in second 2, for the INT pin.
fn visit(t: Duration) -> Frame {
    let celsius = if t.as_secs() == 2 { 31.0 } else { -0.25 };
    Frame::uniform(Celsius::new(celsius))
}

fn sensor(clock: &ManualClock) -> Sensor<'_> {
    let source: Source = visit;
    let bus = Bus::with_sensor(clock, Address::High, source);
    RefCell::new(bus.with_instant_transactions())
}

/// A multiplexer at 0x70 with the sensor on channel 3.
fn mux(clock: &ManualClock) -> Mux<&ManualClock, Source> {
    let mut channels = std::array::from_fn(|_| Bus::new(clock));
    channels[3] = sensor(clock).into_inner();
    let trunk = Bus::new(clock).with_instant_transactions();
    Mux::new(trunk, MuxAddress::FIRST, channels)
}

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// Polls a future to its end; more polls than any wait here needs count as a hang.
fn finish<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    let polls = (0..2_000_000).map(|_| future.as_mut().poll(&mut context));
    let ready = polls.filter_map(|poll| match poll {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    });
    ready.take(1).next().unwrap()
}

mod with_async {
    use super::*;
    use embedded_hal_async::digital::Wait;
    use embedded_hal_async::i2c::{I2c, Operation};

    #[test]
    fn a_bus_and_a_shared_bus_do_the_same_as_the_blocking_one() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        clock.set(ms(100));
        let mut pixel = [0; 2];
        let mut shared = SharedBus::new(&sensor);
        finish(shared.write_read(0x69, &[0x80], &mut pixel)).unwrap();
        assert_eq!(pixel, [0xFF, 0x0F]);
        finish(sensor.borrow_mut().write(0x69, &[0x02, 0x01])).unwrap();
        let mut rate = [0];
        finish(shared.transaction(
            0x69,
            &mut [Operation::Write(&[0x02]), Operation::Read(&mut rate)],
        ))
        .unwrap();
        assert_eq!(rate, [0x01]);
        let nobody = finish(shared.read(0x68, &mut rate));
        assert!(matches!(nobody, Err(BusError::NoAcknowledge { .. })));
        assert_eq!(sensor.borrow().traffic().transactions, 4);
    }

    #[test]
    fn a_multiplexer_is_an_asynchronous_bus() {
        let clock = ManualClock::new();
        let mut mux = mux(&clock);
        clock.set(ms(100));
        let mut pixel = [0; 2];
        assert!(finish(mux.write_read(0x69, &[0x80], &mut pixel)).is_err());
        finish(mux.write(0x70, &[1 << 3])).unwrap();
        finish(mux.write_read(0x69, &[0x80], &mut pixel)).unwrap();
        assert_eq!(pixel, [0xFF, 0x0F]);
    }

    fn alarm(sensor: &Sensor<'_>) {
        let mut bus = SharedBus::new(sensor);
        for pair in [[0x08, 0x78], [0x0A, 0xFF], [0x0B, 0x0F], [0x03, 0x03]] {
            finish(bus.write(0x69, &pair)).unwrap();
        }
    }

    #[test]
    fn a_lone_wait_ends_at_the_time_of_the_edge() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        alarm(&sensor);
        let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
        finish(pin.wait_for_high()).unwrap();
        assert_eq!(clock.now(), ms(0), "it is high already");
        finish(pin.wait_for_low()).unwrap();
        assert_eq!(clock.now(), ms(2_000));
        finish(pin.wait_for_low()).unwrap();
        assert_eq!(clock.now(), ms(2_000), "it is low already");
        finish(pin.wait_for_rising_edge()).unwrap();
        assert_eq!(clock.now(), ms(3_000));
    }

    #[test]
    fn edges_are_waited_for_and_levels_are_not_edges() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        alarm(&sensor);
        let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
        finish(pin.wait_for_falling_edge()).unwrap();
        assert_eq!(clock.now(), ms(2_000));
        finish(pin.wait_for_any_edge()).unwrap();
        assert_eq!(clock.now(), ms(3_000));
        clock.set(ms(3_050));
        let late = finish(pin.wait_for_falling_edge());
        assert_eq!(late, Err(PinError::Late), "low only once, in second 2");
        assert!(late.unwrap_err().to_string().contains("hint:"));
    }

    /// A visit that begins and ends between two polls still counts as an edge.
    #[test]
    fn no_edge_between_two_polls_is_missed() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        alarm(&sensor);
        let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
        let mut wait = pin!(pin.wait_for_falling_edge());
        let mut context = Context::from_waker(Waker::noop());
        assert!(wait.as_mut().poll(&mut context).is_pending());
        clock.set(ms(3_500));
        assert!(wait.as_mut().poll(&mut context).is_ready());
        assert_eq!(clock.now(), ms(3_500));
    }

    #[test]
    fn other_tasks_run_with_each_frame() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        alarm(&sensor);
        let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
        let mut wait = pin!(pin.wait_for_low());
        let mut context = Context::from_waker(Waker::noop());
        for frame in 1..20 {
            assert!(wait.as_mut().poll(&mut context).is_pending());
            assert_eq!(clock.now(), ms(100 * frame));
        }
        assert!(wait.as_mut().poll(&mut context).is_ready());
    }

    #[test]
    fn a_sensor_that_measures_nothing_is_waited_for_a_day() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        finish(SharedBus::new(&sensor).write(0x69, &[0x00, 0x10])).unwrap();
        let mut pin = SharedBus::new(&sensor).int_pin(Address::High);
        assert_eq!(finish(pin.wait_for_low()), Err(PinError::Late));
        assert_eq!(clock.now(), WAIT_MAX);
        let mut nobody: IntPin<'_, _, _> = SharedBus::new(&sensor).int_pin(Address::Low);
        assert_eq!(finish(nobody.wait_for_any_edge()), Err(PinError::Late));
        let held = sensor.borrow_mut();
        assert_eq!(finish(pin.wait_for_low()), Err(PinError::Borrowed));
        drop(held);
    }
}

mod with_0_2 {
    use super::*;
    use embedded_hal_02::blocking::i2c::{
        Operation, Read, Transactional, TransactionalIter, Write, WriteIter, WriteIterRead,
        WriteRead,
    };
    use embedded_hal_02::digital::v2::InputPin;

    #[test]
    fn every_trait_of_the_older_version_reaches_the_registers() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        clock.set(ms(100));
        let mut shared = SharedBus::new(&sensor);
        let mut two = [0; 2];
        WriteRead::write_read(&mut shared, 0x69, &[0x80], &mut two).unwrap();
        assert_eq!(two, [0xFF, 0x0F]);
        Write::write(&mut shared, 0x69, &[0x08, 0x78, 0x00]).unwrap();
        WriteIter::write(&mut shared, 0x69, [0x0A, 0xEC, 0x0F]).unwrap();
        Write::write(&mut shared, 0x69, &[0x09]).unwrap();
        Read::read(&mut shared, 0x69, &mut two).unwrap();
        assert_eq!(two, [0x00, 0xEC]);
        WriteIterRead::write_iter_read(&mut shared, 0x69, [0x0B], &mut two[..1]).unwrap();
        assert_eq!(two, [0x0F, 0xEC]);
        let exec = &mut [Operation::Write(&[0x08]), Operation::Read(&mut two)];
        Transactional::exec(&mut shared, 0x69, exec).unwrap();
        assert_eq!(two, [0x78, 0x00]);
        let operations = [Operation::Write(&[0x0A]), Operation::Read(&mut two)];
        TransactionalIter::exec_iter(&mut shared, 0x69, operations).unwrap();
        assert_eq!(two, [0xEC, 0x0F]);
        assert_eq!(sensor.borrow().traffic().transactions, 8);
    }

    #[test]
    fn a_multiplexer_is_a_bus_of_the_older_version() {
        let clock = ManualClock::new();
        let mut mux = mux(&clock);
        clock.set(ms(100));
        let mut pixel = [0; 2];
        assert!(WriteRead::write_read(&mut mux, 0x69, &[0x80], &mut pixel).is_err());
        Write::write(&mut mux, 0x70, &[1 << 3]).unwrap();
        WriteRead::write_read(&mut mux, 0x69, &[0x80], &mut pixel).unwrap();
        assert_eq!(pixel, [0xFF, 0x0F]);
    }

    #[test]
    fn the_bus_itself_has_them_too_and_its_errors_stay() {
        let clock = ManualClock::new();
        let mut bus = sensor(&clock).into_inner();
        let mut two = [0xA5; 2];
        WriteRead::write_read(&mut bus, 0x69, &[0x80], &mut two).unwrap();
        assert_eq!(two, [0, 0]);
        let nobody = Write::write(&mut bus, 0x68, &[0x00]);
        assert!(matches!(
            nobody,
            Err(BusError::NoAcknowledge { address: 0x68, .. })
        ));
    }

    #[test]
    fn the_int_pin_is_an_input_pin_of_the_older_version() {
        let clock = ManualClock::new();
        let sensor = sensor(&clock);
        let mut shared = SharedBus::new(&sensor);
        let pin = shared.int_pin(Address::High);
        assert!(InputPin::is_high(&pin).unwrap());
        Write::write(&mut shared, 0x69, &[0x03, 0x03]).unwrap();
        clock.set(ms(100));
        assert!(
            InputPin::is_low(&pin).unwrap(),
            "levels of zero: -0.25 trips"
        );
        let held = sensor.borrow_mut();
        assert_eq!(InputPin::is_low(&pin), Err(PinError::Borrowed));
        drop(held);
    }
}
