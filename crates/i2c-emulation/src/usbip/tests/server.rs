//! The server over TCP: its list, its adapters, and clients that misbehave.

use super::host::*;
use crate::rack::{Rack, SharedAdapter};
use crate::usbip::{CONNECTIONS_MAX, Options, Server, UsbipError, attach};
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::thread;
use std::time::Duration;

fn loopback() -> SocketAddr {
    (Ipv4Addr::LOCALHOST, 0).into()
}

fn connect(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(server.address()).unwrap();
    // A server that hangs must fail the test, not hang it.
    let longest = Some(Duration::from_secs(20));
    stream.set_read_timeout(longest).unwrap();
    stream
}

fn import_request(bus_id: &str) -> Vec<u8> {
    let mut bytes = operation(VERSION, OP_REQ_IMPORT);
    bytes.extend(bus_id.as_bytes());
    bytes.resize(40, 0);
    bytes
}

/// Requests a device; returns the status of the answer, and the connection.
fn import(server: &Server, bus_id: &str) -> (u32, Client<TcpStream>) {
    let mut stream = connect(server);
    stream.write_all(&import_request(bus_id)).unwrap();
    let mut header = [0; 8];
    stream.read_exact(&mut header).unwrap();
    assert_eq!(header[..4], [0x01, 0x11, 0x00, 0x03]);
    let status = u32::from_be_bytes(header[4..].try_into().unwrap());
    if status == 0 {
        let mut device = [0; 312];
        stream.read_exact(&mut device).unwrap();
        assert!(device[256..].starts_with(bus_id.as_bytes()));
    }
    (status, Client(stream))
}

fn is_free_soon(server: &Server) -> bool {
    (0..500).any(|_| {
        thread::sleep(Duration::from_millis(10));
        import(server, "1-1").0 == 0
    })
}

fn list(stream: &mut TcpStream) -> Vec<u8> {
    let asked = operation(VERSION, OP_REQ_DEVLIST);
    stream.write_all(&asked).unwrap();
    let mut reply = Vec::new();
    stream.read_to_end(&mut reply).unwrap();
    reply
}

/// The table "OP_REP_DEVLIST" of the protocol's specification, offset by offset.
#[test]
fn the_list_of_devices_is_laid_out_as_documented() {
    let registers = Registers::default();
    let mut rack = rack_of(&registers);
    rack.insert(3, SharedAdapter::new(registers));
    let server = Server::bind(loopback(), &rack).unwrap();
    assert!(server.bus_ids().eq([(1, "1-1"), (3, "1-3")]));
    let reply = list(&mut connect(&server));
    assert_eq!(reply[..12], [0x01, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 2]);
    // 312 bytes per device and four for its interface.
    assert_eq!(reply.len(), 12 + 2 * 316);
    let (first, second) = reply[12..].split_at(316);
    for (device, name, number) in [(first, "1-1", 1), (second, "1-3", 2)] {
        assert_eq!(device[256..260], *format!("{name}\0").as_bytes());
        assert_eq!(device[0x120..0x124], [0, 0, 0, 1], "bus");
        assert_eq!(device[0x124..0x128], [0, 0, 0, number], "device");
        assert_eq!(device[0x128..0x12C], [0, 0, 0, 1], "low speed");
        assert_eq!(device[0x12C..0x130], [0x04, 0x03, 0xC6, 0x31]);
        assert_eq!(device[0x132..0x135], [0xFF, 0, 0], "a class of its own");
        assert_eq!(device[0x136], 1, "one configuration");
        assert_eq!(device[0x137], 1, "one interface");
        assert_eq!(device[0x138..0x13C], [0xFF, 0, 0, 0], "of the same class");
    }
}

#[test]
fn an_adapter_is_fetched_used_and_free_again() {
    let registers = Registers::default();
    let server = Server::bind(loopback(), &rack_of(&registers)).unwrap();
    let (status, mut client) = import(&server, "1-1");
    assert_eq!(status, 0);
    assert_eq!(client.read_message(WHOLE, 0x69, 2).data, [0, 1]);
    assert_eq!(import(&server, "1-1").0, 2, "ST_DEV_BUSY: somebody has it");
    assert_eq!(import(&server, "1-9").0, 4, "ST_NODEV");
    assert_eq!(import(&server, &"x".repeat(32)).0, 4);
    drop(client);
    assert!(is_free_soon(&server), "after its user hung up");
}

#[test]
fn stopping_hangs_up_on_all() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    let address = server.address();
    let (_, mut client) = import(&server, "1-1");
    let mut silent = connect(&server);
    server.stop();
    assert_eq!(client.0.read(&mut [0; 1]).unwrap_or(0), 0);
    assert_eq!(silent.read(&mut [0; 1]).unwrap_or(0), 0);
    assert!(TcpStream::connect(address).is_err());
}

#[test]
fn a_silent_client_is_disconnected() {
    let rack = rack_of(&Registers::default());
    let server = Server::bind_with(loopback(), &rack, Duration::from_millis(50)).unwrap();
    let mut silent = connect(&server);
    assert_eq!(silent.read(&mut [0; 1]).unwrap(), 0);
    let mut slow = connect(&server);
    slow.write_all(&import_request("1-1")[..20]).unwrap();
    assert_eq!(slow.read(&mut [0; 1]).unwrap(), 0);
    let (_, mut user) = import(&server, "1-1");
    thread::sleep(Duration::from_millis(200));
    assert_eq!(user.status(), 0, "a client with a device may be silent");
}

#[test]
fn one_connection_too_many_is_closed_at_once() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    let mut waiting: Vec<_> = (0..CONNECTIONS_MAX).map(|_| connect(&server)).collect();
    let mut one_too_many = connect(&server);
    assert_eq!(one_too_many.read(&mut [0; 1]).unwrap_or(0), 0);
    let served = list(&mut waiting[0]);
    assert!(!served.is_empty(), "the earlier clients are served");
}

#[test]
fn nonsense_on_tcp_ends_its_own_connection_only() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    for nonsense in [
        b"GET / HTTP/1.1\r\n\r\n".to_vec(),
        vec![0xFF; 64],
        operation([0x01, 0x06], OP_REQ_DEVLIST),
        [import_request("1-1"), vec![0xFF; 4096]].concat(),
    ] {
        let mut stream = connect(&server);
        stream.write_all(&nonsense).unwrap();
        let mut reply = Vec::new();
        // Unread bytes turn the end into a reset, which also counts.
        let _ = stream.read_to_end(&mut reply);
    }
    assert!(is_free_soon(&server));
}

#[test]
fn an_address_in_use_and_an_impossible_one_are_told_apart() {
    let rack = rack_of(&Registers::default());
    let server = Server::bind(loopback(), &rack).unwrap();
    let bind = |address| Server::bind(address, &rack).unwrap_err().to_string();
    let error = bind(server.address());
    let in_use = "is in use by another program\nhint: ";
    assert!(error.contains(in_use), "{error}");
    let elsewhere = SocketAddr::from((Ipv4Addr::new(192, 0, 2, 1), 0));
    let error = bind(elsewhere);
    let cannot = "cannot listen on 192.0.2.1:0: ";
    assert!(error.starts_with(cannot), "{error}");
}

#[test]
fn a_rack_has_between_one_bus_and_as_many_as_a_controller_has_ports() {
    let mut rack = Rack::new();
    let no_bus = |outcome| matches!(outcome, Some(UsbipError::NoBus));
    assert!(no_bus(Server::bind(loopback(), &rack).err()));
    assert!(no_bus(attach(&rack, &Options::default()).err()));
    for number in 0..8 {
        rack.insert(number, SharedAdapter::new(Registers::default()));
    }
    assert!(Server::bind(loopback(), &rack).is_ok());
    rack.insert(8, SharedAdapter::new(Registers::default()));
    let refused = |outcome| matches!(outcome, Some(UsbipError::TooManyBuses(9)));
    assert!(refused(Server::bind(loopback(), &rack).err()));
    assert!(refused(attach(&rack, &Options::default()).err()));
}
