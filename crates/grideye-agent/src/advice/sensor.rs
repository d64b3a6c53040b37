//! What to do about a sensor that gives no frame, by the reason.

use grideye_frame::NoData;

/// What to do about a fault of this kind.
#[must_use]
pub fn hint(reason: NoData) -> &'static str {
    match reason {
        NoData::Nack => {
            "nobody answers at this address: most boards are 0x69, with AD_SELECT at GND 0x68 (`i2cdetect -y 1` shows it); \
             check 3.3 V, GND, SDA on pin 3 and SCL on pin 5: or are SDA and SCL exchanged?"
        }
        NoData::BusTimeout => {
            "SDA or SCL is held low: look for a short circuit, for SDA and SCL exchanged, or for a board without supply; take \
             other devices off the bus, and switch the sensor's supply off and on. The pull-ups go to 3.3 V, never to 5 V"
        }
        NoData::Unplugged => {
            "the bus adapter is gone: plug it in again, or enable I2C (dtparam=i2c_arm=on) and restart"
        }
        NoData::ShortTransfer => {
            "the adapter transferred less than asked for: no device answers, or the adapter's driver is at fault"
        }
        NoData::StuckHigh => {
            "every byte reads 0xff: SDA is not connected, or the sensor has no supply"
        }
        NoData::AllZero => {
            "every pixel reads zero: the sensor sleeps or does not measure; switch its supply off and on"
        }
        NoData::Frozen => "the sensor answers but measures no more: switch its supply off and on",
        NoData::WrongConfiguration | NoData::NotReady => {
            "the sensor loses its settings: its supply fails for moments; check the 3.3 V line and its wires"
        }
        NoData::HostStalled => {
            "this computer was too busy to read in time; the sensor itself is well"
        }
        NoData::BusError => {
            "the transfer broke down: shorten the wires, check the pull-ups (2.2 to 10 kOhm, to 3.3 V and never to 5 V: power \
             the board from pin 1, not from pins 2 or 4), lower i2c_arm_baudrate; \
             an adapter that knows SMBus only cannot read this sensor"
        }
    }
}
