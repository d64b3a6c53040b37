//! The collector's promises, tested from outside.

#[cfg(test)]
mod accounts;
#[cfg(test)]
mod annexes;
#[cfg(test)]
mod auth;
#[cfg(test)]
mod backup;
#[cfg(test)]
mod batches;
#[cfg(test)]
mod clocks;
#[cfg(test)]
mod disks;
#[cfg(test)]
mod displacing;
#[cfg(test)]
mod gone;
#[cfg(test)]
mod http;
#[cfg(test)]
mod layouts;
#[cfg(test)]
mod log;
#[cfg(test)]
mod overwritten;
#[cfg(test)]
#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/patience.rs"]
mod patience;
#[cfg(test)]
#[expect(unreachable_pub, reason = "the tests of the whole share this file")]
#[path = "../../../../tests/src/postgres.rs"]
mod postgres;
#[cfg(test)]
mod recordings;
#[cfg(test)]
mod retain;
#[cfg(test)]
mod server;
#[cfg(test)]
mod settle;
#[cfg(test)]
#[expect(
    dead_code,
    unreachable_pub,
    reason = "the tests of the whole share this file"
)]
#[path = "../../../../tests/src/skip.rs"]
mod skip;
#[cfg(test)]
mod socket;
#[cfg(test)]
mod store;
#[cfg(test)]
mod tend;
#[cfg(test)]
mod tls;
