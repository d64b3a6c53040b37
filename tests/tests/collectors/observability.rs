//! What both programs report about themselves: health, metrics that Prometheus' own tool accepts, and logs without
//! secrets.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::programs::{
    Ended, grideye, grideye_agent, is_left_out, root, run, terminate, wait, wait_for,
};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

const WITHOUT_PROMTOOL: &str = "GRIDEYE_WITHOUT_PROMTOOL";

/// A collector that requires tokens and an agent that joined it, both logging to files.
struct Site {
    at: tempfile::TempDir,
    collector: Child,
    collector_at: SocketAddr,
    agent: Child,
    agent_at: SocketAddr,
    /// A token that may do everything.
    token: String,
}

impl Site {
    fn new() -> Self {
        let at = tempfile::tempdir().unwrap();
        let path = |name: &str| at.path().join(name);
        let made = run(grideye()
            .args(["token", "make", "boss", "--scope", "admin", "--out"])
            .arg(path("boss.token"))
            .arg("--access")
            .arg(path("access")));
        assert_eq!(made.code, 0, "{made:?}");
        let mut collector = grideye()
            .args(["collect", "--listen", "127.0.0.1:0", "--log", "json"])
            .arg("--store")
            .arg(path("frames.sqlite"))
            .arg("--access")
            .arg(path("access"))
            .stdout(Stdio::piped())
            .stderr(File::create(path("collector.log")).unwrap())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(collector.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let address = line
            .trim()
            .trim_start_matches("http://")
            .trim_end_matches('/');
        let collector_at = address.parse().unwrap();
        let enrolled = run(grideye()
            .args(["enroll", "pi-1", "--access"])
            .arg(path("access")));
        assert_eq!(enrolled.code, 0, "{enrolled:?}");
        let joined = run(grideye_agent()
            .args(["join", enrolled.stdout.trim(), "--out"])
            .arg(path("collector.toml")));
        assert_eq!(joined.code, 0, "{joined:?}");
        // Free now; if another program takes it meanwhile, the agent fails with a message.
        let agent_at = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap();
        let config = format!(
            "[health]\nlisten = \"{agent_at}\"\n[[bus]]\npath = \"/nonexistent/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n"
        );
        fs::write(path("agent.toml"), config).unwrap();
        let agent = grideye_agent()
            .args(["run", "--log", "json", "--config"])
            .arg(path("agent.toml"))
            .stdout(Stdio::null())
            .stderr(File::create(path("agent.log")).unwrap())
            .spawn()
            .unwrap();
        let token = fs::read_to_string(path("boss.token"))
            .unwrap()
            .trim()
            .to_owned();
        Self {
            at,
            collector,
            collector_at,
            agent,
            agent_at,
            token,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.at.path().join(name)
    }

    /// Status and body of the collector's response to the admin.
    fn collector(&self, path: &str) -> (u16, String) {
        get(
            self.collector_at,
            path,
            &format!("authorization: Bearer {}\r\n", self.token),
        )
        .unwrap()
    }

    fn agent(&self, path: &str) -> Option<(u16, String)> {
        get(self.agent_at, path, "")
    }

    /// The random part of every token, which no log or page may contain.
    fn secrets(&self) -> Vec<String> {
        ["boss.token", "collector.toml"]
            .map(|name| {
                let text = fs::read_to_string(self.path(name)).unwrap();
                let start = text.find("grideye-").unwrap();
                text[start + 21..start + 85].to_owned()
            })
            .to_vec()
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        for child in [&mut self.agent, &mut self.collector] {
            // It may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn get(address: SocketAddr, path: &str, headers: &str) -> Option<(u16, String)> {
    let mut stream = TcpStream::connect(address).ok()?;
    let request =
        format!("GET {path} HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\n{headers}\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    Some((status, body.to_owned()))
}

fn check_by_promtool(metrics: &str) {
    let what = "Prometheus' own check of both programs' metrics";
    if is_left_out(WITHOUT_PROMTOOL, what) {
        return;
    }
    let ended = promtool(&["metrics"], metrics);
    let said = ended.stderr + &ended.stdout;
    assert!(
        ended.code == 0 && said.trim().is_empty(),
        "{said}\n{metrics}"
    );
}

/// Checks that Prometheus understands the dashboard's queries: as rules, which it checks without a server.
fn check_expressions_by_promtool(expressions: &[&str]) {
    let what = "Prometheus' own reading of what the dashboard asks for";
    if is_left_out(WITHOUT_PROMTOOL, what) {
        return;
    }
    let rules = expressions.iter().enumerate().map(
        |(number, expression)| json!({ "record": format!("panel:{number}"), "expr": expression }),
    );
    let rules: Vec<Value> = rules.collect();
    // YAML is a superset of JSON.
    let rules = json!({ "groups": [{ "name": "dashboard", "rules": rules }] });
    let ended = promtool(&["rules", "/dev/stdin"], &rules.to_string());
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(
        ended
            .stdout
            .contains(&format!("{} rules found", expressions.len())),
        "{ended:?}"
    );
}

fn promtool(check: &[&str], input: &str) -> Ended {
    let mut promtool = Command::new("promtool")
        .arg("check")
        .args(check)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    promtool
        .stdin
        .take()
        .unwrap()
        .write_all(input.as_bytes())
        .unwrap();
    let ended = promtool.wait_with_output().unwrap();
    Ended {
        code: ended.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&ended.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&ended.stderr).into_owned(),
    }
}

/// Checks that a program reports every metric family that the dashboard draws.
fn assert_dashboard_is_of(metrics: &str) {
    let file = fs::read_to_string(root().join("firmware-config/grafana.json")).unwrap();
    let dashboard: Value = serde_json::from_str(&file).unwrap();
    let panels = dashboard["panels"].as_array().unwrap();
    let expressions = panels
        .iter()
        .flat_map(|panel| panel["targets"].as_array().unwrap())
        .map(|target| target["expr"].as_str().unwrap());
    let expressions: Vec<&str> = expressions.collect();
    check_expressions_by_promtool(&expressions);
    let mut drawn = 0;
    for expression in expressions {
        let words = expression.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        for family in words.filter(|word| word.starts_with("grideye_")) {
            // Reported only by a store with a quota and by an agent with a spool.
            let told = metrics.contains(&format!("# TYPE {family} "))
                || ["grideye_store_bytes_max", "grideye_agent_spool_bytes"].contains(&family);
            assert!(told, "{family} is drawn, and nothing tells it");
            drawn += 1;
        }
    }
    assert!(drawn > panels.len(), "{drawn}");
}

#[test]
fn both_programs_report_their_health_without_secrets() {
    let mut site = Site::new();
    let device = wait_for("the agent's first post", || {
        let (status, body) = site.collector("/v1/devices");
        assert_eq!(status, 200, "{body}");
        let json: Value = serde_json::from_str(&body).unwrap();
        (!json["devices"][0].is_null()).then(|| json["devices"][0].clone())
    });
    assert_eq!(device["device"], "pi-1");
    assert_eq!(device["agent_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(
        device["configuration"]["sensors"]["i2c-1:0x69"]["rate_hz"],
        10
    );
    assert_eq!(device["sensors"][0]["part"], "AMG8833");

    let health = wait_for("the agent's health", || site.agent("/health"));
    let json: Value = serde_json::from_str(&health.1).unwrap();
    assert_eq!(
        (&json["device"], &json["sensors"][0]["read"]),
        (&"pi-1".into(), &0.into())
    );
    assert_eq!(json["delivery"]["failures_in_a_row"], 0, "{json}");
    // There is no bus: the agent reports this after ten seconds without a frame.
    let degraded = wait_for("a reason to look", || {
        let (status, body) = site.agent("/health").unwrap();
        (status == 503).then_some(body)
    });
    assert!(degraded.contains("i2c-1:0x69: no frame for "), "{degraded}");

    let metrics = site.agent("/metrics").unwrap().1 + &site.collector("/metrics").1;
    assert!(
        metrics.contains("\ngrideye_agent_sensor_read_total{sensor=\"i2c-1:0x69\"} 0\n"),
        "{metrics}"
    );
    assert!(
        metrics.contains("grideye_sensor_stored_total{device=\"pi-1\",sensor=\"i2c-1:0x69\"} 0\n"),
        "{metrics}"
    );
    assert_dashboard_is_of(&metrics);
    check_by_promtool(&metrics);

    // A rejected token is the one most likely to appear in logs.
    let revoked = run(grideye()
        .args(["token", "revoke", "pi-1", "--access"])
        .arg(site.path("access")));
    assert_eq!(revoked.code, 0, "{revoked:?}");
    let log = wait_for("the refusal in the agent's log", || {
        let log = fs::read_to_string(site.path("agent.log")).unwrap();
        log.contains("status 401").then_some(log)
    });
    for line in log.lines() {
        let json: Value = serde_json::from_str(line).unwrap();
        assert!(
            json["level"].is_string() && json["part"].is_string() && json["message"].is_string(),
            "{line}"
        );
    }
    let pages =
        degraded + &metrics + &site.collector("/v1/health").1 + &site.collector("/v1/devices").1;
    terminate(&site.agent);
    assert_eq!(wait(&mut site.agent), 0);
    terminate(&site.collector);
    assert_eq!(wait(&mut site.collector), 0);
    let logs =
        ["agent.log", "collector.log"].map(|name| fs::read_to_string(site.path(name)).unwrap());
    assert!(logs[1].contains("\"bad_token\""), "{}", logs[1]);
    let all = logs.concat() + &pages;
    for secret in site.secrets() {
        assert_eq!(secret.len(), 64);
        assert!(!all.contains(&secret), "a secret in {all}");
    }
}
