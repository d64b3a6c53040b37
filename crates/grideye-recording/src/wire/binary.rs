//! The batch as bytes, laid out as the documentation of `wire` says: a quarter as long as JSON, and read without a parser.

use crate::record::Record;
use crate::record::layout::{ByteReader, Fault, Form, PACKED_BYTES_MAX, put, put_name};
use crate::wire::error::{WireError, WireFault};
use crate::wire::types::{Account, Batch, Reason, SensorBatch};
use crate::wire::values::{Bounded, limit};
use std::collections::BTreeMap;

/// The first bytes of a body: a mark, and the layout's version.
const MAGIC: [u8; 3] = *b"GEB";
const VERSION: u8 = 2;
const FRAME_BYTES_MAX: usize = 3 * 8 + 1 + 2 + PACKED_BYTES_MAX;
const COUNT_BYTES_MAX: usize = 10;

const ACCOUNT_NONE: u8 = 0;
const ACCOUNT_OF_RUN: u8 = 1;
const ACCOUNT_OF_ENDED_RUN: u8 = 2;

pub(super) fn encode(batch: &Batch, body: &mut Vec<u8>) {
    let frames: usize = batch.sensors.iter().map(|sensor| sensor.frames.len()).sum();
    body.reserve(256 * (1 + batch.sensors.len()) + FRAME_BYTES_MAX * frames);
    body.extend_from_slice(&MAGIC);
    body.push(VERSION);
    put_name(body, &batch.device);
    put_name(body, &batch.boot);
    body.push(u8::from(batch.t_sent_boot_ns.is_some()));
    if let Some(sent) = batch.t_sent_boot_ns {
        body.extend_from_slice(&sent.to_le_bytes());
    }
    put_length(body, batch.sensors.len());
    for sensor in &batch.sensors {
        put_name(body, &sensor.sensor);
        body.push(match &sensor.account {
            None => ACCOUNT_NONE,
            Some(account) if account.ended => ACCOUNT_OF_ENDED_RUN,
            Some(_) => ACCOUNT_OF_RUN,
        });
        if let Some(account) = &sensor.account {
            put_account(body, account);
        }
        put_length(body, sensor.frames.len());
        for record in &sensor.frames {
            put(body, record, Form::Wire);
        }
    }
}

fn put_account(body: &mut Vec<u8>, account: &Account) {
    put_count(body, account.read);
    put_count(body, account.missing);
    put_count(body, account.spooled);
    for counts in [&account.dropped, &account.errors] {
        put_length(body, counts.len());
        for (name, count) in counts {
            put_name(body, name);
            put_count(body, *count);
        }
    }
}

fn put_length(body: &mut Vec<u8>, length: usize) {
    put_count(body, u64::try_from(length).unwrap_or(u64::MAX));
}

/// Groups of 7 bits, lowest first; the eighth bit means that another group follows (LEB128).
fn put_count(body: &mut Vec<u8>, mut count: u64) {
    loop {
        let group = count.to_le_bytes()[0] & 0x7F;
        count >>= 7;
        if count == 0 {
            body.push(group);
            return;
        }
        body.push(group | 0x80);
    }
}

trait InField<T> {
    fn at(self, path: impl FnOnce() -> String) -> Result<T, WireError>;
}

impl<T> InField<T> for Result<T, Fault> {
    #[inline]
    fn at(self, path: impl FnOnce() -> String) -> Result<T, WireError> {
        self.map_err(|fault| {
            let path = match fault.field {
                "" => path(),
                field => format!("{}.{field}", path()),
            };
            let (expected, found) = (fault.expected, fault.found);
            let Some(offset) = fault.offset else {
                return WireError::wrong_value(path, &expected, found);
            };
            let what = format!("expected {expected} at byte {offset}, found {found}");
            WireError::new(WireFault::Malformed, path, what)
        })
    }
}

pub(super) fn decode(body: &[u8]) -> Result<Batch, WireError> {
    let mut reader = ByteReader::new(body);
    check_head(&mut reader)?;
    let device = reader.name().at(|| "device".to_owned())?.to_owned();
    let boot = reader.name().at(|| "boot".to_owned())?.to_owned();
    let t_sent_boot_ns = time_sent(&mut reader).at(|| "t_sent_boot_ns".to_owned())?;
    let mut sensors = Vec::new();
    for index in 0..length::<SensorBatch>(&mut reader, || "sensors".to_owned())? {
        sensors.push(sensor(&mut reader, index)?);
    }
    if reader.left() > 0 {
        let found = format!("{} more bytes", reader.left());
        let more = Err(reader.fault("the end of the body", found));
        return more.at(|| "body".to_owned());
    }
    Ok(Batch {
        device,
        boot,
        t_sent_boot_ns,
        sensors,
    })
}

fn check_head(reader: &mut ByteReader<'_>) -> Result<(), WireError> {
    let begin = reader.clone();
    let found: [u8; 3] = reader.array().at(|| "body".to_owned())?;
    if found != MAGIC {
        let found = format!("{:02X} {:02X} {:02X}", found[0], found[1], found[2]);
        let unmarked = Err(begin.fault("the bytes 47 45 42", found));
        return unmarked.at(|| "body".to_owned());
    }
    match reader.array().at(|| "version".to_owned())? {
        [VERSION] => Ok(()),
        [other] => {
            let path = "version".to_owned();
            Err(WireError::wrong_value(path, &VERSION.to_string(), other))
        }
    }
}

fn time_sent(reader: &mut ByteReader<'_>) -> Result<Option<u64>, Fault> {
    let at = reader.at();
    match reader.array()? {
        [0] => Ok(None),
        [1] => reader.array().map(u64::from_le_bytes).map(Some),
        [other] => Err(Fault::byte(at, "0 or 1", other)),
    }
}

fn sensor(reader: &mut ByteReader<'_>, index: usize) -> Result<SensorBatch, WireError> {
    let path = |field: &str| format!("sensors[{index}].{field}");
    let sensor = reader.name().at(|| path("sensor"))?.to_owned();
    let at = reader.at();
    let account = match reader.array().at(|| path("account"))? {
        [ACCOUNT_NONE] => None,
        [ended @ (ACCOUNT_OF_RUN | ACCOUNT_OF_ENDED_RUN)] => {
            let ended = ended == ACCOUNT_OF_ENDED_RUN;
            Some(account(reader, ended, || path("account"))?)
        }
        [other] => return Err(Fault::byte(at, "0 to 2", other)).at(|| path("account")),
    };
    let count = length::<Record>(reader, || path("frames"))?;
    let mut frames = Vec::with_capacity(count);
    for frame in 0..count {
        let record = reader.record(Form::Wire);
        frames.push(record.at(|| format!("sensors[{index}].frames[{frame}]"))?);
    }
    Ok(SensorBatch {
        sensor,
        account,
        frames,
    })
}

fn account(
    reader: &mut ByteReader<'_>,
    ended: bool,
    path: impl Fn() -> String,
) -> Result<Account, WireError> {
    let field = |name: &str| format!("{}.{name}", path());
    Ok(Account {
        read: count(reader).at(|| field("read"))?,
        missing: count(reader).at(|| field("missing"))?,
        spooled: count(reader).at(|| field("spooled"))?,
        dropped: counts(reader, || field("dropped"))?,
        errors: counts(reader, || field("errors"))?,
        ended,
    })
}

fn counts(
    reader: &mut ByteReader<'_>,
    path: impl Fn() -> String,
) -> Result<BTreeMap<String, u64>, WireError> {
    let mut counts = BTreeMap::new();
    for _ in 0..length::<Reason>(reader, &path)? {
        let name = reader.name().at(|| format!("{}, a key", path()))?;
        let of_name = || format!("{}.{name}", path());
        let count = count(reader).at(of_name)?;
        if counts.insert(name.to_owned(), count).is_some() {
            return Err(WireError::repeated(of_name()));
        }
    }
    Ok(counts)
}

/// How many there are of `T`, at most as many as a body may hold.
fn length<T: Bounded>(
    reader: &mut ByteReader<'_>,
    path: impl Fn() -> String,
) -> Result<usize, WireError> {
    let count = usize::try_from(count(reader).at(&path)?).ok();
    let count = count.filter(|count| *count <= T::MAX);
    count.ok_or_else(|| WireError::too_many(path(), &limit::<T>()))
}

fn count(reader: &mut ByteReader<'_>) -> Result<u64, Fault> {
    let begin = reader.clone();
    let mut count = 0_u64;
    for group in 0..COUNT_BYTES_MAX {
        let [byte] = reader.array()?;
        let bits = u64::from(byte & 0x7F);
        let shifted = bits << (7 * group);
        // Each number has one encoding, without an empty last group.
        if shifted >> (7 * group) != bits || byte == 0 && group > 0 {
            break;
        }
        count |= shifted;
        if byte & 0x80 == 0 {
            return Ok(count);
        }
    }
    let found = "a longer one, or one with an empty last group";
    Err(begin.fault("a count of 64 bits", found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_written_in_one_way_only() {
        for number in [0, 1, 127, 128, 16_383, 16_384, u64::MAX - 1, u64::MAX] {
            let mut body = Vec::new();
            put_count(&mut body, number);
            let mut reader = ByteReader::new(&body);
            assert_eq!(count(&mut reader), Ok(number));
            assert_eq!(reader.left(), 0);
        }
        let too_long: &[&[u8]] = &[
            &[0x80, 0x00],
            &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x02],
            &[0x80; 11],
        ];
        for body in too_long {
            count(&mut ByteReader::new(body)).unwrap_err();
        }
    }

    #[test]
    fn a_frame_has_as_many_bytes_as_stated() {
        let of_width = |width: usize| FRAME_BYTES_MAX - 8 * (16 - width);
        assert_eq!((of_width(4), of_width(6), of_width(16)), (62, 78, 158));
    }
}
