//! Why no machine is built, and what to do about it.

use crate::place::Place;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::SceneError;

/// What keeps a machine from being built.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// Two sensors would answer at once.
    #[error(
        "{one} and {other} are both at {place}\nhint: give one of them another bus, address or channel"
    )]
    Taken {
        /// The sensor that is there.
        one: String,
        /// The sensor that was to be there as well.
        other: String,
        /// Where both are.
        place: Place,
    },
    /// A sensor before a multiplexer and one behind it would answer at once.
    #[error(
        "{one} at {before} and {other} at {place} answer at once when the multiplexer 0x{mux:02x} opens that channel\nhint: give one of them the other address"
    )]
    Together {
        /// The sensor before the multiplexer.
        one: String,
        /// Where it is.
        before: Place,
        /// The sensor behind the multiplexer.
        other: String,
        /// Where that is.
        place: Place,
        /// The multiplexer's address.
        mux: u8,
    },
    /// One multiplexer a bus is emulated.
    #[error(
        "bus {bus} has a multiplexer at 0x{first:02x} and one at 0x{second:02x}, and one a bus is emulated\nhint: use its other channels, there are eight, or another bus"
    )]
    SecondMux {
        /// The bus's number.
        bus: u32,
        /// The address of the multiplexer that is there.
        first: u8,
        /// The address of the other.
        second: u8,
    },
    /// No AMG8833 can stand for this sensor.
    #[error(
        "the sensor {sensor} has {columns} x {rows} pixels, and an AMG8833 has {COLUMNS} x {ROWS}\nhint: choose another sensor, or give it `resolution = [8, 8]` in the scene"
    )]
    Resolution {
        /// The sensor's name.
        sensor: String,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
    },
    /// A fault of a sensor or bus that is not there would never strike.
    #[error(
        "fault {number} of the script names a bus or an address without a sensor\nhint: there are sensors at {places}"
    )]
    NoTarget {
        /// The fault's number in the script, from 1.
        number: usize,
        /// Where there are sensors.
        places: String,
    },
    /// The times of a recording have no common beginning.
    #[error(
        "holds {streams} streams of {boots} runs of an agent, whose times have no common beginning\nhint: keep the rows of one device and boot"
    )]
    SeveralBoots {
        /// Streams in the recording.
        streams: usize,
        /// Devices and boots that they come from.
        boots: usize,
    },
    /// A recording in which no sensor was read.
    #[error("holds no frame\nhint: name a recording in which the sensor was read")]
    NoFrame,
    /// The scene has no such sensor, or it cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
