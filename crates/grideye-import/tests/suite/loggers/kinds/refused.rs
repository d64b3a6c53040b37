//! What is no recording of this sensor, and has to be called what it is.

use crate::loggers::archive::{npy, zip};
use crate::loggers::print::{each, two, unix};
use crate::loggers::scene::Scene;
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::Named;
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("8 other things");
    heads(&mut kind);
    sizes(&mut kind);
    texts(&mut kind);
    kind
}

/// A file of such first bytes, whose rest is noise.
fn noise(scene: &mut Scene, head: &[u8]) -> Vec<u8> {
    let count = scene.random.between(600, 9_000);
    let noise = (0..count).map(|_| u8::try_from(scene.random.between(0, 255)).unwrap());
    head.iter().copied().chain(noise).collect()
}

/// What is wrong, the words of which one names it, a file's name, and its first bytes.
type Head = (
    &'static str,
    &'static [&'static str],
    &'static str,
    &'static [u8],
);

const HEADS: [Head; 24] = [
    ("SQLite", &["sqlite"], "walk.db", b"SQLite format 3\0\x10\0\x01\x01\0\x40\x20\x20"),
    ("MATLAB 5", &["matlab"], "walk.mat", b"MATLAB 5.0 MAT-file, Platform: GLNXA64, Created on: Mon Nov 24 16:00:00 2025\0\x01IM"),
    ("MATLAB 7.3", &["matlab", "hdf5"], "walk.mat", b"MATLAB 7.3 MAT-file, Platform: PCWIN64, Created on: Mon Nov 24 16:00:00 2025 HDF5 schema 1.00 ."),
    ("HDF5", &["hdf5"], "walk.h5", b"\x89HDF\r\n\x1a\n\0\0\0\0\0\x08\x08\0"),
    ("pickle of protocol 4", &["pickle"], "walk.pkl", b"\x80\x04\x95\x10\x27\0\0\0\0\0\0\x8c\x15numpy.core.multiarray\x94"),
    ("pickle of protocol 5", &["pickle"], "walk.pickle", b"\x80\x05\x95\x10\x27\0\0\0\0\0\0\x8c\x11pandas.core.frame\x94"),
    ("pickle of protocol 2", &["pickle"], "walk.p", b"\x80\x02cnumpy.core.multiarray\n_reconstruct\nq\0"),
    ("pickle of protocol 0", &["pickle"], "walk.pkl", b"(lp0\ncnumpy.core.multiarray\n_reconstruct\np1\n(cnumpy\nndarray\np2\n"),
    ("PNG", &["png"], "frame.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
    ("JPEG", &["jpeg"], "frame.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF\0"),
    ("GIF", &["gif"], "walk.gif", b"GIF89a\x40\x01\xf0\0"),
    ("MP4", &["mp4", "video"], "walk.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0"),
    ("AVI", &["avi", "video"], "walk.avi", b"RIFF\x10\x27\0\0AVI LIST"),
    ("PDF", &["pdf"], "report.pdf", b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n1 0 obj\n"),
    ("ROS bag", &["ros bag", "rosbag"], "walk.bag", b"#ROSBAG V2.0\nE\0\0\0\x0a\0\0\0conn_count="),
    ("MCAP", &["mcap"], "walk.mcap", b"\x89MCAP0\r\n\x01\x14\0\0\0\0\0\0\0"),
    ("Arrow or Feather", &["arrow", "feather"], "walk.feather", b"ARROW1\0\0\xff\xff\xff\xff"),
    ("an old Excel workbook", &["excel", "workbook", "xls"], "walk.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0\0\0\0"),
    ("7-Zip", &["7z", "7-zip"], "walk.7z", b"7z\xbc\xaf\x27\x1c\0\x04"),
    ("RAR", &["rar"], "walk.rar", b"Rar!\x1a\x07\x01\0"),
    ("xz", &["xz"], "walk.csv.xz", b"\xfd7zXZ\0\0\x04"),
    ("bzip2", &["bzip2", "bz2"], "walk.csv.bz2", b"BZh91AY&SY"),
    ("zstd", &["zstd", "zstandard"], "walk.csv.zst", b"\x28\xb5\x2f\xfd\x04\x58"),
    ("a pcap capture", &["pcap", "capture of a network", "network"], "bus.pcap", b"\xd4\xc3\xb2\xa1\x02\0\x04\0"),
];

fn heads(kind: &mut Kind) {
    for (name, names, file, head) in HEADS {
        kind.file(file);
        kind.add(name, Named(names), move |scene| {
            (noise(scene, head), Truth::of(scene))
        });
    }
    kind.file("walk.docx");
    kind.add(
        "a document of a word processor",
        Named(&["docx", "document", "word"]),
        |scene| {
            let parts = [
                ("[Content_Types].xml", b"<Types/>".to_vec()),
                ("word/document.xml", b"<w:document/>".to_vec()),
            ];
            (zip(&parts, true), Truth::of(scene))
        },
    );
    kind.file("frames.zip");
    kind.add(
        "a zip of pictures",
        Named(&["png", "zip", "picture", "unpack"]),
        |scene| {
            let picture = noise(scene, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
            (
                zip(
                    &[("0001.png", picture.clone()), ("0002.png", picture)],
                    false,
                ),
                Truth::of(scene),
            )
        },
    );
    kind.file("walk.npy");
    kind.add(
        "an array of objects",
        Named(&["object", "pickle"]),
        |scene| {
            (
                npy("|O", "(12,)", b"\x80\x04\x95\x10\0\0\0\0\0\0\0"),
                Truth::of(scene),
            )
        },
    );
    kind.file("walk.tar");
    kind.add("a tape archive", Named(&["tar"]), |scene| {
        let mut head = [
            &b"walk.csv"[..],
            &[0; 92],
            b"0000644\0",
            b"0001750\0",
            b"0001750\0",
        ]
        .concat();
        head.resize(257, b'0');
        head.extend(b"ustar\x0000");
        head.resize(512, 0);
        let text = each(&scene.shots, |shot| {
            shot.celsius().map(two).join(",") + "\n"
        });
        head.extend(text.bytes());
        head.resize(head.len().next_multiple_of(512) + 1_024, 0);
        (head, Truth::of(scene))
    });
}

/// Smooth frames of another size.
fn sized(scene: &mut Scene, rows: i64, columns: i64) -> Vec<f64> {
    let (random, mut values) = (&mut scene.random, Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            let hundredths = 2_000 + 3 * row + 5 * column + random.between(-60, 60);
            values.push(f64::from(i32::try_from(hundredths).unwrap()) / 100.0);
        }
    }
    values
}

/// The sizes as the message may have them, or the sensor.
fn sizes(kind: &mut Kind) {
    let kinds: [(&str, &[&str], i64, i64); 6] = [
        ("24 x 32", &["24 x 32", "32 x 24", "mlx90640"], 24, 32),
        ("70 x 70", &["interpolated", "70 x 70"], 70, 70),
        ("32 x 32", &["interpolated", "32 x 32"], 32, 32),
        ("16 x 16", &["interpolated", "16 x 16"], 16, 16),
        ("12 x 16", &["12 x 16", "mlx90641"], 12, 16),
        ("4 x 4", &["4 x 4", "d6t"], 4, 4),
    ];
    for (name, names, rows, columns) in kinds {
        for (form, is_array, in_lines) in [
            ("a line", false, false),
            ("an array", true, false),
            ("lines of a row", false, true),
        ] {
            let called: &'static str = Box::leak(format!("{name} as {form}").into_boxed_str());
            kind.file(if is_array { "walk.npy" } else { "walk.csv" });
            kind.add(called, Named(names), move |scene| {
                let frames: Vec<Vec<f64>> = (0..3).map(|_| sized(scene, rows, columns)).collect();
                let line = |values: &[f64]| {
                    values
                        .iter()
                        .map(|value| two(*value))
                        .collect::<Vec<_>>()
                        .join(",")
                        + "\n"
                };
                let width = usize::try_from(columns).unwrap();
                let bytes = if is_array {
                    let numbers: Vec<u8> = frames
                        .iter()
                        .flatten()
                        .flat_map(|value| value.to_le_bytes())
                        .collect();
                    npy("<f8", &format!("(3, {rows}, {columns})"), &numbers)
                } else if in_lines {
                    let blocks = frames
                        .iter()
                        .map(|values| values.chunks(width).map(line).collect::<String>() + "\n");
                    blocks.collect::<String>().into()
                } else {
                    let stamps = scene.shots.iter().map(|shot| unix(shot.utc_ns));
                    frames
                        .iter()
                        .zip(stamps)
                        .map(|(values, stamp)| format!("{stamp},{}", line(values)))
                        .collect::<String>()
                        .into()
                };
                (bytes, Truth::of(scene))
            });
        }
    }
}

fn texts(kind: &mut Kind) {
    let texts: [(&str, &[&str], &str, &str); 6] = [
        (
            "a page of a website",
            &["html", "web page"],
            "walk.csv",
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head><title>walk.csv at main</title></head>\n<body>404: Not Found</body>\n</html>\n",
        ),
        (
            "a pointer of Git LFS",
            &["git lfs", "git-lfs"],
            "walk.csv",
            "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n",
        ),
        ("a file of nothing", &["empty", "nothing"], "walk.csv", ""),
        (
            "a header alone",
            &[
                "no row",
                "only a header",
                "only names",
                "header alone",
                "no frame",
            ],
            "walk.csv",
            "time,p0,p1,p2,p3\n",
        ),
        (
            "a notebook",
            &["notebook", "jupyter"],
            "walk.ipynb",
            "{\"cells\": [{\"cell_type\": \"code\", \"source\": [\"import numpy as np\"], \"outputs\": []}], \"metadata\": {}, \"nbformat\": 4, \"nbformat_minor\": 5}\n",
        ),
        (
            "a program of Arduino",
            &["no number", "program", "source", "no frame", "no rows"],
            "amg.ino",
            "#include <Adafruit_AMG88xx.h>\nAdafruit_AMG88xx amg;\nfloat pixels[AMG88xx_PIXEL_ARRAY_SIZE];\nvoid loop() {\n  amg.readPixels(pixels);\n  delay(1000);\n}\n",
        ),
    ];
    for (name, names, file, text) in texts {
        kind.file(file);
        kind.add(name, Named(names), move |scene| (text, Truth::of(scene)));
    }
    kind.file("frame.pgm");
    kind.add(
        "an image as text (PGM)",
        Named(&["pgm", "picture", "image"]),
        |scene| {
            let values = scene.shots[0]
                .celsius()
                .map(|celsius| format!("{:.0}", celsius * 8.0));
            let rows: Vec<String> = values.chunks(8).map(|row| row.join(" ")).collect();
            (
                format!("P2\n8 8\n255\n{}\n", rows.join("\n")),
                Truth::of(scene),
            )
        },
    );
}
