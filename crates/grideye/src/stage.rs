//! A collector with its page on this computer, for one command.

use crate::client::Client;
use crate::{collect, progress};
use anyhow::{Context as _, Result};
use grideye_collector::{
    Annex, Collector, CollectorError, Config, Counting, StoreLocation, SystemClock,
};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use tokio::sync::watch;
use tokio::task::JoinHandle;

pub(crate) struct Stage {
    runtime: Option<Runtime>,
    pub(crate) address: SocketAddr,
    pub(crate) client: Client,
    pub(crate) interrupted: watch::Receiver<bool>,
    shut_down: watch::Sender<bool>,
    serving: Option<JoinHandle<Result<(), CollectorError>>>,
}

impl Stage {
    pub(crate) fn open(
        listen: SocketAddr,
        store: PathBuf,
        annexes: Vec<Annex>,
        counting: Option<Counting>,
    ) -> Result<Self> {
        let runtime =
            grideye_collector::runtime().context("cannot start the collector's threads")?;
        let store = StoreLocation::File(store);
        let mut config = Config::new(listen, store, Arc::new(SystemClock::new()));
        config.annexes = annexes;
        config.counting = counting;
        let collector = runtime.block_on(Collector::bind(config))?;
        let address = collector.local_addr();
        let (shut_down, mut is_shut_down) = watch::channel(false);
        let serving = runtime.spawn(collector.serve(async move {
            // A dropped sender also means shut down.
            let _asked_or_dropped = is_shut_down.wait_for(|asked| *asked).await;
        }));
        let (interrupt, interrupted) = watch::channel(false);
        let stop = {
            let _within = runtime.enter();
            collect::stop_signal().context("cannot catch Ctrl-C")?
        };
        runtime.spawn(async move {
            stop.await;
            interrupt.send_replace(true);
        });
        let client = Client::new(&format!("http://{address}"));
        Ok(Self {
            runtime: Some(runtime),
            address,
            client,
            interrupted,
            shut_down,
            serving: Some(serving),
        })
    }

    pub(crate) fn page(&self) -> String {
        format!("http://{}/", self.address)
    }

    pub(crate) fn wait_for_interrupt(&self) {
        let mut interrupted = self.interrupted.clone();
        if let Some(runtime) = &self.runtime {
            // A closed channel can bring no more signals.
            let _ = runtime.block_on(interrupted.wait_for(|interrupted| *interrupted));
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.shut_down.send_replace(true);
        let (Some(runtime), Some(serving)) = (self.runtime.take(), self.serving.take()) else {
            return;
        };
        if let Ok(Err(error)) = runtime.block_on(serving) {
            progress::say(&format!("warning: {error}"));
        }
        runtime.shutdown_timeout(Duration::from_secs(1));
    }
}

const OPENER: &str = if cfg!(target_os = "macos") {
    "open"
} else {
    "xdg-open"
};

/// Some openers run as long as the browser does, so a thread waits for it.
pub(crate) fn open_in_browser(page: &str) {
    let mut opener = Command::new(OPENER);
    opener.arg(page).stdin(Stdio::null()).stdout(Stdio::null());
    match opener.stderr(Stdio::null()).spawn() {
        Ok(mut opener) => {
            std::thread::spawn(move || match opener.wait() {
                Ok(status) if !status.success() => {
                    progress::say(&format!("warning: {OPENER} opened no browser ({status})"));
                }
                _opened => {}
            });
        }
        Err(error) => progress::say(&format!(
            "warning: cannot run {OPENER}: {error}\nhint: open the address above in a browser"
        )),
    }
}
