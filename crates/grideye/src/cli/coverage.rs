//! The options of `grideye coverage`.

use super::shared::{Choices, one_of, within};
use clap::Args;
use grideye_plan::coverage::Mount;
use grideye_scene::{Clothing, Person, Posture};
use std::path::PathBuf;

const PERSON: &str = "Person to detect";
const DETECTION: &str = "Detection";

/// Map where a room's sensors see a person, or find the best places.
///
/// Without --candidates, rates the scene's own sensors. With it, tries poses all over the room and improves the best, each
/// beside the others. The scene's own agents are removed first.
///
/// Exit code 1: --at-least was not reached
///
/// Example: grideye coverage scenes/bedroom.toml --candidates all --write best.toml
#[derive(Debug, Args)]
pub(crate) struct Coverage {
    /// Scene file (TOML).
    pub(crate) scene: PathBuf,
    /// Places to try: all, ceiling, walls, corners.
    ///
    /// Comma-separated. Without it, no poses are tried.
    #[arg(long, value_name = "WHERE", value_parser = one_of(PLACES), value_delimiter = ',', hide_possible_values = true)]
    pub(crate) candidates: Vec<Option<Mount>>,
    /// Poses to pick from the candidates.
    #[arg(long, value_name = "K", default_value_t = 2, requires = "candidates")]
    pub(crate) best: usize,
    /// Keep the scene's sensors and pick more.
    #[arg(long, requires = "candidates")]
    pub(crate) keep: bool,
    /// Sensors to rate, comma-separated [default: all].
    ///
    /// With --candidates, needs --keep.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) sensors: Vec<String>,
    /// Exit with code 1 if fewer places are covered, in %.
    ///
    /// A place is covered if a person is detected there. 0 to 100.
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub(crate) at_least: Option<f64>,
    /// Map to write: .svg or .csv; repeatable.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Vec<PathBuf>,
    /// Picked poses to write, as `[[sensor]]` tables.
    #[arg(long, value_name = "FILE.toml", requires = "candidates")]
    pub(crate) write: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Threads [default: one per core]; the result does not depend on it.
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub(crate) threads: Option<usize>,

    /// Posture of the person.
    #[arg(long, value_parser = one_of(POSTURES), default_value = "stand", hide_short_help = true, help_heading = PERSON)]
    pub(crate) posture: Posture,
    /// Height when standing, 500 to 2800 mm.
    #[arg(long, value_name = "MM", default_value_t = 1700.0, hide_short_help = true, help_heading = PERSON)]
    pub(crate) person_height_mm: f64,
    /// Build of the person.
    #[arg(long, value_parser = one_of(BUILDS), default_value = "average", hide_short_help = true, help_heading = PERSON)]
    pub(crate) build: f64,
    /// Clothing; matters only in the physical model.
    #[arg(long, value_parser = one_of(CLOTHING), default_value = "indoor", hide_short_help = true, help_heading = PERSON)]
    pub(crate) clothing: Clothing,
    /// Agent of the scene to use as the person.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["posture", "person_height_mm", "build", "clothing"], hide_short_help = true, help_heading = PERSON)]
    pub(crate) agent: Option<String>,
    /// Directions to turn the person at each place, evenly over half a turn; the worst that fits counts.
    #[arg(long, value_name = "N", default_value_t = 2, hide_short_help = true, help_heading = PERSON)]
    pub(crate) turns: usize,

    /// Least contrast that detects a person, in units of noise.
    #[arg(long, value_name = "X", default_value_t = 3.0, hide_short_help = true, help_heading = DETECTION)]
    pub(crate) sigma: f64,
    /// Sensors that must detect a person at each place.
    #[arg(long, value_name = "N", default_value_t = 1, hide_short_help = true, help_heading = DETECTION)]
    pub(crate) sensors_min: usize,
    /// Combine the sensors' contrast instead of judging each alone.
    #[arg(long, hide_short_help = true, help_heading = DETECTION)]
    pub(crate) together: bool,
    /// Frames to average first.
    #[arg(long, value_name = "N", default_value_t = 1, hide_short_help = true, help_heading = DETECTION)]
    pub(crate) frames: u32,
    /// Approximate length of the floor's cells, in mm.
    #[arg(long, value_name = "MM", default_value_t = 200.0, hide_short_help = true, help_heading = DETECTION)]
    pub(crate) cell_mm: f64,

    #[command(flatten)]
    pub(crate) poses: Poses,
}

/// The poses to try; the best are improved between the least and the greatest of each angle.
#[derive(Debug, Args)]
#[command(next_help_heading = "Poses to try (with --candidates)")]
#[group(requires = "candidates")]
pub(crate) struct Poses {
    /// Kind of sensor: grid-eye, grid-eye-wide or lepton [default: as the scene's first, or grid-eye].
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub(crate) preset: Option<String>,
    /// Sensor of the scene to try elsewhere.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "preset",
        hide_short_help = true
    )]
    pub(crate) like: Option<String>,
    /// Approximate distance between poses, in mm.
    #[arg(
        long,
        value_name = "MM",
        default_value_t = 500.0,
        hide_short_help = true
    )]
    pub(crate) spacing_mm: f64,
    /// Ceiling: angles from straight down, 0 to 90 degrees.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [0.0, 30.0, 60.0], hide_short_help = true)]
    pub(crate) tilts_deg: Vec<f64>,
    /// Ceiling: directions of tilted sensors, evenly around.
    #[arg(long, value_name = "N", default_value_t = 8, hide_short_help = true)]
    pub(crate) headings: usize,
    /// Walls and corners: heights above the floor, in mm.
    #[arg(long, value_name = "MM", value_delimiter = ',', default_values_t = [2200.0], hide_short_help = true)]
    pub(crate) heights_mm: Vec<f64>,
    /// Walls and corners: angles below level, 0 to 90 degrees.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [15.0, 35.0, 60.0], hide_short_help = true)]
    pub(crate) downs_deg: Vec<f64>,
    /// Walls: angles from straight into the room, -90 to 90 degrees.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_values_t = [-45.0, 0.0, 45.0], allow_hyphen_values = true, hide_short_help = true)]
    pub(crate) wall_headings_deg: Vec<f64>,
}

/// The places; `None` is all of them.
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
    &[Posture::Stand, Posture::Sit, Posture::Lie],
    "stand Upright on the floor
sit On the floor, or on a seat of up to 600 mm
lie On the floor, or in a bed of up to 800 mm",
);

const BUILDS: Choices<f64> = (
    &[
        Person::BUILDS[0].1,
        Person::BUILDS[1].1,
        Person::BUILDS[2].1,
    ],
    "slight Girths 0.9 times the average
average Girths of the mean adult
stout Girths 1.15 times the average",
);

const CLOTHING: Choices<Clothing> = (
    &[Clothing::LIGHT, Clothing::INDOOR, Clothing::COAT],
    "light T-shirt, bare forearms
indoor Shirt and sweater
coat Coat, with hat or hood",
);

fn percent(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=100.0), "expected a number from 0 to 100")
}
