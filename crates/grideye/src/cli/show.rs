//! Arguments of the commands that end in a page.

use super::access::Scenes;
use super::shared::positive;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Show the whole loop on this computer, without hardware.
///
/// Runs an emulated sensor, agent, collector and live page; then records, compares and writes a report. The page opens
/// with the sensor beside its scene.
///
/// Example: grideye demo --once --out out
#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// Exit with the verdict's code; do not keep serving.
    ///
    /// Without it, the page is served until Ctrl-C.
    #[arg(long)]
    pub(crate) once: bool,
    /// Folder for store, recording, report.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Scene to show [default: a walk in a living room].
    ///
    /// At its end it begins again. scenes/experiment-1.toml is the paper's.
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub(crate) scene: Option<PathBuf>,
    /// Sensor of the scene [default: the only one].
    #[arg(long, value_name = "NAME", conflicts_with = "replay")]
    pub(crate) sensor: Option<String>,
    /// Recording to replay instead of a scene.
    ///
    /// The frames pass through the emulated sensor's registers, and the report counts and compares each one.
    #[arg(long, value_name = "RECORDING")]
    pub(crate) replay: Option<PathBuf>,
    /// Emulated seconds per real second.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = positive)]
    pub(crate) speed: f64,
    /// Seed of the emulated sensor's noise.
    ///
    /// The comparison simulates with another seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) page: Page,
}

/// Play any recording in a browser.
///
/// Reads what `grideye convert` reads, plays it on the live page, and keeps nothing. With scenes, the page compares it.
///
/// Example: grideye view recording.csv --open
#[derive(Debug, Args)]
pub(crate) struct View {
    /// Recording of any format.
    pub(crate) recording: PathBuf,
    #[command(flatten)]
    pub(crate) page: Page,
}

/// The page that a command serves until Ctrl-C.
#[derive(Debug, Args)]
pub(crate) struct Page {
    /// Address of the page.
    ///
    /// Port 0 picks a free one.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:0")]
    pub(crate) listen: SocketAddr,
    /// Open the page in a browser.
    ///
    /// Calls `xdg-open`, or `open` on macOS.
    #[arg(long)]
    pub(crate) open: bool,
    #[command(flatten)]
    pub(crate) scenes: Scenes,
}
