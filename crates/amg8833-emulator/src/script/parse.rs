//! Reads scripts in TOML; `scripts/README.md` describes the format.

use crate::device::ticks::CLOCK_ERROR_PPM_MAX;
use crate::fault::{Chance, Fault, FaultKind, Unit};
use crate::script::rules::{
    EVERY_MIN, Lasting, Place, RULES_MAX, Rule, SCRIPT_BYTES_MAX, Script, ScriptError, When,
};
use crate::signal::Address;
use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::num::NonZeroU32;
use core::ops::{Range, RangeInclusive};
use core::time::Duration;
use grideye_frame::PixelIndex;
use serde::Deserialize;
use toml::Spanned;

const WORD_MAX: i64 = 0xFFF;

impl Script {
    /// Reads a script in TOML. `origin` names the script in errors, usually its file name.
    ///
    /// # Errors
    /// [`ScriptError`] with the place in the text, the field, and what to write instead.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScriptError> {
        if text.len() > SCRIPT_BYTES_MAX {
            return Err(ScriptError::TooLong(origin.to_owned(), text.len()));
        }
        let raw: RawScript = toml::from_str(text).map_err(|error| {
            let place = place(text, origin, error.span().unwrap_or_default());
            ScriptError::Malformed(place, with_hint(error.message()))
        })?;
        if raw.fault.len() > RULES_MAX {
            return Err(ScriptError::TooManyRules(raw.fault.len()));
        }
        let mut rules = Vec::new();
        for (number, fault) in (1..).zip(&raw.fault) {
            let mut reader = Reader {
                text,
                origin,
                number,
                whole: fault.span(),
                raw: fault.get_ref(),
                kind: FaultKind::NackAddress,
            };
            rules.push(reader.rule()?);
        }
        Self::new(raw.seed, rules)
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScript {
    #[serde(default)]
    seed: u64,
    #[serde(default)]
    fault: Vec<Spanned<RawFault>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFault {
    kind: Spanned<String>,
    at: Option<Spanned<String>>,
    from: Option<Spanned<String>>,
    until: Option<Spanned<String>>,
    every: Option<Spanned<String>>,
    frame: Option<Spanned<i64>>,
    duration: Option<Spanned<String>>,
    frames: Option<Spanned<i64>>,
    count: Option<Spanned<i64>>,
    probability: Option<Spanned<f64>>,
    address: Option<Spanned<i64>>,
    bus: Option<Spanned<i64>>,
    byte: Option<Spanned<i64>>,
    bit: Option<Spanned<i64>>,
    register: Option<Spanned<i64>>,
    pixel: Option<Spanned<i64>>,
    word: Option<Spanned<i64>>,
    ppm: Option<Spanned<i64>>,
    hz: Option<Spanned<i64>>,
}

impl RawFault {
    fn whole(&self, field: &str) -> Option<&Spanned<i64>> {
        let value = match field {
            "frame" => &self.frame,
            "frames" => &self.frames,
            "count" => &self.count,
            "address" => &self.address,
            "bus" => &self.bus,
            "byte" => &self.byte,
            "bit" => &self.bit,
            "register" => &self.register,
            "pixel" => &self.pixel,
            "word" => &self.word,
            "ppm" => &self.ppm,
            _ => &self.hz,
        };
        value.as_ref()
    }

    fn time(&self, field: &str) -> Option<&Spanned<String>> {
        let value = match field {
            "at" => &self.at,
            "from" => &self.from,
            "until" => &self.until,
            "every" => &self.every,
            _ => &self.duration,
        };
        value.as_ref()
    }

    /// Those of these fields that the fault sets.
    fn given<const N: usize>(
        &self,
        fields: [&'static str; N],
    ) -> impl Iterator<Item = (&'static str, Range<usize>)> {
        fields.into_iter().filter_map(|field| {
            let span = match field {
                "frame" | "frames" | "count" => self.whole(field)?.span(),
                _ => self.time(field)?.span(),
            };
            Some((field, span))
        })
    }
}

/// The fields that only some kinds have.
const PARTICULARS: [&str; 7] = ["byte", "bit", "register", "pixel", "word", "ppm", "hz"];

/// The fields that a kind requires, then those it allows.
fn particulars_of(kind: FaultKind) -> (&'static [&'static str], &'static [&'static str]) {
    match kind {
        FaultKind::NackByte => (&["byte"], &[]),
        FaultKind::ShortClock => (&["byte", "bit"], &[]),
        FaultKind::BitFlip => (&[], &["register", "byte", "bit"]),
        FaultKind::Torn => (&[], &["pixel"]),
        FaultKind::PixelGlitch => (&["word"], &["pixel"]),
        FaultKind::ThermistorFailure => (&["word"], &[]),
        FaultKind::ClockError => (&["ppm"], &[]),
        FaultKind::SclSpeed => (&["hz"], &[]),
        _ => (&[], &[]),
    }
}

fn has(kind: FaultKind, field: &str) -> bool {
    let (needed, possible) = particulars_of(kind);
    needed.contains(&field) || possible.contains(&field)
}

fn names(kinds: impl Iterator<Item = FaultKind>) -> String {
    kinds.map(FaultKind::name).collect::<Vec<_>>().join(", ")
}

/// Reads one fault and knows its place in the text.
struct Reader<'a> {
    text: &'a str,
    origin: &'a str,
    number: usize,
    whole: Range<usize>,
    raw: &'a RawFault,
    kind: FaultKind,
}

impl Reader<'_> {
    fn rule(&mut self) -> Result<Rule, ScriptError> {
        let name = &self.raw.kind;
        self.kind = FaultKind::from_name(name.get_ref()).ok_or_else(|| {
            let problem = format!("there is no `{}`", name.get_ref());
            let hint = format!(
                "one of {}; crates/amg8833-emulator/scripts/README.md says what each does",
                names(FaultKind::ALL.into_iter())
            );
            self.error("kind", name.span(), problem, hint)
        })?;
        self.check_particulars()?;
        let lasting = self.lasting()?;
        let when = self.when(lasting)?;
        let one_frame = matches!(when, When::Frame(_)) && self.kind != FaultKind::BrownOut;
        let otherwise = if one_frame {
            Lasting::Frames(1)
        } else {
            Lasting::ToTheEnd
        };
        Ok(Rule {
            fault: self.fault()?,
            when,
            lasting: lasting.unwrap_or(otherwise),
            chance: self.chance()?,
            address: self.address()?,
            bus: self.number("bus", 0..=u32::MAX.into())?,
        })
    }

    fn check_particulars(&self) -> Result<(), ScriptError> {
        let kind = self.kind;
        for field in PARTICULARS {
            match self.raw.whole(field) {
                Some(value) if !has(kind, field) => {
                    let having = FaultKind::ALL.into_iter().filter(|kind| has(*kind, field));
                    let problem = format!("`{kind}` has no such field");
                    let hint = format!("it belongs to {}", names(having));
                    return Err(self.error(field, value.span(), problem, hint));
                }
                None if particulars_of(kind).0.contains(&field) => {
                    let problem = format!("`{kind}` requires this field");
                    return Err(self.error(field, self.whole.clone(), problem, hint_for(field)));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn fault(&self) -> Result<Fault, ScriptError> {
        let byte = self.number("byte", 0..=u16::MAX.into())?;
        let bit = self.number("bit", 0..=7)?;
        let register = self.number("register", 0..=0xFF)?;
        let pixel: Option<u8> = self.number("pixel", 1..=64)?;
        let pixel = pixel.and_then(|number| PixelIndex::from_number(number.into()));
        let word = self.number("word", 0..=WORD_MAX)?.unwrap_or_default();
        let limit = i64::from(CLOCK_ERROR_PPM_MAX);
        let ppm = self.number("ppm", -limit..=limit)?.unwrap_or_default();
        let hz = self.number("hz", 1..=u32::MAX.into())?;
        Ok(match self.kind {
            FaultKind::NackAddress => Fault::NackAddress,
            FaultKind::NackByte => Fault::NackByte(byte.unwrap_or_default()),
            FaultKind::BusError => Fault::BusError,
            FaultKind::ArbitrationLoss => Fault::ArbitrationLoss,
            FaultKind::Timeout => Fault::Timeout,
            FaultKind::Hang => Fault::Hang,
            FaultKind::ShortClock => Fault::ShortClock {
                byte: byte.unwrap_or_default(),
                bit: bit.unwrap_or_default(),
            },
            FaultKind::BitFlip => Fault::BitFlip {
                register,
                byte,
                bit,
            },
            FaultKind::StuckHigh => Fault::StuckHigh,
            FaultKind::AllZero => Fault::AllZero,
            FaultKind::BrownOut => Fault::BrownOut,
            FaultKind::FastWake => Fault::FastWake,
            FaultKind::Freeze => Fault::Freeze,
            FaultKind::Torn => Fault::Torn { pixel },
            FaultKind::Unplugged => Fault::Unplugged,
            FaultKind::AdapterGone => Fault::AdapterGone,
            FaultKind::PixelGlitch => Fault::PixelGlitch { pixel, word },
            FaultKind::ThermistorFailure => Fault::ThermistorFailure { word },
            FaultKind::ClockError => Fault::ClockError { ppm },
            FaultKind::SclSpeed => Fault::SclSpeed {
                hz: hz.and_then(NonZeroU32::new).unwrap_or(NonZeroU32::MIN),
            },
        })
    }

    fn lasting(&self) -> Result<Option<Lasting>, ScriptError> {
        let kind = self.kind;
        let mut first = None;
        for (field, span) in self.raw.given(["duration", "frames", "count"]) {
            let problem = match first {
                Some(other) => format!("cannot be combined with `{other}`"),
                None if kind == FaultKind::BrownOut => "`brown-out` has no length".to_owned(),
                None if field == "count" && kind.unit() == Unit::Stretch => {
                    format!("`{kind}` lasts, so there is nothing to count")
                }
                None => {
                    first = Some(field);
                    continue;
                }
            };
            let hint = match kind {
                FaultKind::BrownOut => "for a lasting loss of power, use `unplugged`",
                _ if first.is_none() => "`duration` or `frames` says how long",
                _ => "one of `duration`, `frames`, `count` says how long",
            };
            return Err(self.error(field, span, problem, hint));
        }
        let many = 1..=i64::from(u32::MAX);
        let duration = self.time("duration", Duration::from_nanos(1))?;
        let frames = self.number("frames", many.clone())?;
        let count = self.number("count", many)?;
        let counted = frames.map(Lasting::Frames).or(count.map(Lasting::Times));
        Ok(duration.map(Lasting::For).or(counted))
    }

    fn when(&self, lasting: Option<Lasting>) -> Result<When, ScriptError> {
        self.check_one_when()?;
        let at = self.time("at", Duration::ZERO)?;
        let start = self.time("from", Duration::ZERO)?;
        let until = self.time("until", Duration::ZERO)?;
        let every = self.time("every", EVERY_MIN)?;
        let frame = self.number("frame", 1..=i64::MAX)?;
        let from = start.unwrap_or_default();
        if until.is_some_and(|until| until <= from) {
            let span = self.raw.until.as_ref().map_or(0..0, Spanned::span);
            let hint = "a time after it, like \"20 s\"";
            return Err(self.error("until", span, "is not after `from`".to_owned(), hint));
        }
        let when = match (at, every, frame) {
            (Some(at), _, _) => When::At(at),
            (_, Some(period), _) => When::Every {
                period,
                from,
                until,
            },
            (_, _, Some(frame)) => When::Frame(frame),
            _ if start.is_none() && until.is_none() => When::Always,
            _ => When::Between { from, until },
        };
        self.check_length(when, lasting)?;
        Ok(when)
    }

    /// At most one of `at`, `frame`, `every`; `from` and `until` not with the first two.
    fn check_one_when(&self) -> Result<(), ScriptError> {
        let mut before: Option<&str> = None;
        for (field, span) in self.raw.given(["at", "frame", "every", "from", "until"]) {
            let stretch = matches!(field, "from" | "until");
            match before {
                Some(other) if !(stretch && matches!(other, "every" | "from")) => {
                    let problem = format!("cannot be combined with `{other}`");
                    let hint = "one of `at`, `frame`, `every`, or `from` and `until`, says when";
                    return Err(self.error(field, span, problem, hint));
                }
                Some(_) => {}
                None => before = Some(field),
            }
        }
        Ok(())
    }

    /// A fault that starts at a moment needs a length; only such a fault can have one.
    fn check_length(&self, when: When, lasting: Option<Lasting>) -> Result<(), ScriptError> {
        let moment = matches!(when, When::At(_) | When::Every { .. });
        let begins = moment || matches!(when, When::Frame(_));
        let mut given = self.raw.given(["duration", "frames"]);
        let (field, span, problem, hint) = match (self.kind, lasting) {
            (FaultKind::BrownOut, _) if !begins => {
                let problem = "`brown-out` has no time";
                ("at", self.whole.clone(), problem, hint_for("at"))
            }
            (FaultKind::BrownOut, _) => return Ok(()),
            (_, None) if moment => {
                let problem = "does not say how long the fault lasts";
                let hint = "add `duration = \"2 s\"`, `frames = 3` or `count = 1`; or write `from` instead of `at`";
                ("duration", self.whole.clone(), problem, hint)
            }
            (_, Some(Lasting::For(_) | Lasting::Frames(_))) if !begins => {
                let (field, span) = given.next().unwrap_or(("duration", self.whole.clone()));
                (field, span, "has no beginning", hint_for("at"))
            }
            _ => return Ok(()),
        };
        Err(self.error(field, span, problem.to_owned(), hint))
    }

    fn chance(&self) -> Result<Chance, ScriptError> {
        let Some(probability) = &self.raw.probability else {
            return Ok(Chance::ALWAYS);
        };
        Chance::new(*probability.get_ref()).ok_or_else(|| {
            let problem = format!("{} is not a probability", probability.get_ref());
            self.error("probability", probability.span(), problem, "0 to 1")
        })
    }

    fn address(&self) -> Result<Option<Address>, ScriptError> {
        let Some(address) = &self.raw.address else {
            return Ok(None);
        };
        let kind = self.kind;
        let bits = u8::try_from(*address.get_ref()).ok();
        let known = bits.and_then(Address::from_bits);
        let (problem, hint) = match kind {
            FaultKind::Hang | FaultKind::AdapterGone | FaultKind::SclSpeed => {
                (format!("`{kind}` affects the whole bus"), "leave it out")
            }
            _ if known.is_some() => return Ok(known),
            _ => {
                let problem = format!("no sensor can have {:#04x}", address.get_ref());
                (problem, "0x68 or 0x69")
            }
        };
        Err(self.error("address", address.span(), problem, hint))
    }

    fn number<T: TryFrom<i64>>(
        &self,
        field: &'static str,
        range: RangeInclusive<i64>,
    ) -> Result<Option<T>, ScriptError> {
        let Some(value) = self.raw.whole(field) else {
            return Ok(None);
        };
        let number = *value.get_ref();
        let fits = range.contains(&number).then(|| T::try_from(number).ok());
        fits.flatten().map(Some).ok_or_else(|| {
            let (least, most) = range.into_inner();
            let problem = format!("{number} is not within {least} to {most}");
            self.error(field, value.span(), problem, hint_for(field))
        })
    }

    fn time(&self, field: &'static str, least: Duration) -> Result<Option<Duration>, ScriptError> {
        let Some(value) = self.raw.time(field) else {
            return Ok(None);
        };
        let text = value.get_ref();
        let (problem, hint) = match duration(text) {
            Some(time) if time >= least => return Ok(Some(time)),
            Some(_) => (
                format!("`{text}` is too short"),
                format!("{least:?} at least"),
            ),
            None => (
                format!("`{text}` is not a time"),
                hint_for("duration").to_owned(),
            ),
        };
        Err(self.error(field, value.span(), problem, hint))
    }

    fn error(
        &self,
        field: &'static str,
        span: Range<usize>,
        problem: String,
        hint: impl Into<String>,
    ) -> ScriptError {
        ScriptError::Field {
            place: place(self.text, self.origin, span),
            number: self.number,
            field,
            problem,
            hint: hint.into(),
        }
    }
}

fn hint_for(field: &str) -> &'static str {
    match field {
        "at" => "add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        "duration" => "a number and a unit (ns, us, ms, s, min, h), like \"12.5 s\"",
        "frame" => "frames count from 1",
        "frames" | "count" => "a whole number from 1",
        "bus" => "the N of /dev/i2c-N",
        "byte" => "the byte of a transaction after its address, from 0: `byte = 1`",
        "bit" => "the bit of the byte, 7 (first on the wire) to 0: `bit = 7`",
        "register" => "a register address: `register = 0x80`",
        "pixel" => "pixels are numbered 1 to 64: `pixel = 28`",
        "word" => "the twelve bits of the register: `word = 0xFFF`, or 0x000 for 0.0 °C",
        "ppm" => "parts per million, 50000 is 5 % fast: `ppm = -40000`",
        _ => "hertz: `hz = 100000`",
    }
}

fn with_hint(message: &str) -> String {
    let hint = if message.contains("missing field `kind`") {
        "\nhint: every [[fault]] needs a kind: kind = \"nack-address\""
    } else if message.contains("expected a string") || message.contains("expected string") {
        "\nhint: put times and kinds in quotes: at = \"12.5 s\", kind = \"hang\""
    } else if message.contains("unknown field") {
        "\nhint: use one of these, or remove it; crates/amg8833-emulator/scripts/README.md explains each"
    } else {
        "\nhint: a script is a list of [[fault]] tables, and `seed = 7` before the first"
    };
    message.trim().replace('\n', " ") + hint
}

fn place(text: &str, origin: &str, span: Range<usize>) -> Place {
    let before = text.get(..span.start).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.get(line_start..).unwrap_or_default();
    Place(
        origin.to_owned(),
        before.matches('\n').count() + 1,
        line.chars().count() + 1,
    )
}

/// Parses a decimal number and a unit, to the nanosecond.
fn duration(text: &str) -> Option<Duration> {
    let text = text.trim();
    let digits_end = text.find(|c: char| !c.is_ascii_digit() && c != '.')?;
    let (number, unit) = text.split_at(digits_end);
    let nanoseconds_per_unit: u128 = match unit.trim() {
        "ns" => 1,
        "us" | "µs" | "μs" => 1_000,
        "ms" => 1_000_000,
        "s" => 1_000_000_000,
        "min" => 60_000_000_000,
        "h" => 3_600_000_000_000,
        _ => return None,
    };
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    // Beyond twelve digits, a fraction of an hour is below a nanosecond.
    if whole.is_empty() || fraction.is_empty() || whole.len() > 20 || fraction.len() > 12 {
        return None;
    }
    let scale = 10_u128.checked_pow(u32::try_from(fraction.len()).ok()?)?;
    let parts = whole.parse::<u128>().ok()? * scale + fraction.parse::<u128>().ok()?;
    let nanoseconds = parts.checked_mul(nanoseconds_per_unit)? / scale;
    Some(Duration::from_nanos(u64::try_from(nanoseconds).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString as _;

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        let rows = [
            ("12.5 s", Some(12_500_000_000)),
            ("0 s", Some(0)),
            ("1ns", Some(1)),
            ("1.5 us", Some(1_500)),
            ("2 µs", Some(2_000)),
            (" 200 ms ", Some(200_000_000)),
            ("0.1 min", Some(6_000_000_000)),
            ("24 h", Some(86_400_000_000_000)),
            ("0.000000001 s", Some(1)),
            ("0.9 ns", Some(0)),
            ("600 h 1", None),
            ("12.5", None),
            ("s", None),
            ("-1 s", None),
            (".5 s", None),
            ("1. s", None),
            ("1.2.3 s", None),
            ("1e3 s", None),
            ("1 S", None),
            ("99999999999999999999 h", None),
            ("999999999999999999999 s", None),
            ("0.1234567890123 h", None),
            ("", None),
        ];
        for (text, nanoseconds) in rows {
            let expected = nanoseconds.map(Duration::from_nanos);
            assert_eq!(duration(text), expected, "{text:?}");
        }
    }

    #[test]
    fn places_count_characters_from_one() {
        let text = "a = 1\nµ = \"2\"\n";
        let at = |start: usize| place(text, "f.toml", start..start).to_string();
        assert_eq!(at(0), "f.toml:1:1");
        assert_eq!(at(6), "f.toml:2:1");
        assert_eq!(at(8), "f.toml:2:2");
        assert_eq!(at(text.len()), "f.toml:3:1");
        assert_eq!(at(99), "f.toml:3:1");
    }
}
