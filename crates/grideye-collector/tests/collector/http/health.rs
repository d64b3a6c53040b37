//! Health, and a store that takes nothing.

use crate::batches::numbered;
use crate::http::client::Client;
use crate::server::Server;
use axum::http::{StatusCode, header};
use grideye_collector::store::StoreLocation;
use grideye_collector::{FrameStore, Limits, SqliteStore};
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;

#[tokio::test]
async fn health_is_that_of_the_store() {
    let server = Server::new().await;
    let well = server.get("/healthz").await;
    assert_eq!(
        (well.status, &well.json()["status"]),
        (StatusCode::OK, &json!("ok"))
    );
    server.store.close().await.unwrap();
    let ill = server.get("/healthz").await;
    assert_eq!(
        (ill.status, &ill.json()["status"]),
        (StatusCode::SERVICE_UNAVAILABLE, &json!("failing"))
    );
    assert_eq!(
        server.frames(&numbered(0..1)).await.error(),
        (503, "stopping".to_owned(), None)
    );
}

#[tokio::test]
async fn a_store_that_takes_nothing_is_reported_to_agents_supervisors_and_pages() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(20),
        live_keep_alive: Duration::from_millis(20),
        ..Limits::default()
    };
    let store = SqliteStore::open(&StoreLocation::File(path.clone()), &limits).unwrap();
    let server = Server::on(Arc::new(store), limits).await;
    let mut client = Client::of(&server).await;
    assert_eq!(client.next().await.0, "snapshot");
    let well = client.next().await;
    assert_eq!(well, ("alive".to_owned(), json!({ "store": null })));
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let refused = server.frames(&numbered(0..1)).await;
    assert_eq!(refused.error(), (503, "store_locked".to_owned(), None));
    assert_eq!(refused.headers[header::RETRY_AFTER], "1");
    assert_eq!(server.get("/healthz").await.status, 503);
    let reason = loop {
        let (_, event) = client.next().await;
        if let Some(reason) = event["store"].as_str() {
            break reason.to_owned();
        }
    };
    assert_eq!(reason, "the store's file is locked by another program");
}

#[tokio::test]
async fn a_store_that_may_not_grow_says_so_keeps_what_it_has_and_goes_on_when_it_may() {
    let folder = tempfile::tempdir().unwrap();
    let location = StoreLocation::File(folder.path().join("frames.sqlite"));
    let quota = |bytes| Limits {
        store_bytes_max: Some(bytes),
        ..Limits::default()
    };
    let open = |limits: &Limits| Arc::new(SqliteStore::open(&location, limits).unwrap());
    let small = quota(1 << 20);
    let server = Server::on(open(&small), small).await;
    let mut stored = 0;
    let refused = loop {
        let reply = server.frames(&numbered(stored..stored + 200)).await;
        if reply.status != StatusCode::OK {
            break reply;
        }
        stored += 200;
        assert!(stored < 20_000, "the quota is never reached");
    };
    assert!(stored >= 2000, "{stored} frames of 128 bytes in a MiB");
    assert_eq!(refused.error(), (507, "quota_reached".to_owned(), None));
    assert_eq!(refused.headers[header::RETRY_AFTER], "30");
    let health = server.get("/v1/health").await;
    assert_eq!(
        (health.status.as_u16(), &health.json()["status"]),
        (503, &json!("full"))
    );
    let store = &health.json()["store"];
    assert_eq!(store["bytes_max"], 1 << 20);
    assert!(store["bytes"].as_u64().unwrap() <= 1 << 20);
    assert_eq!(server.get("/healthz").await.json()["status"], "full");
    let metrics = server.get("/metrics").await.body;
    let metrics = String::from_utf8(metrics.to_vec()).unwrap();
    assert!(metrics.contains("\ngrideye_store_up 0\n"), "{metrics}");
    let rows = server.sensor().await["stored"].as_u64();
    assert_eq!(
        rows,
        Some(stored),
        "exactly the acknowledged frames are there"
    );
    server.store.close().await.unwrap();

    let larger = quota(8 << 20);
    let server = Server::on(open(&larger), larger).await;
    let reply = server.frames(&numbered(stored..stored + 200)).await;
    assert_eq!(reply.status, StatusCode::OK);
    assert_eq!(server.get("/v1/health").await.json()["status"], "ok");
}
