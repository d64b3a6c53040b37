//! How long the sampler waits, how often it tries, and what it believes.

use super::phase::Ns;
use std::time::Duration;

/// Content that stays the same for so many frames is that of a sensor which has stopped measuring.
///
/// With the noise of a real sensor two equal frames in a row are already a rarity at 10 Hz; a scene without noise may
/// stand still for a while, as may a replayed recording, and ten seconds of it are believed.
pub const FROZEN_FRAMES: u32 = 100;
/// Attempts at one frame after a fault, beside the first.
pub const RETRIES_PER_FRAME: u32 = 3;
/// Faults in a row, without a good frame between them, after which a sensor that answers is set up again, and one that
/// does not is asked less often.
pub const FAULTS_BEFORE_SET_UP: u32 = 8;
/// The longest pause between two attempts at a sensor that does not answer.
pub const RETRY_PAUSE_MAX: Duration = Duration::from_secs(1);
/// Frame periods after a set-up within which a frame must have come; registers that are still zero then are a fault.
pub const FIRST_FRAME_PERIODS: u32 = 10;
/// How often the settings are read back. A sensor that lost its supply for a moment comes back with others.
pub const SETTINGS_EVERY: Duration = Duration::from_secs(5);
/// The pause before the second attempt to set the sensor up; it doubles up to [`SET_UP_PAUSE_MAX`].
pub const SET_UP_PAUSE: Duration = Duration::from_millis(200);
/// The longest pause between two attempts to set the sensor up.
pub const SET_UP_PAUSE_MAX: Duration = Duration::from_secs(2);
/// Missing frames that are listed row by row at once: an hour at 10 Hz. Beyond, the gap shows in `seq` alone.
pub const ROWS_PER_GAP_MAX: u64 = 36_000;
/// A window narrower than this is not halved any more: at 100 kHz a read takes 12.3 ms of the bus.
pub(super) const NARROW: Ns = 2_000_000;
/// How far behind a window the read is set.
pub(super) const GUARD: Ns = 500_000;
/// How far before a window the read is set that proves its lower bound.
pub(super) const PROBE_LEAD: Ns = 1_000_000;
/// Frames after which the lower bound is proved again.
pub(super) const PROBE_EVERY: u32 = 16;
/// Frames in a row whose content changed, after an equal one, until an unchanged one is taken for a late one at first.
pub(super) const LIVELY_FRAMES: u32 = 16;
/// Reads over which the host's lateness is averaged.
pub(super) const LATENESS_READS: Ns = 8;
/// Reads that wait for a late frame.
pub(super) const LATE_READS: u32 = 2;
/// Equal frames in a row after which the estimate counts them, when the bounds have become wider than a period.
pub(super) const STILL_FRAMES: u32 = 5;
