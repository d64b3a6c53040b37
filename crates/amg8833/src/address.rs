//! The sensor's two possible bus addresses.

use core::error::Error;
use core::fmt;

/// The sensor's bus address, chosen by its AD_SELECT pin (AMG88 spec §4-8-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Address {
    /// 0x68: AD_SELECT at GND.
    Low,
    /// 0x69: AD_SELECT at VDD, as on most breakout boards.
    High,
}

impl Address {
    /// The 7-bit address, without the read/write bit.
    #[must_use]
    pub const fn get(self) -> u8 {
        match self {
            Self::Low => 0x68,
            Self::High => 0x69,
        }
    }

    /// The address at the other level of AD_SELECT.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Low => Self::High,
            Self::High => Self::Low,
        }
    }
}

impl From<Address> for u8 {
    fn from(address: Address) -> Self {
        address.get()
    }
}

impl TryFrom<u8> for Address {
    type Error = UnknownAddress;

    fn try_from(found: u8) -> Result<Self, Self::Error> {
        [Self::Low, Self::High]
            .into_iter()
            .find(|address| address.get() == found)
            .ok_or(UnknownAddress { found })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:#04x}", self.get())
    }
}

/// An address no AMG8833 can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnknownAddress {
    /// The rejected address.
    pub found: u8,
}

impl fmt::Display for UnknownAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "not a sensor address: expected {} or {}, found {:#04x}\n\
             hint: give the 7-bit address; 0xd0 and 0xd2 are the same two with the read/write bit",
            Address::Low,
            Address::High,
            self.found
        )
    }
}

impl Error for UnknownAddress {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_two_addresses_of_the_specification_are_taken() {
        for found in 0..=u8::MAX {
            let address = Address::try_from(found).map(u8::from);
            let error = Err(UnknownAddress { found });
            let expected = if matches!(found, 0x68 | 0x69) {
                Ok(found)
            } else {
                error
            };
            assert_eq!(address, expected);
        }
    }

    #[test]
    fn the_error_names_what_was_found_and_the_common_mistake() {
        let message = std::format!("{}", Address::try_from(0xD2).unwrap_err());
        assert_eq!(
            message,
            "not a sensor address: expected 0x68 or 0x69, found 0xd2\n\
             hint: give the 7-bit address; 0xd0 and 0xd2 are the same two with the read/write bit"
        );
    }
}
