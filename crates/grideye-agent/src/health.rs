//! How the agent does, for supervisors on the same machine: one JSON object, and Prometheus' metrics of the same figures.
//!
//! ```text
//!   GET /health    200 {"status":"ok", ...} or 503 {"status":"degraded","why":["delivery: ...", ...], ...}
//!   GET /metrics   grideye_agent_...
//! ```
//!
//! Nothing in it is secret: the collector's address and names of sensors, no token.

mod server;
mod status;
#[cfg(test)]
mod tests;

pub use server::{ANSWER_TIME_MAX, REQUEST_BYTES_MAX, REQUEST_TIME_MAX, serve};
pub(crate) use status::Identity;
pub use status::{Health, STALE_AFTER};
