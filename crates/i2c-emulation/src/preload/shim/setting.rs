//! The emulator's settings in the environment, read once.

use super::super::protocol::{
    BUSES_MAX, ENVIRONMENT, ENVIRONMENT_PREFETCH, NAME_BYTES_MAX, SECRET_DIGITS, hexadecimal,
};
use super::{path, system};
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU8, Ordering};

const UNREAD: u8 = 0;
const BEING_READ: u8 = 1;
const READY: u8 = 2;
const NOTHING: u8 = 3;

pub(super) struct Setting {
    name: [u8; NAME_BYTES_MAX],
    name_bytes: usize,
    pub(super) secret: u128,
    buses: [u32; BUSES_MAX],
    buses_count: usize,
    pub(super) prefetch: bool,
}

impl Setting {
    const EMPTY: Self = Self {
        name: [0; NAME_BYTES_MAX],
        name_bytes: 0,
        secret: 0,
        buses: [0; BUSES_MAX],
        buses_count: 0,
        prefetch: true,
    };

    pub(super) fn socket(&self) -> &[u8] {
        self.name.get(..self.name_bytes).unwrap_or(&[])
    }

    pub(super) fn has(&self, bus: u32) -> bool {
        self.buses
            .get(..self.buses_count)
            .is_some_and(|buses| buses.contains(&bus))
    }

    fn parse(text: &[u8]) -> Option<Self> {
        let mut setting = Self::EMPTY;
        let mut fields = text.split(|byte| *byte == b':');
        let (name, secret, buses) = (fields.next()?, fields.next()?, fields.next()?);
        setting.name.get_mut(..name.len())?.copy_from_slice(name);
        setting.name_bytes = name.len();
        setting.secret = hexadecimal(secret, SECRET_DIGITS)?;
        for bus in buses.split(|byte| *byte == b',') {
            *setting.buses.get_mut(setting.buses_count)? = path::decimal(bus)?;
            setting.buses_count += 1;
        }
        Some(setting)
    }
}

struct Place(UnsafeCell<Setting>);

// SAFETY: only the thread that turned STATE from UNREAD to BEING_READ writes it, once; it is read only after READY was
// stored.
unsafe impl Sync for Place {}

static PLACE: Place = Place(UnsafeCell::new(Setting::EMPTY));
static STATE: AtomicU8 = AtomicU8::new(UNREAD);

/// The setting; `None` without an emulator, and for other callers during the first read.
pub(super) fn get() -> Option<&'static Setting> {
    match STATE.load(Ordering::Acquire) {
        // SAFETY: there are no more writes.
        READY => Some(unsafe { &*PLACE.0.get() }),
        UNREAD => read(),
        _ => None,
    }
}

#[cold]
fn read() -> Option<&'static Setting> {
    STATE
        .compare_exchange(UNREAD, BEING_READ, Ordering::AcqRel, Ordering::Acquire)
        .ok()?;
    let Some(mut setting) = system::environment(ENVIRONMENT).and_then(Setting::parse) else {
        STATE.store(NOTHING, Ordering::Release);
        return None;
    };
    setting.prefetch = system::environment(ENVIRONMENT_PREFETCH) != Some(b"0");
    // SAFETY: STATE excludes every other thread.
    unsafe { *PLACE.0.get() = setting };
    STATE.store(READY, Ordering::Release);
    get()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_taken_whole_or_not_at_all() {
        let secret = "000102030405060708090a0b0c0d0eff";
        let setting = Setting::parse(format!("name:{secret}:1,30").as_bytes()).unwrap();
        assert_eq!(setting.socket(), b"name");
        assert_eq!(setting.secret, 0x0001_0203_0405_0607_0809_0a0b_0c0d_0eff);
        assert!(setting.has(1) && setting.has(30));
        assert!(!setting.has(0) && !setting.has(3));
        let long = "n".repeat(NAME_BYTES_MAX + 1);
        let many = "7,".repeat(BUSES_MAX) + "8";
        for wrong in [
            String::new(),
            "name".to_owned(),
            format!("name:{secret}"),
            format!("name:{secret}:"),
            format!("name:{secret}:1,"),
            format!("name:{secret}:x"),
            format!("name:{}:1", &secret[1..]),
            format!("name:{}:1", secret.to_uppercase()),
            format!("{long}:{secret}:1"),
            format!("name:{secret}:{many}"),
        ] {
            assert!(Setting::parse(wrong.as_bytes()).is_none(), "{wrong}");
        }
    }
}
