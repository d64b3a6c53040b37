//! The outcome of every frame of a sensor in 24 hours, read by the agent and by polling on the host's clock.
//!
//! ```text
//! cargo bench -p grideye-agent --bench acquisition [-- --hours N] [--only 'PART OF A ROW']
//! ```
//!
//! `--only '400 kHz 1 Hz'`, `--only '400 kHz 10 Hz poll, 128-byte burst'`: only the rows with these first columns.
//!
//! Emulated time, without real pauses. The sensor's clock is at -6 %, -4.3 %, 0 and +6 %, and drifting from -6 % to +6
//! %; the host wakes up 0 to 40 ms late at random. Each row of the agent is checked, so a torn or duplicate frame or a
//! wrong number ends the program.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "what fails here fails the benchmark, which prints a table"
)]

#[path = "../tests/agent/table.rs"]
mod table;

use amg8833::FrameRate;
use std::time::Duration;
use table::{Case, HEADING, Tally, Way, row, run};

const WAYS: [Way; 4] = [Way::Agent, Way::Singles, Way::Blocks, Way::Burst];

fn main() {
    let hours = hours();
    println!(
        "{hours} h of each sensor, clocks from -6 to +6 %, host 0 to 40 ms late; shares: least - most over the clocks\n"
    );
    println!("{HEADING}");
    let only = argument("--only").unwrap_or_default();
    for rate in [FrameRate::Ten, FrameRate::One] {
        for scl_hz in [100_000, 400_000] {
            for way in WAYS {
                let cases = cases(rate, scl_hz, hours);
                if !is_wanted(&cases[0], way, &only) {
                    continue;
                }
                let tallies: Vec<Tally> = cases.iter().map(|case| run(case, way)).collect();
                println!("{}", row(&cases[0], way, &tallies));
                for tally in tallies.iter().filter(|_| way == Way::Agent) {
                    assert_eq!(
                        (
                            tally.torn,
                            tally.doubled,
                            tally.missed_unknown,
                            tally.strange_thermistors
                        ),
                        (0, 0, 0, 0),
                        "{tally:?}"
                    );
                }
            }
        }
    }
}

/// One case per clock.
fn cases(rate: FrameRate, scl_hz: u32, hours: u32) -> Vec<Case> {
    let rise = 120_000 / i32::try_from(hours).unwrap();
    [
        (-60_000, 0),
        (-43_000, 0),
        (0, 0),
        (60_000, 0),
        (-60_000, rise),
    ]
    .into_iter()
    .map(|(error_ppm, drift_ppm_per_hour)| Case {
        rate,
        scl_hz,
        error_ppm,
        drift_ppm_per_hour,
        span: Duration::from_secs(3600) * hours,
        late_max: Duration::from_millis(40),
    })
    .collect()
}

/// Whether this row's first columns contain the `--only` text.
fn is_wanted(case: &Case, way: Way, only: &str) -> bool {
    let (khz, hz) = (case.scl_hz / 1000, case.rate.fps());
    let row = format!("{khz} kHz {hz} Hz {}", way.name());
    row.contains(only)
}

fn hours() -> u32 {
    argument("--hours").map_or(24, |hours| hours.parse().unwrap())
}

/// The argument after this word; cargo adds `--bench`.
fn argument(name: &str) -> Option<String> {
    let arguments: Vec<String> = std::env::args().collect();
    let mut pairs = arguments.windows(2);
    pairs
        .find(|pair| pair[0] == name)
        .map(|pair| pair[1].clone())
}
