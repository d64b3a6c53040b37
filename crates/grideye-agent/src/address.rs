//! What a collector's address looks like.

use std::net::Ipv6Addr;

/// Whether this is HOST:PORT. An address that cannot be right is refused at the start: as a failed delivery it would be
/// retried without end.
pub(crate) fn is_host_and_port(authority: &str) -> bool {
    let Some((host, port)) = authority.rsplit_once(':') else {
        return false;
    };
    let is_port =
        port.bytes().all(|b| b.is_ascii_digit()) && port.parse::<u16>().is_ok_and(|port| port != 0);
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let is_host = match host.strip_prefix('[') {
        Some(inner) => inner
            .strip_suffix(']')
            .is_some_and(|inner| inner.parse::<Ipv6Addr>().is_ok()),
        None => !host.is_empty() && host.chars().all(is_name),
    };
    is_port && is_host
}

/// Whether this is the address of a collector, and what is wrong with it otherwise.
pub(crate) fn check_url(url: &str) -> Result<(), String> {
    let authority = url
        .strip_prefix("https://")
        .or_else(|| url.strip_prefix("http://"));
    if authority.is_some_and(is_host_and_port) {
        return Ok(());
    }
    Err("the collector is not named as https://HOST:PORT".to_owned())
}
