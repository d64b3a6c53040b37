//! A checked scene as plain values: room, bodies, agents, sensors, and the errors of reading a file. Nothing here
//! parses.

mod body;
mod calibrated;
mod contact;
mod doing;
mod error;
mod laws;
pub mod limits;
mod person;
mod print;
mod room;
mod scene;
mod sensor;
pub mod uncertain;
mod vary;

pub use body::{Agent, Body};
pub use calibrated::Calibrated;
pub(crate) use contact::Walls;
pub use contact::{Contact, FreeSpace};
pub(crate) use doing::Keep;
pub use doing::{Doing, Stop};
pub use error::{SceneError, Warning};
pub(crate) use laws::WANDER_OVER_S;
pub use laws::{AgentLaws, Laws};
pub use person::{Clothing, Person, Posture};
pub(crate) use person::{PAPER, SEGMENTS};
pub(crate) use print::Print;
pub use room::Room;
pub use scene::{Loaded, Model, Scene, Variant};
pub use sensor::{Optics, Sensor};
pub(crate) use uncertain::{Claim, FITTED_MAX, Normal, OF_PEOPLE, SDS_MAX, Uncertain};
pub use vary::Vary;
