//! Serves one connection: TLS, then requests until either side closes it.

use crate::alarm::Alarm;
use crate::connections::Connection;
use crate::http::client::Client;
use crate::limits::Limits;
use crate::peer::{Peer, TrustedProxies};
use crate::router::Routes;
use crate::server::tls::Acceptors;
use axum::body::Body;
use axum::response::Response;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::TokioIo;
use std::convert::Infallible;
use std::net::IpAddr;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio_io_timeout::TimeoutWriter;
use tokio_rustls::server::TlsStream;

/// A stream whose peer is disconnected if it accepts nothing for too long.
type StallLimited<S> = Pin<Box<TimeoutWriter<S>>>;

pub(super) fn stall_limited<S: AsyncWrite>(stream: S, stall_max: Duration) -> StallLimited<S> {
    let mut limited = TimeoutWriter::new(stream);
    limited.set_timeout(Some(stall_max));
    Box::pin(limited)
}

pub(super) struct Serving {
    pub(super) peer: IpAddr,
    /// All trusted proxies, if the peer is one of them.
    pub(super) proxies: Option<Arc<TrustedProxies>>,
    pub(super) routes: Routes,
    pub(super) limits: Limits,
    pub(super) stopping: watch::Receiver<bool>,
    pub(super) connection: Connection,
}

impl Serving {
    /// Performs the TLS handshake within the time limit for headers.
    pub(super) async fn encrypt(
        &self,
        acceptors: &Acceptors,
        stream: TcpStream,
    ) -> Option<TlsStream<StallLimited<TcpStream>>> {
        let agreed = async {
            let address = stream.local_addr().ok()?.ip();
            let acceptor = acceptors.for_address(address).ok()?;
            let limited = stall_limited(stream, self.limits.write_stall_max);
            acceptor.accept(limited).await.ok()
        };
        let mut stopping = self.stopping.clone();
        let agreed = tokio::select! {
            agreed = tokio::time::timeout(self.limits.header_time_max, agreed) => agreed.ok().flatten(),
            _stop = stopping.wait_for(|stopping| *stopping) => return None,
        };
        if agreed.is_none() {
            self.connection.tls_failed();
        }
        agreed
    }

    pub(super) async fn run<S>(self, stream: S, is_encrypted: bool)
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let Self {
            peer,
            proxies,
            routes,
            limits,
            mut stopping,
            connection,
        } = self;
        let alarm = Alarm::default();
        let mut builder = http1::Builder::new();
        builder
            .timer(alarm.clone())
            // Otherwise hyper reads the socket while a batch is handled, into a new buffer, to notice a peer that left.
            // The next write notices that too, and a peer that only closed its sending side still gets its response.
            .half_close(true)
            // Most responses are short: head and body go out in one piece. A long one costs one more copy.
            .writev(false)
            .header_read_timeout(limits.header_time_max)
            .max_header_size(limits.header_bytes_max);
        let connection = Arc::new(connection);
        let peer = Peer {
            address: peer,
            is_encrypted,
        };
        let answering = Arc::new(Answering {
            client: Client {
                peer,
                alarm,
                connection: Some(Arc::clone(&connection)),
            },
            proxies,
            routes,
            connection,
        });
        let service = service_fn(move |request: Request<Incoming>| {
            let answering = Arc::clone(&answering);
            async move { answering.answer(request).await }
        });
        let mut connection = pin!(builder.serve_connection(TokioIo::new(stream), service));
        // The result is ignored, because the peer sees the same end. `biased` polls the connection first, because
        // usually the connection woke this task.
        tokio::select! {
            biased;
            _ended = connection.as_mut() => return,
            _stop = stopping.wait_for(|stopping| *stopping) => {}
        }
        connection.as_mut().graceful_shutdown();
        let _ended = connection.await;
    }
}

struct Answering {
    client: Client,
    proxies: Option<Arc<TrustedProxies>>,
    routes: Routes,
    connection: Arc<Connection>,
}

impl Answering {
    async fn answer(&self, request: Request<Incoming>) -> Result<Response, Infallible> {
        let request = request.map(Body::new);
        self.connection.asks();
        let answer = match &self.proxies {
            None => self.routes.answer(&self.client, request).await,
            Some(proxies) => {
                let mut client = self.client.clone();
                client.peer.address = proxies.client(client.peer.address, request.headers());
                Box::pin(self.routes.answer(&client, request)).await
            }
        };
        self.connection.is_answered();
        Ok(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    #[tokio::test(start_paused = true)]
    async fn a_peer_that_accepts_nothing_is_disconnected() {
        let (near, _far) = tokio::io::duplex(8);
        let mut limited = stall_limited(near, Duration::from_secs(20));
        let started = tokio::time::Instant::now();
        let error = limited.write_all(&[0; 64]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(started.elapsed().as_secs(), 20);
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_peer_stays_connected() {
        let (near, mut far) = tokio::io::duplex(8);
        let mut limited = stall_limited(near, Duration::from_secs(20));
        let slow = tokio::spawn(async move {
            let mut piece = [0; 8];
            for _ in 0..8 {
                tokio::time::sleep(Duration::from_secs(19)).await;
                far.read_exact(&mut piece).await.unwrap();
            }
        });
        limited.write_all(&[7; 64]).await.unwrap();
        slow.await.unwrap();
    }
}
