//! Who may do what: tokens, sign-ins of the page, and the certificate authority, stored in one folder.
//!
//! ```text
//!   grideye-access/          0700
//!     tokens.json            each token's SHA-256, name, scope, devices, when created, when revoked
//!     session.key            signs the page's cookies
//!     authority.pem, .key    signs the collector's certificates; agents know it by its SHA-256
//!     address                the collector's last address, which `grideye enroll` prints
//! ```

mod authenticator;
mod authority;
mod book;
mod error;
mod folder;
mod limits;
mod session;
mod token;

pub(crate) use authenticator::{Authenticator, Caller, Presented, Unknown};
pub use authority::Authority;
pub(crate) use authority::pin;
pub use book::{TokenBook, TokenRecord};
pub use error::AccessError;
pub use folder::{AccessFolder, Address};
pub use limits::{DEVICES_PER_TOKEN_MAX, FILE_BYTES_MAX, TOKEN_NAME_CHARS_MAX, TOKENS_MAX};
pub use token::{Scope, Token, TokenId};
