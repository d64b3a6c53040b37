//! `grideye collect`: the collector as a program.

use crate::cli::Collect;
use crate::exit::Outcome;
use crate::output::outln;
use crate::progress;
use anyhow::{Context as _, Result};
use grideye_collector::{Collector, Config, StoreLocation, SystemClock};
use std::io;
use std::sync::Arc;
use tokio::signal::unix::{SignalKind, signal};

/// Serves until Ctrl-C or SIGTERM.
pub(crate) fn run(options: Collect) -> Result<Outcome> {
    let runtime = tokio::runtime::Runtime::new().context("cannot start the collector's threads")?;
    runtime.block_on(async {
        let mut config = Config::new(
            options.listen,
            StoreLocation::File(options.store),
            Arc::new(SystemClock::new()),
        );
        config.network_trusted = options.trust_network;
        config.host_names = options.host_names;
        let collector = Collector::bind(config).await?;
        let stop = stop_signal().context("cannot catch Ctrl-C")?;
        outln!("http://{}/", collector.local_addr())?;
        collector.serve(stop).await?;
        progress::say("stopped: every acknowledged frame is on disk");
        Ok(Outcome::Done)
    })
}

/// Ready on Ctrl-C, and on the SIGTERM that systemd sends. Both are caught from this call on, not only once awaited.
///
/// # Errors
/// When the system lets no handler in. Must be called within a tokio runtime.
pub(crate) fn stop_signal() -> io::Result<impl Future<Output = ()> + Send + 'static> {
    let mut interrupted = signal(SignalKind::interrupt())?;
    let mut terminated = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _signal = interrupted.recv() => {}
            _signal = terminated.recv() => {}
        }
    })
}
