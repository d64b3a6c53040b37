//! Progress on a terminal; nothing where no person is looking.

pub(crate) use grideye_agent::output::say;
use indicatif::{ProgressBar, ProgressBarIter, ProgressFinish, ProgressStyle};
use std::io::{self, Read};
use std::num::NonZeroUsize;
use std::thread;
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};

/// A progress bar to `total` on standard error, if that is a terminal.
pub(crate) fn bar(total: u64, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(total).with_message(what);
    styled(
        bar,
        "  {msg:<12} {bar:32} {pos}/{len}  {per_sec}, {eta} left",
    )
}

fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_no_template) => bar,
    }
}

#[derive(Default)]
pub(crate) struct Bars(Option<(&'static str, ProgressBar)>);

impl Bars {
    pub(crate) fn show(&mut self, stage: &'static str, done: u64, total: u64) {
        if self.0.as_ref().is_none_or(|(shown, _)| *shown != stage) {
            self.0 = Some((stage, bar(total, stage)));
        }
        if let Some((_, bar)) = &self.0 {
            bar.set_position(done);
        }
    }
}

/// A reader with a progress bar over its bytes on standard error, if that is a terminal.
pub(crate) fn reading<R: Read>(input: R, bytes: u64) -> ProgressBarIter<R> {
    let bar = ProgressBar::new(bytes).with_finish(ProgressFinish::AndClear);
    let template = "  reading      {bar:32} {bytes}/{total_bytes}  {bytes_per_sec}, {eta} left";
    styled(bar, template).wrap_read(input)
}

pub(crate) async fn wait(seconds: u64, what: &'static str) {
    let bar = bar(seconds, what);
    let mut each = tokio::time::interval(Duration::from_secs(1));
    each.tick().await;
    for _ in 0..seconds {
        each.tick().await;
        bar.inc(1);
    }
    bar.finish_and_clear();
}

pub(crate) fn runtime() -> io::Result<Runtime> {
    Builder::new_current_thread().enable_all().build()
}

/// The default number of threads.
pub(crate) fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
