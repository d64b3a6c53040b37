//! Two pages over HTTP/1.1, for one client at a time, on this machine only.

use super::status::Health;
use grideye_recording::prometheus::CONTENT_TYPE;
use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, Ipv6Addr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// Maximum size of a request in bytes; a longer one gets status 431.
pub const REQUEST_BYTES_MAX: usize = 8 * 1024;
/// Time limit for a request to arrive. Then the connection closes, and the next client gets its turn.
pub const REQUEST_TIME_MAX: Duration = Duration::from_secs(1);
/// Time limit for the client to read the answer.
pub const ANSWER_TIME_MAX: Duration = Duration::from_secs(1);
/// The pause after a failed accept, when the system is out of memory or descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Answers until the process ends. A slow client costs at most [`REQUEST_TIME_MAX`] plus [`ANSWER_TIME_MAX`].
pub fn serve(listener: &TcpListener, health: &Health) {
    loop {
        match listener.accept() {
            // A client that disconnects gets no answer, and its error concerns nobody else.
            Ok((stream, _)) => drop(answer(stream, health)),
            Err(_) => std::thread::sleep(ACCEPT_PAUSE),
        }
    }
}

fn answer(mut stream: TcpStream, health: &Health) -> io::Result<()> {
    let (status, content_type, body) = match read_request(&mut stream)? {
        None => {
            let status = "431 Request Header Fields Too Large";
            plain(status, "the request is too long\n")
        }
        Some(request) => page(&request, health),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\ncontent-type: {content_type}\r\ncontent-length: {}\r\ncache-control: no-store\r\n\
         x-content-type-options: nosniff\r\nconnection: close\r\n\r\n",
        body.len()
    );
    stream.set_write_timeout(Some(ANSWER_TIME_MAX))?;
    stream.write_all((head + &body).as_bytes())
}

/// First line and headers; `None` if they are too long.
fn read_request(stream: &mut TcpStream) -> io::Result<Option<String>> {
    let deadline = Instant::now() + REQUEST_TIME_MAX;
    let mut request = Vec::new();
    let mut piece = [0; 1024];
    while !request.windows(4).any(|end| end == b"\r\n\r\n") {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        let length = stream.read(&mut piece)?;
        if length == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        request.extend_from_slice(piece.get(..length).unwrap_or_default());
        if request.len() > REQUEST_BYTES_MAX {
            return Ok(None);
        }
    }
    Ok(Some(String::from_utf8_lossy(&request).into_owned()))
}

type Page = (&'static str, &'static str, String);

fn plain(status: &'static str, body: &str) -> Page {
    (status, "text/plain; charset=utf-8", body.to_owned())
}

fn page(request: &str, health: &Health) -> Page {
    let mut lines = request.lines();
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (method, path) = (
        words.next().unwrap_or_default(),
        words.next().unwrap_or_default(),
    );
    // Check the host: a website could resolve its own name to this address (DNS rebinding) and read the answer.
    let mut hosts = lines.filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.eq_ignore_ascii_case("host").then(|| value.trim())
    });
    if !hosts.next().is_some_and(is_of_this_machine) || hosts.next().is_some() {
        let what = "the Host header must name this machine, such as localhost\n";
        return plain("403 Forbidden", what);
    }
    if method != "GET" {
        return plain("405 Method Not Allowed", "use GET\n");
    }
    match path {
        "/health" => {
            let json = health.to_json();
            let status = if json["status"] == "ok" {
                "200 OK"
            } else {
                "503 Service Unavailable"
            };
            (status, "application/json", format!("{json}\n"))
        }
        "/metrics" => ("200 OK", CONTENT_TYPE, health.to_prometheus()),
        _ => plain("404 Not Found", "the pages are /health and /metrics\n"),
    }
}

/// Whether a `host` header names this machine's loopback, with or without a port.
fn is_of_this_machine(host: &str) -> bool {
    let with_port = host.rsplit_once(':');
    let with_port = with_port.filter(|(_, port)| port.parse::<u16>().is_ok());
    // An IPv6 address ends with a bracket, so its last colon is never taken for a port.
    let name = with_port.map_or(host, |(name, _)| name);
    let inner = name
        .strip_prefix('[')
        .and_then(|rest| rest.strip_suffix(']'));
    match inner {
        Some(inner) => inner.parse().is_ok_and(|at: Ipv6Addr| at.is_loopback()),
        None if name.eq_ignore_ascii_case("localhost") => true,
        None => name.parse().is_ok_and(|at: Ipv4Addr| at.is_loopback()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_of_this_machine_by_loopback_address_or_localhost() {
        let ours = "localhost LOCALHOST:8834 127.0.0.1 127.9.9.9:1 [::1] [::1]:8834";
        for host in ours.split(' ') {
            assert!(is_of_this_machine(host), "{host}");
        }
        let others = " evil.example localhost.evil.example 192.168.1.7:8834 localhost:x [::1]x [::2]:1 127.0.0.1:8834:1 ::1";
        for host in others.split(' ') {
            assert!(!is_of_this_machine(host), "{host}");
        }
    }
}
