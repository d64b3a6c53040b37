//! The MQTT 3.1.1 packets that the bridge needs (OASIS, mqtt-v3.1.1).
//!
//! Everything is published at quality of service 0: a connection that holds loses nothing, and after a broken one all
//! retained messages are published again. Frames are heard at quality of service 1, and acknowledged once they are stored.

/// Maximum bytes of a text or password: its length has two bytes (§1.5.3).
pub(crate) const TEXT_BYTES_MAX: usize = 65_535;
const CONNECT: u8 = 0x10;
const PUBLISH: u8 = 0x30;
/// With the bits that §3.8.1 reserves.
const SUBSCRIBE: u8 = 0x82;
const RETAIN: u8 = 0x01;
/// The flag of a session that starts empty and ends with its connection (§3.1.2.4).
const CLEAN: u8 = 0x02;
/// The types of incoming packets: table 2.1.
const HEARD: [u8; 4] = [2, 3, 9, 13];
/// The identifier of the connection's only subscription; 0 is not allowed.
const SUBSCRIPTION: u16 = 1;

/// A ping (§3.12).
pub(crate) const PING: [u8; 2] = [0xC0, 0x00];
/// Ends a connection without its last will (§3.14).
pub(crate) const DISCONNECT: [u8; 2] = [0xE0, 0x00];

/// A message to publish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) payload: Vec<u8>,
    /// The broker keeps it for later subscribers; an empty one deletes what it keeps.
    pub(crate) retain: bool,
}

impl Message {
    pub(crate) fn passing(topic: String, payload: impl Into<Vec<u8>>) -> Self {
        Self {
            topic,
            payload: payload.into(),
            retain: false,
        }
    }

    pub(crate) fn retained(topic: String, payload: impl Into<Vec<u8>>) -> Self {
        Self {
            retain: true,
            ..Self::passing(topic, payload)
        }
    }

    /// Deletes the retained message.
    pub(crate) fn cleared(topic: String) -> Self {
        Self::retained(topic, Vec::new())
    }
}

pub(crate) struct Hello<'a> {
    pub(crate) client_id: &'a str,
    pub(crate) user: Option<&'a str>,
    pub(crate) password: Option<&'a [u8]>,
    pub(crate) will: Option<&'a Message>,
    pub(crate) keep_alive_s: u16,
    /// The broker keeps messages of quality of service 1 while this client is away.
    pub(crate) is_kept: bool,
}

/// A packet from the broker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Heard {
    /// The connection is accepted (0), or rejected with a code (§3.2.2.3).
    Connected(u8),
    /// One code per subscribed topic, 0x80 for a rejected one (§3.9.3).
    Subscribed(Vec<u8>),
    /// Its `retain` is set if it was published before the subscription; the number is that of its acknowledgment.
    Published(Message, Option<u16>),
    /// A message with more bytes than this client takes: its topic, its bytes, and the number of its acknowledgment.
    TooLong(String, usize, Option<u16>),
    Pong,
}

/// An invalid packet.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Garbled(&'static str);

/// §3.1.
pub(crate) fn connect(hello: &Hello<'_>) -> Vec<u8> {
    let mut flags = if hello.is_kept { 0 } else { CLEAN };
    let mut payload = Vec::new();
    put_text(&mut payload, hello.client_id.as_bytes());
    if let Some(will) = hello.will {
        // At quality of service 1 and retained.
        flags |= 0x04 | 0x08 | 0x20;
        put_text(&mut payload, will.topic.as_bytes());
        put_text(&mut payload, &will.payload);
    }
    if let Some(user) = hello.user {
        flags |= 0x80;
        put_text(&mut payload, user.as_bytes());
    }
    if let Some(password) = hello.password {
        flags |= 0x40;
        put_text(&mut payload, password);
    }
    let mut body = Vec::new();
    put_text(&mut body, b"MQTT");
    body.extend([4, flags]);
    body.extend(hello.keep_alive_s.to_be_bytes());
    body.extend(payload);
    packet(CONNECT, &body)
}

/// §3.3, at quality of service 0.
pub(crate) fn publish(message: &Message) -> Vec<u8> {
    let mut body = Vec::with_capacity(2 + message.topic.len() + message.payload.len());
    put_text(&mut body, message.topic.as_bytes());
    body.extend(&message.payload);
    let retain = if message.retain { RETAIN } else { 0 };
    packet(PUBLISH | retain, &body)
}

/// §3.8, at quality of service 0 or 1.
pub(crate) fn subscribe(filters: &[String], quality: u8) -> Vec<u8> {
    let mut body = SUBSCRIPTION.to_be_bytes().to_vec();
    for filter in filters {
        put_text(&mut body, filter.as_bytes());
        body.push(quality);
    }
    packet(SUBSCRIBE, &body)
}

/// Acknowledges a message of quality of service 1 (§3.4).
pub(crate) fn acknowledge(id: u16) -> [u8; 4] {
    let [high, low] = id.to_be_bytes();
    [0x40, 2, high, low]
}

/// Removes the first packet from the inbox; `None` while it is incomplete. Of a message above `bytes_max` the start is
/// enough, and the rest stays.
pub(crate) fn take(inbox: &mut Vec<u8>, bytes_max: usize) -> Result<Option<Heard>, Garbled> {
    let Some((start, length)) = extent(inbox)? else {
        return Ok(None);
    };
    if length > bytes_max {
        let head = &inbox[start..];
        let topic = head
            .first_chunk()
            .map_or(0, |length| u16::from_be_bytes(*length));
        if inbox[0] & 0xF0 != PUBLISH {
            return Err(Garbled("a packet that is too long"));
        }
        if head.len() < usize::from(topic) + 4 {
            return Ok(None);
        }
        let (message, id) = published(inbox[0], head)?;
        return Ok(Some(Heard::TooLong(message.topic, start + length, id)));
    }
    if inbox.len() < start + length {
        return Ok(None);
    }
    let rest = inbox.split_off(start + length);
    let whole = std::mem::replace(inbox, rest);
    parse(whole[0], &whole[start..]).map(Some)
}

/// Where a packet's body begins, and its length (§2.2.3).
fn extent(inbox: &[u8]) -> Result<Option<(usize, usize)>, Garbled> {
    // Otherwise another server's answer could look like a long packet to wait for.
    let mut header = inbox.iter().take(1);
    if header.any(|header| !HEARD.contains(&(header >> 4))) {
        return Err(Garbled("an unexpected packet"));
    }
    let mut length = 0;
    for index in 0..4 {
        let Some(byte) = inbox.get(1 + index) else {
            return Ok(None);
        };
        length |= usize::from(byte & 0x7F) << (7 * index);
        if byte & 0x80 == 0 {
            return Ok(Some((2 + index, length)));
        }
    }
    Err(Garbled("a packet without a length"))
}

fn parse(header: u8, body: &[u8]) -> Result<Heard, Garbled> {
    match (header >> 4, body) {
        (2, [_, code]) => Ok(Heard::Connected(*code)),
        (3, _) => published(header, body).map(|(message, id)| Heard::Published(message, id)),
        (9, [_, _, codes @ ..]) => Ok(Heard::Subscribed(codes.to_vec())),
        (13, []) => Ok(Heard::Pong),
        _ => Err(Garbled("an unexpected packet")),
    }
}

fn published(header: u8, body: &[u8]) -> Result<(Message, Option<u16>), Garbled> {
    let cut = Garbled("a message without a topic");
    let (length, rest) = body.split_first_chunk().ok_or(cut.clone())?;
    let length = usize::from(u16::from_be_bytes(*length));
    let (topic, rest) = rest.split_at_checked(length).ok_or(cut)?;
    let (id, payload) = match ((header >> 1) & 3, rest.split_first_chunk()) {
        (0, _) => (None, rest),
        (1, Some((id, payload))) => (Some(u16::from_be_bytes(*id)), payload),
        _ => return Err(Garbled("a message with another quality of service")),
    };
    let topic = String::from_utf8(topic.to_vec());
    let message = Message {
        topic: topic.or(Err(Garbled("a topic that is not UTF-8")))?,
        payload: payload.to_vec(),
        retain: header & RETAIN != 0,
    };
    Ok((message, id))
}

fn packet(header: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = vec![header];
    let mut length = body.len();
    loop {
        let [low, ..] = (length & 0x7F).to_le_bytes();
        length >>= 7;
        packet.push(if length > 0 { low | 0x80 } else { low });
        if length == 0 {
            break;
        }
    }
    packet.extend(body);
    packet
}

/// A text or bytes after their length; longer ones were rejected before ([`TEXT_BYTES_MAX`]).
fn put_text(body: &mut Vec<u8>, text: &[u8]) {
    let text = &text[..text.len().min(TEXT_BYTES_MAX)];
    body.extend(u16::try_from(text.len()).unwrap_or(u16::MAX).to_be_bytes());
    body.extend(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES_MAX: usize = 1024;

    #[test]
    fn the_packets_are_those_of_the_specification() {
        let will = Message::retained("a/b".to_owned(), "off");
        let hello = Hello {
            client_id: "me",
            user: Some("u"),
            password: Some(b"p"),
            will: Some(&will),
            keep_alive_s: 30,
            is_kept: false,
        };
        // §3.1: figure 3.8's order of the payload, and the flags of table 3.4.
        let expected = b"\x10\x1E\x00\x04MQTT\x04\xEE\x00\x1E\x00\x02me\x00\x03a/b\x00\x03off\x00\x01u\x00\x01p";
        assert_eq!(connect(&hello), expected);
        // §3.1.2.4: without the flag of a clean session, the broker keeps what it has for this client.
        let kept = Hello {
            is_kept: true,
            ..hello
        };
        assert_eq!(connect(&kept)[9], 0xEC);
        // §3.3 and §3.8.
        let message = Message::retained("a/b".to_owned(), "x");
        assert_eq!(publish(&message), b"\x31\x06\x00\x03a/bx");
        let message = Message::passing("a/b".to_owned(), "x");
        assert_eq!(publish(&message), b"\x30\x06\x00\x03a/bx");
        let filters = ["a/b".to_owned(), "c/d".to_owned()];
        let expected = b"\x82\x0E\x00\x01\x00\x03a/b\x00\x00\x03c/d\x00";
        assert_eq!(subscribe(&filters, 0), expected);
        let expected = b"\x82\x08\x00\x01\x00\x03a/b\x01";
        assert_eq!(subscribe(&filters[..1], 1), expected);
        // §3.4: figure 3.10's fixed header, then the message's number.
        assert_eq!(acknowledge(0x1234), *b"\x40\x02\x12\x34");
    }

    #[test]
    fn lengths_are_written_as_in_the_table_of_the_specification() {
        // §2.2.3, table 2.4.
        for (length, bytes) in [
            (0, &[0x00][..]),
            (127, &[0x7F]),
            (128, &[0x80, 0x01]),
            (16_383, &[0xFF, 0x7F]),
            (16_384, &[0x80, 0x80, 0x01]),
        ] {
            let written = packet(PUBLISH, &vec![0; length]);
            assert_eq!(&written[1..=bytes.len()], bytes, "{length}");
            assert_eq!(extent(&written), Ok(Some((1 + bytes.len(), length))));
        }
    }

    #[test]
    fn packets_are_taken_one_by_one_however_they_are_cut() {
        let mut sent = b"\x20\x02\x00\x05\x90\x04\x00\x01\x00\x80\xD0\x00".to_vec();
        let message = Message::retained("a/ü".to_owned(), vec![7; 300]);
        sent.extend(publish(&message));
        let (taken, subscribed) = (Heard::Connected(5), Heard::Subscribed(vec![0, 0x80]));
        sent.extend(b"\x3A\x06\x00\x01a\x12\x34x");
        let again = Message::passing("a".to_owned(), "x");
        let published = [(message, None), (again, Some(0x1234))];
        let [message, again] = published.map(|(message, id)| Heard::Published(message, id));
        let expected = [taken, subscribed, Heard::Pong, message, again];
        for piece in 1..sent.len() {
            let mut inbox = Vec::new();
            let mut heard = Vec::new();
            for bytes in sent.chunks(piece) {
                inbox.extend(bytes);
                while let Some(packet) = take(&mut inbox, BYTES_MAX).unwrap() {
                    heard.push(packet);
                }
            }
            assert_eq!(heard, expected, "in pieces of {piece}");
            assert!(inbox.is_empty());
        }
    }

    #[test]
    fn invalid_packets_are_rejected() {
        for garbled in [
            &b"HTTP/1.1 400 Bad Request"[..],
            b"\x30\xFF\xFF\xFF\xFF",
            b"\x30\x01\x00",
            b"\x30\x03\x00\x02a",
            b"\x30\x03\x00\x01\xFF",
            b"\x32\x04\x00\x01a\x00",
            b"\x34\x05\x00\x01a\x00\x01",
            b"\xD0\xFF\xFF\xFF\x7F",
            b"\x20\x01\x00",
            b"\xF0\x00",
        ] {
            let refused = take(&mut garbled.to_vec(), BYTES_MAX);
            assert!(refused.is_err(), "{garbled:?}: {refused:?}");
        }
    }

    #[test]
    fn of_a_message_that_is_too_long_the_start_is_enough() {
        let mut body = b"\x00\x03a/b\x00\x07".to_vec();
        body.resize(BYTES_MAX, b'x');
        let mut longest = packet(PUBLISH | 0x02, &body);
        assert!(matches!(
            take(&mut longest, BYTES_MAX),
            Ok(Some(Heard::Published(_, Some(7))))
        ));
        body.push(b'x');
        let longer = packet(PUBLISH | 0x02, &body);
        let expected = Heard::TooLong("a/b".to_owned(), longer.len(), Some(7));
        for cut in 0..longer.len() {
            let heard = take(&mut longer[..cut].to_vec(), BYTES_MAX);
            let is_told = heard.unwrap().map(|heard| assert_eq!(heard, expected));
            // The fixed header, the topic and the number.
            assert_eq!(is_told.is_some(), cut >= 3 + 7, "{cut}");
        }
    }
}
