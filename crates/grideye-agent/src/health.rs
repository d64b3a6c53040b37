//! The agent's health for supervisors on the same machine: one JSON object, and the same figures as Prometheus metrics.
//!
//! ```text
//!   GET /health    200 {"status":"ok", ...} or 503 {"status":"degraded","why":["delivery: ...", ...], ...}
//!   GET /metrics   grideye_agent_...
//! ```
//!
//! It contains no secrets: the collector's address and sensor names, but no token.

mod server;
mod status;
#[cfg(test)]
mod tests;

pub use server::{ANSWER_TIME_MAX, REQUEST_BYTES_MAX, REQUEST_TIME_MAX, serve};
pub(crate) use status::Identity;
pub use status::{Health, STALE_AFTER};
