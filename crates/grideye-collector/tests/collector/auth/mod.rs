//! Access control through the router: tokens, scopes, the page's cookie, and rates.

mod answers;
mod folder;
mod lost;
mod server;
mod sign_in;
mod tokens;
