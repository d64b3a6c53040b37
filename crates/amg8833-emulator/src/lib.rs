#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

mod bus;
mod clock;
mod device;
mod fault;
mod hal;
mod mux;
#[cfg(feature = "alloc")]
pub mod script;
mod shared;
mod signal;
mod source;
pub mod trace;
mod word;

pub use bus::{Bus, Carry, Open, SCL_HZ, STEPS_MAX};
pub use clock::Clock;
#[cfg(target_has_atomic = "64")]
pub use clock::ManualClock;
pub use device::edge::{EDGES_MAX, Edge, PinEdge};
pub use device::options::{
    AfterWake, AverageReadback, CATCH_UP_FRAMES_MAX, InitialReset, InterruptFlag, InterruptOutput,
    Options, OverflowFlag, PastTheEnd, SleepImage, StandBy, StatusClear, ThermistorUpdate,
    UnspecifiedBits, WarmUp, ZeroLevels,
};
pub use device::registers::Refusals;
pub use device::ticks::{CLOCK_ERROR_PPM_MAX, DRIFT_STRETCH_MAX, Drift, DriftCurve, DriftError};
pub use device::{Device, SILENT_START, SLEEP_MIN};
pub use fault::active::FAULTS_MAX;
pub use fault::{Chance, Fault, FaultCounts, FaultKind, FaultSet, Unit};
pub use mux::{CHANNELS, Mux, MuxAddress};
pub use shared::{IntPin, PinEdges, PinError, SharedBus, WAIT_MAX};
pub use signal::{Ack, Address, BusError, HANG_TIMEOUT, InterruptPin, Traffic};
pub use source::FrameSource;
