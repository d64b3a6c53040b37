//! Whom a request is counted for.

use crate::auth::{Caller, TokenId};
use crate::peer::AddressGroup;
use std::net::IpAddr;

/// A token, or an address if no token is required.
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
