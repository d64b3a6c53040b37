//! More than 64 numbers that look like pixels, and more than one sensor in a file.

use crate::loggers::print::{
    Column, column, each, grid, iso, joined, p, pixels, python, short, table, two, unix,
};
use crate::loggers::scene::{Scene, Shot};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("5 families and streams");
    names(&mut kind);
    objects(&mut kind);
    devices(&mut kind);
    texts(&mut kind);
    kind
}

/// The same frames after a filter: other numbers that look like pixels.
fn smoothed(scene: &mut Scene) -> Vec<Shot> {
    scene.second(3)
}

/// `p7` of `p#`, and `r0c7` of `r@`.
fn named(pattern: &str, place: usize) -> String {
    let at = format!("{}c{}", place / 8, place % 8);
    pattern.replace('#', &place.to_string()).replace('@', &at)
}

/// A table of a time and two times 64 columns; the truth are both.
fn two_families(scene: &mut Scene, first: &str, second: &str, order: u8) -> (String, Truth) {
    let others = smoothed(scene);
    let time = column("time", &scene.shots, |shot| unix(shot.utc_ns));
    let one = pixels(&scene.shots, |place| named(first, place), two);
    let other = pixels(&others, |place| named(second, place), two);
    let columns: Vec<Column> = match order {
        0 => [vec![time], one, other].concat(),
        1 => [one, other, vec![time]].concat(),
        _ => {
            let pairs = one
                .into_iter()
                .zip(other)
                .flat_map(|(one, other)| [one, other]);
            [time].into_iter().chain(pairs).collect()
        }
    };
    let truth = Truth::of_streams(&[&scene.shots, &at_times_of(others, &scene.shots)]);
    (table(",", &columns), truth.absolute(0))
}

fn at_times_of(mut shots: Vec<Shot>, of: &[Shot]) -> Vec<Shot> {
    for (shot, of) in shots.iter_mut().zip(of) {
        (shot.t_ns, shot.utc_ns) = (of.t_ns, of.utc_ns);
    }
    shots
}

/// A variant's name, patterns of the names of its two families, and the order of the columns.
const FAMILIES: [(&str, &str, &str, u8); 17] = [
    ("W16 background before values", "bg#", "val#", 0),
    ("values before background", "val#", "bg#", 0),
    ("raw and filtered", "raw_#", "filtered_#", 0),
    ("filtered and raw, in turns", "filt#", "raw#", 2),
    ("least and most", "min#", "max#", 0),
    ("mean and median", "mean_#", "med_#", 1),
    ("pixels and their background", "p#", "p#_bg", 0),
    ("pixels and smoothed pixels", "pixel#", "smooth_pixel#", 1),
    ("pixels and what was subtracted", "T#", "T#_offset", 2),
    ("130 columns of left and right", "L#", "R#", 0),
    (
        "130 columns of left and right, in turns",
        "left_#",
        "right_#",
        2,
    ),
    ("130 columns of sensor 1 and 2", "s1_p#", "s2_p#", 0),
    ("130 columns of 0x68 and 0x69", "0x68_#", "0x69_#", 0),
    ("a_r0c0 and b_r0c0", "a_r@", "b_r@", 0),
    ("r0c0 twice", "r@", "r@", 0),
    ("p0 to p63 twice", "p#", "p#", 0),
    ("pixels of now and of before", "t#", "prev_t#", 0),
];

fn names(kind: &mut Kind) {
    for (name, first, second, order) in FAMILIES {
        kind.file("walk.csv");
        kind.unsure(name, move |scene| two_families(scene, first, second, order));
    }
    kind.unsure("p0 to p127", |scene| {
        let others = smoothed(scene);
        let mut columns = pixels(&scene.shots, p, two);
        columns.extend(pixels(&others, |place| p(place + 64), two));
        let others = at_times_of(others, &scene.shots);
        (
            table(",", &columns),
            Truth::of_streams(&[&scene.shots, &others]),
        )
    });
    kind.unsure("128 columns without names", |scene| {
        let others = smoothed(scene);
        let text = each(&scene.shots, |shot| {
            let other = joined(&others[shot.index], two, ",");
            format!("{},{},{other}\n", unix(shot.utc_ns), joined(shot, two, ","))
        });
        let others = at_times_of(others, &scene.shots);
        (
            text,
            Truth::of_streams(&[&scene.shots, &others]).absolute(0),
        )
    });
    kind.right("16 zones beside the pixels", |scene| {
        let mut columns = vec![column("time", &scene.shots, |shot| unix(shot.utc_ns))];
        columns.extend((0..16).map(|zone| {
            column(&format!("zone{zone}"), &scene.shots, |shot| {
                two(shot.celsius()[4 * zone])
            })
        }));
        columns.extend(pixels(&scene.shots, p, two));
        (table(",", &columns), Truth::of(scene).absolute(0))
    });
    kind.right("mean, least and most beside the pixels", |scene| {
        let mut columns = pixels(&scene.shots, p, two);
        columns.push(column("mean", &scene.shots, |shot| {
            format!("{:.3}", shot.celsius().iter().sum::<f64>() / 64.0)
        }));
        columns.push(column("max", &scene.shots, |shot| {
            two(shot.celsius().into_iter().fold(-99.0, f64::max))
        }));
        let truth = Truth::of(scene).label(scene, "max", |shot| {
            two(shot.celsius().into_iter().fold(-99.0, f64::max))
        });
        (table(",", &columns), truth)
    });
}

fn objects(kind: &mut Kind) {
    for (name, first, second) in [
        ("raw and filtered in JSON", "raw", "filtered"),
        ("left and right in JSON", "left", "right"),
        ("pixels and background in JSON", "background", "pixels"),
    ] {
        kind.file("walk.jsonl");
        kind.unsure(name, move |scene| {
            let others = smoothed(scene);
            let text = each(&scene.shots, |shot| {
                let (one, other) = (
                    joined(shot, short, ","),
                    joined(&others[shot.index], short, ","),
                );
                format!(
                    "{{\"ts\":{},\"{first}\":[{one}],\"{second}\":[{other}]}}\n",
                    unix(shot.utc_ns)
                )
            });
            let others = at_times_of(others, &scene.shots);
            (
                text,
                Truth::of_streams(&[&scene.shots, &others]).absolute(0),
            )
        });
    }
    kind.unsure("sensors in a list in JSON", |scene| {
        let others = smoothed(scene);
        let text = each(&scene.shots, |shot| {
            let (one, other) = (joined(shot, python, ", "), joined(&others[shot.index], python, ", "));
            format!("{{\"ts\": {}, \"sensors\": [{{\"addr\": 104, \"pixels\": [{one}]}}, {{\"addr\": 105, \"pixels\": [{other}]}}]}}\n", unix(shot.utc_ns))
        });
        let others = at_times_of(others, &scene.shots);
        (text, Truth::of_streams(&[&scene.shots, &others]).absolute(0))
    });
    for (name, key, one, other) in [
        (
            "devices in turns in JSON",
            "device",
            "\"kitchen\"",
            "\"hall\"",
        ),
        ("nodes in turns in JSON", "node_id", "1", "2"),
        ("rooms in turns in JSON", "room", "\"A\"", "\"B\""),
        (
            "addresses of the bus in turns in JSON",
            "addr",
            "104",
            "105",
        ),
    ] {
        kind.unsure(name, move |scene| {
            let others = scene.second(6);
            let object = |shot: &Shot, value: &str| {
                format!(
                    "{{\"{key}\":{value},\"ts\":{},\"pixels\":[{}]}}\n",
                    unix(shot.utc_ns),
                    joined(shot, short, ",")
                )
            };
            let text = each(&scene.shots, |shot| {
                object(shot, one) + &object(&others[shot.index], other)
            });
            (
                text,
                Truth::of_streams(&[&scene.shots, &others]).absolute(0),
            )
        });
    }
}

fn devices(kind: &mut Kind) {
    for (name, called, one, other) in [
        (
            "W28 two devices by mac",
            "mac",
            "24:0A:C4:00:00:01",
            "24:0A:C4:00:00:02",
        ),
        ("two rooms", "room", "kitchen", "hall"),
        ("two rooms in German", "Raum", "Küche", "Flur"),
        ("two nodes by number", "node", "1", "2"),
        ("two sensors by id", "id", "0", "1"),
        ("two sensors by address", "address", "0x68", "0x69"),
        (
            "two sensors by address in decimal",
            "i2c_addr",
            "104",
            "105",
        ),
        ("two sides", "side", "L", "R"),
        ("two ports of a multiplexer", "channel", "0", "1"),
        ("two hosts", "host", "pi-1", "pi-2"),
        ("two sensors", "sensor", "left", "right"),
        ("two devices", "device", "esp32-a", "esp32-b"),
        ("two topics", "topic", "home/kitchen/amg", "home/hall/amg"),
        ("two IP addresses", "ip", "192.168.1.20", "192.168.1.21"),
    ] {
        kind.file("walk.csv");
        kind.unsure(name, move |scene| {
            let others = scene.second(8);
            let lines = |shots: &[Shot], value: &str| -> Vec<String> {
                let mut columns = vec![
                    column(called, shots, |_| value.to_owned()),
                    column("time", shots, |shot| unix(shot.utc_ns)),
                ];
                columns.extend(pixels(shots, p, two));
                table(",", &columns)
                    .lines()
                    .map(|line| line.to_owned() + "\n")
                    .collect()
            };
            let (ones, twos) = (lines(&scene.shots, one), lines(&others, other));
            let pairs = ones.iter().zip(&twos).skip(1);
            let text = ones[0].clone()
                + &pairs
                    .map(|(one, two)| one.clone() + two)
                    .collect::<String>();
            (
                text,
                Truth::of_streams(&[&scene.shots, &others]).absolute(0),
            )
        });
    }
}

fn texts(kind: &mut Kind) {
    for (name, one, other) in [
        ("lines with L: and R:", "L: ", "R: "),
        ("lines with left, and right,", "left,", "right,"),
        ("lines with 0x68 and 0x69", "[0x68] ", "[0x69] "),
        (
            "lines with two topics",
            "home/kitchen/amg ",
            "home/hall/amg ",
        ),
        ("lines with S1: and S2:", "S1:", "S2:"),
    ] {
        kind.file("capture.txt");
        kind.unsure(name, move |scene| {
            let others = scene.second(8);
            let text = each(&scene.shots, |shot| {
                format!(
                    "{one}{}\n{other}{}\n",
                    joined(shot, two, ","),
                    joined(&others[shot.index], two, ",")
                )
            });
            (text, Truth::of_streams(&[&scene.shots, &others]))
        });
    }
    for (name, one, other) in [
        ("blocks of Sensor 1 and Sensor 2", "Sensor 1:", "Sensor 2:"),
        ("blocks of left and right", "--- left ---", "--- right ---"),
    ] {
        kind.unsure(name, move |scene| {
            let others = scene.second(8);
            let block = |shot: &Shot, caption: &str| {
                format!("{caption}\n{}\n\n", grid(shot, two, " ").join("\n"))
            };
            let text = each(&scene.shots, |shot| {
                block(shot, one) + &block(&others[shot.index], other)
            });
            (text, Truth::of_streams(&[&scene.shots, &others]))
        });
    }
    kind.unsure("two times 64 numbers with their names on a line", |scene| {
        let others = smoothed(scene);
        let text = each(&scene.shots, |shot| {
            let time = iso(shot.utc_ns, " ", ".");
            format!(
                "{time} A=[{}] B=[{}]\n",
                joined(shot, two, " "),
                joined(&others[shot.index], two, " ")
            )
        });
        let others = at_times_of(others, &scene.shots);
        (
            text,
            Truth::of_streams(&[&scene.shots, &others]).absolute(0),
        )
    });
}
