//! Single values of JSON: integers that fit a type, names, texts.

use core::fmt;
use core::marker::PhantomData;
use core::str::FromStr;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Unexpected, Visitor};

/// An integer of JSON, without fraction or exponent, that fits the type.
pub(super) struct Integer<T> {
    pub(super) expected: &'static str,
    pub(super) kind: PhantomData<T>,
}

pub(super) const WORD: Integer<u16> = Integer {
    expected: "an integer from 0 to 65535",
    kind: PhantomData,
};
/// Through `i64`, so that [`COUNT_MAX`](crate::COUNT_MAX) is kept.
pub(super) const COUNT: Integer<u64> = Integer {
    expected: "an integer from 0 to 9223372036854775807",
    kind: PhantomData,
};
pub(super) const NANOSECONDS: Integer<i64> = Integer {
    expected: "an integer of 64 bits with sign",
    kind: PhantomData,
};

impl<'de, T: TryFrom<i64>> DeserializeSeed<'de> for Integer<T> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_i64(self)
    }
}

impl<T: TryFrom<i64>> Visitor<'_> for Integer<T> {
    type Value = T;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.expected)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<T, E> {
        i64::try_from(value)
            .ok()
            .and_then(|value| T::try_from(value).ok())
            .ok_or_else(|| E::invalid_value(Unexpected::Unsigned(value), &self))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        T::try_from(value)
            .ok()
            .ok_or_else(|| E::invalid_value(Unexpected::Signed(value), &self))
    }
}

/// A value that is written as its name.
pub(super) struct Named<T> {
    pub(super) expected: &'static str,
    pub(super) kind: PhantomData<T>,
}

impl<'de, T: FromStr> DeserializeSeed<'de> for Named<T> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<T: FromStr> Visitor<'_> for Named<T> {
    type Value = T;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.expected)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<T, E> {
        name.parse()
            .ok()
            .ok_or_else(|| E::invalid_value(Unexpected::Str(name), &self))
    }
}

pub(super) struct Text;

impl<'de> DeserializeSeed<'de> for Text {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        serde::Deserialize::deserialize(deserializer)
    }
}

/// Reads the value of a field that may stand in its object once.
pub(super) fn fill<'de, A: MapAccess<'de>, S: DeserializeSeed<'de>>(
    slot: &mut Option<S::Value>,
    field: &'static str,
    map: &mut A,
    seed: S,
) -> Result<(), A::Error> {
    if slot.is_some() {
        return Err(A::Error::duplicate_field(field));
    }
    *slot = Some(map.next_value_seed(seed)?);
    Ok(())
}
