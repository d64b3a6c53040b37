//! `--trace`: the log of the buses, as a table or as the lines that a logic analyzer shows.

use crate::exit::bad_input;
use crate::files::{self, Pending};
use amg8833_emulator::trace::{CsvTrace, TraceSummary, VcdTrace};
use anyhow::{Result, anyhow};
use grideye_rig::Observer;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// The first bytes of a trace as CSV and as VCD.
const FRONTS: [&[u8]; 2] = [b"time_s,b", b"$comment"];
const FRONT_BYTES: u64 = 8;

pub(super) struct TraceFile {
    path: PathBuf,
    pending: Pending,
    format: Format,
}

enum Format {
    Csv(CsvTrace<File>),
    Vcd(VcdTrace<File>),
}

impl TraceFile {
    pub(super) fn create(path: &Path, buses: usize) -> Result<Self> {
        let (ending, shown) = (files::end(path).unwrap_or_default(), path.display());
        if ending != "csv" && ending != "vcd" {
            return Err(files::unknown_end(path, ".csv or .vcd"));
        }
        if ending == "vcd" && buses > 1 {
            return Err(bad_input(anyhow!(
                "{shown} would draw one pair of lines, and there are {buses} buses\nhint: end the name with .csv, which has a column for the bus"
            )));
        }
        if holds_something_else(path) {
            return Err(bad_input(anyhow!(
                "{shown} is there already and is no trace of a bus\nhint: choose another name; nothing was changed"
            )));
        }
        let pending = Pending::of(&files::target(path));
        let opened = pending.and_then(|pending| Ok((pending.file().try_clone()?, pending)));
        let (file, pending) = opened.map_err(|error| {
            bad_input(anyhow!(
                "cannot write {shown}: {error}\nhint: name a file in a folder that you may write into"
            ))
        })?;
        let format = match ending == "csv" {
            true => Format::Csv(CsvTrace::new(file)),
            false => Format::Vcd(VcdTrace::new(file)),
        };
        Ok(Self {
            path: path.to_owned(),
            pending,
            format,
        })
    }

    pub(super) fn observer(&self, bus: u32) -> Observer {
        match &self.format {
            Format::Csv(trace) => Box::new(trace.observer(&format!("i2c-{bus}"))),
            Format::Vcd(trace) => Box::new(trace.observer()),
        }
    }

    pub(super) fn finish(&self) -> Result<String> {
        let path = self.path.display();
        let summary = self
            .summary()
            .and_then(|summary| self.pending.put().map(|()| summary));
        let summary = summary.map_err(|error| {
            anyhow!("cannot write the trace {path}: {error}\nhint: is there room on the disk?")
        })?;
        Ok(format!("trace {path}: {summary}"))
    }

    /// Completes the file after an error, unless nothing could reach the bus.
    pub(super) fn keep_unless_empty(&self) {
        if self.summary().is_ok_and(|summary| summary.messages > 0) {
            // The caller gets the earlier error.
            drop(self.pending.put());
        }
    }

    fn summary(&self) -> io::Result<TraceSummary> {
        match &self.format {
            Format::Csv(trace) => trace.finish(),
            Format::Vcd(trace) => trace.finish(),
        }
    }
}

/// Whether the path holds something other than a trace: recordings end in .csv too.
fn holds_something_else(path: &Path) -> bool {
    let Ok(there) = path.metadata() else {
        return false;
    };
    let mut front = Vec::new();
    let mut read = || File::open(path)?.take(FRONT_BYTES).read_to_end(&mut front);
    !there.is_file() || (there.len() > 0 && read().is_ok() && !FRONTS.contains(&front.as_slice()))
}
