//! How a test waits for what must come, beside whatever else this machine does.
//!
//! Tests of other crates compile this file as well.

use std::time::{Duration, Instant};

/// Only a test that fails waits this long: many times what anything takes on a busy machine.
pub const WAIT_MAX: Duration = Duration::from_secs(300);

/// Asks until there is an answer.
///
/// # Panics
/// When none comes in time.
pub fn wait_for<T>(what: &str, ask: impl FnMut() -> Option<T>) -> T {
    wait_or_explain(ask, || what.to_owned())
}

/// The same, with something to say about what did not come.
///
/// # Panics
/// When none comes in time.
pub fn wait_or_explain<T>(
    mut ask: impl FnMut() -> Option<T>,
    explain: impl FnOnce() -> String,
) -> T {
    let since = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        let waited = since.elapsed();
        assert!(waited < WAIT_MAX, "waited in vain for {}", explain());
        // What takes long is asked for seldom: asking costs the processor that it waits for.
        let pause = (waited / 10).clamp(Duration::from_millis(2), Duration::from_millis(200));
        std::thread::sleep(pause);
    }
}
