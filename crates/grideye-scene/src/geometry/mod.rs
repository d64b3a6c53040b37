//! Shapes and places in the room, without temperature.

mod angle;
mod collision;
pub mod count;
mod cuboid;
mod distance;
mod ellipsoid;
mod mesh;
pub mod polygon;
mod pose;

pub(crate) use angle::{rotation_x_deg, rotation_y_deg, rotation_z_deg};
pub(crate) use collision::{Bounds, Meeting, Piece, Shape, Span, TOLERANCE_M, first_meeting};
pub(crate) use count::range;
pub use cuboid::Cuboid;
pub(crate) use ellipsoid::{Contour, Ellipsoid};
pub use mesh::Mesh;
pub(crate) use mesh::{Enclosure, winding};
pub(crate) use polygon::{area_m2, area_vector, clipped, hull, normal};
pub use pose::Pose;
