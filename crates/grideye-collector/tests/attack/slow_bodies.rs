//! Slow bodies of one token beside agents with their own tokens; default limits.

use crate::ALONE;
use crate::agent::{Agent, connect};
use crate::collector_process::{Folder, authorization};
use crate::patience::WAIT_MAX;
use grideye_collector::Limits;
use grideye_collector::auth::Token;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::task::JoinSet;

/// Bodies that barely arrive: together they announce one and a half times the memory limit.
const DRIPPING: usize = 120;
/// Bodies that arrive almost entirely: together half the memory limit.
const NEARLY_WHOLE: usize = 40;
const AGENTS: usize = 20;
const ATTACKER: [u8; 4] = [127, 0, 0, 2];
const POST_EVERY: Duration = Duration::from_millis(250);
const DRIP_EVERY: Duration = Duration::from_millis(100);
/// Memory the collector may use for them: the token's share, twice because a growing body is copied, plus buffers.
const GROWTH_MAX_KIB: u64 = 48 * 1024;

/// Sends the largest body: `at_once` bytes, then a byte now and then. Returns how long it took the collector to end it,
/// and the status.
async fn slow_body(
    to: SocketAddr,
    token: Token,
    at_once: usize,
    limits: &Limits,
) -> (Duration, String) {
    let mut stream = connect(ATTACKER, to).await.unwrap();
    let began = Instant::now();
    let head = format!(
        "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\n{}content-length: {}\r\n\r\n",
        authorization(Some(&token)),
        limits.body_bytes_max
    );
    let (mut read, mut write) = stream.split();
    let sent = async {
        // A rejected body cannot be written to its end.
        let _ = write.write_all(head.as_bytes()).await;
        let _ = write.write_all(&vec![b' '; at_once]).await;
        loop {
            tokio::time::sleep(DRIP_EVERY).await;
            if write.write_all(b" ").await.is_err() {
                std::future::pending::<()>().await;
            }
        }
    };
    let mut answer = Vec::new();
    let received = async {
        let mut piece = [0; 4096];
        while let Ok(count @ 1..) = read.read(&mut piece).await {
            answer.extend_from_slice(&piece[..count]);
        }
    };
    let time_max = limits.body_time_max + WAIT_MAX;
    let ended = tokio::time::timeout(time_max, async {
        tokio::select! {
            () = received => {}
            () = sent => {}
        }
    });
    assert!(ended.await.is_ok(), "held for {time_max:?}");
    let status = answer.get(9..12).unwrap_or_default();
    (
        began.elapsed(),
        String::from_utf8_lossy(status).into_owned(),
    )
}

#[tokio::test]
async fn slow_bodies_of_one_token_are_ended_and_take_no_memory_from_other_agents() {
    let _beside = ALONE.read().await;
    let limits = Limits::default();
    assert!(DRIPPING * limits.body_bytes_max > 3 * limits.bodies_bytes_max / 2);
    let folder = Folder::new();
    let reader = folder.reader();
    let names: Vec<String> = (0..=AGENTS).map(|number| format!("pi-{number}")).collect();
    let mut tokens = folder.tokens(&names);
    let attacker = tokens.remove(0);
    let collector = folder.start();
    let to = collector.address;
    let before_kib = collector.resident_kib();

    let mut attacks = JoinSet::new();
    for number in 0..DRIPPING + NEARLY_WHOLE {
        let (token, limits) = (attacker.clone(), limits.clone());
        let at_once = if number < DRIPPING {
            1
        } else {
            limits.body_bytes_max - 1000
        };
        attacks.spawn(async move { slow_body(to, token, at_once, &limits).await });
    }
    let mut posting = JoinSet::new();
    for (token, name) in tokens.into_iter().zip(&names[1..]) {
        let mut agent = Agent::new(name, Some(token), [127, 0, 0, 1], to);
        let until = Instant::now() + limits.body_time_max;
        posting.spawn(async move {
            let mut slowest = Duration::ZERO;
            while Instant::now() < until {
                slowest = slowest.max(agent.post().await);
                tokio::time::sleep(POST_EVERY).await;
            }
            (agent.posted, slowest)
        });
    }
    let mut most_kib = 0;
    while !posting.is_empty() && attacks.try_join_next().is_none() {
        tokio::time::sleep(POST_EVERY).await;
        most_kib = collector.resident_kib().max(most_kib);
    }
    let (counts, slowest): (Vec<_>, Vec<_>) = posting.join_all().await.into_iter().unzip();
    let posted: u64 = counts.iter().sum();
    let ended = attacks.join_all().await;

    let metrics = collector.metrics(Some(&reader)).await;
    println!(
        "{} slow bodies of one token: {} ended after {:?}, {} refused at its share; {posted} of {posted} posts of {AGENTS} others taken, slowest {:?}; resident {before_kib} KiB before, {most_kib} KiB at most",
        DRIPPING + NEARLY_WHOLE,
        metrics.refused("body_too_slow"),
        ended.iter().map(|(took, _)| *took).max().unwrap(),
        metrics.refused("too_much_at_once"),
        slowest.iter().max().unwrap(),
    );
    assert_eq!(metrics.of("grideye_frames_stored_total"), posted);
    assert_eq!(metrics.refused("busy"), 0);
    assert!(most_kib < before_kib + GROWTH_MAX_KIB);
    let held = limits.bodies_bytes_per_sender_max / limits.body_bytes_max;
    let count = |bodies: usize| u64::try_from(bodies).unwrap();
    assert_eq!(
        metrics.refused("too_much_at_once"),
        count(NEARLY_WHOLE - held)
    );
    assert_eq!(metrics.refused("body_too_slow"), count(DRIPPING + held));
}
