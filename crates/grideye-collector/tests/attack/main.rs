//! Attackers and a device that goes on delivering: through the router by the hundred thousand, and on real sockets.
//!
//! `GRIDEYE_ATTACK_REQUESTS` says how many requests are made up (20,000 unless it is set, and a million with `GRIDEYE_ALL_SEEDS=1`), `GRIDEYE_ATTACK_SEED` from which
//! seed; the same seed makes the same requests.

#[cfg(test)]
mod made_up;
#[cfg(test)]
mod router;
#[cfg(test)]
mod sockets;

#[cfg(test)]
fn from_environment(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}

/// Memory of this process that is resident now, in KiB.
#[cfg(test)]
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.unwrap()
        .trim()
        .trim_end_matches(" kB")
        .parse()
        .unwrap()
}
