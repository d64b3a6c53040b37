//! Arguments of `grideye count`.

use clap::Args;
use grideye_count::Line;
use std::path::PathBuf;

/// Count the people in a recording.
///
/// Prints a line per change. The network was trained on simulated frames alone; crates/grideye-count/README.md says how
/// well it counts on real ones.
///
/// Example: grideye count recording.csv --line -0.5,3.5,7.5,3.5
#[derive(Debug, Args)]
pub(crate) struct Count {
    /// Recording of any format.
    pub(crate) recording: PathBuf,
    /// Sensor to count by [default: all].
    ///
    /// SENSOR, or DEVICE/SENSOR if several devices have a sensor of that name.
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// File of JSON lines to write, one a frame.
    ///
    /// The name - prints them instead of the changes. seq, t_s (of the device's clock), people (3 is three or more), p (the
    /// chance of each count), places (column, row, °C above the empty room), and with --line entered and left so far.
    #[arg(long, value_name = "FILE.jsonl")]
    pub(crate) json: Option<PathBuf>,
    /// Line to count crossings of [default: none].
    ///
    /// In pixels: 0,0 is the middle of pixel 1, and x grows along a row. Who goes from the line's left to its right, looking from its first
    /// point to its second, has entered: with -0.5,3.5,7.5,3.5 who goes down the image. Crossings were not judged: no recording has their truth.
    #[arg(long, value_name = "X1,Y1,X2,Y2", allow_hyphen_values = true)]
    pub(crate) line: Option<Line>,
    /// Empty room, as a profile [default: learned].
    ///
    /// Its `[background]`, as `grideye characterize` measures it. Without it, a pixel's empty room is what its colder frames show.
    #[arg(long, value_name = "FILE")]
    pub(crate) profile: Option<PathBuf>,
    /// Learn the empty room as the collector does.
    ///
    /// From the first half minute, in which nothing is counted.
    #[arg(long, conflicts_with = "profile")]
    pub(crate) live: bool,
    /// File of the network [default: the shipped one].
    ///
    /// .gec, as tests/peers/counting trains it.
    #[arg(long, value_name = "FILE.gec")]
    pub(crate) weights: Option<PathBuf>,
    /// True numbers of people, to judge the count by.
    ///
    /// A CSV file with a column people (or people_number, count, ...), one row a frame or with their seq. The recording itself
    /// may have it. FILE:COLUMN names another column.
    #[arg(long, value_name = "FILE[:COLUMN]")]
    pub(crate) truth: Option<String>,
    /// Counts of another program to judge, as --truth.
    #[arg(long, value_name = "FILE[:COLUMN]", requires = "truth", conflicts_with_all = ["json", "line", "weights", "profile", "live"])]
    pub(crate) counts: Option<String>,
}

/// Counting of people in frames as they come.
#[derive(Debug, Default, Args)]
pub(crate) struct CountLive {
    /// Count the people in front of each sensor.
    ///
    /// For the live page, GET /v1/sensors, /metrics and Home Assistant, for which it is on. A .gec file is another network.
    #[arg(long, value_name = "FILE.gec", hide_short_help = true, num_args = 0..=1, require_equals = true)]
    pub(crate) count: Option<Option<PathBuf>>,
    /// Line to count crossings of [default: none].
    ///
    /// As of `grideye count`; the same for every sensor. Turns on --count.
    #[arg(
        long,
        value_name = "X1,Y1,X2,Y2",
        hide_short_help = true,
        allow_hyphen_values = true
    )]
    pub(crate) line: Option<Line>,
}
