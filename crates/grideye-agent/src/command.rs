//! One file per subcommand, and what they share.

pub(crate) mod check;
pub(crate) mod common;
pub(crate) mod join;
pub(crate) mod resend;
pub(crate) mod run;
