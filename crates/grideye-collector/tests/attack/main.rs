//! Attackers beside a device that keeps delivering: a hundred thousand requests through the router, and real sockets.
//!
//! `GRIDEYE_ATTACK_REQUESTS` sets the number of generated requests (default 20,000, or a million with
//! `GRIDEYE_ALL_SEEDS=1`), `GRIDEYE_ATTACK_SEED` their seed; the same seed gives the same requests.

#[cfg(test)]
mod agent;
#[cfg(test)]
mod collector_process;
#[cfg(test)]
mod made_up;
#[cfg(test)]
#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/patience.rs"]
mod patience;
#[cfg(test)]
mod router;
#[cfg(test)]
mod silent;
#[cfg(test)]
mod slow_bodies;
#[cfg(test)]
mod sockets;

/// Held exclusively by tests that measure; the others share it.
#[cfg(test)]
static ALONE: tokio::sync::RwLock<()> = tokio::sync::RwLock::const_new(());

#[cfg(test)]
fn from_environment(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}
