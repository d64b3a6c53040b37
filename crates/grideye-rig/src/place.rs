//! A sensor's place and its notation: `NAME`, `NAME=BUS:ADDRESS`, `NAME=BUS:MUX.CHANNEL:ADDRESS`.

use amg8833_emulator::{Address, CHANNELS, MuxAddress};
use std::fmt;
use std::str::FromStr;

/// The highest bus number: Linux has that many minor numbers (`MINORMASK` in `drivers/i2c/i2c-dev.c`).
const BUS_NUMBER_MAX: u32 = (1 << 20) - 1;
/// A sensor's place in the emulated machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// Bus 1 is `/dev/i2c-1`.
    pub bus: u32,
    /// The multiplexer channel in front of the sensor.
    pub branch: Option<Branch>,
    /// 0x68 or 0x69.
    pub address: Address,
}

/// One channel of a multiplexer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Branch {
    /// 0x70 to 0x77.
    pub mux: MuxAddress,
    /// 0 to 7.
    pub channel: usize,
}

/// A sensor requested by name, and its place if given.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Placed {
    pub name: String,
    pub place: Option<Place>,
}

/// One sensor of the emulated machine, with its name in the scene or recording.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Planned {
    pub name: String,
    pub place: Place,
}

impl FromStr for Placed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, place) = match text.rsplit_once('=') {
            Some((name, place)) => (name, Some(place.parse()?)),
            None => (text, None),
        };
        if name.is_empty() {
            let hint = "NAME=BUS:ADDRESS, such as left=1:0x69";
            return Err(format!("the sensor's name is missing\nhint: {hint}"));
        }
        let name = name.to_owned();
        Ok(Self { name, place })
    }
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        let (bus, branch, address) = match parts.as_slice() {
            [bus, address] => (bus, None, address),
            [bus, branch, address] => (bus, Some(branch.parse()?), address),
            _ => {
                let hint = "BUS:ADDRESS, such as 1:0x69, or BUS:MUX.CHANNEL:ADDRESS, such as 1:0x70.3:0x69";
                return Err(format!("invalid place: {text}\nhint: {hint}"));
            }
        };
        Ok(Self {
            bus: bus_number(bus)?,
            branch,
            address: address_of(address)?,
        })
    }
}

impl FromStr for Branch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let hint = "MUX.CHANNEL, such as 0x70.3";
        let (mux, channel) = text
            .split_once('.')
            .ok_or_else(|| format!("invalid multiplexer channel: {text}\nhint: {hint}"))?;
        let mux = number(mux)
            .and_then(MuxAddress::from_bits)
            .ok_or_else(|| format!("a multiplexer answers at 0x70 to 0x77, not at {mux}"))?;
        let known = number(channel).map(usize::from);
        let channel = known
            .filter(|channel| *channel < CHANNELS)
            .ok_or_else(|| format!("a multiplexer has the channels 0 to 7, not {channel}"))?;
        Ok(Self { mux, channel })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:", self.bus)?;
        if let Some(Branch { mux, channel }) = self.branch {
            write!(formatter, "{mux}.{channel}:")?;
        }
        write!(formatter, "0x{:02x}", self.address.bits())
    }
}

/// Parses the address of an AMG8833, in hexadecimal with 0x or in decimal.
/// # Errors
/// If an AMG8833 cannot have it.
pub fn address_of(text: &str) -> Result<Address, String> {
    number(text)
        .and_then(Address::from_bits)
        .ok_or_else(|| "the AMG8833 answers at 0x68 or 0x69".to_owned())
}

/// Parses the bus number from the path of its device.
/// # Errors
/// If the path is not one of an I2C bus.
pub fn device(text: &str) -> Result<u32, String> {
    let number = text.strip_prefix("/dev/i2c-").ok_or_else(|| {
        format!("{text} is not the path of an I2C bus\nhint: the emulated bus N is /dev/i2c-N, such as /dev/i2c-1")
    })?;
    bus_number(number)
}

fn bus_number(text: &str) -> Result<u32, String> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse()
        .ok()
        .filter(|number| digits && *number <= BUS_NUMBER_MAX)
        .ok_or_else(|| {
            format!("invalid bus number: {text}\nhint: 0 to {BUS_NUMBER_MAX}; bus 1 is /dev/i2c-1")
        })
}

fn number(text: &str) -> Option<u8> {
    match text.strip_prefix("0x") {
        Some(hexadecimal) => u8::from_str_radix(hexadecimal, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_places_are_read_and_written_back() {
        let places = ["1:0x69", "0:0x68", "3:0x70.0:0x69", "1048575:0x77.7:0x68"];
        let decimal = ("1:112.3:105", "1:0x70.3:0x69");
        for (text, written) in places.map(|text| (text, text)).into_iter().chain([decimal]) {
            let odd: Placed = format!("a=b={text}").parse().unwrap();
            assert_eq!(odd.name, "a=b");
            assert_eq!(odd.place.unwrap().to_string(), written);
        }
        let bare: Placed = "ceiling".parse().unwrap();
        assert_eq!((bare.name.as_str(), bare.place), ("ceiling", None));
    }

    #[test]
    fn what_is_wrong_with_a_place_is_named() {
        for (text, words) in [
            ("=1:0x69", "name is missing"),
            ("a=", "invalid place"),
            ("a=1", "invalid place"),
            ("a=1:2:3:4", "invalid place"),
            ("a=x:0x69", "invalid bus number: x"),
            ("a=-1:0x69", "invalid bus number: -1"),
            ("a=+1:0x69", "invalid bus number: +1"),
            ("a=1048576:0x69", "0 to 1048575"),
            ("a=1:0x67", "0x68 or 0x69"),
            ("a=1:0x70:0x69", "MUX.CHANNEL"),
            ("a=1:0x6f.0:0x69", "0x70 to 0x77"),
            ("a=1:0x78.0:0x69", "0x70 to 0x77"),
            ("a=1:0x70.8:0x69", "0 to 7"),
        ] {
            let error = text.parse::<Placed>().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn only_the_path_of_a_bus_is_a_device() {
        assert_eq!(device("/dev/i2c-1"), Ok(1));
        let strange = "/dev/ttyS0 /dev/i2c- /dev/i2c-x i2c-1 1 /dev/i2c-1/ /dev/i2c-9999999";
        for text in strange.split(' ') {
            let error = device(text).unwrap_err();
            assert!(error.contains("hint:"), "{text}: {error}");
        }
    }
}
