//! `grideye collect`: the collector as a program.

use crate::cli::Collect;
use crate::exit::Outcome;
use crate::progress;
use anyhow::{Context as _, Result};
use grideye_collector::{Collector, Config, StoreLocation};

/// Serves until Ctrl-C or SIGTERM.
pub(crate) fn run(options: Collect) -> Result<Outcome> {
    let runtime = tokio::runtime::Runtime::new().context("cannot start the collector's threads")?;
    runtime.block_on(async {
        let mut config = Config::new(options.listen, StoreLocation::File(options.store));
        config.network_trusted = options.trust_network;
        config.host_names = options.host_names;
        let collector = Collector::bind(config).await?;
        println!("http://{}/", collector.local_addr());
        collector.serve(stop_signal()).await?;
        progress::say("stopped: every acknowledged frame is on disk");
        Ok(Outcome::Done)
    })
}

/// Ready on Ctrl-C, and on the SIGTERM that systemd sends.
pub(crate) async fn stop_signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut terminated) = signal(SignalKind::terminate()) else {
        // Without a handler SIGTERM ends the program at once; Ctrl-C still stops it gently.
        drop(tokio::signal::ctrl_c().await);
        return;
    };
    tokio::select! {
        _interrupted = tokio::signal::ctrl_c() => {}
        _terminated = terminated.recv() => {}
    }
}
