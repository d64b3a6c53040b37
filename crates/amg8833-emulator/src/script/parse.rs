//! Scripts in TOML: `scripts/README.md` is the format.

use crate::fault::{Chance, Fault, FaultKind, Unit};
use crate::script::error::{RULES_MAX, ScriptError};
use crate::script::rules::{EVERY_MIN, Lasting, Rule, Script, When};
use crate::script::text::{duration, place};
use crate::signal::Address;
use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::num::NonZeroU32;
use core::ops::Range;
use core::time::Duration;
use grideye_frame::PixelIndex;
use serde::Deserialize;
use toml::Spanned;

/// The longest script that is read.
pub const SCRIPT_BYTES_MAX: usize = 1 << 20;
/// The twelve bits of a register word.
const WORD_MAX: i64 = 0xFFF;

impl Script {
    /// Reads a script in TOML. `origin` is what errors call it, a file name as a rule.
    ///
    /// # Errors
    /// What is wrong, with the place in the text, the field, and what to write instead.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScriptError> {
        if text.len() > SCRIPT_BYTES_MAX {
            return Err(ScriptError::TooLong {
                origin: origin.to_owned(),
                bytes: text.len(),
                bytes_max: SCRIPT_BYTES_MAX,
            });
        }
        let raw: RawScript = toml::from_str(text).map_err(|error| ScriptError::Malformed {
            place: place(text, origin, error.span().unwrap_or_default()),
            problem: with_hint(error.message()),
        })?;
        if raw.fault.len() > RULES_MAX {
            let found = raw.fault.len();
            return Err(ScriptError::TooManyRules { found });
        }
        let mut rules = Vec::new();
        for (number, fault) in (1..).zip(&raw.fault) {
            let reader = Reader {
                text,
                origin,
                number,
                whole: fault.span(),
            };
            rules.push(reader.rule(fault.get_ref())?);
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
    /// The fields that only some kinds have, by their names.
    fn particulars(&self) -> [(&'static str, &Option<Spanned<i64>>); 7] {
        [
            ("byte", &self.byte),
            ("bit", &self.bit),
            ("register", &self.register),
            ("pixel", &self.pixel),
            ("word", &self.word),
            ("ppm", &self.ppm),
            ("hz", &self.hz),
        ]
    }
}

/// Which particulars a kind has; the first ones it must have.
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

/// Reads one fault, and knows where it stands.
struct Reader<'a> {
    text: &'a str,
    origin: &'a str,
    number: usize,
    whole: Range<usize>,
}

impl Reader<'_> {
    fn rule(&self, raw: &RawFault) -> Result<Rule, ScriptError> {
        let kind = self.kind(raw)?;
        self.check_particulars(raw, kind)?;
        let lasting = self.lasting(raw, kind)?;
        let when = self.when(raw, kind, lasting)?;
        Ok(Rule {
            fault: self.fault(raw, kind)?,
            when,
            lasting: match (lasting, when) {
                (Some(lasting), _) => lasting,
                (None, When::Frame(_)) if kind != FaultKind::BrownOut => Lasting::Frames(1),
                (None, _) => Lasting::ToTheEnd,
            },
            chance: self.chance(raw)?,
            address: self.address(raw, kind)?,
            bus: self.number(
                "bus",
                raw.bus.as_ref(),
                0..=u32::MAX.into(),
                "the N of /dev/i2c-N",
            )?,
        })
    }

    fn kind(&self, raw: &RawFault) -> Result<FaultKind, ScriptError> {
        let name = raw.kind.get_ref();
        FaultKind::from_name(name).ok_or_else(|| {
            let names: Vec<&str> = FaultKind::ALL.into_iter().map(FaultKind::name).collect();
            self.error(
                "kind",
                raw.kind.span(),
                format!("there is no `{name}`"),
                format!("one of {}", names.join(", ")),
            )
        })
    }

    fn check_particulars(&self, raw: &RawFault, kind: FaultKind) -> Result<(), ScriptError> {
        let (needed, possible) = particulars_of(kind);
        for (field, value) in raw.particulars() {
            let known = needed.contains(&field) || possible.contains(&field);
            match value {
                Some(value) if !known => {
                    let having = FaultKind::ALL.into_iter().filter(|kind| {
                        let (needed, possible) = particulars_of(*kind);
                        needed.contains(&field) || possible.contains(&field)
                    });
                    let names: Vec<&str> = having.map(FaultKind::name).collect();
                    return Err(self.error(
                        field,
                        value.span(),
                        format!("`{kind}` has no such field"),
                        format!("it belongs to {}", names.join(", ")),
                    ));
                }
                None if needed.contains(&field) => {
                    return Err(self.error(
                        field,
                        self.whole.clone(),
                        format!("`{kind}` needs it, and it is not there"),
                        hint_for(field).to_owned(),
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn fault(&self, raw: &RawFault, kind: FaultKind) -> Result<Fault, ScriptError> {
        let byte = self.number(
            "byte",
            raw.byte.as_ref(),
            0..=u16::MAX.into(),
            hint_for("byte"),
        )?;
        let bit = self.number("bit", raw.bit.as_ref(), 0..=7, hint_for("bit"))?;
        let register = self.number(
            "register",
            raw.register.as_ref(),
            0..=0xFF,
            hint_for("register"),
        )?;
        let pixel: Option<u8> =
            self.number("pixel", raw.pixel.as_ref(), 1..=64, hint_for("pixel"))?;
        let pixel = pixel.and_then(|number| PixelIndex::from_number(number.into()));
        let word = self
            .number("word", raw.word.as_ref(), 0..=WORD_MAX, hint_for("word"))?
            .unwrap_or_default();
        let limit = i64::from(crate::device::drift::CLOCK_ERROR_PPM_MAX);
        let ppm = self.number("ppm", raw.ppm.as_ref(), -limit..=limit, hint_for("ppm"))?;
        let hz = self.number("hz", raw.hz.as_ref(), 1..=u32::MAX.into(), hint_for("hz"))?;
        Ok(match kind {
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
            FaultKind::ClockError => Fault::ClockError {
                ppm: ppm.unwrap_or_default(),
            },
            FaultKind::SclSpeed => Fault::SclSpeed {
                hz: hz.and_then(NonZeroU32::new).unwrap_or(NonZeroU32::MIN),
            },
        })
    }

    fn lasting(&self, raw: &RawFault, kind: FaultKind) -> Result<Option<Lasting>, ScriptError> {
        let given = [
            ("duration", raw.duration.as_ref().map(Spanned::span)),
            ("frames", raw.frames.as_ref().map(Spanned::span)),
            ("count", raw.count.as_ref().map(Spanned::span)),
        ];
        let given = given
            .into_iter()
            .filter_map(|(field, span)| Some((field, span?)));
        let mut first = None;
        for (field, span) in given {
            let problem = match first {
                Some(other) => Some(format!("cannot stand beside `{other}`")),
                None if kind == FaultKind::BrownOut => Some("`brown-out` is a moment".to_owned()),
                None if field == "count" && kind.unit() == Unit::Stretch => Some(format!(
                    "`{kind}` is a stretch of time, of which there is nothing to count"
                )),
                None => None,
            };
            if let Some(problem) = problem {
                let hint = match kind {
                    FaultKind::BrownOut => "a supply that stays away is `unplugged`",
                    _ if first.is_none() => "`duration` or `frames` says how long",
                    _ => "one of `duration`, `frames`, `count` says how long",
                };
                return Err(self.error(field, span, problem, hint.to_owned()));
            }
            first = Some(field);
        }
        let many = 1..=i64::from(u32::MAX);
        let hint = "a whole number from 1";
        let duration = self.time("duration", raw.duration.as_ref(), Duration::from_nanos(1))?;
        let frames = self.number("frames", raw.frames.as_ref(), many.clone(), hint)?;
        let count = self.number("count", raw.count.as_ref(), many, hint)?;
        let duration = duration.map(Lasting::For);
        Ok(duration
            .or(frames.map(Lasting::Frames))
            .or(count.map(Lasting::Times)))
    }

    fn when(
        &self,
        raw: &RawFault,
        kind: FaultKind,
        lasting: Option<Lasting>,
    ) -> Result<When, ScriptError> {
        self.check_one_when(raw)?;
        let at = self.time("at", raw.at.as_ref(), Duration::ZERO)?;
        let from = self.time("from", raw.from.as_ref(), Duration::ZERO)?;
        let until = self.time("until", raw.until.as_ref(), Duration::ZERO)?;
        let every = self.time("every", raw.every.as_ref(), EVERY_MIN)?;
        let frame = self.number(
            "frame",
            raw.frame.as_ref(),
            1..=i64::MAX,
            "frames count from 1",
        )?;
        if let (Some(until), Some(span)) = (until, &raw.until) {
            if until <= from.unwrap_or_default() {
                let problem = "is not after `from`".to_owned();
                let hint = "a time after it, like \"20 s\"".to_owned();
                return Err(self.error("until", span.span(), problem, hint));
            }
        }
        let from_start = from.unwrap_or_default();
        let when = match (at, every, frame) {
            (Some(at), _, _) => When::At(at),
            (_, Some(period), _) => When::Every {
                period,
                from: from_start,
                until,
            },
            (_, _, Some(frame)) => When::Frame(frame),
            _ if from.is_none() && until.is_none() => When::Always,
            _ => When::Between {
                from: from_start,
                until,
            },
        };
        self.check_length(raw, kind, when, lasting)?;
        Ok(when)
    }

    /// At most one of `at`, `frame`, `every`; `from` and `until` not with the first two.
    fn check_one_when(&self, raw: &RawFault) -> Result<(), ScriptError> {
        let moments = [
            ("at", raw.at.as_ref().map(Spanned::span)),
            ("frame", raw.frame.as_ref().map(Spanned::span)),
            ("every", raw.every.as_ref().map(Spanned::span)),
            ("from", raw.from.as_ref().map(Spanned::span)),
            ("until", raw.until.as_ref().map(Spanned::span)),
        ];
        let mut before: Option<&str> = None;
        for (field, span) in moments {
            let Some(span) = span else { continue };
            let stretch = matches!(field, "from" | "until");
            match before {
                Some(other) if !(stretch && matches!(other, "every" | "from")) => {
                    return Err(self.error(
                        field,
                        span,
                        format!("cannot stand beside `{other}`"),
                        "one of `at`, `frame`, `every`, or `from` and `until`, says when"
                            .to_owned(),
                    ));
                }
                Some(_) => {}
                None => before = Some(field),
            }
        }
        Ok(())
    }

    /// A moment needs to be told how long, a stretch of time knows.
    fn check_length(
        &self,
        raw: &RawFault,
        kind: FaultKind,
        when: When,
        lasting: Option<Lasting>,
    ) -> Result<(), ScriptError> {
        let moment = matches!(when, When::At(_) | When::Every { .. });
        if kind == FaultKind::BrownOut {
            if moment || matches!(when, When::Frame(_)) {
                return Ok(());
            }
            let problem = "`brown-out` is a moment, and it is not said which".to_owned();
            return Err(self.error("at", self.whole.clone(), problem, hint_for("at").to_owned()));
        }
        match lasting {
            None if moment => Err(self.error(
                "duration",
                self.whole.clone(),
                "it is not said how long it lasts".to_owned(),
                "add `duration = \"2 s\"`, `frames = 3` or `count = 1`; or write `from` instead of `at`"
                    .to_owned(),
            )),
            Some(Lasting::For(_) | Lasting::Frames(_))
                if matches!(when, When::Always | When::Between { .. }) =>
            {
                let (field, span) = match (&raw.duration, &raw.frames) {
                    (Some(duration), _) => ("duration", duration.span()),
                    (_, Some(frames)) => ("frames", frames.span()),
                    _ => ("duration", self.whole.clone()),
                };
                let problem = "has no beginning".to_owned();
                Err(self.error(field, span, problem, hint_for("at").to_owned()))
            }
            _ => Ok(()),
        }
    }

    fn chance(&self, raw: &RawFault) -> Result<Chance, ScriptError> {
        let Some(probability) = &raw.probability else {
            return Ok(Chance::ALWAYS);
        };
        Chance::new(*probability.get_ref()).ok_or_else(|| {
            self.error(
                "probability",
                probability.span(),
                format!("{} is no probability", probability.get_ref()),
                "0 to 1".to_owned(),
            )
        })
    }

    fn address(&self, raw: &RawFault, kind: FaultKind) -> Result<Option<Address>, ScriptError> {
        let Some(address) = &raw.address else {
            return Ok(None);
        };
        if matches!(
            kind,
            FaultKind::Hang | FaultKind::AdapterGone | FaultKind::SclSpeed
        ) {
            return Err(self.error(
                "address",
                address.span(),
                format!("`{kind}` is of the whole bus"),
                "leave it out".to_owned(),
            ));
        }
        let bits = u8::try_from(*address.get_ref()).ok();
        let known = bits.and_then(Address::from_bits);
        known.map(Some).ok_or_else(|| {
            self.error(
                "address",
                address.span(),
                format!("no sensor can have {:#04x}", address.get_ref()),
                "0x68 or 0x69".to_owned(),
            )
        })
    }

    fn number<T: TryFrom<i64>>(
        &self,
        field: &'static str,
        value: Option<&Spanned<i64>>,
        range: core::ops::RangeInclusive<i64>,
        hint: &str,
    ) -> Result<Option<T>, ScriptError> {
        let Some(value) = value else {
            return Ok(None);
        };
        let number = *value.get_ref();
        let fits = range.contains(&number).then(|| T::try_from(number).ok());
        fits.flatten().map(Some).ok_or_else(|| {
            let problem = format!(
                "{number} is not within {} to {}",
                range.start(),
                range.end()
            );
            self.error(field, value.span(), problem, hint.to_owned())
        })
    }

    fn time(
        &self,
        field: &'static str,
        value: Option<&Spanned<String>>,
        least: Duration,
    ) -> Result<Option<Duration>, ScriptError> {
        let Some(value) = value else {
            return Ok(None);
        };
        let text = value.get_ref();
        let Some(time) = duration(text) else {
            return Err(self.error(
                field,
                value.span(),
                format!("`{text}` is no time"),
                "a number and a unit (ns, us, ms, s, min, h), like \"12.5 s\"".to_owned(),
            ));
        };
        if time < least {
            let problem = format!("`{text}` is too short");
            return Err(self.error(field, value.span(), problem, format!("{least:?} at least")));
        }
        Ok(Some(time))
    }

    fn error(
        &self,
        field: &'static str,
        span: Range<usize>,
        problem: String,
        hint: String,
    ) -> ScriptError {
        ScriptError::Field {
            place: place(self.text, self.origin, span),
            number: self.number,
            field,
            problem,
            hint,
        }
    }
}

fn hint_for(field: &str) -> &'static str {
    match field {
        "at" => "add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        "byte" => "which byte of a transaction behind the address, from 0: `byte = 1`",
        "bit" => "which bit of the byte, 7 (first on the wire) to 0: `bit = 7`",
        "register" => "a register address: `register = 0x80`",
        "pixel" => "pixels are numbered 1 to 64: `pixel = 28`",
        "word" => "twelve bits as the register has them: `word = 0xFFF`, or 0x000 for 0.0 °C",
        "ppm" => "parts per million, 50000 is 5 % fast: `ppm = -40000`",
        _ => "hertz: `hz = 100000`",
    }
}

/// What the parser says, with a word on what may have been meant.
fn with_hint(message: &str) -> String {
    let hint = if message.contains("missing field `kind`") {
        "\nhint: every [[fault]] says what breaks: kind = \"nack-address\""
    } else if message.contains("expected a string") || message.contains("expected string") {
        "\nhint: times and kinds stand in quotes: at = \"12.5 s\", kind = \"hang\""
    } else if message.contains("unknown field") {
        "\nhint: write one of these instead, or take it out; scripts/README.md says what each means"
    } else {
        "\nhint: a script is a list of [[fault]] tables, and `seed = 7` before the first"
    };
    let mut text = message.trim().replace('\n', " ");
    text.push_str(hint);
    text
}
