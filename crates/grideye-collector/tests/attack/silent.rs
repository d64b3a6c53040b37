//! 10,000 silent connections from two addresses, and 200 agents.

use crate::ALONE;
use crate::agent::{Agent, connect, quantile};
use crate::collector_process::{Attacked, Folder};
use crate::patience::WAIT_MAX;
use grideye_collector::auth::Token;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use tokio::io::AsyncReadExt as _;
use tokio::runtime;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;

const CROWD: usize = 10_000;
/// The attackers' addresses.
const ATTACKERS: [[u8; 4]; 2] = [[127, 0, 0, 2], [127, 0, 0, 3]];
/// An address without attackers.
const APART: [u8; 4] = [127, 0, 0, 4];
const AGENTS: usize = 200;
/// Every fourth agent shares an attacker's address, as behind the same NAT.
const BESIDE_EVERY: usize = 4;
const POST_EVERY: Duration = Duration::from_millis(500);
/// Consecutive batches of each agent on one connection.
const POSTS: usize = 6;
/// Quiet and attacked phases alternate, so that other load on this machine affects both alike.
const TURNS: usize = 2;
/// Maximum repetitions: a host that stalled gets another try.
const TURNS_MAX: usize = 6;
/// Batches of each agent while the crowd connects.
const POSTS_MEANWHILE: usize = 2;
/// Connections of the crowd opened at once.
const OPENING: usize = 32;
/// The pause between two openings if the crowd stays. Without it the system's queue overflows, and nobody can tell
/// which connections exist.
const OPENING_PAUSE: Duration = Duration::from_millis(8);
/// Polling interval.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Silent connections; each is reopened when closed, or not.
struct Crowd {
    opened: Arc<AtomicUsize>,
    is_over: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<()>,
}

impl Crowd {
    fn start(to: SocketAddr, size: usize, comes_again: bool) -> Self {
        let (opened, is_over) = (Arc::<AtomicUsize>::default(), Arc::<AtomicBool>::default());
        let (count, over) = (Arc::clone(&opened), Arc::clone(&is_over));
        let thread = std::thread::spawn(move || {
            let runtime = runtime::Builder::new_current_thread().enable_all().build();
            runtime.unwrap().block_on(async {
                let opening = Arc::new(Semaphore::new(OPENING));
                let mut open = JoinSet::new();
                for number in 0..size {
                    let from = ATTACKERS[number % ATTACKERS.len()];
                    let (opening, count) = (Arc::clone(&opening), Arc::clone(&count));
                    open.spawn(async move {
                        if !comes_again {
                            return stand(from, to, &opening, OPENING_PAUSE, &count).await;
                        }
                        loop {
                            stand(from, to, &opening, Duration::ZERO, &count).await;
                        }
                    });
                }
                while !over.load(Ordering::Relaxed) {
                    tokio::time::sleep(LOOK_EVERY).await;
                }
            });
        });
        Self {
            opened,
            is_over,
            thread,
        }
    }

    fn opened(&self) -> usize {
        self.opened.load(Ordering::Relaxed)
    }

    /// Closes all connections.
    fn end(self) -> usize {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
        self.opened.load(Ordering::Relaxed)
    }
}

/// One connection until it is closed.
async fn stand(
    from: [u8; 4],
    to: SocketAddr,
    opening: &Semaphore,
    pause: Duration,
    opened: &AtomicUsize,
) {
    let opens = opening.acquire().await.unwrap();
    let connected = connect(from, to).await;
    tokio::time::sleep(pause).await;
    drop(opens);
    if let Ok(mut stream) = connected {
        opened.fetch_add(1, Ordering::Relaxed);
        let _ = stream.read(&mut [0]).await;
    }
}

fn agents(tokens: &[Option<Token>], to: SocketAddr) -> Vec<Agent> {
    let agents = tokens.iter().enumerate().map(|(number, token)| {
        let is_beside = number % BESIDE_EVERY == 0;
        let from = if is_beside { ATTACKERS[0] } else { APART };
        Agent::new(&name(number), token.clone(), from, to)
    });
    agents.collect()
}

fn name(number: usize) -> String {
    format!("pi-{number}")
}

/// Every agent posts `count` times, spread over the pause like real agents; returns the time of each.
async fn posts(agents: Vec<Agent>, count: usize) -> (Vec<Agent>, Vec<Duration>) {
    let mut posting = JoinSet::new();
    for (number, mut agent) in agents.into_iter().enumerate() {
        let offset = POST_EVERY * u32::try_from(number).unwrap() / u32::try_from(AGENTS).unwrap();
        let mut next = tokio::time::Instant::now() + offset;
        posting.spawn(async move {
            let mut took = Vec::new();
            for _ in 0..count {
                tokio::time::sleep_until(next).await;
                took.push(agent.post().await);
                next += POST_EVERY;
            }
            (agent, took)
        });
    }
    let (mut agents, mut took) = (Vec::new(), Vec::new());
    for (agent, of_agent) in posting.join_all().await {
        agents.push(agent);
        took.extend(of_agent);
    }
    (agents, took)
}

fn count(number: usize) -> u64 {
    u64::try_from(number).unwrap()
}

/// This process holds the crowd's descriptors, the collector its own.
fn raise_open_files() {
    let maximum = getrlimit(Resource::Nofile).maximum;
    let raised = Rlimit {
        current: maximum,
        maximum,
    };
    setrlimit(Resource::Nofile, raised).unwrap();
    let wanted = count(CROWD + 2 * AGENTS);
    assert!(
        maximum.is_none_or(|most| most > wanted),
        "{wanted} open files are needed: ulimit -H -n"
    );
}

fn run(test: impl Future<Output = ()>) {
    let runtime = runtime::Builder::new_current_thread().enable_all().build();
    runtime.unwrap().block_on(async {
        let _alone = ALONE.write().await;
        raise_open_files();
        let ended = tokio::time::timeout(WAIT_MAX, test).await;
        ended.expect("somebody waits without end");
    });
}

/// Waits until the crowd was admitted at least `count` times.
async fn until_opened(crowd: &Crowd, count: usize) {
    while crowd.opened() < count {
        tokio::time::sleep(LOOK_EVERY).await;
    }
}

#[test]
fn a_crowd_that_says_nothing_keeps_no_agent_out_and_makes_none_wait() {
    run(async {
        let folder = Folder::new();
        let reader = folder.reader();
        let names: Vec<String> = (0..AGENTS).map(name).collect();
        let tokens: Vec<_> = folder.tokens(&names).into_iter().map(Some).collect();
        let collector = folder.start();
        let to = collector.address;
        let mut agents = agents(&tokens, to);
        let (mut quiet, mut attacked) = (Vec::new(), Vec::new());
        let (mut meanwhile, mut opened) = (Vec::new(), 0);
        let mut turns = 0;
        let (p99_quiet, p99_attacked) = loop {
            let mut took;
            agents.iter_mut().for_each(Agent::disconnect);
            (agents, took) = posts(agents, POSTS).await;
            quiet.append(&mut took);
            let crowd = Crowd::start(to, CROWD, false);
            (agents, took) = posts(agents, POSTS_MEANWHILE).await;
            meanwhile.append(&mut took);
            until_opened(&crowd, CROWD).await;
            // All agents are newcomers now, and one in four comes from an attacker's address.
            agents.iter_mut().for_each(Agent::disconnect);
            (agents, took) = posts(agents, POSTS).await;
            attacked.append(&mut took);
            opened += crowd.end();
            turns += 1;
            let p99 = (quantile(&mut quiet, 99), quantile(&mut attacked, 99));
            if turns >= TURNS && (p99.1 <= 2 * p99.0 || turns == TURNS_MAX) {
                break p99;
            }
        };
        println!("{opened} silent connections from 2 addresses, {AGENTS} agents, every post taken");
        print("  quiet", &mut quiet);
        print("  while they come", &mut meanwhile);
        print("  while they are there", &mut attacked);
        check(&collector, &reader, opened, turns).await;
        assert!(
            p99_attacked <= 2 * p99_quiet,
            "p99 {p99_attacked:?}, quiet {p99_quiet:?}"
        );
    });
}

fn print(when: &str, took: &mut [Duration]) {
    let [median, p99, slowest] = [50, 99, 100].map(|percent| quantile(took, percent));
    let count = took.len();
    println!("{when}: {count} posts, median {median:?}, p99 {p99:?}, slowest {slowest:?}");
}

/// Checks that nobody was turned away, and that every connection is accounted for.
async fn check(collector: &Attacked, reader: &Token, opened: usize, turns: usize) {
    let metrics = collector.metrics(Some(reader)).await;
    let of = |name: &str| metrics.of(name);
    assert_eq!(of("grideye_connections_turned_away_total"), 0);
    let posts = AGENTS * (2 * POSTS + POSTS_MEANWHILE) * turns;
    assert_eq!(of("grideye_frames_stored_total"), count(posts));
    // The crowd, the agents twice per turn, and the metrics request.
    let taken = opened + 2 * turns * AGENTS + 1;
    assert_eq!(of("grideye_connections_total"), count(taken));
    let displaced = of("grideye_connections_displaced_total");
    println!("  {displaced} of {taken} connections made room for another");
    assert!(displaced > 0);
    assert!(collector.log().contains("warning: displaced peer=127.0.0."));
}

#[test]
fn a_crowd_that_comes_again_as_fast_as_it_can_keeps_no_agent_out() {
    run(async {
        let folder = Folder::new();
        let collector = folder.start();
        let agents = agents(&vec![None; AGENTS], collector.address);
        let crowd = Crowd::start(collector.address, CROWD, true);
        until_opened(&crowd, CROWD).await;
        let before = crowd.opened();
        let (_agents, mut took) = posts(agents, POSTS).await;
        let during = crowd.opened() - before;
        let opened = crowd.end();
        let metrics = collector.metrics(None).await;
        let displaced = metrics.of("grideye_connections_displaced_total");
        println!(
            "{during} silent connections from 2 addresses, each again as soon as it made room ({displaced} of {opened} did), {AGENTS} agents, every post taken"
        );
        print("  meanwhile", &mut took);
        assert_eq!(metrics.of("grideye_connections_turned_away_total"), 0);
        let posts = count(AGENTS * POSTS);
        assert_eq!(metrics.of("grideye_frames_stored_total"), posts);
        assert!(during > 0 && displaced > 0, "{during}, {displaced}");
    });
}

#[test]
fn with_few_descriptors_there_are_fewer_connections_and_it_is_logged() {
    run(async {
        let collector = Folder::new().start_after("ulimit -n 500");
        let expected = "warning: few_descriptors open_files_max=500 connections_wanted=4096 connections_max=244\n";
        assert!(collector.log().contains(expected), "{}", collector.log());
        let crowd = Crowd::start(collector.address, 1000, false);
        until_opened(&crowd, 1000).await;
        let mut agent = Agent::new("pi-1", None, APART, collector.address);
        agent.post().await;
        let health = collector.get("/v1/health", None).await;
        assert!(health.contains("\"max\":244"), "{health}");
        crowd.end();
    });
}
