//! Parts of the other kinds put together by chance.

use super::console::{PREFIXES, When, truth_of};
use crate::loggers::archive::{gzip, zip};
use crate::loggers::print::{
    Column, Number, clock, column, each, grid, iso, joined, nested, one, pixels, python, short,
    table, two, unix,
};
use crate::loggers::scene::{Random, Scene, Shot};
use crate::loggers::truth::Truth;
use crate::loggers::variant::{Accept, Kind};

/// Some are in an archive.
const PACKED: Accept = Accept::RightOrNamed(&["unpack"]);

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("9 other kinds mixed");
    kind.file("capture.log");
    for name in [
        "a log, 1", "a log, 2", "a log, 3", "a log, 4", "a log, 5", "a log, 6",
    ] {
        kind.add(name, PACKED, log);
    }
    kind.file("walk.csv");
    for name in [
        "a table, 1",
        "a table, 2",
        "a table, 3",
        "a table, 4",
        "a table, 5",
        "a table, 6",
    ] {
        kind.add(name, PACKED, any_table);
    }
    kind.file("walk.json");
    for name in [
        "an object, 1",
        "an object, 2",
        "an object, 3",
        "an object, 4",
        "an object, 5",
    ] {
        kind.add(name, PACKED, object);
    }
    kind
}

/// The text in some encoding or archive.
fn encoded(random: &mut Random, text: &str) -> Vec<u8> {
    match random.between(0, 9) {
        0 => format!("\u{feff}{text}").into(),
        1 => format!("\u{feff}{text}")
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect(),
        2 => gzip(text.as_bytes()),
        3 => zip(&[("walk.csv", text.into())], true),
        _ => text.into(),
    }
}

fn log(scene: &mut Scene) -> (Vec<u8>, Truth) {
    scene.any_room();
    let random = &mut scene.random;
    let (_, mut when, mut prefix, _) = random.one_of(&PREFIXES);
    if random.between(0, 4) == 0 {
        when = When::Not;
        prefix = |_: &Shot| String::new();
    }
    let number: Number = random.one_of(&[two, one, python, short]);
    let separator = random.one_of(&[",", ", ", " ", "\t"]);
    let end = random.one_of(&["\n", "\r\n"]);
    let form = random.between(0, 3);
    let boot = random.one_of(&[
        "",
        "",
        "AMG88xx test",
        "ets Jun  8 2016 00:22:57",
        "--- Miniterm ---",
    ]);
    let text = each(&scene.shots, |shot| {
        let before = prefix(shot);
        match form {
            0 => format!("{before}{}{end}", joined(shot, number, separator)),
            1 => format!("{before}[{}]{end}", joined(shot, number, ", ")),
            2 => format!("{before}{}{end}", nested(shot, number, ", ")),
            _ => {
                let rows = grid(shot, number, separator);
                let lines = rows.iter().map(|row| format!("{before}{row}{end}"));
                lines.collect::<String>() + &before + end
            }
        }
    });
    let head = if boot.is_empty() {
        String::new()
    } else {
        format!("{boot}{end}")
    };
    let bytes = encoded(&mut scene.random, &(head + &text));
    (bytes, truth_of(scene, when))
}

type Stamp = fn(&Shot) -> String;
/// The name of the time's column, its stamp, and how exact it is.
type Timed = (&'static str, Stamp, When);

const TIMES: [Timed; 8] = [
    ("time", |shot| unix(shot.utc_ns), When::Absolute),
    (
        "timestamp",
        |shot| (shot.utc_ns / 1_000_000).to_string(),
        When::Absolute,
    ),
    (
        "datetime",
        |shot| iso(shot.utc_ns, " ", "."),
        When::Absolute,
    ),
    (
        "Time",
        |shot| iso(shot.utc_ns, "T", ".") + "Z",
        When::Absolute,
    ),
    (
        "millis",
        |shot| (shot.t_ns / 1_000_000 + 90_000_000).to_string(),
        When::Relative,
    ),
    ("t [s]", |shot| unix(shot.t_ns), When::Relative),
    (
        "time_us",
        |shot| (shot.t_ns / 1_000 + 90_000_000).to_string(),
        When::Relative,
    ),
    ("Uhrzeit", |shot| clock(shot.utc_ns, "."), When::Relative),
];

const NAMES: [&str; 7] = ["p#", "pixel_#", "Pixel #", "r@", "T#", "amg_#", "temp[#]"];

fn any_table(scene: &mut Scene) -> (Vec<u8>, Truth) {
    scene.any_room();
    let random = &mut scene.random;
    let (called, stamp, when) = random.one_of(&TIMES);
    let pattern = random.one_of(&NAMES);
    let name = |place: usize| {
        let at = format!("{}c{}", place / 8, place % 8);
        pattern.replace('#', &place.to_string()).replace('@', &at)
    };
    let separator = random.one_of(&[",", ";", "\t"]);
    let is_comma = separator != "," && random.between(0, 2) == 0;
    let people = random.one_of(&["people", "n_persons", "label", "人数", "Personen"]);
    let has_thermistor = random.between(0, 1) == 1;
    let is_shuffled = random.between(0, 2) == 0;
    let number: Number = random.one_of(&[two, one, python, short]);
    let mut columns: Vec<Column> = vec![column(called, &scene.shots, stamp)];
    columns.extend(pixels(&scene.shots, name, number));
    columns.push(column(people, &scene.shots, |shot| shot.people.to_string()));
    if has_thermistor {
        columns.push(column("thermistor", &scene.shots, |shot| {
            format!("{:.4}", shot.thermistor_c())
        }));
    }
    if is_shuffled {
        scene.random.shuffle(&mut columns);
    }
    let mut text = table(separator, &columns);
    if is_comma {
        let (head, rest) = text.split_once('\n').unwrap();
        text = format!("{head}\n{}", rest.replace('.', ","));
    }
    let truth = truth_of(scene, when).people(scene, people);
    let truth = if has_thermistor {
        truth.thermistor(0.001)
    } else {
        truth
    };
    (encoded(&mut scene.random, &text), truth)
}

fn object(scene: &mut Scene) -> (Vec<u8>, Truth) {
    let random = &mut scene.random;
    let (_, stamp, when) = random.one_of(&TIMES[..4]);
    let called = random.one_of(&["ts", "time", "timestamp", "created_at"]);
    let pixels = random.one_of(&["pixels", "data", "frame", "temperatures", "grid"]);
    let (form, wrapping, around) = (
        random.between(0, 2),
        random.between(0, 2),
        random.between(0, 2),
    );
    let entries: Vec<String> = scene
        .shots
        .iter()
        .map(|shot| {
            let stamp = stamp(shot);
            let stamp = if stamp.contains('-') {
                format!("\"{stamp}\"")
            } else {
                stamp
            };
            let list = match form {
                0 => format!("[{}]", joined(shot, short, ",")),
                1 => nested(shot, short, ","),
                _ => format!("\"{}\"", joined(shot, two, ",")),
            };
            let inner = format!("\"{pixels}\":{list},\"people\":{}", shot.people);
            match wrapping {
                0 => format!("{{\"{called}\":{stamp},{inner}}}"),
                1 => format!("{{\"{called}\":{stamp},\"payload\":{{{inner}}}}}"),
                _ => format!("{{{inner},\"{called}\":{stamp},\"device\":\"esp32\"}}"),
            }
        })
        .collect();
    let text = match around {
        0 => entries.join("\n") + "\n",
        1 => format!("[{}]\n", entries.join(",\n")),
        _ => format!("{{\"site\":\"x\",\"frames\":[{}]}}\n", entries.join(", ")),
    };
    (
        encoded(&mut scene.random, &text),
        truth_of(scene, when).people(scene, "people"),
    )
}
