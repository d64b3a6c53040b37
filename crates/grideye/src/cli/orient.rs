use super::access::CollectorAddress;
use clap::Args;
use std::path::PathBuf;

/// Find out how a sensor is mounted, by a hand at the left and one at the top.
///
/// Left and top are those of somebody behind the sensor who looks where it looks; below a ceiling they are those of a map
/// of the room. In a recording the first to be seen after an empty view is the hand at the left, the second the one at the
/// top. A person does as well as a hand.
///
/// Exit code 3: it cannot tell.
///
/// Example: grideye orient --sensor pi-1/i2c-1:0x69
#[derive(Debug, Args)]
pub(crate) struct Orient {
    /// The sensor, where there are several.
    ///
    /// As the page names it, with its device and a slash before it where two devices have a sensor of that name.
    #[arg(long, value_name = "SENSOR")]
    pub(crate) sensor: Option<String>,
    /// Look at a recording, not at live frames.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["url", "token_file", "authority", "seconds"])]
    pub(crate) recording: Option<PathBuf>,
    /// Longest wait for each hand, in seconds.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub(crate) seconds: u64,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) collector: CollectorAddress,
}
