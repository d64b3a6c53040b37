//! Eight lines of eight numbers, whole and damaged.

use crate::loggers::print::{Number, USUAL, each, grid, numpy, one, python, two};
use crate::loggers::scene::{Scene, Shot};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept::{Right, RightOrAsked};
use crate::loggers::variant::Kind;

const NAME: &str = "1 blocks";

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new(NAME);
    kind.file("capture.txt");
    whole(&mut kind);
    numbered_rows(&mut kind);
    printers(&mut kind);
    numpy_prints(&mut kind);
    cut(&mut kind);
    cut_lines(&mut kind);
    lost(&mut kind);
    kind
}

/// Usual numbers and what stands between them.
fn style(scene: &mut Scene) -> (Number, &'static str) {
    (
        scene.random.one_of(&USUAL),
        scene.random.one_of(&[" ", "  ", "\t", ", ", ",", ";"]),
    )
}

fn block(shot: &Shot, number: Number, separator: &str, end: &str) -> String {
    grid(shot, number, separator).join(end) + end
}

/// Blocks with a text before each and a text after each.
fn between(
    kind: &mut Kind,
    name: &'static str,
    before: fn(&Shot) -> String,
    after: fn(&Shot) -> String,
) {
    kind.right(name, move |scene| {
        scene.any_room();
        let (number, separator) = style(scene);
        let text = each(&scene.shots, |shot| {
            before(shot) + &block(shot, number, separator, "\n") + &after(shot)
        });
        (text, Truth::of(scene))
    });
}

fn whole(kind: &mut Kind) {
    let nothing = |_: &Shot| String::new();
    between(kind, "a blank line after each", nothing, |_| {
        "\n".to_owned()
    });
    between(
        kind,
        "two blank lines before each",
        |_| "\n\n".to_owned(),
        nothing,
    );
    between(kind, "dashes between", nothing, |_| "-".repeat(40) + "\n");
    between(
        kind,
        "equals signs before",
        |_| "=".repeat(20) + "\n",
        nothing,
    );
    between(kind, "a form feed between", nothing, |_| {
        "\u{c}\n".to_owned()
    });
    between(
        kind,
        "a caption before",
        |_| "Thermal Camera Data:\n".to_owned(),
        nothing,
    );
    between(
        kind,
        "a caption and a blank line",
        |_| "AMG8833 pixels [C]\n".to_owned(),
        |_| "\n".to_owned(),
    );
    between(
        kind,
        "the columns' captions before",
        |_| "C0 C1 C2 C3 C4 C5 C6 C7\n".to_owned(),
        |_| "\n".to_owned(),
    );
    between(kind, "a prompt between", nothing, |_| ">>> \n".to_owned());
    between(kind, "greatest and least after", nothing, |shot| {
        let celsius = shot.celsius();
        let most = celsius.iter().copied().fold(f64::MIN, f64::max);
        let least = celsius.iter().copied().fold(f64::MAX, f64::min);
        format!("Max: {most:.2} Min: {least:.2}\n\n")
    });
    kind.right("numbers of the frames before", |scene| {
        let (number, separator) = style(scene);
        let first = usize::try_from(scene.random.between(0, 900)).unwrap();
        let caption = scene.random.one_of(&["Frame ", "frame: ", "#"]);
        let text = each(&scene.shots, |shot| {
            let number_there = first + shot.index;
            format!(
                "{caption}{number_there}\n{}",
                block(shot, number, separator, "\n")
            )
        });
        let comment = caption == "#";
        let truth = Truth::of(scene);
        (text, if comment { truth } else { truth.numbered() })
    });
}

fn numbered_rows(kind: &mut Kind) {
    kind.unsure("nothing between", |scene| {
        let (number, separator) = style(scene);
        let text = each(&scene.shots, |shot| block(shot, number, separator, "\n"));
        (text, Truth::of(scene))
    });
    kind.right("numbers of the rows", |scene| {
        let number = scene.random.one_of(&USUAL);
        let mark = scene.random.one_of(&[": ", " | ", ") ", " -> "]);
        let from = scene.random.between(0, 1);
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, number, " ");
            let rows = rows.iter().zip(from..);
            rows.map(|(row, place)| format!("{place}{mark}{row}\n"))
                .collect::<String>()
                + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.right("names of the rows", |scene| {
        let number = scene.random.one_of(&USUAL);
        let name = scene.random.one_of(&["Row ", "row", "R"]);
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, number, ", ");
            let rows = rows.iter().zip(0..);
            rows.map(|(row, place)| format!("{name}{place}: {row}\n"))
                .collect::<String>()
        });
        (text, Truth::of(scene))
    });
}

/// Around each row, and around the frame.
fn framed(kind: &mut Kind, name: &'static str, signs: fn(&[String]) -> String) {
    kind.right(name, move |scene| {
        scene.any_room();
        let number = scene.random.one_of(&[two, one]);
        let text = each(&scene.shots, |shot| signs(&grid(shot, number, " ")));
        (text, Truth::of(scene))
    });
}

/// Rows with signs around them and between their numbers.
fn rows(rows: &[String], before: &str, after: &str, between: &str) -> String {
    let row = |row: &String| format!("{before}{}{after}\n", row.replace(' ', between));
    rows.iter().map(row).collect()
}

fn printers(kind: &mut Kind) {
    framed(kind, "R12 stars around", |lines| {
        let stars = "* ".repeat(20);
        format!("{stars}\n{}{stars}\n\n", rows(lines, "*  ", "  *", " "))
    });
    framed(kind, "bars and crosses around", |lines| {
        let line = format!("+{}\n", "-------+".repeat(8));
        format!("{line}{}{line}", rows(lines, "| ", " |", " | "))
    });
    framed(kind, "bars without a border", |lines| {
        format!("{}\n", rows(lines, "|", "|", "|"))
    });
    framed(kind, "box-drawing characters around", |lines| {
        let edge = "─".repeat(50);
        format!("┌{edge}┐\n{}└{edge}┘\n", rows(lines, "│ ", " │", " "))
    });
    framed(kind, "hashes around", |lines| {
        let edge = "#".repeat(52);
        format!("{edge}\n{}{edge}\n", rows(lines, "# ", " #", " "))
    });
    framed(kind, "Markdown table", |lines| {
        let head = format!("|{}\n|{}\n", " |".repeat(8), "---|".repeat(8));
        format!("{head}{}\n", rows(lines, "| ", " |", " | "))
    });
    framed(kind, "Adafruit's Arduino example", |lines| {
        format!("[{}]\n\n", rows(lines, "", ", ", ", "))
    });
    framed(kind, "SparkFun's Arduino example", |lines| {
        format!("{}\n\n", rows(lines, "", "\t", "\t"))
    });
    framed(kind, "Adafruit's CircuitPython example", |lines| {
        format!("{}\n\n", rows(lines, "['", "']\n", "', '"))
    });
    framed(kind, "nested lists over lines", |lines| {
        let lines = lines.join("],\n [").replace(' ', ", ");
        format!("[[{}]]\n", lines.replace(", [", " ["))
    });
    framed(kind, "MATLAB's semicolons on a line", |lines| {
        format!("[{}]\n", lines.join("; "))
    });
    framed(kind, "MATLAB's semicolons over lines", |lines| {
        format!("A = [{}];\n", lines.join(";\n     "))
    });
    framed(kind, "Octave's page of an array", |lines| {
        format!("ans =\n\n   {}\n\n", lines.join("\n   "))
    });
    framed(kind, "C's initializers", |lines| {
        format!("{{{}}},\n", rows(lines, "  {", "},", ", "))
    });
}

fn numpy_prints(kind: &mut Kind) {
    kind.right("numpy's print of a frame", |scene| {
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, |celsius| format!("{:<5}", numpy(celsius)), " ");
            format!("[[{}]]\n", rows.join("]\n ["))
        });
        (text, Truth::of(scene))
    });
    kind.right("numpy's print of 64 numbers, wrapped", |scene| {
        let text = each(&scene.shots, |shot| {
            let all = shot
                .celsius()
                .map(|celsius| format!("{:<5}", numpy(celsius)));
            let lines: Vec<String> = all.chunks(12).map(|some| some.join(" ")).collect();
            format!("[{}]\n", lines.join("\n "))
        });
        (text, Truth::of(scene))
    });
    kind.right("numpy's repr of a frame", |scene| {
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, |celsius| format!("{:<5}", numpy(celsius)), ", ");
            format!("array([[{}]], dtype=float32)\n", rows.join("],\n       ["))
        });
        (text, Truth::of(scene))
    });
    kind.right("numpy's savetxt of pages", |scene| {
        let number: Number = |celsius| format!("{celsius:.18e}");
        let text = each(&scene.shots, |shot| {
            format!("# New slice\n{}", block(shot, number, " ", "\n"))
        });
        (text, Truth::of(scene))
    });
}

/// The lines of a capture from one place to another.
fn part(text: &str, from: usize, to_end: usize) -> String {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    lines[from..lines.len() - to_end].concat()
}

/// A capture that begins after some rows of the first frame and ends before the last rows of the last.
fn capture(
    kind: &mut Kind,
    name: &'static str,
    accept: crate::loggers::variant::Accept,
    print: fn(&[String]) -> String,
    lines_each: usize,
) {
    kind.add(name, accept, move |scene| {
        let number = scene.random.one_of(&[two, one, python]);
        let text = each(&scene.shots, |shot| print(&grid(shot, number, " ")));
        // Not a line that is drawn before the rows alone: then the frame is whole.
        let mut cut = || usize::try_from(scene.random.between(2, 6)).unwrap() * lines_each;
        let text = part(&text, cut(), cut());
        let last = scene.shots.len() - 1;
        (text, Truth::of(scene).torn(0).torn(last))
    });
}

fn cut(kind: &mut Kind) {
    capture(
        kind,
        "from midframe to midframe, blank lines",
        Right,
        |rows| format!("\n{}\n", rows.join("\n")),
        1,
    );
    capture(
        kind,
        "from midframe to midframe, dashes",
        Right,
        |rows| format!("------\n{}\n", rows.join("\n")),
        1,
    );
    capture(
        kind,
        "from midframe to midframe, brackets",
        Right,
        |rows| format!("[[{}]]\n", rows.join("]\n [")),
        1,
    );
    capture(
        kind,
        "from midframe to midframe, stars",
        Right,
        |rows| format!("**********\n* {} *\n", rows.join(" *\n* ")),
        1,
    );
    capture(
        kind,
        "from midframe to midframe, two blank lines after CircuitPython's",
        Right,
        |rows| {
            let rows: Vec<String> = rows
                .iter()
                .map(|row| format!("['{}']\n\n", row.replace(' ', "', '")))
                .collect();
            format!("{}\n\n", rows.concat())
        },
        2,
    );
    capture(
        kind,
        "W01 from midframe to midframe, every row the same",
        RightOrAsked,
        |rows| {
            let rows: Vec<String> = rows
                .iter()
                .map(|row| format!("['{}']\n\n", row.replace(' ', "', '")))
                .collect();
            rows.concat()
        },
        2,
    );
    capture(
        kind,
        "from midframe to midframe, nothing between",
        RightOrAsked,
        |rows| format!("{}\n", rows.join("\n")),
        1,
    );
}

fn cut_lines(kind: &mut Kind) {
    kind.right("from the middle of a number", |scene| {
        let number = scene.random.one_of(&[two, one]);
        let text = each(&scene.shots, |shot| {
            block(shot, number, " ", "\r\n") + "\r\n"
        });
        let from = usize::try_from(scene.random.between(4, 150)).unwrap();
        (text[from..].to_owned(), Truth::of(scene).torn(0))
    });
    kind.right("to the middle of a line", |scene| {
        let text = each(&scene.shots, |shot| block(shot, two, " ", "\n") + "\n");
        let less = usize::try_from(scene.random.between(9, 300)).unwrap();
        let last = scene.shots.len() - 1;
        (
            text[..text.len() - less].to_owned(),
            Truth::of(scene).torn(last),
        )
    });
    kind.file("capture.csv");
    kind.right("rows of 64 to the middle of a line", |scene| {
        let text = each(&scene.shots, |shot| grid(shot, two, ",").join(",") + "\n");
        let less = usize::try_from(scene.random.between(8, 300)).unwrap();
        let last = scene.shots.len() - 1;
        (
            text[..text.len() - less].to_owned(),
            Truth::of(scene).torn(last),
        )
    });
    kind.right("rows of 64 from the middle of a line", |scene| {
        let text = each(&scene.shots, |shot| grid(shot, two, ",").join(",") + "\n");
        let from = usize::try_from(scene.random.between(8, 300)).unwrap();
        (text[from..].to_owned(), Truth::of(scene).torn(0))
    });
}

fn lost(kind: &mut Kind) {
    kind.file("capture.txt");
    rows_lost(kind, "W02 one row lost, blank lines", 1, |rows| {
        format!("{}\n\n", rows.join("\n"))
    });
    rows_lost(kind, "two rows lost, dashes", 2, |rows| {
        format!("{}\n----\n", rows.join("\n"))
    });
    rows_lost(kind, "a row lost, captions", 1, |rows| {
        format!("Frame:\n{}\n", rows.join("\n"))
    });
    rows_lost(kind, "a row lost, brackets", 1, |rows| {
        format!("[{}]\n", rows.join("\n "))
    });
    rows_lost(kind, "seven rows lost, blank lines", 7, |rows| {
        format!("{}\n\n", rows.join("\n"))
    });
    rows_lost(kind, "a row lost, bars", 1, |rows| {
        format!("+------+\n| {} |\n+------+\n", rows.join(" |\n| "))
    });
    kind.right("a row cut short", |scene| {
        let at = usize::try_from(scene.random.between(1, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let mut rows = grid(shot, two, " ");
            if shot.index == at {
                rows[at].truncate(17);
            }
            rows.join("\n") + "\n\n"
        });
        (text, Truth::of(scene).torn(at))
    });
    kind.right("two rows on one line", |scene| {
        let at = usize::try_from(scene.random.between(1, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, two, " ").join("\n");
            let rows = if shot.index == at {
                rows.replacen('\n', "", 1)
            } else {
                rows
            };
            rows + "\n\n"
        });
        (text, Truth::of(scene).torn(at))
    });
    kind.right("a restart in the middle of a frame", |scene| {
        let at = usize::try_from(scene.random.between(1, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, two, ", ");
            match shot.index == at {
                true => {
                    rows[..at].join("\n")
                        + "\nets Jun  8 2016 00:22:57\nrst:0x1 (POWERON_RESET)\nAMG88xx pixels\n\n"
                }
                false => rows.join("\n") + "\n\n",
            }
        });
        (text, Truth::of(scene).torn(at))
    });
    kind.unsure("another program's line in the middle of a frame", |scene| {
        let at = usize::try_from(scene.random.between(1, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let mut rows = grid(shot, two, " ");
            if shot.index == at {
                rows.insert(at, "WiFi: reconnecting".to_owned());
            }
            rows.join("\n") + "\n\n"
        });
        // All rows of the frame are there, between its borders.
        (text, Truth::of(scene))
    });
}

/// Some frame lost so many rows.
fn rows_lost(kind: &mut Kind, name: &'static str, count: usize, print: fn(&[String]) -> String) {
    kind.right(name, move |scene| {
        let number = scene.random.one_of(&[two, one, python]);
        let at = usize::try_from(scene.random.between(1, 7)).unwrap();
        let first = usize::try_from(scene.random.between(0, 7))
            .unwrap()
            .min(8 - count);
        let text = each(&scene.shots, |shot| {
            let mut rows = grid(shot, number, " ");
            if shot.index == at {
                rows.drain(first..first + count);
            }
            print(&rows)
        });
        (text, Truth::of(scene).torn(at))
    });
}
