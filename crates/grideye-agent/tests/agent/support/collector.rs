//! A scripted collector.

use grideye_recording::Record;
use grideye_recording::wire::{Acknowledgement, Batch, Gap};
use std::collections::{BTreeMap, VecDeque};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The collector's response to one post.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Conduct {
    /// Store and acknowledge.
    Store,
    /// Store, then close the connection without an answer.
    StoreAndHangUp,
    /// Close the connection without storing.
    HangUp,
    /// Answer with this status and store nothing.
    Status(u16),
    /// Answer 503 and ask for this pause, in seconds.
    RetryAfter(u64),
    /// Stay silent for this many milliseconds, then close the connection.
    Silence(u64),
    /// Reject any batch with this number (422), and store others.
    RefuseSeq(u64),
    /// Answer 200 with something that is no acknowledgement.
    Babble,
}

#[derive(Debug, Default)]
pub(crate) struct Store {
    pub(crate) frames: BTreeMap<String, BTreeMap<u64, Record>>,
    pub(crate) batches: Vec<Batch>,
    pub(crate) bodies: usize,
    /// For each body, whether it was compact.
    pub(crate) compact: Vec<bool>,
    pub(crate) arrivals: Vec<Instant>,
}

/// A collector on a loopback port that follows its script and repeats the last entry.
pub(crate) struct Collector {
    pub(crate) url: String,
    pub(crate) store: Arc<Mutex<Store>>,
    pub(crate) connections: Arc<AtomicUsize>,
    stopping: Arc<AtomicBool>,
}

impl Collector {
    pub(crate) fn start(script: Vec<Conduct>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let collector = Self {
            url: format!("http://{}", listener.local_addr().unwrap()),
            store: Arc::default(),
            connections: Arc::default(),
            stopping: Arc::default(),
        };
        let (store, connections, stopping) = (
            Arc::clone(&collector.store),
            Arc::clone(&collector.connections),
            Arc::clone(&collector.stopping),
        );
        let script = Arc::new(Mutex::new(VecDeque::from(script)));
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if stopping.load(Ordering::SeqCst) {
                    return;
                }
                connections.fetch_add(1, Ordering::SeqCst);
                let (store, script) = (Arc::clone(&store), Arc::clone(&script));
                std::thread::spawn(move || serve(&stream.unwrap(), &store, &script));
            }
        });
        collector
    }

    pub(crate) fn storing() -> Self {
        Self::start(vec![Conduct::Store])
    }

    pub(crate) fn records(&self, sensor: &str) -> Vec<Record> {
        let store = self.store.lock().unwrap();
        store
            .frames
            .get(sensor)
            .map(|frames| frames.values().copied().collect())
            .unwrap_or_default()
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        let _ = TcpStream::connect(self.url.trim_start_matches("http://"));
    }
}

fn serve(stream: &TcpStream, store: &Mutex<Store>, script: &Mutex<VecDeque<Conduct>>) {
    let mut reader = BufReader::new(stream);
    while let Some(body) = read_post(&mut reader) {
        let conduct = {
            let mut script = script.lock().unwrap();
            if script.len() > 1 {
                script.pop_front().unwrap()
            } else {
                script[0]
            }
        };
        let is_compact = body.starts_with(b"GEB");
        let batch = if is_compact {
            Batch::from_binary(&body).expect("a valid batch")
        } else {
            Batch::from_json(&body).expect("a valid batch")
        };
        store.lock().unwrap().compact.push(is_compact);
        let Some(answer) = act(conduct, batch, &mut store.lock().unwrap()) else {
            return;
        };
        if (&*stream).write_all(&answer).is_err() {
            return;
        }
    }
}

/// The answer; `None` to close the connection.
fn act(conduct: Conduct, batch: Batch, store: &mut Store) -> Option<Vec<u8>> {
    store.bodies += 1;
    store.arrivals.push(Instant::now());
    let holds = |seq| {
        batch
            .sensors
            .iter()
            .flat_map(|sensor| &sensor.frames)
            .any(|record| record.seq == seq)
    };
    match conduct {
        Conduct::RefuseSeq(seq) if holds(seq) => {
            let body =
                br#"{"error":{"code":"wrong_value","message":"no","field":null,"hint":null}}"#;
            Some(response(
                "422 Unprocessable",
                "content-type: application/json\r\n",
                body,
            ))
        }
        Conduct::Store | Conduct::RefuseSeq(_) => Some(response("200 OK", "", &keep(batch, store))),
        Conduct::StoreAndHangUp => {
            keep(batch, store);
            None
        }
        Conduct::HangUp => None,
        Conduct::Status(status) => Some(response(&format!("{status} No"), "", b"no\n")),
        Conduct::RetryAfter(seconds) => Some(response(
            "503 Busy",
            &format!("retry-after: {seconds}\r\n"),
            b"",
        )),
        Conduct::Silence(milliseconds) => {
            std::thread::sleep(Duration::from_millis(milliseconds));
            None
        }
        Conduct::Babble => Some(response("200 OK", "", b"<html>welcome</html>")),
    }
}

fn response(status: &str, headers: &str, body: &[u8]) -> Vec<u8> {
    let head = format!(
        "HTTP/1.1 {status}\r\n{headers}content-length: {}\r\n\r\n",
        body.len()
    );
    [head.as_bytes(), body].concat()
}

/// Stores every record once, and panics if a stored one changes.
fn keep(batch: Batch, store: &mut Store) -> Vec<u8> {
    let mut answer = Acknowledgement::default();
    for sensor in &batch.sensors {
        let stored = store.frames.entry(sensor.sensor.clone()).or_default();
        for record in &sensor.frames {
            let before = stored.insert(record.seq, *record);
            assert!(
                before.is_none_or(|before| before == *record),
                "record {} changed",
                record.seq
            );
        }
        if let Some((last, _)) = stored.last_key_value() {
            answer.durable_through.insert(sensor.sensor.clone(), *last);
            let before = std::iter::once(None).chain(stored.keys().map(Some));
            let pairs = before.zip(stored.keys());
            let ranges = pairs.map(|(before, seq)| (before.map_or(0, |before| before + 1), *seq));
            let gaps = ranges.filter(|(from, seq)| from < seq);
            answer.gaps.extend(gaps.map(|(from, seq)| Gap {
                sensor: sensor.sensor.clone(),
                from,
                to: seq - 1,
            }));
        }
    }
    store.batches.push(batch);
    answer.to_json().unwrap()
}

fn read_post(reader: &mut BufReader<&TcpStream>) -> Option<Vec<u8>> {
    let mut length = None;
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        let line = line.trim_end().to_ascii_lowercase();
        if line.is_empty() {
            break;
        }
        if let Some(value) = line.strip_prefix("content-length:") {
            length = value.trim().parse().ok();
        }
    }
    let mut body = vec![0; length?];
    reader.read_exact(&mut body).ok()?;
    Some(body)
}
