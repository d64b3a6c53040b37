//! Who may do what, through the router: tokens, scopes, the page's cookie, and how often.

mod answers;
mod folder;
mod server;
mod sign_in;
mod tokens;
