//! The errors of building a machine.

use crate::place::Place;
use amg8833_emulator::MuxAddress;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::SceneError;

/// Why a machine cannot be built.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum RigError {
    #[error("{0} and {1} are both at {2}\nhint: give one of them another bus, address or channel")]
    Taken(String, String, Place),
    #[error(
        "{0} at {1} and {2} at {3} answer at once when the multiplexer {4} opens that channel\nhint: give one of them the other address"
    )]
    Together(String, Place, String, Place, MuxAddress),
    #[error(
        "bus {0} has multiplexers at {1} and {2}, but only one per bus is emulated\nhint: use the other of its eight channels, or another bus"
    )]
    SecondMux(u32, MuxAddress, MuxAddress),
    #[error(
        "the sensor {0} has {1} x {2} pixels, but an AMG8833 has {COLUMNS} x {ROWS}\nhint: choose another sensor, or give it `resolution = [8, 8]` in the scene"
    )]
    Resolution(String, usize, usize),
    #[error(
        "fault {0} of the script names a bus or an address without a sensor\nhint: there are sensors at {1}"
    )]
    NoTarget(usize, String),
    #[error(
        "holds {0} streams of {1} boots, which have no common start of time\nhint: keep the rows of one device and boot"
    )]
    SeveralBoots(usize, usize),
    #[error("holds no frame\nhint: name a recording in which the sensor was read")]
    NoFrame,
    #[error(transparent)]
    Scene(#[from] SceneError),
}
