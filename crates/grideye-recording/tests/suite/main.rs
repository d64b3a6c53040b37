//! The crate's public API: records, the wire format, the CSV recording format and the page of metrics.

#[cfg(test)]
mod binary;
#[cfg(test)]
mod csv;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod made_up;
#[cfg(test)]
mod prometheus;
#[cfg(test)]
mod record;
#[cfg(test)]
mod wire;
