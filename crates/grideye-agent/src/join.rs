//! Introduces an agent to its collector: the line that `grideye enroll` prints, and the file that joining writes.
//!
//! ```text
//! echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=grideye-…,pin=sha256-…' | sudo grideye-agent join -
//! ```
//!
//! The line is a complete command to paste; the text between the quotation marks is the code. The pin is the SHA-256 of
//! the authority's certificate. While joining, the agent fetches the certificate with this hash from the collector, and
//! from then on trusts that authority alone.

mod credentials;
mod handshake;
mod line;

pub(crate) use credentials::is_host_and_port;
pub use credentials::{ClientCertificate, Credentials, NotJoined, Pin, Secret};
pub use handshake::authority_of;
pub use line::{JoinLine, Joined, read_text};
