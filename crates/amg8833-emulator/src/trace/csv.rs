//! A bus trace as CSV, one row per message.

use crate::signal::{Acknowledge, BusError};
use crate::trace::file::{TRACE_BYTES_MAX, TraceFile};
use crate::trace::log::{Start, Transfer};
use alloc::format;
use alloc::string::String;
use core::fmt::Write as _;
use core::time::Duration;
use std::io::Write;

const HEADER: &str =
    "time_s,bus,transaction,start,address,direction,bytes,acknowledge,stop,end_s,error,faults\n";

/// A trace of one or several buses as a table: CSV with a header, one row per message.
///
/// | column | values |
/// |---|---|
/// | `time_s` | START on the bus's clock, seconds with nine decimals |
/// | `bus` | the name given to the observer |
/// | `transaction` | number of the transaction on its bus, from 1 |
/// | `start` | `S` START, `Sr` repeated START, `none` no adapter |
/// | `address` | seven bits, `0x69` |
/// | `direction` | `write`, `read` |
/// | `bytes` | `0x80 0x01`, what the controller sent or received |
/// | `acknowledge` | `ack`, `nack-address`, `nack-byte` (the last of the bytes) |
/// | `stop` | `P`; empty before a repeated START and where the controller gave up |
/// | `end_s` | the end, as `time_s` |
/// | `error` | `nack`, `bus-error`, `arbitration-loss`, `timeout`, `gone`, or empty |
/// | `faults` | names of [`FaultKind`](crate::FaultKind)s, separated by spaces |
pub type CsvTrace<W> = TraceFile<W, Table>;

/// The format of a [`CsvTrace`].
#[derive(Debug)]
pub struct Table;

impl<W: Write> CsvTrace<W> {
    /// A trace of at most [`TRACE_BYTES_MAX`] bytes.
    pub fn new(out: W) -> Self {
        Self::with_bytes_max(out, TRACE_BYTES_MAX)
    }

    /// A trace of at most this many bytes.
    pub fn with_bytes_max(out: W, bytes_max: u64) -> Self {
        Self::begin(out, HEADER, bytes_max, Table)
    }

    /// The observer for [`Bus::set_trace`](crate::Bus::set_trace); names the bus in the file.
    pub fn observer(&self, bus: &str) -> impl FnMut(&Transfer<'_>) + use<W> {
        let file = self.clone();
        let bus = cell(bus);
        move |transfer| file.message(|_, line| row(line, &bus, transfer))
    }
}

/// A name as one cell that no spreadsheet reads as a formula.
fn cell(name: &str) -> String {
    let quote = if name.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        "'"
    } else {
        ""
    };
    let name = format!("{quote}{name}");
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name
    }
}

fn row(line: &mut String, bus: &str, transfer: &Transfer<'_>) {
    let start = match transfer.start {
        Start::First => "S",
        Start::Repeated => "Sr",
        Start::Never => "none",
    };
    let direction = if transfer.reads { "read" } else { "write" };
    let acknowledge = match transfer.acknowledge {
        Acknowledge::All => "ack",
        Acknowledge::NotAddress => "nack-address",
        Acknowledge::NotLastByte => "nack-byte",
    };
    let stop = if transfer.stop { "P" } else { "" };
    let address = transfer.address;
    let transaction = transfer.transaction;
    // Writing to a string cannot fail.
    let _ = seconds(line, transfer.started);
    let _ = write!(
        line,
        ",{bus},{transaction},{start},0x{address:02x},{direction},"
    );
    for (place, byte) in transfer.bytes.iter().enumerate() {
        let space = if place == 0 { "" } else { " " };
        let _ = write!(line, "{space}0x{byte:02x}");
    }
    let _ = write!(line, ",{acknowledge},{stop},");
    let _ = seconds(line, transfer.ended);
    let error = transfer.error.map_or("", error_name);
    let _ = writeln!(line, ",{error},{}", transfer.faults);
}

fn seconds(line: &mut String, time: Duration) -> core::fmt::Result {
    write!(line, "{}.{:09}", time.as_secs(), time.subsec_nanos())
}

fn error_name(error: BusError) -> &'static str {
    match error {
        BusError::NoAcknowledge { .. } => "nack",
        BusError::Bus => "bus-error",
        BusError::ArbitrationLoss => "arbitration-loss",
        BusError::Timeout => "timeout",
        BusError::Gone => "gone",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_one_cell_and_no_formula() {
        let rows = [
            ("i2c-1", "i2c-1"),
            ("=1+1", "'=1+1"),
            ("-a", "'-a"),
            ("a,b", "\"a,b\""),
            ("@\"x\"", "\"'@\"\"x\"\"\""),
        ];
        for (name, written) in rows {
            assert_eq!(cell(name), written);
        }
    }
}
