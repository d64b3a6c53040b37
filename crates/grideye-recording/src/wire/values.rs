//! JSON values: integers that fit a type, names, objects, and arrays with a limit.

use super::error::too_many;
use crate::record::{CLOCK_STATES, ClockState};
use core::cell::Cell;
use core::fmt;
use core::marker::PhantomData;
use core::str::FromStr;
use grideye_frame::NoData;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor,
};

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

/// A JSON integer, without fraction or exponent, that fits the type.
pub(super) struct Integer<T>(pub(super) T);

pub(super) struct Named<T>(pub(super) T);

pub(super) const COUNT: PhantomData<Integer<u64>> = PhantomData;
pub(super) const TEXT: PhantomData<String> = PhantomData;

struct ValueVisitor<V>(PhantomData<V>);

impl<'de, T: TryFrom<i64> + Expected> Deserialize<'de> for Integer<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_i64(ValueVisitor::<Self>(PhantomData))
    }
}

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

impl<'de, T: FromStr + Expected> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(ValueVisitor::<Self>(PhantomData))
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

/// Serde's derive would also accept an array of the fields' values.
pub(super) trait Object<'de>: Sized {
    type Value;
    const EXPECTED: &'static str;

    fn read<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error>;
}

#[derive(Clone, Copy)]
pub(super) struct Seed<O>(pub(super) O);

impl<'de, O: Object<'de>> DeserializeSeed<'de> for Seed<O> {
    type Value = O::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<O::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, O: Object<'de>> Visitor<'de> for Seed<O> {
    type Value = O::Value;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(O::EXPECTED)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<O::Value, A::Error> {
        self.0.read(map)
    }
}

/// An array, rejected at the first element beyond `left`.
pub(super) struct Array<'l, S> {
    pub(super) of: &'static str,
    pub(super) limit: usize,
    pub(super) limit_of: &'static str,
    pub(super) left: &'l Cell<usize>,
    pub(super) each: S,
}

impl<'de, S: DeserializeSeed<'de> + Copy> DeserializeSeed<'de> for Array<'_, S> {
    type Value = Vec<S::Value>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, S: DeserializeSeed<'de> + Copy> Visitor<'de> for Array<'_, S> {
    type Value = Vec<S::Value>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "an array of {}", self.of)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut elements = Vec::new();
        while let Some(element) = seq.next_element_seed(self.each)? {
            let left = self.left.get().checked_sub(1);
            self.left
                .set(left.ok_or_else(|| too_many::<A::Error>(self.limit, self.limit_of))?);
            elements.push(element);
        }
        Ok(elements)
    }
}

/// Reads a field's value, at most once per object.
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
