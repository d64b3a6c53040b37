//! Way 3 as a whole: `/dev/i2c-N` for one program, by [`fuse`] or by [`preload`], whichever works here.
//!
//! | | [`Way::Fuse`] | [`Way::Preload`] |
//! |---|---|---|
//! | what the program has | a file of the kernel | intercepted calls of the C library |
//! | static programs | yes | no |
//! | set-user-ID programs | as root | no |
//! | 32-bit programs on a 64-bit machine | yes | no |
//! | the machine must allow | `/dev/fuse`, mounts, process_vm_readv | nothing |

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::str::FromStr;
use std::sync::Mutex;

use crate::ended::Ended as EndedBy;
use crate::fuse::{self, Device};
use crate::ioctl::AdapterMode;
use crate::preload;
use crate::rack::{Rack, SharedAdapter};

mod signals;

/// Which way is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Via {
    /// FUSE where it works, else preloading.
    #[default]
    Auto,
    /// FUSE or nothing.
    Fuse,
    /// Preloading or nothing.
    Preload,
}

/// Which way was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Way {
    /// A file of the kernel in a private mount namespace; see [`fuse`].
    Fuse,
    /// A preloaded library; see [`preload`].
    Preload,
}

/// How a program is run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which way is wanted.
    pub via: Via,
    /// Which adapter to be like, for every bus.
    pub mode: AdapterMode,
    /// The kernel's FUSE device, `/dev/fuse`.
    pub fuse_device: PathBuf,
    /// Whether signals to this process are the program's meanwhile; see [`Chosen::run`].
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

/// How a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Its exit code, or the signal that ended it.
    pub status: ExitStatus,
    /// The way that was taken.
    pub via: Way,
    /// How often it, or what it started, opened a device: 0 is a program that never looked.
    pub opens: u64,
}

/// Why a program could not be run with its buses, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The rack is empty.
    #[error("no bus to show the program\nhint: put at least one bus into the rack")]
    NoBus,
    /// A path that is no bus of i2c-dev.
    #[error("unknown device path {}\nhint: the path of bus N is /dev/i2c-N, for example /dev/i2c-1", device.display())]
    UnknownDevice {
        /// The path.
        device: PathBuf,
    },
    /// FUSE was asked for, or was the only way, and does not work.
    #[error(transparent)]
    Fuse(#[from] fuse::RunError),
    /// Preloading was asked for and does not work.
    #[error(transparent)]
    Preload(#[from] preload::RunError),
    /// Neither way works for this program on this machine.
    #[error("FUSE does not work here: {fuse}\nand preloading does not either: {preload}")]
    NoWay {
        /// Why not by FUSE.
        fuse: fuse::RunError,
        /// Why not by preloading.
        preload: preload::RunError,
    },
}

impl RunError {
    /// Whether the caller asked for something that is not there or not possible here (a wrong name, a static program, no
    /// FUSE), before the program had started; otherwise something failed on the way.
    #[must_use]
    pub const fn is_bad_input(&self) -> bool {
        use fuse::RunError as ByFuse;
        use preload::RunError as ByPreload;
        match self {
            Self::NoBus | Self::UnknownDevice { .. } | Self::NoWay { .. } => true,
            Self::Fuse(error) => !matches!(
                error,
                ByFuse::Serve { .. } | ByFuse::Wait { .. } | ByFuse::Setup { .. }
            ),
            Self::Preload(error) => {
                !matches!(error, ByPreload::Wait { .. } | ByPreload::Setup { .. })
            }
        }
    }
}

/// The bus that a device path means: 1 for `/dev/i2c-1`.
///
/// # Errors
/// [`RunError::UnknownDevice`] for every other path.
pub fn bus_number(device: &Path) -> Result<u32, RunError> {
    device
        .to_str()
        .and_then(|text| text.strip_prefix("/dev/i2c-"))
        .filter(|digits| *digits == "0" || !digits.starts_with(['0', '+']))
        .and_then(|digits| digits.parse().ok())
        .ok_or_else(|| RunError::UnknownDevice {
            device: device.to_owned(),
        })
}

/// A way that works for a program, and why it was taken. `Display` says both in one line.
#[derive(Debug)]
pub struct Chosen {
    way: Way,
    without_fuse: Option<fuse::RunError>,
    numbers: Vec<u32>,
}

/// Looks for the way to show the buses of `rack` to `command`. Nothing of it is started.
///
/// # Errors
/// What is missing for the way that is asked for in [`Options::via`], or for both.
pub fn choose(rack: &Rack, options: &Options, command: &Command) -> Result<Chosen, RunError> {
    let numbers: Vec<u32> = rack.iter().map(|(number, _)| number).collect();
    if numbers.is_empty() {
        return Err(RunError::NoBus);
    }
    // Both ways would say so; it is said once, before anything is tried.
    preload::find(command)?;
    let (way, without_fuse) = match options.via {
        Via::Fuse => {
            fuse::probe_with(&options.fuse_device)?;
            (Way::Fuse, None)
        }
        Via::Preload => {
            preload::check(command)?;
            (Way::Preload, None)
        }
        Via::Auto => match (
            fuse::probe_with(&options.fuse_device),
            preload::check(command),
        ) {
            (Ok(()), _) => (Way::Fuse, None),
            (Err(fuse), Ok(())) => (Way::Preload, Some(fuse)),
            (Err(fuse), Err(preload)) => return Err(RunError::NoWay { fuse, preload }),
        },
    };
    Ok(Chosen {
        way,
        without_fuse,
        numbers,
    })
}

/// [`choose`] and [`Chosen::run`] in one.
///
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
    /// When this process dies, however that happens, the program is sent SIGTERM (perhaps
    /// more than once), and its buses are dead (ENOTCONN).
    /// With [`Options::signals`], SIGTERM and SIGHUP that arrive meanwhile are handed on to the program, and so are
    /// SIGINT and SIGQUIT unless they come from the terminal, which signals the program itself; this process lives on
    /// until the program has ended. Afterwards all handlers are as before. One such run at a time has the signals.
    ///
    /// # Errors
    /// What failed on the way; a program that ended badly is no error.
    pub fn run(
        &self,
        rack: &Rack,
        options: &Options,
        command: &mut Command,
    ) -> Result<Ended, RunError> {
        let buses: Vec<(u32, Mutex<SharedAdapter>)> = rack
            .iter()
            .map(|(number, bus)| (number, Mutex::new(bus)))
            .collect();
        let handed_on = signals::HandedOn::begin(options.signals);
        signals::end_with_this_process(command);
        let started = |pid| handed_on.to(pid);
        let EndedBy { status, opens } = match self.way {
            Way::Fuse => {
                let devices: Vec<Device<'_>> = buses
                    .iter()
                    .map(|(number, bus)| Device {
                        path: device_of(*number),
                        adapter: bus,
                    })
                    .collect();
                fuse::run_devices(
                    &devices,
                    options.mode,
                    &options.fuse_device,
                    command,
                    &started,
                )?
            }
            Way::Preload => preload::run_rack(rack, options.mode, command, &started)?,
        };
        Ok(Ended {
            status,
            via: self.way,
            opens,
        })
    }
}

fn device_of(number: u32) -> PathBuf {
    PathBuf::from(format!("/dev/i2c-{number}"))
}

impl fmt::Display for Chosen {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, number) in self.numbers.iter().enumerate() {
            let before = if index == 0 { "" } else { ", " };
            write!(formatter, "{before}{}", device_of(*number).display())?;
        }
        write!(formatter, " by {}", self.way)?;
        if let Some(reason) = &self.without_fuse {
            let reason = reason.to_string();
            let reason = reason.lines().next().unwrap_or_default();
            write!(formatter, " (no FUSE: {reason})")?;
        }
        Ok(())
    }
}

impl fmt::Display for Way {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Fuse => "fuse",
            Self::Preload => "preload",
        })
    }
}

impl Via {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Fuse, Self::Preload];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Fuse => "fuse",
            Self::Preload => "preload",
        }
    }
}

impl fmt::Display for Via {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A name that is no [`Via`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown way {found:?}\nhint: one of auto, fuse, preload")]
pub struct UnknownVia {
    /// What was given.
    pub found: String,
}

impl FromStr for Via {
    type Err = UnknownVia;

    fn from_str(name: &str) -> Result<Self, UnknownVia> {
        Self::ALL
            .into_iter()
            .find(|via| via.name() == name)
            .ok_or_else(|| UnknownVia {
                found: name.to_owned(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_leads_back_to_its_way() {
        for via in Via::ALL {
            assert_eq!(via.to_string().parse(), Ok(via));
        }
        let error = "cuse".parse::<Via>().unwrap_err().to_string();
        for via in Via::ALL {
            assert!(error.contains(via.name()), "{error}");
        }
    }

    #[test]
    fn only_a_path_of_i2c_dev_has_a_number() {
        for (path, number) in [("/dev/i2c-0", 0), ("/dev/i2c-1", 1), ("/dev/i2c-123", 123)] {
            assert_eq!(bus_number(Path::new(path)).unwrap(), number);
        }
        for path in [
            "",
            "/dev/i2c-",
            "/dev/i2c-x",
            "/dev/i2c-01",
            "/dev/i2c-+1",
            "/dev/i2c-4294967296",
            "/dev/i2c/1",
            "i2c-1",
            "/tmp/i2c-1",
        ] {
            let error = bus_number(Path::new(path)).unwrap_err().to_string();
            assert!(
                error.contains(path) && error.contains("\nhint: "),
                "{error}"
            );
        }
    }

    #[test]
    fn a_rack_without_a_bus_is_refused() {
        let refused = choose(&Rack::new(), &Options::default(), &Command::new("true"));
        assert!(matches!(refused, Err(RunError::NoBus)));
    }
}
