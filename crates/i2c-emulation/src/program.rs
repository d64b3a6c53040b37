//! Way 3 as a whole: `/dev/i2c-N` for one program, by [`fuse`] or [`preload`], whichever works here.

use crate::fuse::{self, Device};
use crate::ioctl::{AdapterMode, UnknownName, named};
use crate::preload;
use crate::rack::Rack;
pub use crate::run::{Ended, RunError, Way};
use std::fmt;
use std::path::PathBuf;
use std::process::Command;
use std::str::FromStr;

mod signals;

/// The way to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Via {
    /// FUSE where it works, otherwise preloading.
    #[default]
    Auto,
    /// FUSE only.
    Fuse,
    /// Preloading only.
    Preload,
}

/// How to run a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The way to use.
    pub via: Via,
    /// The adapter that every bus imitates.
    pub mode: AdapterMode,
    /// The kernel's FUSE device, `/dev/fuse`.
    pub fuse_device: PathBuf,
    /// Whether to pass signals for this process on to the program; see [`Chosen::run`].
    pub signals: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            via: Via::default(),
            mode: AdapterMode::default(),
            fuse_device: PathBuf::from("/dev/fuse"),
            signals: true,
        }
    }
}

/// A way that works for a program, and why it was chosen. `Display` prints both in one line.
#[derive(Debug)]
pub struct Chosen {
    way: Way,
    without_fuse: Option<RunError>,
    devices: Vec<String>,
}

/// Chooses the way to show the buses of `rack` to `command`, without starting it.
/// # Errors
/// What the way in [`Options::via`] lacks, or what both lack.
pub fn choose(rack: &Rack, options: &Options, command: &Command) -> Result<Chosen, RunError> {
    let devices: Vec<String> = rack.iter().map(|(number, _)| device_of(number)).collect();
    if devices.is_empty() {
        return Err(RunError::NoBus);
    }
    // Both ways would report a missing program; report it once, first.
    preload::find(command)?;
    let by_fuse = || fuse::probe_with(&options.fuse_device).map(|()| Way::Fuse);
    let by_preload = || preload::check(command).map(|()| Way::Preload);
    let (way, without_fuse) = match options.via {
        Via::Fuse => (by_fuse()?, None),
        Via::Preload => (by_preload()?, None),
        Via::Auto => match by_fuse() {
            Ok(way) => (way, None),
            Err(fuse) => match by_preload() {
                Ok(way) => (way, Some(fuse)),
                Err(preload) => return Err(RunError::NoWay(fuse.into(), preload.into())),
            },
        },
    };
    Ok(Chosen {
        way,
        without_fuse,
        devices,
    })
}

/// [`choose`], then [`Chosen::run`].
/// # Errors
/// Those of both.
pub fn run(rack: &Rack, options: &Options, command: &mut Command) -> Result<Ended, RunError> {
    choose(rack, options, command)?.run(rack, options, command)
}

impl Chosen {
    /// The way.
    #[must_use]
    pub const fn way(&self) -> Way {
        self.way
    }

    /// Runs `command` to its end with the buses of `rack` at `/dev/i2c-N`, and returns how it ended.
    ///
    /// If this process dies, the program gets SIGTERM (perhaps more than once), and its buses return ENOTCONN. With
    /// [`Options::signals`], this process passes SIGTERM and SIGHUP on to the program, and also SIGINT and SIGQUIT
    /// unless they come from the terminal, which signals the program itself. All handlers are restored afterward. Only
    /// one such run at a time handles signals.
    /// # Errors
    /// Why the program could not run with its buses; a program that ended badly is no error.
    pub fn run(
        &self,
        rack: &Rack,
        options: &Options,
        command: &mut Command,
    ) -> Result<Ended, RunError> {
        let handed_on = signals::HandedOn::begin(options.signals);
        handed_on.prepare(command);
        let started = |pid| handed_on.to(pid);
        match self.way {
            Way::Fuse => {
                let buses: Vec<_> = rack.iter().collect();
                let devices = buses.iter().map(|(number, bus)| Device {
                    path: device_of(*number).into(),
                    adapter: &*bus.0,
                });
                let devices: Vec<Device<'_>> = devices.collect();
                let fuse_device = &options.fuse_device;
                fuse::run_devices(&devices, options.mode, fuse_device, command, &started)
            }
            Way::Preload => preload::run_rack(rack, options.mode, command, &started),
        }
    }
}

fn device_of(number: u32) -> String {
    format!("/dev/i2c-{number}")
}

impl fmt::Display for Chosen {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} by {}", self.devices.join(", "), self.way)?;
        if let Some(reason) = &self.without_fuse {
            let reason = reason.to_string();
            let reason = reason.lines().next().unwrap_or_default();
            write!(formatter, " (no FUSE: {reason})")?;
        }
        Ok(())
    }
}

impl Via {
    /// All ways.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Fuse, Self::Preload];
}

impl fmt::Display for Via {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Auto => "auto",
            Self::Fuse => "fuse",
            Self::Preload => "preload",
        })
    }
}

impl FromStr for Via {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        named("way", &Self::ALL, name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rack_without_a_bus_is_refused() {
        let refused = choose(&Rack::new(), &Options::default(), &Command::new("true"));
        assert!(matches!(refused, Err(RunError::NoBus)));
    }
}
