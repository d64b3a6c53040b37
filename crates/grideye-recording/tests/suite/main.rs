//! The crate from outside: the wire format, the CSV recording format and the LINAIGE layout.

#[cfg(test)]
mod bare;
#[cfg(test)]
mod binary;
#[cfg(test)]
mod csv;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod linaige;
#[cfg(test)]
mod made_up;
#[cfg(test)]
mod wire;
