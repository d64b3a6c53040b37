//! Each connection takes a file descriptor, of which a process may have only so many.

use crate::limits::Limits;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Kept free for everything else: the store and its readers, files of the program's own routes, the runtime.
const OTHERS_MAX: usize = 128;
/// Displaced connections that are not closed yet.
pub(super) const LEAVING_MAX: usize = 128;

/// Raises the soft limit to what the connections need, if the hard limit allows; the limit afterwards, `None` without one.
pub(super) fn raise(limits: &Limits) -> Option<usize> {
    let needed = u64::try_from(limits.connections_max + LEAVING_MAX + OTHERS_MAX).ok()?;
    let limit = getrlimit(Resource::Nofile);
    let current = limit.current?;
    let wanted = limit.maximum.map_or(needed, |most| most.min(needed));
    let raised = Rlimit {
        current: Some(wanted),
        maximum: limit.maximum,
    };
    let is_raised = wanted > current && setrlimit(Resource::Nofile, raised).is_ok();
    let now = if is_raised { wanted } else { current };
    usize::try_from(now).ok()
}

/// Limits with fewer connections, where there are not enough descriptors; the limit for one address shrinks in proportion.
pub(super) fn fit(limits: &Limits, descriptors: usize) -> Option<Limits> {
    let available = descriptors.saturating_sub(LEAVING_MAX + OTHERS_MAX).max(1);
    if available >= limits.connections_max {
        return None;
    }
    let per_peer = limits.connections_per_peer_max.min(limits.connections_max);
    Some(Limits {
        connections_max: available,
        connections_per_peer_max: (per_peer * available / limits.connections_max).max(1),
        ..limits.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_are_as_many_as_there_are_descriptors_for_and_one_address_has_its_part_of_them() {
        let limits = Limits {
            connections_max: 4096,
            connections_per_peer_max: 2560,
            ..Limits::default()
        };
        assert_eq!(fit(&limits, 4096 + 256), None);
        let fitted = |descriptors| {
            let fitted = fit(&limits, descriptors).unwrap();
            (fitted.connections_max, fitted.connections_per_peer_max)
        };
        assert_eq!(fitted(4096 + 255), (4095, 2559));
        assert_eq!(fitted(1024), (768, 480));
        assert_eq!(fitted(100), (1, 1));
    }
}
