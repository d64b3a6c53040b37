//! A network that goes wrong, between agent and collector.

use crate::seeded::Seeded;
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What the network does to one connection.
const MISFORTUNES: [&str; 7] = [
    "none",
    "drop",
    "delay",
    "reset in mid-body",
    "half-close",
    "truncated answer",
    "swallowed answer",
];

/// A network that goes wrong, by a seed.
pub(crate) struct Proxy {
    pub(crate) url: String,
    pub(crate) is_kind: Arc<AtomicBool>,
    counts: Arc<Mutex<BTreeMap<&'static str, u64>>>,
    drawn: Arc<AtomicU64>,
}

impl Proxy {
    pub(crate) fn start(collector: SocketAddr, seed: u64) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let proxy = Self {
            url: format!("http://{}", listener.local_addr().unwrap()),
            is_kind: Arc::default(),
            counts: Arc::default(),
            drawn: Arc::default(),
        };
        let (is_kind, counts, drawn) = (
            Arc::clone(&proxy.is_kind),
            Arc::clone(&proxy.counts),
            Arc::clone(&proxy.drawn),
        );
        std::thread::spawn(move || {
            let mut seeded = Seeded(seed);
            for stream in listener.incoming().flatten() {
                let drawn_now = seeded.below(u64::try_from(MISFORTUNES.len()).unwrap());
                let kind = is_kind.load(Ordering::SeqCst);
                let misfortune = if kind {
                    "none"
                } else {
                    MISFORTUNES[usize::try_from(drawn_now).unwrap()]
                };
                drawn.fetch_add(1, Ordering::SeqCst);
                *counts.lock().unwrap().entry(misfortune).or_default() += 1;
                std::thread::spawn(move || carry(&stream, collector, misfortune));
            }
        });
        proxy
    }

    pub(crate) fn said(&self) -> String {
        let counts = self.counts.lock().unwrap();
        let named: Vec<String> = counts
            .iter()
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        format!(
            "{} connections ({})",
            self.drawn.load(Ordering::SeqCst),
            named.join(", ")
        )
    }
}

/// Requests on one connection that go well before the misfortune.
const GOOD_REQUESTS: u32 = 4;

/// Carries requests and answers one by one; the last of some meets with the misfortune.
fn carry(agent: &TcpStream, collector: SocketAddr, misfortune: &str) {
    let Ok(far) = TcpStream::connect(collector) else {
        return;
    };
    let mut requests = BufReader::new(agent.try_clone().unwrap());
    let mut answers = BufReader::new(far.try_clone().unwrap());
    for number in 0.. {
        let is_now = number == GOOD_REQUESTS && misfortune != "none";
        let Some(request) = message(&mut requests) else {
            return;
        };
        match misfortune {
            "drop" if is_now => return,
            "delay" if is_now => std::thread::sleep(Duration::from_millis(1700)),
            "reset in mid-body" if is_now => {
                let _ = (&far).write_all(&request[..request.len() / 2]);
                return;
            }
            _ => {}
        }
        if (&far).write_all(&request).is_err() {
            return;
        }
        if is_now && misfortune == "half-close" {
            let _ = far.shutdown(Shutdown::Write);
        }
        let Some(answer) = message(&mut answers) else {
            return;
        };
        match misfortune {
            "truncated answer" if is_now => {
                let _ = { agent }.write_all(&answer[..answer.len() / 2]);
                return;
            }
            // The agent hears nothing, and does not hear that it will hear nothing.
            "swallowed answer" if is_now => {
                std::thread::sleep(Duration::from_secs(2));
                return;
            }
            _ => {}
        }
        if { agent }.write_all(&answer).is_err() || is_now {
            return;
        }
    }
}

/// One message of HTTP, head and body.
fn message(reader: &mut BufReader<TcpStream>) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut length = 0;
    loop {
        let begin = bytes.len();
        if reader.read_until(b'\n', &mut bytes).ok()? == 0 {
            return None;
        }
        let line = String::from_utf8_lossy(&bytes[begin..]).to_ascii_lowercase();
        if let Some(value) = line.strip_prefix("content-length:") {
            length = value.trim().parse().ok()?;
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    bytes.extend(body);
    Some(bytes)
}
