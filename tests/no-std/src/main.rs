//! A program without std or an allocator that reads an emulated sensor with both drivers. It is linked, not run.
#![no_std]
#![no_main]

use amg8833::{Amg8833, Settings, asynch, word};
use amg8833_emulator::{Address, Bus, Clock};
use core::cell::Cell;
use core::hint::black_box;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use core::time::Duration;
use grideye_frame::{Celsius, Frame};

/// A clock that advances by the time of the bus and the driver.
struct Time(Cell<Duration>);

impl Clock for Time {
    fn now(&self) -> Duration {
        self.0.get()
    }

    fn pass(&self, bus_time: Duration) {
        self.0.set(self.0.get() + bus_time);
    }
}

struct Delay<'t>(&'t Time);

impl embedded_hal::delay::DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        self.0.pass(Duration::from_nanos(ns.into()));
    }
}

impl embedded_hal_async::delay::DelayNs for Delay<'_> {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.pass(Duration::from_nanos(ns.into()));
    }
}

fn bus(time: &Time) -> Bus<&Time, Frame> {
    Bus::with_sensor(time, Address::High, Frame::uniform(Celsius::new(20.0)))
}

fn blocking(time: &Time) -> Option<Frame> {
    let mut sensor = Amg8833::new(bus(time), amg8833::Address::High);
    sensor.init(&mut Delay(time), &Settings::default()).ok()?;
    Some(word::frame(&sensor.read_frame().ok()?))
}

async fn asynchronous(time: &Time) -> Option<Frame> {
    let mut sensor = asynch::Amg8833::new(bus(time), amg8833::Address::High);
    let settings = Settings::default();
    sensor.init(&mut Delay(time), &settings).await.ok()?;
    Some(word::frame(&sensor.read_frame().await.ok()?))
}

/// Where the linker has the program begin.
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    let time = black_box(Time(Cell::new(Duration::ZERO)));
    black_box(blocking(&time));
    let mut future = pin!(asynchronous(&time));
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(frame) = future.as_mut().poll(&mut context) {
            black_box(frame);
            halt();
        }
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    halt()
}

fn halt() -> ! {
    loop {
        core::hint::spin_loop();
    }
}
