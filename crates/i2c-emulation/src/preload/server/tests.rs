//! The server against connections from outside the library, and at its limits.

use super::*;
use crate::adapter::{ByFunction, Message};
use proptest::prelude::*;
use std::thread;

fn with_server(test: impl FnOnce(&Server)) {
    let mut rack = Rack::new();
    let silent = ByFunction(|_: &mut [Message<'_>]| Ok(()));
    rack.insert(1, SharedAdapter::new(silent));
    let server = Server::new(&rack, AdapterMode::Pi).unwrap();
    let (wake, awake) = UnixStream::pair().unwrap();
    thread::scope(|scope| {
        let (server, wake) = (&server, &wake);
        scope.spawn(move || server.serve(wake.as_fd(), scope));
        // Dropped even if the test fails; otherwise the server would never end.
        let _awake = awake;
        test(server);
    });
}

fn connect(server: &Server) -> UnixStream {
    let address = SocketAddr::from_abstract_name(&server.name).unwrap();
    UnixStream::connect_addr(&address).unwrap()
}

fn hello(server: &Server) -> Hello {
    Hello {
        purpose: Purpose::Channel,
        pointer_bytes: 8,
        secret: server.secret,
    }
}

/// The errno in the answer to a hello; `None` without an answer.
fn answer_to(mut stream: &UnixStream, hello: &[u8]) -> Option<i32> {
    stream.write_all(hello).unwrap();
    let mut errno = [0; 4];
    stream.read_exact(&mut errno).ok()?;
    Some(i32::from_ne_bytes(errno))
}

fn channel(server: &Server) -> Result<UnixStream, i32> {
    let stream = connect(server);
    match answer_to(&stream, &hello(server).to_bytes()) {
        Some(0) => Ok(stream),
        Some(errno) => Err(errno),
        None => panic!("not answered"),
    }
}

fn request(file: u64) -> [u8; REQUEST_BYTES] {
    let (buffer, length, memory_bytes) = (0, 1, 0);
    let call = Call::Read { buffer, length };
    let request = Request {
        file,
        call,
        memory_bytes,
    };
    request.to_bytes()
}

fn asked(mut stream: &UnixStream, request: &[u8]) -> Option<Answer> {
    stream.write_all(request).ok()?;
    let mut answer = [0; 16];
    stream.read_exact(&mut answer).ok()?;
    Answer::parse(&answer)
}

#[test]
fn a_connection_without_the_secret_is_closed() {
    with_server(|server| {
        let good = hello(server).to_bytes();
        assert_eq!(answer_to(&connect(server), &good), Some(0));
        let mut wrong_secret = hello(server);
        wrong_secret.secret ^= 1 << 120;
        assert_eq!(answer_to(&connect(server), &wrong_secret.to_bytes()), None);
        for (at, value) in [(0, 1), (4, 2), (5, 3)] {
            let mut wrong = good;
            wrong[at] = value;
            assert_eq!(answer_to(&connect(server), &wrong), None, "byte {at}");
        }
        let mut nameless = hello(server);
        nameless.purpose = Purpose::Token { bus: 1, flags: 2 };
        let answer = answer_to(&connect(server), &nameless.to_bytes());
        assert_eq!(answer, None, "a token without a name has no number");
        assert_eq!(server.opens(), 0);
    });
}

#[test]
fn a_greeting_may_come_in_pieces() {
    with_server(|server| {
        let stream = connect(server);
        let bytes = hello(server).to_bytes();
        for byte in &bytes[..31] {
            { &stream }.write_all(&[*byte]).unwrap();
            thread::yield_now();
        }
        assert_eq!(answer_to(&stream, &bytes[31..]), Some(0));
    });
}

#[test]
fn a_file_that_nobody_opened_is_ebadf_and_nonsense_ends_the_channel() {
    with_server(|server| {
        let stream = channel(server).unwrap();
        for _ in 0..3 {
            assert_eq!(asked(&stream, &request(7)), Some(Answer::Done(-9)));
        }
        let mut unknown = request(7);
        unknown[8] = 9;
        assert_eq!(asked(&stream, &unknown), None);
        let stream = channel(server).unwrap();
        let mut too_long = request(7);
        too_long[32..36].copy_from_slice(&4057u32.to_ne_bytes());
        assert_eq!(asked(&stream, &too_long), None);
        let stream = channel(server).unwrap();
        let two = [request(7), request(7)].concat();
        assert_eq!(
            asked(&stream, &two),
            None,
            "no request may precede the answer"
        );
    });
}

#[test]
fn one_channel_too_many_is_enfile_until_one_ends() {
    with_server(|server| {
        let channels = (0..CHANNELS_MAX).map(|_| channel(server).unwrap());
        let mut channels: Vec<UnixStream> = channels.collect();
        assert_eq!(channel(server).map(drop), Err(23));
        channels.pop();
        while server.channels.count() == CHANNELS_MAX {
            thread::yield_now();
        }
        assert!(channel(server).is_ok());
    });
}

#[test]
fn silent_connections_push_each_other_out_and_nobody_else() {
    with_server(|server| {
        let talking = channel(server).unwrap();
        let silent: Vec<UnixStream> = (0..=STRANGERS_MAX).map(|_| connect(server)).collect();
        let end = { &silent[0] }.read(&mut [0]).unwrap();
        assert_eq!(end, 0, "the oldest is dropped");
        let next = answer_to(&silent[1], &hello(server).to_bytes());
        assert_eq!(next, Some(0), "the next one is not");
        assert_eq!(asked(&talking, &request(7)), Some(Answer::Done(-9)));
    });
}

#[test]
fn the_address_has_everything_that_the_library_needs() {
    with_server(|server| {
        let address = server.address();
        let fields: Vec<&str> = address.split(':').collect();
        assert_eq!(fields.len(), 3, "{address}");
        assert!(fields[0].starts_with("i2c-emulation-") && fields[0].len() == 30);
        assert_eq!(fields[1].len(), 32);
        assert_eq!(fields[2], "1");
        let other = Server::new(&Rack::new(), AdapterMode::Pi).unwrap();
        assert_ne!(other.secret, server.secret);
        assert_ne!(other.name, server.name);
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Whatever arrives over a channel or before a hello, the next caller is served.
    #[test]
    fn no_bytes_can_break_the_server(
        noise in prop::collection::vec(any::<u8>(), 0..200),
        kind in 0..5u8,
        lengths in prop::collection::vec(any::<u8>(), 0..120),
    ) {
        with_server(|server| {
            let mut stranger = connect(server);
            let _ = stranger.write_all(&noise);
            let broken = channel(server).unwrap();
            let mut bytes = request(7).to_vec();
            bytes[8] = kind;
            bytes[32] = u8::try_from(lengths.len()).unwrap();
            bytes.extend(&lengths);
            let _ = { &broken }.write_all(&bytes);
            let _ = { &broken }.write_all(&noise);
            let next = channel(server).unwrap();
            assert_eq!(asked(&next, &request(7)), Some(Answer::Done(-9)));
        });
    }
}
