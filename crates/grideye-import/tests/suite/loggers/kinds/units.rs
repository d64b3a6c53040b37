//! What the pixels' numbers mean.

use crate::loggers::print::{
    Column, Number, column, each, grid, joined, one, p, pixels, table, two, unix,
};
use crate::loggers::scene::Scene;
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{self, Asked, AskedOrNamed, Right, RightOrAsked};
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("2 units");
    named(&mut kind);
    plain(&mut kind, &UNNAMED);
    words(&mut kind);
    changed(&mut kind);
    kind
}

/// A table of a Unix time and the pixels.
fn with_time(
    scene: &Scene,
    name: impl Fn(usize) -> String,
    number: impl Fn(f64) -> String,
) -> String {
    let time: Column = column("time", &scene.shots, |shot| unix(shot.utc_ns));
    let columns: Vec<Column> = [vec![time], pixels(&scene.shots, name, number)].concat();
    table(",", &columns)
}

fn fahrenheit(celsius: f64) -> f64 {
    celsius * 1.8 + 32.0
}

fn kelvin(celsius: f64) -> f64 {
    celsius + 273.15
}

fn tenths(celsius: f64) -> String {
    format!("{:.0}", celsius * 10.0)
}

fn hundredths(celsius: f64) -> String {
    format!("{:.0}", celsius * 100.0)
}

fn thousandths(celsius: f64) -> String {
    format!("{:.0}", celsius * 1_000.0)
}

fn whole(celsius: f64) -> String {
    format!("{celsius:.0}")
}

fn signed_words(celsius: f64) -> String {
    whole(celsius * 4.0)
}

/// A pattern of the columns' names, their numbers, and the steps that rounding takes.
const NAMED: [(&str, Number, i16); 24] = [
    ("W04 p#_degF", |celsius| two(fahrenheit(celsius)), 0),
    ("p#_F", |celsius| two(fahrenheit(celsius)), 0),
    ("p# (°F)", |celsius| one(fahrenheit(celsius)), 0),
    ("temp_f_#", |celsius| two(fahrenheit(celsius)), 0),
    ("fahrenheit#", |celsius| one(fahrenheit(celsius)), 0),
    ("p# [F], whole", |celsius| whole(fahrenheit(celsius)), 2),
    ("pixel# deg F", |celsius| one(fahrenheit(celsius)), 0),
    ("p#_K", |celsius| two(kelvin(celsius)), 0),
    ("p# (K)", |celsius| kelvin(celsius).to_string(), 0),
    ("kelvin_#", |celsius| one(kelvin(celsius)), 1),
    ("p#_degC", two, 0),
    ("p# (°C)", one, 0),
    ("p# [C]", two, 0),
    ("p#_celsius, whole", whole, 2),
    ("p#_x10", tenths, 0),
    ("p#x10", tenths, 0),
    ("p#_x100", hundredths, 0),
    ("p#*100", hundredths, 0),
    ("p#_cC", hundredths, 0),
    ("p#_dC", tenths, 0),
    ("p#_mC", thousandths, 0),
    ("raw#", signed_words, 0),
    ("p#_raw", signed_words, 0),
    ("p#_counts", signed_words, 0),
];

/// Where the names say the unit.
fn named(kind: &mut Kind) {
    for (name, number, steps) in NAMED {
        kind.right(name, move |scene| {
            let pattern = name.trim_start_matches("W04 ").trim_end_matches(", whole");
            let pixel = |place: usize| pattern.replace('#', &place.to_string());
            let truth = Truth::of(scene).absolute(0).within(steps);
            (with_time(scene, pixel, number), truth)
        });
    }
}

/// Rows of 64 numbers alone: a name, what may be done, whether the room is cold, and the steps that rounding takes.
type Plain = (&'static str, Accept, bool, Number, i16);

fn plain(kind: &mut Kind, rows: &[Plain]) {
    for &(name, accept, is_cold, number, steps) in rows {
        kind.add(name, accept, move |scene| {
            if is_cold {
                scene.cold();
            }
            let separator = scene.random.one_of(&[",", ", ", "\t", " ", ";"]);
            let text = each(&scene.shots, |shot| joined(shot, number, separator) + "\n");
            (text, Truth::of(scene).within(steps))
        });
    }
}

const UNNAMED: [Plain; 28] = [
    ("two decimals", Right, false, two, 0),
    ("two decimals of a cold room", Right, true, two, 0),
    ("one decimal", Right, false, one, 0),
    ("one decimal of a cold room", Right, true, one, 0),
    (
        "six decimals",
        Right,
        false,
        |celsius| format!("{celsius:.6}"),
        0,
    ),
    (
        "scientific",
        Right,
        false,
        |celsius| format!("{celsius:.6e}"),
        0,
    ),
    (
        "noise digits",
        Right,
        false,
        |celsius| (celsius + 4e-7).to_string(),
        0,
    ),
    (
        "one decimal, halves up",
        Right,
        false,
        |celsius| one(celsius + 0.01),
        0,
    ),
    (
        "a plus before",
        Right,
        false,
        |celsius| format!("{celsius:+.2}"),
        0,
    ),
    (
        "zeros before",
        Right,
        false,
        |celsius| format!("{celsius:06.2}"),
        0,
    ),
    ("19.25C", Right, false, |celsius| two(celsius) + "C", 0),
    ("19.25°C", Right, false, |celsius| two(celsius) + "°C", 0),
    (
        "an offset of 0.12 °C",
        Right,
        false,
        |celsius| two(celsius + 0.12),
        1,
    ),
    (
        "67.10F",
        RightOrAsked,
        false,
        |celsius| two(fahrenheit(celsius)) + "F",
        0,
    ),
    ("whole degrees", RightOrAsked, false, whole, 2),
    (
        "cut to whole degrees",
        RightOrAsked,
        false,
        |celsius| whole(celsius.floor()),
        3,
    ),
    ("whole degrees of a cold room", RightOrAsked, true, whole, 2),
    (
        "whole degrees F",
        RightOrAsked,
        false,
        |celsius| whole(fahrenheit(celsius)),
        2,
    ),
    (
        "degrees F, two decimals",
        RightOrAsked,
        false,
        |celsius| two(fahrenheit(celsius)),
        0,
    ),
    (
        "degrees F, one decimal",
        RightOrAsked,
        false,
        |celsius| one(fahrenheit(celsius)),
        0,
    ),
    (
        "W06 Kelvin",
        RightOrAsked,
        false,
        |celsius| two(kelvin(celsius)),
        0,
    ),
    (
        "Kelvin, one decimal",
        RightOrAsked,
        false,
        |celsius| one(kelvin(celsius)),
        1,
    ),
    (
        "hundredths of Kelvin",
        RightOrAsked,
        false,
        |celsius| hundredths(kelvin(celsius)),
        0,
    ),
    ("tenths", RightOrAsked, false, tenths, 0),
    (
        "tenths with their halves",
        RightOrAsked,
        false,
        |celsius| (celsius * 10.0).to_string(),
        0,
    ),
    ("hundredths", RightOrAsked, false, hundredths, 0),
    ("thousandths", RightOrAsked, false, thousandths, 0),
    (
        "filtered, so that steps are gone",
        RightOrAsked,
        false,
        |celsius| format!("{:.4}", celsius + (celsius * 977.0).sin() / 9.0),
        1,
    ),
];

/// The 12 bits of a pixel's register.
fn register(celsius: f64) -> u16 {
    let steps: i16 = format!("{:.0}", celsius * 4.0).parse().unwrap();
    u16::from_ne_bytes(steps.to_ne_bytes()) & 0x0FFF
}

fn bytes(celsius: f64) -> [u8; 2] {
    register(celsius).to_le_bytes()
}

const WORDS: [Plain; 12] = [
    (
        "words",
        Right,
        false,
        |celsius| register(celsius).to_string(),
        0,
    ),
    (
        "words with a decimal",
        Right,
        false,
        |celsius| one(celsius * 4.0),
        0,
    ),
    (
        "words of a room at 0 °C, twelve bits",
        Right,
        true,
        |celsius| register(celsius).to_string(),
        0,
    ),
    (
        "words of a room at 0 °C, signed",
        RightOrAsked,
        true,
        signed_words,
        0,
    ),
    (
        "words of a room at 0 °C, sixteen bits",
        RightOrAsked,
        true,
        |celsius| {
            let steps: i16 = signed_words(celsius).parse().unwrap();
            u16::from_ne_bytes(steps.to_ne_bytes()).to_string()
        },
        0,
    ),
    (
        "W23 words with sign and magnitude",
        RightOrAsked,
        true,
        |celsius| {
            let sign = if celsius < 0.0 { 2_048.0 } else { 0.0 };
            whole(sign + celsius.abs() * 4.0)
        },
        0,
    ),
    (
        "words as 0x04F",
        Right,
        false,
        |celsius| format!("0x{:03X}", register(celsius)),
        0,
    ),
    (
        "words as 004f",
        Right,
        false,
        |celsius| format!("{:04x}", register(celsius)),
        0,
    ),
    (
        "bytes as 4F 00",
        Right,
        false,
        |celsius| bytes(celsius).map(|byte| format!("{byte:02X}")).join(" "),
        0,
    ),
    (
        "bytes as 0x4f,0x00",
        Right,
        false,
        |celsius| bytes(celsius).map(|byte| format!("0x{byte:02x}")).join(","),
        0,
    ),
    (
        "bytes of a cold room as fc 0f",
        Right,
        true,
        |celsius| bytes(celsius).map(|byte| format!("{byte:02x}")).join(" "),
        0,
    ),
    (
        "bytes as decimal numbers",
        RightOrAsked,
        false,
        |celsius| bytes(celsius).map(|byte| byte.to_string()).join(" "),
        0,
    ),
];

fn words(kind: &mut Kind) {
    plain(kind, &WORDS);
    kind.unsure("words of a room at 6 °C", |scene| {
        scene.colder(56);
        let text = each(&scene.shots, |shot| {
            joined(shot, |celsius| register(celsius).to_string(), ",") + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.unsure("bytes as one text of hexadecimal digits", |scene| {
        let text = each(&scene.shots, |shot| {
            let hex = joined(
                shot,
                |celsius| format!("{:04x}", register(celsius).swap_bytes()),
                "",
            );
            format!("{},{hex}\n", unix(shot.utc_ns))
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("words in eight lines of eight", |scene| {
        let text = each(&scene.shots, |shot| {
            grid(shot, |celsius| register(celsius).to_string(), "\t").join("\n") + "\n\n"
        });
        (text, Truth::of(scene))
    });
}

const NAMES: &[&str] = &[
    "picture",
    "image",
    "scaled",
    "normal",
    "mask",
    "gray",
    "grey",
    "absolute zero",
    "zeros and ones",
];

fn scaled(celsius: f64) -> f64 {
    ((celsius - 15.0) / 19.7).clamp(0.0, 1.0)
}

const CHANGED: [Plain; 8] = [
    (
        "W32 zeros and ones",
        AskedOrNamed(NAMES),
        false,
        |celsius| u8::from(celsius > 26.0).to_string(),
        0,
    ),
    (
        "0 to 1 without a step",
        AskedOrNamed(NAMES),
        false,
        |celsius| format!("{:.6}", scaled(celsius)),
        0,
    ),
    (
        "0 to 1 with two decimals",
        AskedOrNamed(NAMES),
        false,
        |celsius| two(scaled(celsius)),
        0,
    ),
    (
        "0 to 255",
        AskedOrNamed(NAMES),
        false,
        |celsius| whole(scaled(celsius) * 255.0),
        0,
    ),
    (
        "-1 to 1",
        AskedOrNamed(NAMES),
        false,
        |celsius| format!("{:.5}", scaled(celsius) * 2.0 - 1.0),
        0,
    ),
    (
        "standard scores",
        AskedOrNamed(NAMES),
        false,
        |celsius| format!("{:.6}", (celsius - 22.3) / 2.57),
        0,
    ),
    (
        "below absolute zero",
        AskedOrNamed(NAMES),
        false,
        |celsius| two(celsius - 512.0),
        0,
    ),
    (
        "true and false",
        AskedOrNamed(NAMES),
        false,
        |celsius| (celsius > 26.0).to_string(),
        0,
    ),
];

/// Numbers that are no temperatures anymore: nothing in the file gives them back.
fn changed(kind: &mut Kind) {
    plain(kind, &CHANGED);
    kind.add("0 to 255, called p0", AskedOrNamed(NAMES), |scene| {
        let text = with_time(scene, p, |celsius| whole(scaled(celsius) * 255.0));
        (text, Truth::of(scene))
    });
    kind.add("words that may be degrees", Asked, |scene| {
        // Every pixel has 50 at all times: the word of 12.5 °C, or 50 °C.
        let text = each(&scene.shots, |shot| {
            joined(shot, |_| "50".to_owned(), ",") + "\n"
        });
        (text, Truth::of(scene))
    });
}
