//! How an agent comes to know its collector: the line that `grideye enroll` prints, and the file that joining leaves.
//!
//! ```text
//! echo 'grideye:https://192.168.1.20:8833,device=pi-1,token=grideye-…,pin=sha256-…' | sudo grideye-agent join -
//! ```
//!
//! The line is the whole command, so that it can be pasted as it is; the part between the quotation marks is the code.
//! The pin is the SHA-256 of the authority's certificate. While joining, the agent takes from the collector the
//! certificate that has this hash, and from then on believes that authority and no other.

mod credentials;
mod handshake;
mod line;

pub(crate) use credentials::is_host_and_port;
pub use credentials::{ClientCertificate, Credentials, NotJoined, Pin, Secret};
pub use handshake::authority_of;
pub use line::{JoinLine, Joined};
