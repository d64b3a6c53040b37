//! The HTTP handlers, and the middleware before them.

pub(crate) mod agents;
mod annex;
pub(crate) mod audit;
pub(crate) mod authorize;
pub(crate) mod bodies;
pub(crate) mod body;
pub(crate) mod client;
pub(crate) mod devices;
pub(crate) mod events;
pub(crate) mod headers;
pub(crate) mod health;
pub(crate) mod ingest;
pub(crate) mod middleware;
mod origin;
pub(crate) mod recent;
pub(crate) mod recordings;
mod refusal;
mod state;

pub use annex::{Annex, Asset, Ingest, Inside};
pub(crate) use origin::HostNames;
pub use recordings::{attachment, played};
pub use refusal::Refusal;
pub(crate) use refusal::in_own_form;
pub use state::AppState;
pub(crate) use state::Options;
