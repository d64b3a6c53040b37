//! What else people write: other shapes of text, headers that do not fit, two clocks, numpy's other types.

use crate::loggers::archive::{npy, parquet, zip};
use crate::loggers::print::{
    Civil, Column, clock, column, each, grid, iso, joined, p, pixels, python, short, table, timed,
    two, unix,
};
use crate::loggers::scene::{Scene, Shot};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{Named, RightOrNamed};
use crate::loggers::variant::Kind;

const S: i64 = 1_000_000_000;
const LONG: &[&str] = &[
    "one pixel",
    "a pixel a line",
    "one value",
    "one number",
    "long",
];

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("9 other habits");
    kind.file("capture.txt");
    shapes(&mut kind);
    odd_blocks(&mut kind);
    captions(&mut kind);
    kind.file("walk.csv");
    heads(&mut kind);
    clocks(&mut kind);
    two_clocks(&mut kind);
    columns(&mut kind);
    arrays(&mut kind);
    parquets(&mut kind);
    markup(&mut kind);
    kind
}

fn shapes(kind: &mut Kind) {
    for (name, between) in [
        ("a number a line, a blank line after 64", "\n"),
        ("a number a line", ""),
    ] {
        kind.add(name, RightOrNamed(LONG), move |scene| {
            (
                each(&scene.shots, |shot| {
                    joined(shot, two, "\n") + "\n" + between
                }),
                Truth::of(scene),
            )
        });
    }
    kind.add("a named pixel a line", RightOrNamed(LONG), |scene| {
        let text = each(&scene.shots, |shot| {
            let values = shot.celsius();
            let lines = values.iter().enumerate();
            lines
                .map(|(place, value)| format!("Pixel {place}: {value:.2}\n"))
                .collect::<String>()
                + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.right("rows between semicolons on a line", |scene| {
        (
            each(&scene.shots, |shot| grid(shot, two, ",").join(";") + "\n"),
            Truth::of(scene),
        )
    });
    kind.right("rows between bars on a line", |scene| {
        (
            each(&scene.shots, |shot| grid(shot, two, " ").join(" | ") + "\n"),
            Truth::of(scene),
        )
    });
    kind.right("lists of rows on a line, with a time", |scene| {
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, python, ", ");
            format!("{} [{}]\n", unix(shot.utc_ns), rows.join("] ["))
        });
        (text, Truth::of(scene).absolute(0))
    });
    let with_means = |scene: &mut Scene| {
        let row = |row: &[f64]| {
            let mean = row.iter().sum::<f64>() / 8.0;
            let row: Vec<String> = row.iter().map(|value| two(*value)).collect();
            format!("{} | {mean:.2}\n", row.join(" "))
        };
        let text = each(&scene.shots, |shot| {
            shot.celsius().chunks(8).map(row).collect::<String>() + "\n"
        });
        (text, Truth::of(scene))
    };
    kind.add(
        "rows and their means",
        RightOrNamed(&["found 9"]),
        with_means,
    );
}

/// Blocks that are not eight lines of eight.
fn odd_blocks(kind: &mut Kind) {
    let of_sixteen = |scene: &mut Scene| {
        let text = each(&scene.shots, |shot| {
            let values = shot.celsius().map(two);
            let lines: Vec<String> = values.chunks(16).map(|line| line.join(" ")).collect();
            lines.join("\n") + "\n\n"
        });
        (text, Truth::of(scene))
    };
    kind.add(
        "four lines of sixteen",
        RightOrNamed(&["16 x 16"]),
        of_sixteen,
    );
}

fn captions(kind: &mut Kind) {
    kind.right("a number and milliseconds before each block", |scene| {
        let text = each(&scene.shots, |shot| {
            let ms = shot.t_ns / 1_000_000 + 4_200;
            format!(
                "Frame {} @ {ms} ms:\n{}\n\n",
                shot.index,
                grid(shot, two, " ").join("\n")
            )
        });
        (text, Truth::of(scene).relative(0))
    });
    kind.right("frames a second after each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}\nFPS: 9.{}\n\n",
                grid(shot, two, ", ").join("\n"),
                shot.index % 3 + 7
            )
        });
        (text, Truth::of(scene))
    });
    kind.right("ISO time before each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "{}Z\n{}\n\n",
                iso(shot.utc_ns, "T", "."),
                grid(shot, two, "\t").join("\n")
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.right("begin and end around each block", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("BEGIN\n{}\nEND\n", grid(shot, two, ",").join("\n"))
        });
        (text, Truth::of(scene))
    });
    kind.right(
        "a block's rows under a caption with a time and a dash",
        |scene| {
            let text = each(&scene.shots, |shot| {
                format!(
                    "--- {} ---\n{}\n",
                    unix(shot.utc_ns),
                    grid(shot, two, " ").join("\n")
                )
            });
            (text, Truth::of(scene).absolute(0))
        },
    );
}

/// A table with a Unix time.
fn usual(scene: &Scene) -> (String, Truth) {
    let text = timed("time", &scene.shots, |shot| unix(shot.utc_ns), Vec::new());
    (text, Truth::of(scene).absolute(0))
}

fn heads(kind: &mut Kind) {
    for (name, head) in [
        (
            "facts before the table",
            "device,esp32\nfirmware,1.2\nrate,10\n\n",
        ),
        (
            "comments of MATLAB before the table",
            "% logged by grid.m\n% 10 Hz\n",
        ),
        ("comments of C before the table", "// AMG8833, 10 Hz\n"),
        (
            "LabVIEW's header before the table",
            "LabVIEW Measurement\nWriter_Version\t2\nSeparator\tComma\n***End_of_Header***\n",
        ),
    ] {
        kind.right(name, move |scene| {
            let (text, truth) = usual(scene);
            (format!("{head}{text}"), truth)
        });
    }
    kind.right("names in quotes, blanks after the commas", |scene| {
        let (text, truth) = usual(scene);
        let (names, rest) = text.split_once('\n').unwrap();
        let names: Vec<String> = names.split(',').map(|name| format!("\"{name}\"")).collect();
        (
            format!("{}\n{}", names.join(", "), rest.replace(',', ", ")),
            truth,
        )
    });
    kind.right("a comma after the names alone", |scene| {
        let (text, truth) = usual(scene);
        (text.replacen('\n', ",\n", 1), truth)
    });
    kind.unsure("R's write.table: one name fewer than columns", |scene| {
        let mut columns: Vec<Column> = vec![column("time", &scene.shots, |shot| unix(shot.utc_ns))];
        columns.extend(pixels(&scene.shots, p, short));
        let text = table(" ", &columns);
        let (names, rest) = text.split_once('\n').unwrap();
        let names: Vec<String> = names.split(' ').map(|name| format!("\"{name}\"")).collect();
        let rows = rest.lines().enumerate();
        let rows: String = rows
            .map(|(row, line)| format!("\"{}\" {line}\n", row + 1))
            .collect();
        (
            format!("{}\n{rows}", names.join(" ")),
            Truth::of(scene).absolute(0),
        )
    });
    kind.right("units in a second header", |scene| {
        let (text, truth) = usual(scene);
        let units = format!("\ns{}\n", ",°C".repeat(64));
        (text.replacen('\n', &units, 1), truth)
    });
    for (name, sign) in [
        ("a pixel is NaN", "nan"),
        ("a pixel is dashes", "--"),
        ("a pixel is ERR", "ERR"),
    ] {
        kind.right(name, move |scene| {
            let at = usize::try_from(scene.random.between(2, 7)).unwrap();
            let mut columns: Vec<Column> =
                vec![column("time", &scene.shots, |shot| unix(shot.utc_ns))];
            columns.extend(pixels(&scene.shots, p, two));
            columns[at + 9].1[at] = sign.to_owned();
            (table(",", &columns), Truth::of(scene).absolute(0).torn(at))
        });
    }
}

fn clocks(kind: &mut Kind) {
    kind.right("German dates with a comma before milliseconds", |scene| {
        scene.on_day(|day| day > 12);
        let stamp = |shot: &Shot| {
            let (year, month, day) = Civil::of(shot.utc_ns).date;
            format!("{day:02}.{month:02}.{year} {}", clock(shot.utc_ns, ","))
        };
        let mut columns: Vec<Column> = vec![column("Zeit", &scene.shots, stamp)];
        columns.extend(pixels(&scene.shots, p, |celsius| {
            two(celsius).replace('.', ",")
        }));
        (table(";", &columns), Truth::of(scene).absolute(0))
    });
    kind.right("a time of day with PM", |scene| {
        let stamp = |shot: &Shot| {
            let civil = Civil::of(shot.utc_ns);
            let half = if civil.hour < 12 { "AM" } else { "PM" };
            format!(
                "{}:{:02}:{:02}.{:03} {half}",
                (civil.hour + 11) % 12 + 1,
                civil.minute,
                civil.second,
                civil.ms
            )
        };
        (
            timed("time", &scene.shots, stamp, Vec::new()),
            Truth::of(scene).relative(0),
        )
    });
    for (name, zone) in [
        ("a zone UTC+01:00", " UTC+01:00"),
        ("a zone [Europe/Berlin]", "+01:00[Europe/Berlin]"),
        ("a zone GMT+1", " GMT+1"),
    ] {
        kind.unsure(name, move |scene| {
            let stamp = |shot: &Shot| iso(shot.utc_ns + 3_600 * S, "T", ".") + zone;
            (
                timed("time", &scene.shots, stamp, Vec::new()),
                Truth::of(scene).absolute(0),
            )
        });
    }
}

fn two_clocks(kind: &mut Kind) {
    kind.right("two clocks: millis and a date", |scene| {
        let date = column("datetime", &scene.shots, |shot| iso(shot.utc_ns, " ", "."));
        let text = timed(
            "millis",
            &scene.shots,
            |shot| (shot.t_ns / 1_000_000).to_string(),
            vec![date],
        );
        (text, Truth::of(scene).absolute(0))
    });
    kind.unsure("two clocks: local and UTC", |scene| {
        let utc = column("utc_time", &scene.shots, |shot| iso(shot.utc_ns, " ", "."));
        let text = timed(
            "local_time",
            &scene.shots,
            |shot| iso(shot.utc_ns + 3_600 * S, " ", "."),
            vec![utc],
        );
        (text, Truth::of(scene).absolute(0))
    });
    kind.unsure("seconds and milliseconds in two columns", |scene| {
        let ms = column("ms", &scene.shots, |shot| {
            (shot.utc_ns / 1_000_000 % 1_000).to_string()
        });
        let text = timed(
            "unix_s",
            &scene.shots,
            |shot| (shot.utc_ns / S).to_string(),
            vec![ms],
        );
        (text, Truth::of(scene).absolute(0))
    });
    kind.unsure("a clock that is set during the recording", |scene| {
        // Before the time comes from the network, the clock begins at 1970.
        let at = scene.shots[4].t_ns;
        let stamp = |shot: &Shot| {
            if shot.index < 4 {
                unix(shot.t_ns)
            } else {
                unix(shot.utc_ns)
            }
        };
        let text = timed("time", &scene.shots, stamp, Vec::new());
        let mut truth = Truth::of(scene).absolute(0);
        for event in &mut truth.streams[0] {
            if let crate::loggers::truth::Event::Whole(shot) = event {
                shot.utc_ns -= if shot.t_ns < at {
                    shot.utc_ns - shot.t_ns
                } else {
                    0
                };
            }
        }
        (text, truth)
    });
}

fn columns(kind: &mut Kind) {
    kind.right("t beside t0 to t63", |scene| {
        let mut columns: Vec<Column> = vec![column("t", &scene.shots, |shot| unix(shot.utc_ns))];
        columns.extend(pixels(&scene.shots, |place| format!("t{place}"), two));
        (table(",", &columns), Truth::of(scene).absolute(0))
    });
    kind.right("where the person is, beside x0y0", |scene| {
        let x = |shot: &Shot| format!("{:.2}", f64::from(shot.people) * 1.25 + 0.5);
        let mut columns: Vec<Column> = vec![column("time", &scene.shots, |shot| unix(shot.utc_ns))];
        columns.push(column("x", &scene.shots, x));
        columns.extend(pixels(
            &scene.shots,
            |place| format!("x{}y{}", place % 8, place / 8),
            two,
        ));
        (
            table(",", &columns),
            Truth::of(scene).absolute(0).label(scene, "x", x),
        )
    });
    kind.right("a checksum at the end", |scene| {
        let sum = |shot: &Shot| {
            (shot.steps.iter().map(|step| i32::from(*step)).sum::<i32>() % 256).to_string()
        };
        let text = timed(
            "time",
            &scene.shots,
            |shot| unix(shot.utc_ns),
            vec![column("crc", &scene.shots, sum)],
        );
        (text, Truth::of(scene).absolute(0).label(scene, "crc", sum))
    });
    kind.unsure("the battery's voltage first, without names", |scene| {
        let text = each(&scene.shots, |shot| {
            format!("3.{},{}\n", 91 - shot.index / 8, joined(shot, two, ","))
        });
        (
            text,
            Truth::of(scene).label(scene, "", |shot| format!("3.{}", 91 - shot.index / 8)),
        )
    });
}

fn arrays(kind: &mut Kind) {
    kind.file("walk.npz");
    kind.right("times of numpy's datetime64 and labels of texts", |scene| {
        let count = scene.shots.len();
        let times: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(|shot| (shot.utc_ns / 1_000_000).to_le_bytes())
            .collect();
        let words: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(|shot| {
                let letter = if shot.people > 0 { 'a' } else { 'e' };
                u32::from(letter).to_le_bytes()
            })
            .collect();
        let frames: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(Shot::celsius)
            .flat_map(f64::to_le_bytes)
            .collect();
        let entries = [
            ("t.npy", npy("<M8[ms]", &format!("({count},)"), &times)),
            (
                "frames.npy",
                npy("<f8", &format!("({count}, 8, 8)"), &frames),
            ),
            ("label.npy", npy("<U1", &format!("({count},)"), &words)),
        ];
        let truth = Truth::of(scene).absolute(1);
        (
            zip(&entries, true),
            truth.label(scene, "label", |shot| {
                if shot.people > 0 { "a" } else { "e" }.to_owned()
            }),
        )
    });
    kind.file("walk.npy");
    kind.unsure("a time and 64 pixels in a row of an array", |scene| {
        let row = |shot: &Shot| {
            let time: f64 = unix(shot.utc_ns).parse().unwrap();
            let values = [time].into_iter().chain(shot.celsius());
            values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>()
        };
        let numbers: Vec<u8> = scene.shots.iter().flat_map(row).collect();
        (
            npy("<f8", &format!("({}, 65)", scene.shots.len()), &numbers),
            Truth::of(scene).absolute(1),
        )
    });
    kind.right("halves of 16 bits", |scene| {
        // A half has 11 bits: quarters are exact below 512.
        let half = |celsius: f64| {
            let exponent: i16 = if celsius >= 32.0 { 5 } else { 4 };
            let scale = if celsius >= 32.0 { 32.0 } else { 64.0 };
            let bits: i16 = format!("{:.0}", celsius * scale - 1_024.0).parse().unwrap();
            (((15 + exponent) << 10) | bits).to_le_bytes()
        };
        let numbers: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(Shot::celsius)
            .flat_map(half)
            .collect();
        (
            npy("<f2", &format!("({}, 8, 8)", scene.shots.len()), &numbers),
            Truth::of(scene),
        )
    });
}

type Name = fn(usize) -> String;

/// A variant's name, the names of its columns, their numbers, and the name and the unit of its times.
type Stored = (&'static str, Name, fn(f64) -> f64, &'static str, i64);

const STORED: [Stored; 5] = [
    ("Parquet, ts", p, |celsius| celsius, "ts", 1_000_000),
    ("Parquet, time_us", p, |celsius| celsius, "time_us", 1_000),
    (
        "Parquet, degrees F",
        |place| format!("p{place}_degF"),
        |celsius| celsius * 1.8 + 32.0,
        "time",
        1_000_000,
    ),
    (
        "Parquet, c0r0",
        |place| format!("c{}r{}", place % 8, place / 8),
        |celsius| celsius,
        "time",
        1,
    ),
    (
        "Parquet, words",
        p,
        |celsius| celsius * 4.0,
        "t_utc_ms",
        1_000_000,
    ),
];

fn parquets(kind: &mut Kind) {
    kind.file("walk.parquet");
    for (name, pixel, number, called, unit_ns) in STORED {
        kind.right(name, move |scene| {
            let times: Vec<i64> = scene
                .shots
                .iter()
                .map(|shot| shot.utc_ns / unit_ns)
                .collect();
            let column = |place: usize| {
                let values = scene.shots.iter().map(|shot| number(shot.celsius()[place]));
                (pixel(place), values.collect())
            };
            let columns: Vec<(String, Vec<f64>)> = (0..64).map(column).collect();
            (
                parquet((called, &times), &columns),
                Truth::of(scene).absolute(1),
            )
        });
    }
    kind.unsure("Parquet, raw and filtered", |scene| {
        let others = scene.second(3);
        let times: Vec<i64> = scene.shots.iter().map(|shot| shot.utc_ns).collect();
        let family = |shots: &[Shot], name: &str| -> Vec<(String, Vec<f64>)> {
            let column = |place: usize| {
                let values = shots.iter().map(|shot| shot.celsius()[place]);
                (format!("{name}{place}"), values.collect())
            };
            (0..64).map(column).collect()
        };
        let columns = [family(&scene.shots, "raw"), family(&others, "filtered")].concat();
        let file = parquet(("time", &times), &columns);
        (
            file,
            Truth::of_streams(&[&scene.shots, &others]).absolute(50),
        )
    });
}

fn markup(kind: &mut Kind) {
    kind.file("walk.yaml");
    kind.add("YAML", RightOrNamed(&["yaml"]), |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "- time: {}\n  pixels: [{}]\n",
                unix(shot.utc_ns),
                joined(shot, python, ", ")
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
    kind.file("walk.xml");
    kind.add("XML", RightOrNamed(&["xml"]), |scene| {
        let text = each(&scene.shots, |shot| {
            format!(
                "  <frame t=\"{}\">{}</frame>\n",
                unix(shot.utc_ns),
                joined(shot, short, " ")
            )
        });
        (
            format!("<?xml version=\"1.0\"?>\n<frames>\n{text}</frames>\n"),
            Truth::of(scene).absolute(0),
        )
    });
    kind.file("walk.tdms");
    kind.add("LabVIEW's TDMS", Named(&["tdms", "labview"]), |scene| {
        (
            [&b"TDSm\x0e\0\0\0\x69\x12\0\0"[..], &[7; 900]].concat(),
            Truth::of(scene),
        )
    });
    kind.file("walk.jsonl");
    kind.add("base64 in JSON", RightOrNamed(&["base64"]), |scene| {
        let text = each(&scene.shots, |shot| {
            let bytes: Vec<u8> = shot
                .steps
                .iter()
                .flat_map(|step| step.to_le_bytes())
                .collect();
            format!(
                "{{\"ts\":{},\"data\":\"{}\"}}\n",
                unix(shot.utc_ns),
                base64(&bytes)
            )
        });
        (text, Truth::of(scene).absolute(0))
    });
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let letters = bytes.chunks(3).flat_map(|three| {
        let word = [0, 1, 2].map(|at| u32::from(three.get(at).copied().unwrap_or(0)));
        let word = (word[0] << 16) | (word[1] << 8) | word[2];
        let letter = move |at: usize| match at > three.len() {
            true => '=',
            false => char::from(LETTERS[usize::try_from(word >> (18 - 6 * at) & 63).unwrap()]),
        };
        (0..4).map(letter)
    });
    letters.collect()
}
