//! What the collector promises, seen from outside.

#[cfg(test)]
mod batches;
#[cfg(test)]
mod http;
#[cfg(test)]
mod socket;
#[cfg(test)]
mod store;
