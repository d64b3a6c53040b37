//! Debian's MQTT broker, mosquitto, as the tests' own: on a free port, with a configuration of its own, stopped when dropped.

use crate::patience::wait_for;
use crate::programs::is_left_out;
use std::io::{BufRead as _, BufReader};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

/// Leaves out what needs mosquitto where it is not to be had.
pub const WITHOUT_MOSQUITTO: &str = "GRIDEYE_WITHOUT_MOSQUITTO";

/// Below what Linux gives to outgoing connections, so that the port is still free when the broker is started again.
const PORTS: std::ops::Range<u16> = 20_000..32_000;

/// A running broker.
#[derive(Debug)]
pub struct Broker {
    child: Option<Child>,
    port: u16,
    folder: tempfile::TempDir,
}

/// A message as a subscriber hears it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// Its topic.
    pub topic: String,
    /// The broker had kept it.
    pub retained: bool,
    /// What it says.
    pub payload: Vec<u8>,
}

impl Heard {
    /// The payload as text.
    #[must_use]
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.payload).into_owned()
    }

    /// The payload as JSON.
    ///
    /// # Panics
    /// When it is none.
    #[must_use]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.payload).unwrap()
    }
}

/// A subscriber to everything, `mosquitto_sub`.
#[derive(Debug)]
pub struct Subscriber {
    child: Child,
    heard: Arc<Mutex<Vec<Heard>>>,
}

impl Broker {
    /// Starts a broker that keeps nothing on disk and lets everybody in; `None` if brokers are left out.
    ///
    /// # Panics
    /// When it does not start.
    #[must_use]
    pub fn start(what: &str) -> Option<Self> {
        Self::start_with(what, |_folder| "allow_anonymous true\n".to_owned())
    }

    /// The same with more lines of configuration, which may name files in the folder that is handed in.
    ///
    /// # Panics
    /// When it does not start.
    #[must_use]
    pub fn start_with(what: &str, lines: impl FnOnce(&Path) -> String) -> Option<Self> {
        if is_left_out(WITHOUT_MOSQUITTO, what) {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let lines = lines(folder.path());
        let mut broker = Self {
            child: None,
            port: 0,
            folder,
        };
        // Another program may take the port in between.
        for _ in 0..20 {
            broker.port = free_port();
            let listener = format!("listener {} 127.0.0.1\n", broker.port);
            let config = format!("user root\npersistence false\n{listener}{lines}");
            std::fs::write(broker.config(), config).unwrap();
            if broker.resume() {
                return Some(broker);
            }
        }
        panic!(
            "mosquitto does not start\nhint: apt-get install mosquitto mosquitto-clients, or set {WITHOUT_MOSQUITTO}=1 to leave its tests out"
        );
    }

    /// The port that it listens on.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// `mqtt://127.0.0.1:PORT`.
    #[must_use]
    pub fn url(&self) -> String {
        format!("mqtt://127.0.0.1:{}", self.port)
    }

    /// Ends it at once; what it kept is gone.
    ///
    /// # Panics
    /// When it does not end.
    pub fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Starts it again on the same port; whether it listens.
    ///
    /// # Panics
    /// When there is no mosquitto.
    pub fn resume(&mut self) -> bool {
        // Debian has it where only root looks for programs.
        let path = format!("{}:/usr/sbin", std::env::var("PATH").unwrap());
        let mut child = Command::new("mosquitto")
            .env("PATH", path)
            .arg("-c")
            .arg(self.config())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let is_up = wait_for("the broker", || {
            let is_up = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_ok();
            let has_ended = child.try_wait().unwrap().is_some();
            (is_up || has_ended).then_some(is_up && !has_ended)
        });
        self.child = Some(child);
        is_up
    }

    /// Listens to everything from now on, and first hears what the broker kept.
    ///
    /// # Panics
    /// When there is no `mosquitto_sub`.
    #[must_use]
    pub fn subscribe(&self) -> Subscriber {
        let mut child = Command::new("mosquitto_sub")
            .args(["-p", &self.port.to_string(), "-t", "#", "-F", "%t %r %x"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let heard = Arc::<Mutex<Vec<Heard>>>::default();
        let hears = Arc::clone(&heard);
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let mut parts = line.split(' ');
                let topic = parts.next().unwrap().to_owned();
                let retained = parts.next() == Some("1");
                let payload = bytes(parts.next().unwrap_or_default());
                let message = Heard {
                    topic,
                    retained,
                    payload,
                };
                let mut heard = hears.lock().unwrap_or_else(PoisonError::into_inner);
                heard.push(message);
            }
        });
        Subscriber { child, heard }
    }

    /// What it keeps now, by topic, without what is the broker's own.
    ///
    /// # Panics
    /// When there is no `mosquitto_sub`, or it does not come to an end.
    #[must_use]
    pub fn kept(&self) -> Vec<Heard> {
        let subscriber = self.subscribe();
        let end = format!("the-end/{}", subscriber.child.id());
        // Sent again until the subscription is there: what was kept comes before it.
        wait_for("the end of what the broker keeps", || {
            self.publish(&end, b"end", false);
            subscriber.find(|heard| heard.topic == end)
        });
        let mut kept = subscriber.all();
        kept.retain(|heard| heard.retained);
        kept
    }

    /// Publishes something at quality of service 1, as anybody might; the broker has it afterwards.
    ///
    /// # Panics
    /// When there is no `mosquitto_pub`, or the broker refuses.
    pub fn publish(&self, topic: &str, payload: &[u8], retain: bool) {
        let file = self.folder.path().join("payload");
        std::fs::write(&file, payload).unwrap();
        let mut command = Command::new("mosquitto_pub");
        command.args(["-q", "1", "-p", &self.port.to_string(), "-t", topic]);
        if retain {
            command.arg("-r");
        }
        let status = command.arg("-f").arg(file).status().unwrap();
        assert!(status.success(), "{status}");
    }

    fn config(&self) -> PathBuf {
        self.folder.path().join("mosquitto.conf")
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // It may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Subscriber {
    /// All that was heard so far.
    #[must_use]
    pub fn all(&self) -> Vec<Heard> {
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.clone()
    }

    /// The first message of those so far that is right.
    pub fn find(&self, is_right: impl Fn(&Heard) -> bool) -> Option<Heard> {
        self.all().into_iter().find(is_right)
    }

    /// Waits for a message that is right, among those that come from now on.
    ///
    /// # Panics
    /// When none comes in time.
    pub fn wait_for_next(&self, what: &str, is_right: impl Fn(&Heard) -> bool) -> Heard {
        let before = self.all().len();
        wait_for(what, || self.all().into_iter().skip(before).find(&is_right))
    }

    /// Waits for a message that is right, of all that ever came.
    ///
    /// # Panics
    /// When none comes in time.
    pub fn wait_for(&self, what: &str, is_right: impl Fn(&Heard) -> bool) -> Heard {
        wait_for(what, || self.find(&is_right))
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that nobody listens on.
fn free_port() -> u16 {
    static NEXT: Mutex<Option<u16>> = Mutex::new(None);
    let mut next = NEXT.lock().unwrap_or_else(PoisonError::into_inner);
    // Test programs that run at the same time begin at different places.
    let first = PORTS.start + u16::try_from(std::process::id() * 37 % 12_000).unwrap();
    let mut port = next.unwrap_or(first);
    loop {
        port = if port + 1 < PORTS.end {
            port + 1
        } else {
            PORTS.start
        };
        if TcpListener::bind((Ipv4Addr::LOCALHOST, port)).is_ok() {
            *next = Some(port);
            return port;
        }
    }
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits: Vec<u32> = hexadecimal.chars().filter_map(|c| c.to_digit(16)).collect();
    digits
        .chunks_exact(2)
        .map(|pair| u8::try_from(16 * pair[0] + pair[1]).unwrap())
        .collect()
}
