//! Hints: what a person can do about each failure.

use grideye_frame::NoData;
use std::io;

const TLS_HINT: &str = "\nhint: the collector must show a certificate of the authority that this agent joined; if that was replaced, join again";

const PLAIN_HINT: &str = "\nhint: the collector speaks plain HTTP: start it with `grideye collect --tls`; or, in a network that you trust, join it with the line of `grideye enroll DEVICE --url http://HOST:PORT`";

const NAME_HINT: &str = "\nhint: is the host's name right, and the network up? An address such as 192.168.1.20 needs no name";

const AWAY_HINT: &str = "\nhint: is the network up, is this the collector's address, and does its firewall let the port through?";

/// How to fix a request without an answer. Starts with a line break; empty if there is no advice.
#[must_use]
pub fn network_hint(error: &ureq::Error) -> &'static str {
    use std::io::ErrorKind;
    match error {
        ureq::Error::HostNotFound => NAME_HINT,
        // The resolver's failures are `io::Error`s without a number or kind of their own.
        ureq::Error::Io(error) if error.to_string().contains("lookup") => NAME_HINT,
        ureq::Error::Io(error) if error.kind() == ErrorKind::ConnectionRefused => {
            "\nhint: is `grideye collect` running there, on this port? On its own it listens on loopback alone; other machines \
             reach it with --listen 0.0.0.0:8833, and this agent joins it with the line that `grideye enroll DEVICE` prints"
        }
        // Handshake failures arrive as `io::Error` too.
        ureq::Error::Io(error) => in_handshake(error).map_or(AWAY_HINT, tls_hint),
        ureq::Error::Timeout(_) | ureq::Error::ConnectionFailed => AWAY_HINT,
        ureq::Error::Rustls(error) => tls_hint(error),
        ureq::Error::Tls(_) => TLS_HINT,
        ureq::Error::Protocol(_) => {
            "\nhint: a collector that speaks TLS does not answer plain HTTP: join it with the line that `grideye enroll DEVICE` prints, which names https://"
        }
        _ => "",
    }
}

fn tls_hint(error: &rustls::Error) -> &'static str {
    certificate_hint(error).unwrap_or(TLS_HINT)
}

/// The TLS error behind a failed read or write, if there is one.
pub(crate) fn in_handshake(error: &io::Error) -> Option<&rustls::Error> {
    error.get_ref()?.downcast_ref()
}

/// Whether the other side does not speak TLS.
pub(crate) const fn is_plain(error: &rustls::Error) -> bool {
    matches!(error, rustls::Error::InvalidMessage(_))
}

/// Starts with a line break.
pub(crate) fn certificate_hint(error: &rustls::Error) -> Option<&'static str> {
    if is_plain(error) {
        return Some(PLAIN_HINT);
    }
    use rustls::CertificateError as Refused;
    let rustls::Error::InvalidCertificate(refused) = error else {
        return None;
    };
    match refused {
        Refused::Expired
        | Refused::ExpiredContext { .. }
        | Refused::NotValidYet
        | Refused::NotValidYetContext { .. } => Some(
            "\nhint: what this machine's clock says decides that: see `timedatectl`. A Raspberry Pi has no battery clock, \
             and wants a network with NTP; if the clock is right, the collector needs a certificate that is valid now",
        ),
        Refused::NotValidForName | Refused::NotValidForNameContext { .. } => Some(
            "\nhint: the collector's certificate is for another name than the agent calls it by: start it with \
             `--host-name NAME`, or print a line with a name that stands in it: `grideye enroll DEVICE --url https://NAME:PORT`",
        ),
        _ => None,
    }
}

/// How to fix a sensor that delivers no frames for this reason.
#[must_use]
pub fn sensor_hint(reason: NoData) -> &'static str {
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
