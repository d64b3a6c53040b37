//! The device file: which sensor the suite may use.

use amg8833::Address;
use anyhow::{Context as _, bail};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// One sensor, as its user describes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Device {
    /// What it is, in its user's words.
    pub(crate) what: String,
    /// Whether it is this project's emulator and no sensor.
    pub(crate) emulated: bool,
    /// The device file of the bus, as `/dev/i2c-1`.
    pub(crate) bus: PathBuf,
    #[serde(deserialize_with = "address")]
    pub(crate) address: Address,
}

impl Device {
    /// The one whose file the command line names.
    pub(crate) fn of_the_command_line() -> anyhow::Result<Self> {
        let mut arguments = std::env::args_os().skip(1);
        let (Some(path), None) = (arguments.next(), arguments.next()) else {
            bail!(
                "expected the path of one device file\nhint: tests/hardware/README.md has one to copy"
            );
        };
        let path = Path::new(&path);
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        toml::from_str(&text).with_context(|| format!("{} is no device file", path.display()))
    }
}

fn address<'de, D: serde::Deserializer<'de>>(value: D) -> Result<Address, D::Error> {
    Address::try_from(u8::deserialize(value)?).map_err(serde::de::Error::custom)
}
