//! Checks host and origin: a page of another site may neither read nor write here.

use crate::http::refusal::Refusal;
use crate::peer::Peer;
use axum::extract::Request;
use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use std::net::IpAddr;

/// Rejects reads by a name that another site controls (DNS rebinding), and writes from another site.
pub(crate) fn check_origin(
    hosts: &HostNames,
    peer: Peer,
    request: &Request,
) -> Result<(), Refusal> {
    let host = host_of(request.uri(), request.headers())?;
    let mut origins = request.headers().get_all(header::ORIGIN).iter();
    let origin = origins.next();
    if origins.next().is_some() {
        let what = "the request must name its origin at most once";
        return Err(Refusal::new(StatusCode::BAD_REQUEST, "two_origins", what).field("origin"));
    }
    if !hosts.accepts(host) {
        let what = format!("this server does not answer for the host {host:?}");
        return Err(Refusal::new(StatusCode::FORBIDDEN, "unknown_host", what)
            .field("host")
            .hint("use 127.0.0.1 or the address that it listens on, or start it with the name (`--host-name pi.local`)"));
    }
    if matches!(
        *request.method(),
        Method::GET | Method::HEAD | Method::OPTIONS
    ) {
        return Ok(());
    }
    let Some(origin) = origin else {
        return Ok(());
    };
    let scheme = if peer.is_encrypted { "https" } else { "http" };
    let own = format!("{scheme}://{host}");
    if origin.as_bytes().eq_ignore_ascii_case(own.as_bytes()) {
        return Ok(());
    }
    let what = "a page of another site may not do this";
    Err(Refusal::new(StatusCode::FORBIDDEN, "foreign_origin", what).field("origin"))
}

/// The request's host and port, which must be named exactly once.
fn host_of<'r>(uri: &'r Uri, headers: &'r HeaderMap) -> Result<&'r str, Refusal> {
    let mut named = headers.get_all(header::HOST).iter();
    let host = match (named.next(), named.next(), uri.authority()) {
        (Some(host), None, None) => host.to_str().ok(),
        (Some(host), None, Some(authority)) => host
            .to_str()
            .ok()
            .filter(|host| authority.as_str().eq_ignore_ascii_case(host)),
        (None, _, Some(authority)) => Some(authority.as_str()),
        _ => None,
    };
    host.ok_or_else(|| {
        let what = "the request must name its host exactly once";
        Refusal::new(StatusCode::BAD_REQUEST, "no_host", what).field("host")
    })
}

#[derive(Debug, Clone)]
pub(crate) struct HostNames {
    listen: IpAddr,
    names: Vec<String>,
}

impl HostNames {
    /// Accepts loopback names, the address listened on, and `names`.
    pub(crate) fn new(listen: IpAddr, names: &[String]) -> Self {
        Self {
            listen,
            names: names.to_vec(),
        }
    }

    /// Any port is accepted: it may be forwarded.
    fn accepts(&self, host_and_port: &str) -> bool {
        let Some(host) = without_port(host_and_port) else {
            return false;
        };
        // A name may also be an address: that of this machine beyond a NAT, as QEMU guests see it.
        let mut names = self.names.iter();
        let is_named = names.any(|name| name.eq_ignore_ascii_case(host));
        let is_own = match host.parse::<IpAddr>() {
            // Rebinding needs a name: a server that listens on every address may accept every address.
            Ok(address) => {
                address.is_loopback() || address == self.listen || self.listen.is_unspecified()
            }
            Err(_name) => host.eq_ignore_ascii_case("localhost"),
        };
        is_named || is_own
    }
}

fn without_port(host: &str) -> Option<&str> {
    if let Some(bracketed) = host.strip_prefix('[') {
        let (address, port) = bracketed.split_once(']')?;
        return is_port(port).then_some(address);
    }
    let end = host.find(':').unwrap_or(host.len());
    is_port(&host[end..]).then_some(&host[..end])
}

fn is_port(text: &str) -> bool {
    text.is_empty()
        || text
            .strip_prefix(':')
            .is_some_and(|port| port.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_and_own_address_are_accepted_and_foreign_names_are_not() {
        let hosts = HostNames::new(IpAddr::from([192, 168, 1, 7]), &["Pi.local".to_owned()]);
        let own =
            "127.0.0.1 127.0.0.1:8080 127.9.9.9:1 localhost localhost:80 LocalHost [::1] [::1]:8080
                   192.168.1.7:8080 pi.local:8080 PI.LOCAL:8080";
        for own in own.split_whitespace() {
            assert!(hosts.accepts(own), "{own}");
        }
        let foreign = "evil.example evil.example:8080 localhost.evil.example 127.0.0.1.evil.example 192.168.1.8
                       :80 [::1 [::1]x 127.0.0.1:x localhost:80:80 [2001:db8::1] user@127.0.0.1";
        for foreign in foreign.split_whitespace().chain([""]) {
            assert!(!hosts.accepts(foreign), "{foreign}");
        }
    }

    #[test]
    fn named_and_listening_addresses_are_accepted() {
        for (listen, named, host, expected) in [
            ([127, 0, 0, 1], "10.0.2.2", "10.0.2.2:8833", true),
            ([127, 0, 0, 1], "10.0.2.2", "10.0.2.3:8833", false),
            ([127, 0, 0, 1], "pi.local", "10.0.2.2:8833", false),
            // A server that listens on every address accepts every address, but no foreign name.
            ([0, 0, 0, 0], "pi.local", "192.168.1.8:8080", true),
            ([0, 0, 0, 0], "pi.local", "[2001:db8::1]:8080", true),
            ([0, 0, 0, 0], "pi.local", "evil.example", false),
        ] {
            let hosts = HostNames::new(IpAddr::from(listen), &[named.to_owned()]);
            assert_eq!(hosts.accepts(host), expected, "{listen:?} {host}");
        }
    }
}
