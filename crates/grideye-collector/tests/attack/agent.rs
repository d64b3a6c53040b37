//! A well-behaved agent.

use crate::collector_process::authorization;
use grideye_collector::auth::Token;
use serde_json::json;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpSocket, TcpStream};

/// Connects from an address of this machine.
pub(crate) async fn connect(from: [u8; 4], to: SocketAddr) -> std::io::Result<TcpStream> {
    let socket = TcpSocket::new_v4()?;
    socket.bind(SocketAddr::from((from, 0)))?;
    socket.connect(to).await
}

/// Posts one frame after another on a persistent connection.
pub(crate) struct Agent {
    device: String,
    token: Option<Token>,
    from: [u8; 4],
    to: SocketAddr,
    stream: Option<TcpStream>,
    pub(crate) posted: u64,
}

impl Agent {
    pub(crate) fn new(device: &str, token: Option<Token>, from: [u8; 4], to: SocketAddr) -> Self {
        Self {
            device: device.to_owned(),
            token,
            from,
            to,
            stream: None,
            posted: 0,
        }
    }

    /// The next batch uses a new connection.
    pub(crate) fn disconnect(&mut self) {
        self.stream = None;
    }

    /// Posts the next frame; returns the time until the acknowledgment, including connecting.
    pub(crate) async fn post(&mut self) -> Duration {
        let began = Instant::now();
        if self.stream.is_none() {
            let stream = connect(self.from, self.to).await.unwrap();
            stream.set_nodelay(true).unwrap();
            self.stream = Some(stream);
        }
        let stream = self.stream.as_mut().unwrap();
        let seq = self.posted;
        let frame = json!({
            "seq": seq, "t_boot_ns": seq, "t_utc_ns": 0, "clock": "synced",
            "thermistor_raw": 400, "pixels_raw": vec![80; 64],
        });
        let sensors = json!([{ "sensor": "s1", "frames": [frame] }]);
        let body = json!({ "device": self.device, "boot": "b1", "sensors": sensors }).to_string();
        let request = format!(
            "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\n{}content-length: {}\r\n\r\n{body}",
            authorization(self.token.as_ref()),
            body.len()
        );
        let who = (&self.device, self.from, seq);
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        let expected = format!("{{\"durable_through\":{{\"s1\":{seq}}},\"gaps\":[]}}");
        while !answer.ends_with(&expected) {
            let mut piece = [0; 4096];
            let count = stream.read(&mut piece).await.unwrap();
            assert!(count > 0, "{who:?} was cut off after {answer:?}");
            answer.push_str(std::str::from_utf8(&piece[..count]).unwrap());
            assert!(answer.starts_with("HTTP/1.1 200"), "{who:?}: {answer}");
        }
        self.posted += 1;
        began.elapsed()
    }
}

/// The time within which `percent` of all batches were acknowledged.
pub(crate) fn quantile(took: &mut [Duration], percent: usize) -> Duration {
    took.sort_unstable();
    took[(took.len() * percent / 100).min(took.len() - 1)]
}
