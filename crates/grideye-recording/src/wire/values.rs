//! JSON values with bounds: integers that fit a type, names, objects, and lists that end at their limit.

use super::error::TOO_MANY;
use crate::record::{CLOCK_STATES, ClockState};
use core::fmt;
use core::marker::PhantomData;
use core::str::FromStr;
use grideye_frame::{NoData, PIXELS, PixelWord};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// The value's description in error messages.
pub(super) trait Expected {
    const EXPECTED: &'static str;
}

impl Expected for u16 {
    const EXPECTED: &'static str = "an integer from 0 to 65535";
}

/// Parsed as `i64`, which enforces [`COUNT_MAX`](crate::COUNT_MAX).
impl Expected for u64 {
    const EXPECTED: &'static str = "an integer from 0 to 9223372036854775807";
}

impl Expected for i64 {
    const EXPECTED: &'static str = "a signed 64-bit integer";
}

impl Expected for ClockState {
    const EXPECTED: &'static str = CLOCK_STATES;
}

impl Expected for NoData {
    const EXPECTED: &'static str = "the name of a reason why there is no frame";
}

/// What a body may hold several of, and how many.
pub(super) trait Bounded {
    const MAX: usize;
    const MANY: &'static str;
    /// What the limit counts.
    const LIMIT_OF: &'static str;
}

/// A JSON integer, without fraction or exponent, that fits the type.
#[derive(Serialize)]
pub(super) struct Integer<T>(pub(super) T);

pub(super) struct Named<T>(pub(super) T);

/// An object: serde's derive would also accept an array of the fields' values.
pub(super) struct Object<T>(pub(super) T);

struct List<T>(Vec<T>);

/// Names, each with a count; `T` says which names there are.
struct Counts<T>(BTreeMap<String, u64>, PhantomData<T>);

pub(super) struct Pixels(pub(super) [PixelWord; PIXELS]);

impl<T: fmt::Display> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

impl Serialize for Pixels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|word| word.0))
    }
}

struct ValueVisitor<V>(PhantomData<V>);

macro_rules! read_by {
    ([$($generics:tt)*] $value:ty, $method:ident) => {
        impl<'de, $($generics)*> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                deserializer.$method(ValueVisitor::<Self>(PhantomData))
            }
        }
    };
}

read_by!([T: TryFrom<i64> + Expected] Integer<T>, deserialize_i64);
read_by!([T: FromStr + Expected] Named<T>, deserialize_str);
read_by!([T: Deserialize<'de> + Expected] Object<T>, deserialize_map);
read_by!([T: Deserialize<'de> + Expected + Bounded] List<T>, deserialize_seq);
read_by!([T: Bounded] Counts<T>, deserialize_map);
read_by!([] Pixels, deserialize_seq);

impl<T: TryFrom<i64> + Expected> Visitor<'_> for ValueVisitor<Integer<T>> {
    type Value = Integer<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(T::EXPECTED)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        let fitting = i64::try_from(value).ok().map(T::try_from);
        let fitting = fitting.and_then(Result::ok).map(Integer);
        fitting.ok_or_else(|| E::invalid_value(Unexpected::Unsigned(value), &self))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        let fitting = T::try_from(value).ok().map(Integer);
        fitting.ok_or_else(|| E::invalid_value(Unexpected::Signed(value), &self))
    }
}

impl<T: FromStr + Expected> Visitor<'_> for ValueVisitor<Named<T>> {
    type Value = Named<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(T::EXPECTED)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        let named = name.parse().ok().map(Named);
        named.ok_or_else(|| E::invalid_value(Unexpected::Str(name), &self))
    }
}

impl<'de, T: Deserialize<'de> + Expected> Visitor<'de> for ValueVisitor<Object<T>> {
    type Value = Object<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(T::EXPECTED)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Object)
    }
}

impl<'de, T: Deserialize<'de> + Expected + Bounded> Visitor<'de> for ValueVisitor<List<T>> {
    type Value = List<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "an array of {}", T::MANY)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut elements = Vec::new();
        while let Some(Object(element)) = seq.next_element()? {
            if elements.len() == T::MAX {
                return Err(too_many::<T, _>());
            }
            elements.push(element);
        }
        Ok(List(elements))
    }
}

impl<'de, T: Bounded> Visitor<'de> for ValueVisitor<Counts<T>> {
    type Value = Counts<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object of names and counts")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut counts = BTreeMap::new();
        while let Some(key) = map.next_key::<String>()? {
            let Integer(count) = map.next_value()?;
            if counts.contains_key(&key) {
                return Err(A::Error::custom(format_args!("duplicate field `{key}`")));
            }
            if counts.len() == T::MAX {
                return Err(too_many::<T, _>());
            }
            counts.insert(key, count);
        }
        Ok(Counts(counts, PhantomData))
    }
}

impl<'de> Visitor<'de> for ValueVisitor<Pixels> {
    type Value = Pixels;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "an array of exactly {PIXELS} integers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Pixels, A::Error> {
        let mut words = [PixelWord(0); PIXELS];
        for (index, slot) in words.iter_mut().enumerate() {
            *slot = match seq.next_element::<Integer<u16>>()? {
                Some(Integer(word)) => PixelWord(word),
                None => return Err(A::Error::invalid_length(index, &self)),
            };
        }
        match seq.next_element::<Integer<u16>>()? {
            None => Ok(Pixels(words)),
            Some(_) => Err(A::Error::invalid_value(Unexpected::Other("a 65th"), &self)),
        }
    }
}

/// The limit of `T`, in words.
pub(super) fn limit<T: Bounded>() -> String {
    format!("{} {}", T::MAX, T::LIMIT_OF)
}

fn too_many<T: Bounded, E: Error>() -> E {
    E::custom(format_args!("{TOO_MANY}{}", limit::<T>()))
}

pub(super) fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    Integer::deserialize(deserializer).map(|Integer(count)| count)
}

pub(super) fn some_count<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<u64>, D::Error> {
    count(deserializer).map(Some)
}

pub(super) fn counts<'de, T: Bounded, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, u64>, D::Error> {
    Counts::<T>::deserialize(deserializer).map(|Counts(counts, _)| counts)
}

pub(super) fn list<'de, T, D>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    T: Deserialize<'de> + Expected + Bounded,
    D: Deserializer<'de>,
{
    List::deserialize(deserializer).map(|List(elements)| elements)
}

pub(super) fn object<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de> + Expected,
    D: Deserializer<'de>,
{
    Object::deserialize(deserializer).map(|Object(value)| Some(value))
}

/// Rejects `null`, which a plain `Option` would accept.
pub(super) fn some<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}
