//! `grideye-agent join`, and finding what it left.

use crate::{BadUsage, read_text, write_stdout};
use anyhow::Context as _;
use grideye_agent::cli::JoinArgs;
use grideye_agent::config::Config;
use grideye_agent::join::{
    ClientCertificate, Credentials, JOINED_BYTES_MAX, JoinLine, Joined, Secret, authority_of,
};
use grideye_agent::transport;
use std::fs::{self, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// How long the collector may take to answer while the agent joins.
const TIMEOUT: Duration = Duration::from_secs(10);
const FILE: &str = "collector.toml";
/// The same file as systemd hands it to the unit (`LoadCredential=grideye:/etc/grideye`).
const CREDENTIAL: &str = "grideye_collector.toml";

/// Joins: line, authority, token, file. Each step that fails says so, and nothing is written before all went well.
pub(crate) fn run(args: &JoinArgs) -> anyhow::Result<ExitCode> {
    let line = line(args)?;
    let client = client(args)?;
    let authority = line
        .pin
        .as_ref()
        .map(|pin| authority_of(&line.collector, pin, client.as_ref(), TIMEOUT))
        .transpose()?;
    let joined = Joined {
        collector: line.collector,
        device: line.device,
        credentials: Credentials {
            token: line.token,
            authority,
            client,
        },
    };
    let scope = whoami(&joined.collector, &joined.credentials)?;
    write(&args.out, &joined)?;
    let device = joined.device.as_deref().unwrap_or("its own name");
    write_stdout(&format!(
        "joined {} as {device}: {scope}\nwritten to {}; start the agent: sudo systemctl enable grideye-agent; sudo systemctl restart grideye-agent\n",
        joined.collector,
        args.out.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The configuration with what joining left: in the file that it names, the one that systemd hands over, or the one
/// beside the configuration.
pub(crate) fn read(mut config: Config, path: &Path) -> anyhow::Result<Config> {
    let handed = std::env::var_os("CREDENTIALS_DIRECTORY")
        .map(|folder| PathBuf::from(folder).join(CREDENTIAL));
    let beside = path.with_file_name(FILE);
    let found = config.joined.clone().or_else(|| {
        handed
            .into_iter()
            .chain([beside])
            .find(|path| path.exists())
    });
    let Some(found) = found else {
        return Ok(config);
    };
    let origin = found.display().to_string();
    let text = read_text(&found, JOINED_BYTES_MAX).map_err(|error| {
        let hint = "grideye-agent join 'LINE' writes it; it must be readable for the user that runs the agent";
        BadUsage(format!("{origin}: {error}\nhint: {hint}"))
    })?;
    let joined = Joined::parse(&text, &origin).map_err(|error| BadUsage(error.to_string()))?;
    config
        .join(joined)
        .map_err(|error| BadUsage(error.to_string()))?;
    Ok(config)
}

fn line(args: &JoinArgs) -> anyhow::Result<JoinLine> {
    let mut text = args.line.clone();
    if text == "-" {
        text.clear();
        let limit = u64::try_from(JOINED_BYTES_MAX).unwrap_or(u64::MAX);
        io::stdin()
            .take(limit)
            .read_to_string(&mut text)
            .context("standard input")?;
    }
    let line = text.parse::<JoinLine>();
    Ok(line.map_err(|error| BadUsage(error.to_string()))?)
}

fn client(args: &JoinArgs) -> anyhow::Result<Option<ClientCertificate>> {
    let (Some(chain), Some(key)) = (&args.client_cert, &args.client_key) else {
        return Ok(None);
    };
    let read = |path: &Path| {
        read_text(path, JOINED_BYTES_MAX).map_err(|error| {
            let hint = "name a PEM file that you may read";
            BadUsage(format!("{}: {error}\nhint: {hint}", path.display()))
        })
    };
    Ok(Some(ClientCertificate {
        chain: read(chain)?,
        key: Secret::pem(read(key)?),
    }))
}

/// Asks the collector what the token allows: the first request in the agent's own way.
pub(crate) fn whoami(collector: &str, credentials: &Credentials) -> anyhow::Result<String> {
    let client = transport::client(credentials, TIMEOUT).map_err(BadUsage)?;
    let mut request = client.get(format!("{collector}/v1/whoami"));
    if let Some(token) = &credentials.token {
        request = request.header("authorization", format!("Bearer {}", token.reveal()));
    }
    let mut response = request
        .call()
        .map_err(|error| anyhow::anyhow!("{collector}: {error}{}", transport::hint(&error)))?;
    let status = response.status().as_u16();
    let text = response.body_mut().read_to_string().unwrap_or_default();
    let answer: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    if status == 401 {
        anyhow::bail!(
            "{collector}: the token is not, or no longer, known there\nhint: print a new line with `grideye enroll DEVICE`"
        );
    }
    match answer["scope"].as_str() {
        Some("ingest") => Ok("its frames are taken".to_owned()),
        Some("open") => Ok("anybody's frames are taken there".to_owned()),
        Some(other) => anyhow::bail!(
            "{collector}: this token is for {other}, not for frames\nhint: print a line with `grideye enroll DEVICE`"
        ),
        None => anyhow::bail!(
            "{collector}: answered {status}, which no collector does\nhint: is this the address of `grideye collect`?"
        ),
    }
}

/// For its owner alone; whole or not at all.
fn write(path: &Path, joined: &Joined) -> anyhow::Result<()> {
    let text = joined.to_toml()?;
    let beside = path.with_extension("new");
    let write = || -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        // A file that was left over may be readable for others.
        match fs::remove_file(&beside) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(&beside)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&beside, path)
    };
    write().map_err(|error| {
        anyhow::anyhow!(
            "{}: {error}\nhint: run this as root (sudo), or name a file of your own with --out",
            path.display()
        )
    })
}
