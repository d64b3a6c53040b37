//! Bus traces, message by message: for a closure, a table, or a logic analyzer.
//!
//! ```
//! # #[cfg(feature = "std")] {
//! use amg8833_emulator::trace::CsvTrace;
//! use amg8833_emulator::{Address, Bus, ManualClock};
//! use embedded_hal::i2c::I2c;
//! use grideye_frame::{Celsius, Frame};
//!
//! let clock = ManualClock::new();
//! let mut bus = Bus::with_sensor(&clock, Address::High, Frame::uniform(Celsius::new(20.0)));
//! let trace = CsvTrace::new(std::io::stdout());
//! bus.set_trace(trace.observer("i2c-1"));
//! bus.write(0x69, &[0x02, 0x01]).unwrap();
//! assert_eq!(trace.finish().unwrap().messages, 1);
//! # }
//! ```

#[cfg(feature = "alloc")]
mod log;
#[cfg(not(feature = "alloc"))]
#[path = "trace/no_log.rs"]
mod log;

pub use crate::signal::Acknowledge;
pub(crate) use log::Log;
#[cfg(feature = "std")]
mod csv;
#[cfg(feature = "std")]
mod file;
#[cfg(feature = "std")]
mod vcd;

#[cfg(feature = "std")]
pub use csv::{CsvTrace, Table};
#[cfg(feature = "std")]
pub use file::{TRACE_BYTES_MAX, TraceFile, TraceSummary};
#[cfg(feature = "alloc")]
pub use log::{Start, Transfer};
#[cfg(feature = "std")]
pub use vcd::{Drawing, VcdTrace};
