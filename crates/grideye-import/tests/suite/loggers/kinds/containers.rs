//! Encodings, archives and arrays.

use crate::loggers::archive::{gzip, npy, zip};
use crate::loggers::print::{column, joined, p, pixels, table, timed, two, unix};
use crate::loggers::scene::{Scene, Shot};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{self, AskedOrNamed, Right, RightOrAsked, RightOrNamed};
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("7 encodings and arrays");
    encodings(&mut kind);
    archives(&mut kind);
    shapes(&mut kind);
    units(&mut kind);
    pictures(&mut kind);
    several(&mut kind);
    two_arrays(&mut kind);
    others(&mut kind);
    kind
}

/// A table with a time and a label.
fn usual(scene: &Scene) -> (String, Truth) {
    let people = column("people", &scene.shots, |shot| shot.people.to_string());
    let text = timed("time", &scene.shots, |shot| unix(shot.utc_ns), vec![people]);
    (text, Truth::of(scene).absolute(0).people(scene, "people"))
}

fn utf_16(text: &str, of: fn(u16) -> [u8; 2]) -> Vec<u8> {
    text.encode_utf16().flat_map(of).collect()
}

type Encode = fn(&str) -> Vec<u8>;

fn encodings(kind: &mut Kind) {
    let encodings: [(&str, Accept, Encode); 8] = [
        ("UTF-8 with its mark", Right, |text| {
            format!("\u{feff}{text}").into()
        }),
        ("UTF-8 with its mark and CR LF", Right, |text| {
            format!("\u{feff}{text}").replace('\n', "\r\n").into()
        }),
        ("R07 UTF-16 little end first", Right, |text| {
            utf_16(&format!("\u{feff}{text}"), u16::to_le_bytes)
        }),
        ("UTF-16 big end first", Right, |text| {
            utf_16(&format!("\u{feff}{text}"), u16::to_be_bytes)
        }),
        (
            "UTF-16 without its mark",
            RightOrNamed(&["utf-16"]),
            |text| utf_16(text, u16::to_le_bytes),
        ),
        ("UTF-16 with CR LF", Right, |text| {
            utf_16(
                &format!("\u{feff}{}", text.replace('\n', "\r\n")),
                u16::to_le_bytes,
            )
        }),
        (
            "CR alone ends lines",
            RightOrNamed(&["cr", "carriage return", "line ends", "line endings"]),
            |text| text.replace('\n', "\r").into(),
        ),
        ("zeros after the end", Right, |text| {
            format!("{text}{}", "\0".repeat(512)).into()
        }),
    ];
    for (name, accept, encode) in encodings {
        kind.file("walk.csv");
        kind.add(name, accept, move |scene| {
            let (text, truth) = usual(scene);
            (encode(&text), truth)
        });
    }
    kind.file("capture.txt");
    kind.right("UTF-16 of a console capture", |scene| {
        let text =
            crate::loggers::print::each(&scene.shots, |shot| joined(shot, two, ",") + "\r\n");
        (
            utf_16(&format!("\u{feff}{text}"), u16::to_le_bytes),
            Truth::of(scene),
        )
    });
}

fn archives(kind: &mut Kind) {
    kind.file("walk.csv.gz");
    kind.right("a text in gzip", |scene| {
        let (text, truth) = usual(scene);
        (gzip(text.as_bytes()), truth)
    });
    kind.file("walk.jsonl.gz");
    kind.right("JSON in gzip", |scene| {
        let text = crate::loggers::print::each(&scene.shots, |shot| {
            format!(
                "{{\"ts\":{},\"pixels\":[{}]}}\n",
                unix(shot.utc_ns),
                joined(shot, two, ",")
            )
        });
        (gzip(text.as_bytes()), Truth::of(scene).absolute(0))
    });
    for (name, is_compressed) in [
        ("R09 a zip with one text", true),
        ("a zip with one text, stored", false),
    ] {
        kind.file("walk.zip");
        kind.add(name, RightOrNamed(&["unpack"]), move |scene| {
            let (text, truth) = usual(scene);
            (zip(&[("walk.csv", text.into())], is_compressed), truth)
        });
    }
    kind.add(
        "a zip with one text in a folder and a Mac's shadow",
        RightOrNamed(&["unpack"]),
        |scene| {
            let (text, truth) = usual(scene);
            (
                zip(
                    &[
                        ("data/", Vec::new()),
                        ("data/walk.csv", text.into()),
                        ("__MACOSX/data/._walk.csv", vec![0, 5, 22, 7]),
                    ],
                    true,
                ),
                truth,
            )
        },
    );
    kind.file("walks.zip");
    kind.add("a zip with two texts", AskedOrNamed(&["unpack"]), |scene| {
        let (text, truth) = usual(scene);
        (
            zip(
                &[("a.csv", text.clone().into()), ("b.csv", text.into())],
                true,
            ),
            truth,
        )
    });
}

fn singles(shots: &[Shot], mut of: impl FnMut(f64) -> f32) -> Vec<u8> {
    let values = shots.iter().flat_map(Shot::celsius);
    values
        .flat_map(|celsius| of(celsius).to_le_bytes())
        .collect()
}

/// Exact for what a temperature may be.
fn single(celsius: f64) -> f32 {
    f32::from(steps(celsius)) / 4.0
}

fn steps(celsius: f64) -> i16 {
    format!("{:.0}", celsius * 4.0).parse().unwrap()
}

/// The number of frames in a shape.
fn shape(form: &str, scene: &Scene) -> String {
    form.replace('N', &scene.shots.len().to_string())
}

/// The same numbers with the frames as the last axis.
fn frames_last(scene: &Scene) -> Vec<u8> {
    let places =
        (0..64).flat_map(|place| scene.shots.iter().map(move |shot| shot.celsius()[place]));
    places
        .flat_map(|celsius| single(celsius).to_le_bytes())
        .collect()
}

fn shapes(kind: &mut Kind) {
    for (name, form) in [
        ("an array (N, 8, 8)", "(N, 8, 8)"),
        ("an array (N, 64)", "(N, 64)"),
        ("an array (N, 8, 8, 1)", "(N, 8, 8, 1)"),
        ("an array (N, 1, 8, 8)", "(N, 1, 8, 8)"),
        ("an array (N, 64, 1)", "(N, 64, 1)"),
        ("an array (1, N, 8, 8)", "(1, N, 8, 8)"),
        ("an array (N, 1, 64)", "(N, 1, 64)"),
    ] {
        kind.file("walk.npy");
        kind.right(name, move |scene| {
            scene.any_room();
            (
                npy("<f4", &shape(form, scene), &singles(&scene.shots, single)),
                Truth::of(scene),
            )
        });
    }
    for (name, form) in [
        ("an array (8, 8, N)", "(8, 8, N)"),
        ("an array (64, N)", "(64, N)"),
    ] {
        kind.unsure(name, move |scene| {
            if scene.shots.len() == 64 {
                scene.frames(30);
            }
            (
                npy("<f4", &shape(form, scene), &frames_last(scene)),
                Truth::of(scene),
            )
        });
    }
    kind.unsure("an array (8, 8, 8), frames first", |scene| {
        scene.frames(8);
        (
            npy("<f4", "(8, 8, 8)", &singles(&scene.shots, single)),
            Truth::of(scene),
        )
    });
    kind.unsure("an array in Fortran's order", |scene| {
        // The first index runs fastest: frame, row, column.
        let mut numbers = Vec::new();
        for column in 0..8 {
            for row in 0..8 {
                for shot in &scene.shots {
                    numbers.extend(single(shot.celsius()[8 * row + column]).to_le_bytes());
                }
            }
        }
        let file = npy("<f4", &shape("(N, 8, 8)", scene), &numbers);
        let text = b"False".as_slice();
        let at = file.windows(5).position(|five| five == text).unwrap();
        (
            [&file[..at], b"True ", &file[at + 5..]].concat(),
            Truth::of(scene),
        )
    });
}

fn array(
    kind: &mut Kind,
    name: &'static str,
    accept: Accept,
    number: &'static str,
    tolerance: i16,
    of: impl Fn(f64) -> Vec<u8> + 'static,
) {
    kind.file("walk.npy");
    kind.add(name, accept, move |scene| {
        let values = scene.shots.iter().flat_map(Shot::celsius);
        let numbers: Vec<u8> = values.flat_map(&of).collect();
        (
            npy(number, &shape("(N, 8, 8)", scene), &numbers),
            Truth::of(scene).within(tolerance),
        )
    });
}

const PICTURE: &[&str] = &[
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

fn units(kind: &mut Kind) {
    let double = |celsius: f64| celsius.to_le_bytes().to_vec();
    array(kind, "doubles", Right, "<f8", 0, double);
    array(kind, "words of 16 bits", Right, "<i2", 0, |celsius| {
        steps(celsius).to_le_bytes().to_vec()
    });
    array(
        kind,
        "words of 16 bits, big end first",
        Right,
        ">u2",
        0,
        |celsius| steps(celsius).to_be_bytes().to_vec(),
    );
    array(kind, "words of 8 bits", RightOrAsked, "|u1", 0, |celsius| {
        vec![u8::try_from(steps(celsius)).unwrap()]
    });
    array(kind, "words of 64 bits", Right, "<i8", 0, |celsius| {
        i64::from(steps(celsius)).to_le_bytes().to_vec()
    });
    array(
        kind,
        "W03 tenths of degrees",
        RightOrAsked,
        "<f8",
        0,
        move |celsius| double(celsius * 10.0),
    );
    array(
        kind,
        "tenths of 16 bits",
        RightOrAsked,
        "<i2",
        0,
        |celsius| (steps(celsius) * 5 / 2).to_le_bytes().to_vec(),
    );
    array(
        kind,
        "hundredths of 16 bits",
        RightOrAsked,
        "<i2",
        0,
        |celsius| (steps(celsius) * 25).to_le_bytes().to_vec(),
    );
    array(
        kind,
        "Kelvin in an array",
        RightOrAsked,
        "<f4",
        0,
        |celsius| (single(celsius) + 273.15).to_le_bytes().to_vec(),
    );
    array(
        kind,
        "degrees F in an array",
        RightOrAsked,
        "<f4",
        0,
        |celsius| (single(celsius) * 1.8 + 32.0).to_le_bytes().to_vec(),
    );
}

fn pictures(kind: &mut Kind) {
    array(
        kind,
        "W21 pictures of 8 bits",
        AskedOrNamed(PICTURE),
        "|u1",
        0,
        |celsius| {
            let gray = format!("{:.0}", ((celsius - 15.0) * 13.0).clamp(0.0, 255.0));
            vec![gray.parse().unwrap()]
        },
    );
    array(
        kind,
        "W22 0 to 1",
        AskedOrNamed(PICTURE),
        "<f4",
        0,
        |celsius| {
            ((single(celsius) - 15.0) / 19.7)
                .clamp(0.0, 1.0)
                .to_le_bytes()
                .to_vec()
        },
    );
    array(
        kind,
        "standard scores in an array",
        AskedOrNamed(PICTURE),
        "<f4",
        0,
        |celsius| ((single(celsius) - 22.3) / 2.57).to_le_bytes().to_vec(),
    );
    array(kind, "a mask", AskedOrNamed(PICTURE), "|b1", 0, |celsius| {
        vec![u8::from(celsius > 26.0)]
    });
    array(
        kind,
        "a mask of 8 bits",
        AskedOrNamed(PICTURE),
        "|u1",
        0,
        |celsius| vec![u8::from(celsius > 26.0)],
    );
    kind.file("walk.npy");
    kind.unsure("filtered numbers in an array", |scene| {
        let mut phase = 0.0_f64;
        let numbers = singles(&scene.shots, |celsius| {
            phase += 1.7;
            single(celsius) + single(phase.sin() * 40.0) / 400.0
        });
        (
            npy("<f4", &shape("(N, 8, 8)", scene), &numbers),
            Truth::of(scene).within(1),
        )
    });
}

/// The entries of an `.npz`.
fn npz(entries: &[(&str, Vec<u8>)], is_compressed: bool) -> Vec<u8> {
    zip(entries, is_compressed)
}

fn several(kind: &mut Kind) {
    kind.file("walk.npz");
    kind.right("frames, times and labels", |scene| {
        let count = shape("(N,)", scene);
        let times: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(|shot| (shot.utc_ns / 1_000_000).to_le_bytes())
            .collect();
        let people: Vec<u8> = scene
            .shots
            .iter()
            .flat_map(|shot| i64::from(shot.people).to_le_bytes())
            .collect();
        let is_compressed = scene.random.between(0, 1) == 1;
        let frames = npy(
            "<f4",
            &shape("(N, 8, 8)", scene),
            &singles(&scene.shots, single),
        );
        let entries = vec![
            ("frames.npy", frames),
            ("t_ms.npy", npy("<i8", &count, &times)),
            ("people.npy", npy("<i8", &count, &people)),
        ];
        (
            npz(&entries, is_compressed),
            Truth::of(scene).absolute(1).people(scene, "people"),
        )
    });
    for (name, split) in [
        ("W15 train and test", 2_usize),
        ("train and test of one size", 0),
    ] {
        kind.unsure(name, move |scene| {
            scene.frames(24);
            let cut = if split == 0 {
                12
            } else {
                24 - 24 / (split + 1)
            };
            let (train, test) = scene.shots.split_at(cut);
            let entry = |shots: &[Shot]| {
                npy(
                    "<f4",
                    &format!("({}, 8, 8)", shots.len()),
                    &singles(shots, single),
                )
            };
            let labels = |shots: &[Shot]| {
                npy(
                    "|u1",
                    &format!("({},)", shots.len()),
                    &shots.iter().map(|shot| shot.people).collect::<Vec<u8>>(),
                )
            };
            let entries = vec![
                ("X_train.npy", entry(train)),
                ("y_train.npy", labels(train)),
                ("X_test.npy", entry(test)),
                ("y_test.npy", labels(test)),
            ];
            (npz(&entries, true), Truth::of(scene).people(scene, ""))
        });
    }
}

fn two_arrays(kind: &mut Kind) {
    for (name, one, other) in [
        ("left and right in an archive", "left.npy", "right.npy"),
        (
            "frames and background in an archive",
            "background.npy",
            "frames.npy",
        ),
    ] {
        kind.unsure(name, move |scene| {
            let others = scene.second(5);
            let entry = |shots: &[Shot]| {
                npy(
                    "<f4",
                    &format!("({}, 8, 8)", shots.len()),
                    &singles(shots, single),
                )
            };
            let file = npz(
                &[(one, entry(&scene.shots)), (other, entry(&others))],
                false,
            );
            (file, Truth::of_streams(&[&scene.shots, &others]))
        });
    }
    kind.unsure("one background beside the frames", |scene| {
        let still = scene.second(0);
        let frames = npy(
            "<f4",
            &shape("(N, 8, 8)", scene),
            &singles(&scene.shots, single),
        );
        let background = npy("<f4", "(8, 8)", &singles(&still[..1], single));
        (
            npz(
                &[("background.npy", background), ("frames.npy", frames)],
                false,
            ),
            Truth::of(scene),
        )
    });
    kind.file("walk.npy");
}

fn others(kind: &mut Kind) {
    kind.add(
        "sequences of frames",
        AskedOrNamed(&["shape", "sequence", "4 x 8 x 8"]),
        |scene| {
            // Windows that overlap: the frames of one after the other are no recording.
            let windows: Vec<Shot> = scene.shots.windows(4).flatten().cloned().collect();
            let form = format!("({}, 4, 8, 8)", scene.shots.len() - 3);
            (
                npy("<f4", &form, &singles(&windows, single)),
                Truth::of(scene),
            )
        },
    );
    kind.file("walk.csv");
    kind.unsure("degrees beside a table of words", |scene| {
        let mut columns = pixels(&scene.shots, p, two);
        columns.extend(pixels(
            &scene.shots,
            |place| format!("w{place}"),
            |celsius| steps(celsius).to_string(),
        ));
        let shots = &scene.shots[..];
        (table(",", &columns), Truth::of_streams(&[shots, shots]))
    });
}
