//! Attackers and a device that goes on delivering: through the router by the hundred thousand, and on real sockets.
//!
//! `GRIDEYE_ATTACK_REQUESTS` says how many requests are made up (20,000 unless it is set, and a million with `GRIDEYE_ALL_SEEDS=1`), `GRIDEYE_ATTACK_SEED` from which
//! seed; the same seed makes the same requests.

#[cfg(test)]
mod agent;
#[cfg(test)]
mod collector_process;
#[cfg(test)]
mod made_up;
#[cfg(test)]
mod router;
#[cfg(test)]
mod silent;
#[cfg(test)]
mod slow_bodies;
#[cfg(test)]
mod sockets;

/// Who measures is alone; the others may run beside one another.
#[cfg(test)]
static ALONE: tokio::sync::RwLock<()> = tokio::sync::RwLock::const_new(());

#[cfg(test)]
fn from_environment(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}
