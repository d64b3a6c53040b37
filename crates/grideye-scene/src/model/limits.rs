//! Limits of a scene; each has a test that reaches it.

/// Bytes of a scene file or a trajectory.
pub const TEXT_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Bytes of all the files that a scene names, each as often as it is named.
pub const NAMED_BYTES_MAX: usize = 4 * TEXT_BYTES_MAX;
/// Characters of a name; a sensor's has at most `grideye_frame::NAME_CHARS_MAX`.
pub const NAME_CHARACTERS_MAX: usize = 100;
/// Objects in a scene; the paper's largest has 1,056.
pub const OBJECTS_MAX: usize = 10_000;
/// Sensors in a scene.
pub const SENSORS_MAX: usize = 1_000;
/// Agents in a scene.
pub const AGENTS_MAX: usize = 100;
/// Parts of an agent.
pub const PARTS_MAX: usize = 100;
/// Vertices of one polyhedron; also its faces.
pub const VERTICES_MAX: usize = 100_000;
/// Reported contacts.
pub const CONTACTS_MAX: usize = 100;
/// Cells of a texture, after dividing interpolated cells.
pub const TEXTURE_CELLS_MAX: usize = 10_000;
/// Warm prints on objects: one per part, stop and face.
pub const PRINTS_MAX: usize = 10_000;
/// Corners of a room's floor plan; also faces of a room given as a mesh.
pub const ROOM_CORNERS_MAX: usize = 1_000;
/// Waypoints of a trajectory.
pub const WAYPOINTS_MAX: usize = 100_000;
/// Points of a sensor's sampling grid on one axis: field of view times points per degree.
pub const GRID_POINTS_MAX: usize = 2_048;
/// Pixels of a sensor on one axis.
pub const PIXELS_PER_AXIS_MAX: usize = 1_024;
/// Days that an agent's path may take.
pub const WALK_DAYS_MAX: u64 = 366;
/// The latest time stamp and the longest stop, seconds.
pub const TIME_MAX_S: f64 = 86_400.0 * 366.0;
