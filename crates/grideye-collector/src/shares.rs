//! Shares of what is limited in total: a sender may hold at most as much as is free. So one alone gets half, and however
//! much a few hold, the next one gets something.

use crate::auth::{Caller, TokenId};
use crate::lock::lock;
use crate::peer::AddressGroup;
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex};

/// Whom a request is counted for: a token, or an address if no token is required.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Sender {
    Token(TokenId),
    Group(AddressGroup),
}

impl Sender {
    pub(crate) fn of(caller: Option<&Caller>, peer: IpAddr) -> Self {
        match caller {
            Some(Caller::Holder { record, .. }) => Self::Token(record.id.clone()),
            Some(Caller::Anyone) | None => Self::Group(AddressGroup::of(peer)),
        }
    }
}

/// What is limited: connections, bytes, clients, requests.
pub(crate) struct Shares {
    all_max: usize,
    own_max: usize,
    held: Mutex<Held>,
}

#[derive(Default)]
struct Held {
    all: usize,
    of: HashMap<Sender, usize>,
}

/// Why a sender gets no more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Denied {
    /// Nearly all is held.
    All,
    /// The sender already holds this much, as much as is free for it.
    Own(usize),
}

impl Shares {
    /// `all_max` in total; of it, no sender holds more than `own_max`.
    pub(crate) fn new(all_max: usize, own_max: usize) -> Arc<Self> {
        Arc::new(Self {
            all_max,
            own_max,
            held: Mutex::default(),
        })
    }

    /// What all senders hold.
    pub(crate) fn held(&self) -> usize {
        lock(&self.held).all
    }

    pub(crate) fn take(self: &Arc<Self>, sender: Sender, amount: usize) -> Result<Share, Denied> {
        let mut share = Share {
            shares: Arc::clone(self),
            sender,
            amount: 0,
        };
        share.grow(amount)?;
        Ok(share)
    }
}

/// What one request or connection holds; given back on drop.
pub(crate) struct Share {
    shares: Arc<Shares>,
    sender: Sender,
    amount: usize,
}

impl Share {
    pub(crate) fn grow(&mut self, more: usize) -> Result<(), Denied> {
        let Held { all, of } = &mut *lock(&self.shares.held);
        let free = self.shares.all_max.saturating_sub(*all);
        let own = of.get(&self.sender).copied().unwrap_or(0);
        if more > free {
            return Err(Denied::All);
        }
        if own.saturating_add(more) > free.min(self.shares.own_max) {
            return Err(Denied::Own(own));
        }
        *all += more;
        of.insert(self.sender.clone(), own + more);
        self.amount += more;
        Ok(())
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let Held { all, of } = &mut *lock(&self.shares.held);
        *all -= self.amount;
        let own = of.get(&self.sender).map_or(0, |own| own - self.amount);
        match own {
            0 => of.remove(&self.sender),
            own => of.insert(self.sender.clone(), own),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sender(number: u8) -> Sender {
        Sender::of(None, IpAddr::from([10, 0, 0, number]))
    }

    #[test]
    fn a_sender_holds_at_most_as_much_as_is_free_and_the_next_always_gets_something() {
        let shares = Shares::new(64, usize::MAX);
        let mut held = Vec::new();
        let mut of_each = Vec::new();
        for number in 0..5 {
            let before = held.len();
            while let Ok(share) = shares.take(sender(number), 1) {
                held.push(share);
            }
            of_each.push(held.len() - before);
        }
        assert_eq!(of_each, [32, 16, 8, 4, 2]);
        assert_eq!(shares.take(sender(0), 1).err(), Some(Denied::Own(32)));
        assert_eq!(shares.take(sender(9), 3).err(), Some(Denied::All));
        held.truncate(10);
        assert_eq!(shares.held(), 10);
        held.clear();
        let Held { all, of } = &*lock(&shares.held);
        assert_eq!((*all, of.len()), (0, 0));
    }

    #[test]
    fn a_share_grows_up_to_a_limit_of_its_own() {
        let shares = Shares::new(25_000, 10_000);
        let mut first = shares.take(sender(1), 6000).unwrap();
        let second = shares.take(sender(1), 3000).unwrap();
        assert_eq!(first.grow(1001), Err(Denied::Own(9000)));
        assert_eq!(first.grow(1000), Ok(()));
        drop(first);
        assert_eq!(shares.held(), 3000);
        drop(second);
        assert_eq!(shares.held(), 0);
    }
}
