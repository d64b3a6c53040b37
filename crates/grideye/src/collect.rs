//! `grideye collect`: the collector as a program.

use crate::access::{outward_address, url_of};
use crate::cli::{Collect, LogFormat, Scenes};
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{count, dropped, files, mqtt, progress};
use anyhow::{Context as _, Result, anyhow};
use grideye_collector::auth::{AccessFolder, Address};
use grideye_collector::{
    Annex, Certificates, Collector, CollectorError, Config, Log, StoreLocation, SystemClock, Tls,
    pin_of_file,
};
use grideye_inputs::read_text;
use grideye_studio::{Demonstration, Disk};
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::signal::unix::{SignalKind, signal};

pub(crate) fn run(options: &Collect) -> Result<Outcome> {
    let runtime = grideye_collector::runtime().context("cannot start the collector's threads")?;
    let done = runtime.block_on(async {
        let config = config(options)?;
        let collector = Collector::bind(config).await.map_err(told)?;
        let stop = stop_signal().context("cannot catch Ctrl-C")?;
        remember(options, &collector)?;
        outln!("{}://{}/", collector.scheme(), collector.local_addr())?;
        collector.serve(stop).await?;
        progress::say("stopped: every acknowledged frame is on disk");
        Ok(Outcome::Done)
    });
    // The store is closed: nobody waits for the answer to a long computation any more.
    runtime.shutdown_background();
    done
}

/// Ready on Ctrl-C or systemd's SIGTERM. Both are caught from this call on, not only once awaited.
pub(crate) fn stop_signal() -> io::Result<impl Future<Output = ()> + Send + 'static> {
    let mut interrupted = signal(SignalKind::interrupt())?;
    let mut terminated = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _signal = interrupted.recv() => {}
            _signal = terminated.recv() => {}
        }
    })
}

fn config(options: &Collect) -> Result<Config> {
    let store = location(&options.store)?;
    let is_file = matches!(store, StoreLocation::File(_));
    if options.store_quota.is_some() && !is_file {
        return Err(bad_input(anyhow!(
            "--store-quota is for a store in a file\nhint: give the database a tablespace of its own on a disk of that size"
        )));
    }
    if (options.keep_days.is_some() || options.keep_bytes.is_some()) && !is_file {
        return Err(bad_input(anyhow!(
            "--keep-days and --keep-bytes are for a store in a file\nhint: a database deletes by SQL: see \"Old frames\" in crates/grideye-collector/README.md"
        )));
    }
    let mut config = Config::new(options.listen, store, Arc::new(SystemClock::new()));
    config.network_trusted = options.trust_network;
    config.tokens_forgotten = options.forget_tokens;
    config.trusted_proxies.clone_from(&options.trusted_proxies);
    config.host_names = options.host_names.clone();
    config.access = Some(AccessFolder::new(&options.folder.path));
    config.tls = tls(options);
    config.log = log(options.log);
    config.annexes = annexes(&options.scenes, None)?;
    let has_line = options.people.line.is_some();
    let bridge = mqtt::annex(&options.mqtt, has_line, config.log.clone())?;
    config.counting = count::live(&options.people, bridge.is_some())?;
    config.annexes.extend(bridge);
    let limits = &mut config.limits;
    limits.store_bytes_max = options.store_quota;
    let days = options.keep_days;
    limits.keep_for = days.map(|days| Duration::from_secs(86_400 * days));
    limits.keep_bytes = options.keep_bytes;
    limits.requests_per_second_max = options.requests_per_second;
    limits.requests_burst_max = options.requests_per_second.saturating_mul(2);
    limits.unknown_requests_per_second_max = options.requests_per_second.div_ceil(10);
    Ok(config)
}

/// TLS is on wherever others could listen, unless an option turns it off.
fn tls(options: &Collect) -> Option<Tls> {
    let certificates = match (&options.tls_cert, &options.tls_key) {
        (Some(chain), Some(key)) => Certificates::Files {
            chain: chain.clone(),
            key: key.clone(),
        },
        _ => Certificates::OwnAuthority,
    };
    let is_asked_for = options.tls || options.tls_cert.is_some() || options.tls_client_ca.is_some();
    let is_exposed = !options.listen.ip().to_canonical().is_loopback() && !options.trust_network;
    (is_asked_for || is_exposed && !options.plain_http).then(|| Tls {
        certificates,
        client_authorities: options.tls_client_ca.clone(),
    })
}

/// What the collector refuses is bad input; a port in use or a full disk is a failure.
fn told(error: CollectorError) -> anyhow::Error {
    match error {
        CollectorError::NoTokens { .. }
        | CollectorError::TokensGone(_)
        | CollectorError::NoTls { .. }
        | CollectorError::NoAuthority
        | CollectorError::TlsFile { .. } => bad_input(error),
        other => other.into(),
    }
}

fn log(format: LogFormat) -> Log {
    Log::new(move |event| {
        progress::say(&format(event));
    })
}

/// Stores the collector's address for `grideye enroll`, if it requires tokens.
fn remember(options: &Collect, collector: &Collector) -> Result<()> {
    let folder = AccessFolder::new(&options.folder.path);
    if !folder.path().exists() {
        return Ok(());
    }
    let pin = match (&options.tls_cert, collector.scheme()) {
        (_, "http") => None,
        (Some(chain), _) => Some(pin_of_file(chain)?),
        (None, _) => Some(folder.authority()?.pin()),
    };
    let (scheme, listen) = (collector.scheme(), collector.local_addr());
    let url = url(scheme, listen, &options.host_names);
    folder.set_address(&Address { url, pin })?;
    Ok(())
}

/// The collector's URL, by its first host name, else by its address.
fn url(scheme: &str, listen: SocketAddr, names: &[String]) -> String {
    let port = listen.port();
    if let Some(name) = names.first() {
        return format!("{scheme}://{name}:{port}");
    }
    let address = match listen.ip() {
        any if any.is_unspecified() => outward_address().unwrap_or(any),
        one => one,
    };
    url_of(scheme, address, port)
}

pub(crate) fn location(text: &str) -> Result<StoreLocation> {
    let location = text.parse::<StoreLocation>().map_err(bad_input)?;
    let StoreLocation::Postgres(url) = location else {
        return Ok(location);
    };
    let Some(path) = std::env::var_os("PGPASSFILE") else {
        return Ok(StoreLocation::Postgres(url));
    };
    let text = password_file(Path::new(&path)).map_err(bad_input)?;
    let url = url.with_password_file(&text).map_err(bad_input)?;
    Ok(StoreLocation::Postgres(url))
}

fn password_file(path: &Path) -> Result<String> {
    let shown = path.display();
    let about = std::fs::metadata(path);
    let about = about.with_context(|| {
        format!("cannot read the password file {shown}\nhint: PGPASSFILE names it; unset it if there is none")
    })?;
    if about.permissions().mode() & 0o077 != 0 {
        return Err(anyhow!(
            "others can read the password file {shown}\nhint: chmod 600 {shown}"
        ));
    }
    files::text(
        path,
        "the password file",
        "PGPASSFILE names a file of lines HOST:PORT:DATABASE:USER:PASSWORD",
    )
}

const FOLDER: &str = "scenes";

/// Exports, the scenes of the given folder (or of `scenes` if it exists), and the scene that the page opens with.
pub(crate) fn annexes(
    options: &Scenes,
    demonstration: Option<&Demonstration>,
) -> Result<Vec<Annex>> {
    let export = grideye_export::annex::annex(tempfile::tempfile);
    let usual = Some(Path::new(FOLDER)).filter(|folder| folder.is_dir());
    let folder = options.folder.as_deref().or(usual);
    let disk = Disk {
        read: |file| read_text(file),
        replace: |path, content| {
            let put = files::replace(path, |out| Ok(io::copy(content, out).map(drop)?));
            put.map_err(io::Error::other)
        },
    };
    let annexes = grideye_studio::annexes(folder, demonstration, disk).map_err(bad_input)?;
    let added = [export, dropped::annex()];
    Ok(annexes.into_iter().chain(added).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;

    fn parsed(arguments: &[&str]) -> Collect {
        let all = ["grideye", "collect"].iter().chain(arguments);
        match crate::cli::Cli::parse_from(all).command {
            crate::cli::Command::Collect(options) => options,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_others_could_read_is_encrypted_unless_it_was_said_otherwise() {
        for (arguments, is_on) in [
            (&[][..], false),
            (&["--tls"], true),
            (&["--listen", "[::1]:1"], false),
            (&["--listen", "192.168.1.20:1"], true),
            (&["--listen", "0.0.0.0:1"], true),
            (&["--listen", "0.0.0.0:1", "--trust-network"], false),
            (&["--listen", "0.0.0.0:1", "--trust-network", "--tls"], true),
            (&["--listen", "0.0.0.0:1", "--plain-http"], false),
            (&["--tls-cert", "c", "--tls-key", "k"], true),
            (&["--tls-client-ca", "c"], true),
        ] {
            assert_eq!(tls(&parsed(arguments)).is_some(), is_on, "{arguments:?}");
        }
    }

    #[test]
    fn a_collector_is_called_by_its_name_or_its_address() {
        let listen = SocketAddr::from(([192, 168, 1, 20], 8833));
        assert_eq!(url("https", listen, &[]), "https://192.168.1.20:8833");
        let names = ["pc.local".to_owned(), "pc".to_owned()];
        assert_eq!(url("https", listen, &names), "https://pc.local:8833");
        let six = "[fd00::1]:8833".parse().unwrap();
        assert_eq!(url("http", six, &[]), "http://[fd00::1]:8833");
    }
}
