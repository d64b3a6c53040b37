//! Tracks open connections, and decides which one a new connection displaces when there is no room.
//!
//! ```text
//!    silent ──▶ asking ◀──▶ idle     displaced in the order silent, idle, asking; the oldest first
//!                 └──▶ established    never displaced
//! ```
//!
//! A silent connection has sent no complete header. An established one has shown a valid token or, if none is required,
//! had a successful response; those of one token (or address) are at most as many as are not established. A newcomer from an address group at its limit displaces a connection of that group;
//! otherwise one of the group that has the most of that kind.

use crate::counters::{Counters, add};
use crate::limits::Limits;
use crate::lock::lock;
use crate::peer::AddressGroup;
use crate::shares::{Sender, Share, Shares};
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};
use std::net::IpAddr;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, OnceLock};
use tokio::task::AbortHandle;

/// A connection's state, in the order of displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    Silent,
    Idle,
    Asking,
    Established,
}

const TIERS: usize = 3;

impl Standing {
    const fn tier(self) -> Option<usize> {
        match self {
            Self::Silent => Some(0),
            Self::Idle => Some(1),
            Self::Asking => Some(2),
            Self::Established => None,
        }
    }
}

pub(crate) struct Connections {
    places: Mutex<Places>,
    established: Arc<Shares>,
    counters: Arc<Counters>,
}

impl Connections {
    pub(crate) fn new(limits: &Limits, counters: Arc<Counters>) -> Self {
        Self {
            places: Mutex::new(Places::new(limits)),
            established: Shares::new(limits.connections_max, usize::MAX),
            counters,
        }
    }

    /// A new connection, and the address group of the one it displaced; `None` if all places are taken and nothing can
    /// be displaced. The limit per address does not apply to a trusted proxy.
    pub(crate) fn admit(
        self: &Arc<Self>,
        peer: IpAddr,
        is_trusted_proxy: bool,
    ) -> Option<(Connection, Option<AddressGroup>)> {
        let group = AddressGroup::of(peer);
        let admitted = lock(&self.places).admit(group, is_trusted_proxy);
        let (number, displaced) = admitted.or_else(|| {
            add(&self.counters.turned_away, 1);
            None
        })?;
        add(&self.counters.connections, 1);
        match &displaced {
            None => add(&self.counters.connections_open, 1),
            Some(place) => {
                add(&self.counters.displaced, 1);
                if let Some(task) = &place.task {
                    task.abort();
                }
            }
        }
        let connection = Connection {
            all: Arc::clone(self),
            number,
            established: OnceLock::new(),
        };
        Some((connection, displaced.map(|place| place.group)))
    }

    pub(crate) fn serve_by(&self, number: u64, task: AbortHandle) {
        if let Some(place) = lock(&self.places).open.get_mut(&number) {
            place.task = Some(task);
        }
    }
}

/// One open connection. Its place is freed on drop, or at once when it is displaced.
pub(crate) struct Connection {
    all: Arc<Connections>,
    number: u64,
    /// Read without a lock: requests of an established connection take none.
    established: OnceLock<Share>,
}

impl Connection {
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    pub(crate) fn tls_failed(&self) {
        add(&self.all.counters.tls_failed, 1);
    }

    pub(crate) fn is_established(&self) -> bool {
        self.established.get().is_some()
    }

    /// A complete header arrived.
    pub(crate) fn asks(&self) {
        self.comes_to(Standing::Asking);
    }

    pub(crate) fn is_answered(&self) {
        self.comes_to(Standing::Idle);
    }

    /// From now on it is never displaced, unless too many of its sender's are established.
    pub(crate) fn establish(&self, sender: impl FnOnce() -> Sender) {
        if self.is_established() {
            return;
        }
        if let Ok(share) = self.all.established.take(sender(), 1) {
            self.comes_to(Standing::Established);
            // One request at a time is answered on a connection.
            let _ = self.established.set(share);
        }
    }

    fn comes_to(&self, standing: Standing) {
        if !self.is_established() {
            lock(&self.all.places).move_to(self.number, standing);
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        if lock(&self.all.places).remove(self.number).is_some() {
            let open = &self.all.counters.connections_open;
            open.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

struct Places {
    connections_max: usize,
    per_group_max: usize,
    /// Number of the next connection, in order of arrival.
    next: u64,
    open: HashMap<u64, Place>,
    by_group: HashMap<AddressGroup, Group>,
}

/// The connections of one address group.
#[derive(Default)]
struct Group {
    count: usize,
    /// Those that can be displaced, by standing.
    tiers: [BTreeSet<u64>; TIERS],
}

struct Place {
    group: AddressGroup,
    standing: Standing,
    task: Option<AbortHandle>,
}

impl Places {
    fn new(limits: &Limits) -> Self {
        Self {
            connections_max: limits.connections_max,
            per_group_max: limits.connections_per_peer_max,
            next: 0,
            open: HashMap::new(),
            by_group: HashMap::new(),
        }
    }

    /// The number of a new connection, and the place it displaced.
    fn admit(
        &mut self,
        group: AddressGroup,
        is_trusted_proxy: bool,
    ) -> Option<(u64, Option<Place>)> {
        let own = self.by_group.get(&group);
        let full = own.filter(|own| !is_trusted_proxy && own.count >= self.per_group_max);
        let oldest = if let Some(own) = full {
            Some(own.tiers.iter().find_map(|tier| tier.first().copied())?)
        } else if self.open.len() >= self.connections_max {
            Some((0..TIERS).find_map(|tier| self.oldest_of_largest(tier))?)
        } else {
            None
        };
        let displaced = oldest.and_then(|oldest| self.remove(oldest));
        let number = self.next;
        self.next += 1;
        let place = Place {
            group,
            standing: Standing::Silent,
            task: None,
        };
        self.open.insert(number, place);
        let own = self.by_group.entry(group).or_default();
        own.count += 1;
        own.tiers[0].insert(number);
        Some((number, displaced))
    }

    fn move_to(&mut self, number: u64, standing: Standing) {
        // It may have been displaced meanwhile.
        let Some(place) = self.open.get_mut(&number) else {
            return;
        };
        let before = std::mem::replace(&mut place.standing, standing);
        let Some(group) = self.by_group.get_mut(&place.group) else {
            return;
        };
        if let Some(tier) = before.tier() {
            group.tiers[tier].remove(&number);
        }
        if let Some(tier) = standing.tier() {
            group.tiers[tier].insert(number);
        }
    }

    fn remove(&mut self, number: u64) -> Option<Place> {
        let place = self.open.remove(&number)?;
        let group = self.by_group.get_mut(&place.group)?;
        group.count -= 1;
        for tier in &mut group.tiers {
            tier.remove(&number);
        }
        if group.count == 0 {
            self.by_group.remove(&place.group);
        }
        Some(place)
    }

    /// The oldest connection of the group with the most of this tier; among equals, the oldest of all. Looks at every
    /// group, of which there are no more than connections.
    fn oldest_of_largest(&self, tier: usize) -> Option<u64> {
        let groups = self.by_group.values().map(|group| &group.tiers[tier]);
        let sized = groups.filter_map(|tier| Some((tier.len(), Reverse(*tier.first()?))));
        sized.max().map(|(_, Reverse(oldest))| oldest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 1));
    const B: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 2));
    const C: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 3));

    struct Scene {
        all: Arc<Connections>,
        counters: Arc<Counters>,
        open: Vec<Connection>,
    }

    impl Scene {
        fn new(connections_max: usize, connections_per_peer_max: usize) -> Self {
            let limits = Limits {
                connections_max,
                connections_per_peer_max,
                ..Limits::default()
            };
            let counters = Arc::<Counters>::default();
            Self {
                all: Arc::new(Connections::new(&limits, Arc::clone(&counters))),
                counters,
                open: Vec::new(),
            }
        }

        /// Admits a connection or not; returns the numbers that disappeared.
        fn comes(&mut self, from: IpAddr) -> Option<Vec<u64>> {
            let before = self.numbers();
            self.open.push(self.all.admit(from, false)?.0);
            let after = self.numbers();
            Some(before.difference(&after).copied().collect())
        }

        fn numbers(&self) -> BTreeSet<u64> {
            lock(&self.all.places).open.keys().copied().collect()
        }

        fn of(&self, number: usize) -> &Connection {
            &self.open[number]
        }

        /// Each is of a sender of its own.
        fn establish(&self, number: usize) {
            let last = u8::try_from(number).unwrap();
            self.of(number)
                .establish(|| Sender::of(None, [10, 9, 9, last].into()));
        }

        fn establish_last(&self) {
            self.establish(self.open.len() - 1);
        }
    }

    #[test]
    fn the_oldest_silent_one_makes_room_then_the_oldest_idle_one_then_the_oldest_asking_one() {
        let mut scene = Scene::new(6, 6);
        for _ in 0..6 {
            assert_eq!(scene.comes(A), Some(vec![]));
        }
        scene.of(0).asks();
        for number in [1, 2] {
            scene.of(number).asks();
            scene.of(number).is_answered();
        }
        scene.of(4).asks();
        scene.establish(4);
        scene.of(4).is_answered();
        for makes_room in [3, 5] {
            assert_eq!(scene.comes(A), Some(vec![makes_room]));
            scene.establish_last();
        }
        // A connection that sends another request is not idle.
        scene.of(1).asks();
        for makes_room in [2, 0, 1] {
            assert_eq!(scene.comes(A), Some(vec![makes_room]));
            scene.establish_last();
        }
        assert_eq!(scene.comes(A), None, "all are established");
        assert_eq!(scene.comes(B), None, "all are established");
        let Counters {
            displaced,
            turned_away,
            connections_open,
            connections,
            ..
        } = &*scene.counters;
        let counted = [displaced, turned_away, connections_open, connections];
        assert_eq!(counted.map(crate::counters::load), [5, 2, 6, 11]);
    }

    #[test]
    fn an_address_at_its_limit_displaces_one_of_its_own() {
        let mut scene = Scene::new(100, 2);
        for from in [B, A, A, B] {
            assert_eq!(scene.comes(from), Some(vec![]));
        }
        assert_eq!(scene.comes(A), Some(vec![1]));
        scene.establish(2);
        assert_eq!(scene.comes(A), Some(vec![4]));
        scene.establish_last();
        assert_eq!(scene.comes(A), None);
        assert_eq!(scene.comes(C), Some(vec![]));
        assert!(scene.all.admit(A, true).is_some(), "a trusted proxy");
    }

    #[test]
    fn a_full_server_displaces_from_the_address_with_the_most_silent_connections() {
        let mut scene = Scene::new(6, 6);
        for from in [C, A, A, A, B, B] {
            assert_eq!(scene.comes(from), Some(vec![]));
        }
        // A's two are no attack: now B has the most silent ones.
        scene.establish(1);
        scene.of(2).asks();
        assert_eq!(scene.comes(A), Some(vec![4]));
        // A has two silent ones, B and C one each.
        assert_eq!(scene.comes(B), Some(vec![3]));
        // B has two now.
        assert_eq!(scene.comes(C), Some(vec![5]));
        assert_eq!(scene.comes(C), Some(vec![0]));
    }

    #[test]
    fn all_connections_of_one_sender_leave_room_for_others() {
        let limits = Limits::default();
        let mut scene = Scene::new(limits.connections_max, limits.connections_per_peer_max);
        let hostile = || Sender::of(None, [10, 9, 9, 9].into());
        for from in [A, B] {
            for _ in 0..limits.connections_max / 2 {
                assert_eq!(scene.comes(from), Some(vec![]));
                let connection = scene.open.last().unwrap();
                connection.asks();
                connection.establish(hostile);
                connection.is_answered();
            }
        }
        // The first half of them stays.
        let half = u64::try_from(limits.connections_max / 2).unwrap();
        for number in 0..100 {
            assert_eq!(scene.comes(C), Some(vec![half + number]));
            let newcomer = scene.open.last().unwrap();
            let last = u8::try_from(number).unwrap();
            newcomer.establish(|| Sender::of(None, [10, 9, 8, last].into()));
            assert!(newcomer.is_established());
        }
    }

    #[test]
    fn a_place_is_freed_once_whether_displaced_or_closed() {
        let mut scene = Scene::new(2, 2);
        for from in [A, A] {
            assert_eq!(scene.comes(from), Some(vec![]));
        }
        assert_eq!(scene.comes(B), Some(vec![0]));
        let of = |counter| crate::counters::load(counter);
        // The displaced connection learns of it only now, and frees no other place.
        scene.of(0).asks();
        scene.establish(0);
        drop(scene.open.remove(0));
        assert_eq!(of(&scene.counters.connections_open), 2);
        assert_eq!(scene.numbers(), BTreeSet::from([1, 2]));
        scene.open.clear();
        assert_eq!(of(&scene.counters.connections_open), 0);
        let places = lock(&scene.all.places);
        assert!(places.open.is_empty() && places.by_group.is_empty());
    }

    #[tokio::test]
    async fn displacing_aborts_the_connections_task() {
        let mut scene = Scene::new(1, 1);
        let mut tasks = tokio::task::JoinSet::new();
        scene.comes(A);
        let task = tasks.spawn(std::future::pending::<()>());
        scene.all.serve_by(0, task);
        assert_eq!(scene.comes(A), Some(vec![0]));
        assert!(tasks.join_next().await.unwrap().unwrap_err().is_cancelled());
    }
}
