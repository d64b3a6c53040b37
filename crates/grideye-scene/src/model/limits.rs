//! What a scene may have at most: each bound has a test that reaches it.

/// Bytes of a scene file, or of a trajectory.
pub const TEXT_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Characters of a name; a sensor's has at most `grideye_frame::NAME_CHARS_MAX`.
pub const NAME_CHARACTERS_MAX: usize = 100;
/// Objects of a scene; the paper's largest has 1,056.
pub const OBJECTS_MAX: usize = 10_000;
/// Sensors of a scene.
pub const SENSORS_MAX: usize = 1_000;
/// Moving agents of a scene.
pub const AGENTS_MAX: usize = 100;
/// Parts of an agent.
pub const PARTS_MAX: usize = 100;
/// Vertices, and faces, of one polyhedron.
pub const VERTICES_MAX: usize = 100_000;
/// Contacts that are told of.
pub const CONTACTS_MAX: usize = 100;
/// Cells of a texture, after cells that are interpolated were divided.
pub const TEXTURE_CELLS_MAX: usize = 10_000;
/// Warm prints on objects: one for each part, each stop and each face.
pub const PRINTS_MAX: usize = 10_000;
/// Corners of a room's floor plan, and faces of a room given as a mesh.
pub const ROOM_CORNERS_MAX: usize = 1_000;
/// Way-points of a trajectory.
pub const WAYPOINTS_MAX: usize = 100_000;
/// Points of a sensor's sampling grid on one axis: field of view times points a degree.
pub const GRID_POINTS_MAX: usize = 2_048;
/// Pixels of a sensor on one axis.
pub const PIXELS_PER_AXIS_MAX: usize = 1_024;
/// Days that an agent may be on its way.
pub const WALK_DAYS_MAX: u64 = 366;
/// The latest time stamp and the longest stop, seconds.
pub const TIME_MAX_S: f64 = 86_400.0 * 366.0;
