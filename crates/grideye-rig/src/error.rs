//! Why no machine is built, and what to do about it.

use crate::place::Place;
use amg8833_emulator::MuxAddress;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::SceneError;

/// What keeps a machine from being built.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// Two sensors would answer at once.
    #[error("{0} and {1} are both at {2}\nhint: give one of them another bus, address or channel")]
    Taken(String, String, Place),
    /// A sensor before a multiplexer and one behind it would answer at once.
    #[error(
        "{0} at {1} and {2} at {3} answer at once when the multiplexer {4} opens that channel\nhint: give one of them the other address"
    )]
    Together(String, Place, String, Place, MuxAddress),
    /// One multiplexer a bus is emulated.
    #[error(
        "bus {0} has a multiplexer at {1} and one at {2}, and one a bus is emulated\nhint: use its other channels, there are eight, or another bus"
    )]
    SecondMux(u32, MuxAddress, MuxAddress),
    /// No AMG8833 can stand for this sensor with its columns and rows.
    #[error(
        "the sensor {0} has {1} x {2} pixels, and an AMG8833 has {COLUMNS} x {ROWS}\nhint: choose another sensor, or give it `resolution = [8, 8]` in the scene"
    )]
    Resolution(String, usize, usize),
    /// The fault of this number, from 1, would never strike; where there are sensors.
    #[error(
        "fault {0} of the script names a bus or an address without a sensor\nhint: there are sensors at {1}"
    )]
    NoTarget(usize, String),
    /// The times of a recording with so many streams, devices and boots have no common beginning.
    #[error(
        "holds {0} streams of {1} runs of an agent, whose times have no common beginning\nhint: keep the rows of one device and boot"
    )]
    SeveralBoots(usize, usize),
    /// A recording in which no sensor was read.
    #[error("holds no frame\nhint: name a recording in which the sensor was read")]
    NoFrame,
    /// The scene has no such sensor, or it cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
