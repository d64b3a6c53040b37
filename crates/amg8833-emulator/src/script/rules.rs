//! The rules of a script (what breaks, when, how long, how likely, where), and why a script is invalid.

use crate::fault::{Chance, Fault, FaultKind, Unit, mix};
use crate::signal::Address;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

/// When a fault comes. Times and frames (from 1) count from when the bus received the script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Throughout.
    Always,
    /// From this time on.
    At(Duration),
    /// A stretch of time.
    Between {
        /// The first moment.
        from: Duration,
        /// The end, not included; `None`: never ends.
        until: Option<Duration>,
    },
    /// Repeatedly.
    Every {
        /// The time between occurrences, at least [`EVERY_MIN`]; the first comes one period after `from`.
        period: Duration,
        /// When the first period begins.
        from: Duration,
        /// No occurrence begins from this time on.
        until: Option<Duration>,
    },
    /// With this frame of the sensor at the rule's address, or of the sensor at the lowest address in use.
    Frame(u64),
}

/// How long a fault lasts once it has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lasting {
    /// As long as [`When`] says.
    ToTheEnd,
    /// This long.
    For(Duration),
    /// For this many frames of the sensor.
    Frames(u32),
    /// Until it has struck this often, in its [`Unit`]; not for faults counted by [`Unit::Stretch`].
    Times(u32),
}

/// One fault with when, how long, how likely, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// What breaks.
    pub fault: Fault,
    /// When.
    pub when: When,
    /// How long.
    pub lasting: Lasting,
    /// How likely on each occasion, by the fault's [`Unit`].
    pub chance: Chance,
    /// Which sensor; `None` for the whole bus with all of its sensors.
    pub address: Option<Address>,
    /// Which of several buses ([`Script::for_bus`]); `None` for each.
    pub bus: Option<u32>,
}

impl Rule {
    /// This fault on the whole bus, always and with certainty.
    #[must_use]
    pub const fn new(fault: Fault) -> Self {
        Self {
            fault,
            when: When::Always,
            lasting: Lasting::ToTheEnd,
            chance: Chance::ALWAYS,
            address: None,
            bus: None,
        }
    }

    fn check(&self) -> Result<(), &'static str> {
        let kind = self.fault.kind();
        let moment = kind == FaultKind::BrownOut;
        match (self.when, self.lasting) {
            (When::Every { period, .. }, _) if period < EVERY_MIN => {
                Err("the period is shorter than 1 ms")
            }
            (_, Lasting::Times(_)) if kind.unit() == Unit::Stretch => {
                Err("a fault that lasts cannot have a count")
            }
            (_, Lasting::For(_) | Lasting::Frames(_)) if moment => {
                Err("a momentary fault cannot have a duration")
            }
            _ => Ok(()),
        }
    }
}

/// A list of rules, and the seed for all their chances.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Script {
    seed: u64,
    /// Rules with their number in the whole script, which selects their random stream.
    pub(super) rules: Vec<(u64, Rule)>,
    bus: Option<u32>,
}

impl Script {
    /// A script of these rules.
    ///
    /// # Errors
    /// [`ScriptError`] on more than [`RULES_MAX`] rules, or an invalid one.
    pub fn new(seed: u64, rules: Vec<Rule>) -> Result<Self, ScriptError> {
        if rules.len() > RULES_MAX {
            return Err(ScriptError::TooManyRules(rules.len()));
        }
        for (number, rule) in (1..).zip(&rules) {
            let checked = rule.check();
            checked.map_err(|problem| ScriptError::Rule(number, problem))?;
        }
        Ok(Self {
            seed,
            rules: (1..).zip(rules).collect(),
            bus: None,
        })
    }

    /// The rules for this bus: those that name it or none. Each bus draws from its own seed.
    #[must_use]
    pub fn for_bus(&self, number: u32) -> Self {
        let mut script = self.clone();
        let is_here = |rule: &Rule| rule.bus.is_none_or(|bus| bus == number);
        script.rules.retain(|(_, rule)| is_here(rule));
        script.bus = Some(number);
        script
    }

    /// The rules in order.
    pub fn rules(&self) -> impl Iterator<Item = &Rule> {
        self.rules.iter().map(|(_, rule)| rule)
    }

    /// The seed as given.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// The same rules with another seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    pub(crate) fn seed_here(&self) -> u64 {
        self.bus
            .map_or(self.seed, |bus| mix(self.seed ^ mix(u64::from(bus))))
    }
}

/// The shortest time between two occurrences of a rule.
pub const EVERY_MIN: Duration = Duration::from_millis(1);

/// The most rules in one script.
pub const RULES_MAX: usize = 100;
/// The longest script accepted.
pub const SCRIPT_BYTES_MAX: usize = 1 << 20;

/// A place in a script: the script's name, line and column, from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place(pub String, pub usize, pub usize);

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(origin, line, column) = self;
        write!(formatter, "{origin}:{line}:{column}")
    }
}

/// Why a script is invalid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScriptError {
    /// Not TOML, an unknown key, or a value of the wrong type: where, and the parser's message.
    Malformed(Place, String),
    /// A field of a fault is invalid.
    Field {
        /// Where.
        place: Place,
        /// The fault's number, from 1.
        number: usize,
        /// The field's name.
        field: &'static str,
        /// What is wrong.
        problem: String,
        /// What to write instead.
        hint: String,
    },
    /// A rule made in Rust (its number, from 1) is invalid, and why.
    Rule(usize, &'static str),
    /// This many rules exceed [`RULES_MAX`].
    TooManyRules(usize),
    /// The text of this origin, with this many bytes, exceeds [`SCRIPT_BYTES_MAX`].
    TooLong(String, usize),
}

impl fmt::Display for ScriptError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(place, problem) => write!(formatter, "{place}: {problem}"),
            Self::Field {
                place,
                number,
                field,
                problem,
                hint,
            } => write!(
                formatter,
                "{place}: fault {number}, `{field}`: {problem}\nhint: {hint}"
            ),
            Self::Rule(number, problem) => write!(formatter, "rule {number}: {problem}"),
            Self::TooManyRules(found) => write!(
                formatter,
                "{found} rules, at most {RULES_MAX} are possible\nhint: give each bus its own script"
            ),
            Self::TooLong(origin, bytes) => write!(
                formatter,
                "{origin}: {bytes} bytes, at most {SCRIPT_BYTES_MAX} are possible\nhint: is this a fault script?"
            ),
        }
    }
}

impl core::error::Error for ScriptError {}
