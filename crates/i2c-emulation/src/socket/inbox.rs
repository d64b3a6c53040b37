//! Reads whole packets from a stream, with time limits.

use super::wire::{LENGTH_BYTES, PACKET_BYTES_MAX};
use std::io::{ErrorKind, Read};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// Room for a frame's packets without growing.
const ROOM_AT_FIRST: usize = 4096;
/// The shortest read timeout a socket accepts.
const SHORTEST_WAIT: Duration = Duration::from_millis(1);

#[derive(Debug)]
pub(super) enum NoPacket {
    /// The peer closed the connection between two packets.
    Closed,
    /// The peer closed the connection within a packet.
    CutShort,
    /// Nothing came for the whole wait.
    Idle,
    /// A packet began but did not end in time.
    Slow,
    /// The peer announced a packet longer than [`PACKET_BYTES_MAX`].
    TooLong(usize),
    Broken,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// The limit for a packet's first byte.
    pub(super) first: Duration,
    /// The limit from its first byte to its last.
    pub(super) rest: Duration,
}

pub(super) struct Inbox {
    room: Vec<u8>,
    filled: usize,
    /// The length of the last packet returned; the next call drops it.
    taken: usize,
    wait: Option<Duration>,
}

impl Inbox {
    pub(super) fn new() -> Self {
        Self {
            room: vec![0; ROOM_AT_FIRST],
            filled: 0,
            taken: 0,
            wait: None,
        }
    }

    pub(super) fn receive(
        &mut self,
        stream: &UnixStream,
        patience: Patience,
    ) -> Result<&[u8], NoPacket> {
        self.room.copy_within(self.taken..self.filled, 0);
        self.filled -= self.taken;
        self.taken = 0;
        let mut deadline = (self.filled > 0).then(|| Instant::now() + patience.rest);
        loop {
            if let Some(end) = self.end_of_packet()? {
                self.taken = end;
                return Ok(self.room.get(LENGTH_BYTES..end).unwrap_or_default());
            }
            let wait = match deadline {
                None => patience.first,
                Some(deadline) => deadline
                    .checked_duration_since(Instant::now())
                    .ok_or(NoPacket::Slow)?,
            };
            self.read_some(stream, wait, deadline.is_some())?;
            deadline.get_or_insert_with(|| Instant::now() + patience.rest);
        }
    }

    /// The end of the first packet, once all of it has arrived.
    fn end_of_packet(&mut self) -> Result<Option<usize>, NoPacket> {
        let arrived = self.room.get(..self.filled).unwrap_or_default();
        let Some(head) = arrived.first_chunk::<LENGTH_BYTES>() else {
            return Ok(None);
        };
        let length = usize::try_from(u32::from_le_bytes(*head)).unwrap_or(usize::MAX);
        if length > PACKET_BYTES_MAX {
            return Err(NoPacket::TooLong(length));
        }
        let end = LENGTH_BYTES + length;
        if self.room.len() < end {
            self.room.resize(end, 0);
        }
        Ok((end <= self.filled).then_some(end))
    }

    fn read_some(
        &mut self,
        mut stream: &UnixStream,
        wait: Duration,
        begun: bool,
    ) -> Result<(), NoPacket> {
        let wait = wait.max(SHORTEST_WAIT);
        if self.wait != Some(wait) {
            let set = stream.set_read_timeout(Some(wait));
            set.or(Err(NoPacket::Broken))?;
            self.wait = Some(wait);
        }
        let room = self.room.get_mut(self.filled..).unwrap_or_default();
        match stream.read(room) {
            Ok(0) if begun => Err(NoPacket::CutShort),
            Ok(0) => Err(NoPacket::Closed),
            Ok(bytes) => {
                self.filled += bytes;
                Ok(())
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut if begun => Err(NoPacket::Slow),
                ErrorKind::WouldBlock | ErrorKind::TimedOut => Err(NoPacket::Idle),
                ErrorKind::Interrupted => Ok(()),
                ErrorKind::ConnectionReset | ErrorKind::BrokenPipe => Err(NoPacket::Closed),
                _ => Err(NoPacket::Broken),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    const PATIENCE: Patience = Patience {
        first: Duration::from_secs(20),
        rest: Duration::from_secs(20),
    };

    fn packet(body: &[u8]) -> Vec<u8> {
        let length = u32::try_from(body.len()).unwrap();
        [&length.to_le_bytes()[..], body].concat()
    }

    fn pair() -> (UnixStream, UnixStream) {
        UnixStream::pair().unwrap()
    }

    #[test]
    fn packets_come_out_whole_however_they_were_cut() {
        let (mut sender, receiver) = pair();
        let long = vec![7; 3 * ROOM_AT_FIRST];
        let sent = [packet(b"one"), packet(b""), packet(&long), packet(b"two")].concat();
        let writer = std::thread::spawn(move || {
            for piece in sent.chunks(1000) {
                sender.write_all(piece).unwrap();
            }
        });
        let mut inbox = Inbox::new();
        for expected in [b"one", &b""[..], &long, b"two"] {
            assert_eq!(inbox.receive(&receiver, PATIENCE).unwrap(), expected);
        }
        writer.join().unwrap();
        let end = inbox.receive(&receiver, PATIENCE);
        assert!(matches!(end, Err(NoPacket::Closed)), "{end:?}");
        for cut in 1..7 {
            let (mut sender, receiver) = pair();
            sender.write_all(&packet(b"one")[..cut]).unwrap();
            drop(sender);
            let end = Inbox::new().receive(&receiver, PATIENCE).map(<[u8]>::len);
            assert!(matches!(end, Err(NoPacket::CutShort)), "{cut}: {end:?}");
        }
    }

    #[test]
    fn the_longest_packet_passes_and_one_byte_more_does_not() {
        let (mut sender, receiver) = pair();
        let longest = vec![1; PACKET_BYTES_MAX];
        let sent = packet(&longest);
        let writer = std::thread::spawn(move || {
            sender.write_all(&sent).unwrap();
            let more = u32::try_from(PACKET_BYTES_MAX + 1).unwrap();
            sender.write_all(&more.to_le_bytes()).unwrap();
            sender
        });
        let mut inbox = Inbox::new();
        assert_eq!(inbox.receive(&receiver, PATIENCE).unwrap(), longest);
        let end = inbox.receive(&receiver, PATIENCE).map(<[u8]>::len);
        let one_more = PACKET_BYTES_MAX + 1;
        assert!(matches!(end, Err(NoPacket::TooLong(length)) if length == one_more));
        drop(writer.join().unwrap());
    }

    #[test]
    fn waiting_for_a_first_byte_and_for_the_rest_have_their_own_ends() {
        let (mut sender, receiver) = pair();
        let short = Duration::from_millis(5);
        let end = |first, rest| {
            let patience = Patience { first, rest };
            Inbox::new().receive(&receiver, patience).map(<[u8]>::len)
        };
        let idle = end(short, PATIENCE.rest);
        assert!(matches!(idle, Err(NoPacket::Idle)), "{idle:?}");
        sender.write_all(&packet(b"one")[..5]).unwrap();
        let slow = end(PATIENCE.first, short);
        assert!(matches!(slow, Err(NoPacket::Slow)), "{slow:?}");
    }
}
