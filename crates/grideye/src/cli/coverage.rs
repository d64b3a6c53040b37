//! The options of `grideye coverage`.

use super::shared::{Choices, one_of, within};
use clap::Args;
use grideye_plan::coverage::{Mount, Posture};
use std::path::PathBuf;

const WHO: &str = "Who is looked for";
const COUNTS: &str = "What counts";
const WRITTEN: &str = "What is written";

/// Say where a room's sensors see a person, or find the best places.
///
/// Without --candidates it is the scene's own sensors; with it, poses are tried all over the room and the best few are
/// picked, one after the other. The scene's own agents are taken out first.
///
/// Exit code 1: --at-least was not reached.
///
/// Example: grideye coverage scenes/bedroom.toml --candidates all --best 2 --out coverage.svg --write best.toml
#[derive(Debug, Args)]
pub(crate) struct Coverage {
    /// Scene file.
    pub(crate) scene: PathBuf,
    /// Where poses are tried, with commas.
    #[arg(long, value_name = "WHERE", value_parser = one_of(PLACES), value_delimiter = ',')]
    pub(crate) candidates: Vec<Option<Mount>>,
    /// Poses to pick from the candidates.
    #[arg(long, value_name = "K", default_value_t = 2, requires = "candidates")]
    pub(crate) best: usize,
    /// Pick beside the scene's own sensors.
    ///
    /// The scene's own sensors stay, and the poses are picked beside them.
    #[arg(long, requires = "candidates")]
    pub(crate) keep: bool,
    /// Sensors that count, with commas [default: all].
    ///
    /// Beside --candidates only with --keep.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) sensors: Vec<String>,

    /// How the person is.
    #[arg(long, value_parser = one_of(POSTURES), default_value = "standing", help_heading = WHO)]
    pub(crate) posture: Posture,
    /// Depth, width, height when standing.
    ///
    /// The width is that across the shoulders.
    #[arg(long, value_name = "D,W,H", value_delimiter = ',', default_values_t = [200.0, 500.0, 1750.0], help_heading = WHO)]
    pub(crate) person_mm: Vec<f64>,
    /// Temperature of the clothed surface.
    #[arg(long, value_name = "C", default_value_t = 28.0, allow_hyphen_values = true, help_heading = WHO)]
    pub(crate) person_c: f64,
    /// This agent of the scene instead.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["posture", "person_mm", "person_c"], help_heading = WHO)]
    pub(crate) agent: Option<String>,
    /// Turns in which the person is tried at each place, evenly over half a turn; the worst that fits counts.
    #[arg(long, value_name = "N", default_value_t = 2, hide_short_help = true, help_heading = WHO)]
    pub(crate) turns: usize,

    /// Least contrast, in units of noise.
    ///
    /// From this contrast on a person is detected.
    #[arg(long, value_name = "X", default_value_t = 3.0, help_heading = COUNTS)]
    pub(crate) sigma: f64,
    /// Sensors that must detect a person.
    ///
    /// At each place.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = COUNTS)]
    pub(crate) sensors_min: usize,
    /// The sensors detect together, not each alone.
    #[arg(long, help_heading = COUNTS)]
    pub(crate) together: bool,
    /// Frames that are averaged first.
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = COUNTS)]
    pub(crate) frames: u32,
    /// About the length of the cells that the floor is divided into.
    #[arg(long, value_name = "MM", default_value_t = 200.0, hide_short_help = true, help_heading = COUNTS)]
    pub(crate) cell_mm: f64,
    /// Exit code 1 at fewer of the places.
    ///
    /// If a person is detected at fewer of the places than this.
    #[arg(long, value_name = "PERCENT", value_parser = percent, help_heading = COUNTS)]
    pub(crate) at_least: Option<f64>,

    #[command(flatten)]
    pub(crate) poses: Poses,

    /// Map: .svg, .png or .csv; repeatable.
    #[arg(long, value_name = "FILE", help_heading = WRITTEN)]
    pub(crate) out: Vec<PathBuf>,
    /// The poses picked, for a scene file.
    ///
    /// As `[[sensor]]` tables.
    #[arg(long, value_name = "FILE.toml", requires = "candidates", help_heading = WRITTEN)]
    pub(crate) write: Option<PathBuf>,
    /// Print JSON.
    #[arg(long, help_heading = WRITTEN)]
    pub(crate) json: bool,
    /// Threads [default: as many as there are cores]; the result is the same with any number.
    #[arg(long, value_name = "N", hide_short_help = true, help_heading = WRITTEN)]
    pub(crate) threads: Option<usize>,
}

/// The poses that are tried.
#[derive(Debug, Args)]
#[command(next_help_heading = "Which poses are tried")]
#[group(requires = "candidates")]
pub(crate) struct Poses {
    /// Kind of sensor that is tried [default: as the scene's first, or grid-eye if it has none].
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub(crate) preset: Option<String>,
    /// Sensor of the scene that is tried elsewhere.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "preset",
        hide_short_help = true
    )]
    pub(crate) like: Option<String>,
    /// About the distance of one pose to the next.
    #[arg(
        long,
        value_name = "MM",
        default_value_t = 500.0,
        hide_short_help = true
    )]
    pub(crate) spacing_mm: f64,
    /// Under the ceiling: angles off straight down.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [0.0, 30.0], hide_short_help = true)]
    pub(crate) tilts_deg: Vec<f64>,
    /// Under the ceiling: directions of those that are tilted.
    #[arg(long, value_name = "N", default_value_t = 8, hide_short_help = true)]
    pub(crate) headings: usize,
    /// On walls and in corners: heights.
    #[arg(long, value_name = "MM", value_delimiter = ',', default_values_t = [2200.0], hide_short_help = true)]
    pub(crate) heights_mm: Vec<f64>,
    /// On walls and in corners: angles below the level.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [25.0, 45.0], hide_short_help = true)]
    pub(crate) downs_deg: Vec<f64>,
    /// On walls: directions off straight into the room.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [-30.0, 0.0, 30.0], allow_hyphen_values = true, hide_short_help = true)]
    pub(crate) wall_headings_deg: Vec<f64>,
}

/// Where poses are tried; everywhere, or at one place.
const PLACES: Choices<Option<Mount>> = (
    &[
        None,
        Some(Mount::Ceiling),
        Some(Mount::Wall),
        Some(Mount::Corner),
    ],
    "all Ceiling, walls and corners
ceiling Under the ceiling
walls On the walls
corners In the corners",
);

const POSTURES: Choices<Posture> = (
    &[Posture::Standing, Posture::Sitting, Posture::Lying],
    "standing Upright on the floor
sitting On the floor, or on a seat of up to 600 mm
lying On the floor, or in a bed of up to 800 mm",
);

fn percent(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=100.0), "expected a number from 0 to 100")
}
