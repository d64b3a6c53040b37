//! A frame on a line, or a row of one, with nothing before it.

use crate::loggers::print::{Number, each, grid, joined, short, two, unix};
use crate::loggers::truth::Truth;
use crate::loggers::variant::Accept;
use crate::loggers::variant::Kind;

pub(crate) fn kind() -> Kind {
    let mut kind = Kind::new("7 lines");
    numbers(&mut kind);
    rows_alone(&mut kind);
    kind
}

fn numbers(kind: &mut Kind) {
    let comma: Number = |celsius| two(celsius).replace('.', ",");
    let styles: [(&str, Number, &str); 6] = [
        ("decimal commas, semicolons", comma, ";"),
        ("decimal commas, tabs", comma, "\t"),
        ("decimal commas, blanks", comma, " "),
        (
            "R10 decimal commas in quotes",
            |celsius| format!("\"{celsius:.2}\"").replace('.', ","),
            ",",
        ),
        (
            "numbers in quotes",
            |celsius| format!("\"{celsius:.2}\""),
            ",",
        ),
        ("bars between", two, "|"),
    ];
    for (name, number, separator) in styles {
        kind.file("walk.csv");
        kind.right(name, move |scene| {
            scene.any_room();
            let text = each(&scene.shots, |shot| joined(shot, number, separator) + "\n");
            (text, Truth::of(scene))
        });
    }
    kind.file("walk.txt");
    kind.right("blanks to a width", |scene| {
        scene.any_room();
        let text = each(&scene.shots, |shot| {
            joined(shot, |celsius| format!("{celsius:8.2}"), "") + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.right("a separator at the end", |scene| {
        let separator = scene.random.one_of(&[",", ";", "\t", ", "]);
        let text = each(&scene.shots, |shot| {
            joined(shot, two, separator) + separator + "\n"
        });
        (text, Truth::of(scene))
    });
    kind.file("walk.csv");
    kind.right("sep= as Excel has it", |scene| {
        let text = each(&scene.shots, |shot| joined(shot, two, ";") + "\n");
        (format!("sep=;\n{text}"), Truth::of(scene))
    });
}

/// One row of the sensor in a line, in a table.
fn rows_alone(kind: &mut Kind) {
    for (name, has_time) in [
        ("R17 a row of the sensor a line", false),
        ("a row of the sensor a line, with times", true),
    ] {
        kind.file("walk.csv");
        kind.right(name, move |scene| {
            let time = if has_time { "time," } else { "" };
            let text = each(&scene.shots, |shot| {
                let rows = grid(shot, two, ",");
                let stamp = if has_time {
                    unix(shot.utc_ns) + ","
                } else {
                    String::new()
                };
                let rows = rows.iter().enumerate();
                rows.map(|(row, values)| format!("{stamp}{},{row},{values}\n", shot.index))
                    .collect()
            });
            let truth = if has_time {
                Truth::of(scene).absolute(0)
            } else {
                Truth::of(scene)
            };
            (
                format!("{time}frame,row,c0,c1,c2,c3,c4,c5,c6,c7\n{text}"),
                truth.numbered(),
            )
        });
    }
    kind.unsure("a row of the sensor a line, one lost", |scene| {
        let at = usize::try_from(scene.random.between(2, 7)).unwrap();
        let text = each(&scene.shots, |shot| {
            let rows = grid(shot, two, ",");
            let rows = rows
                .iter()
                .enumerate()
                .filter(|(row, _)| shot.index != at || *row != at);
            rows.map(|(row, values)| format!("{},{row},{values}\n", shot.index))
                .collect()
        });
        (
            format!("frame,row,c0,c1,c2,c3,c4,c5,c6,c7\n{text}"),
            Truth::of(scene).torn(at),
        )
    });
    kind.add(
        "one pixel a line",
        Accept::RightOrNamed(&["one pixel", "a pixel a line", "one value", "long"]),
        |scene| {
            let text = each(&scene.shots, |shot| {
                let values = shot.celsius();
                let lines = values.iter().enumerate();
                lines
                    .map(|(place, value)| {
                        format!(
                            "{},{},{},{}\n",
                            shot.index,
                            place / 8,
                            place % 8,
                            short(*value)
                        )
                    })
                    .collect()
            });
            (
                format!("frame,row,col,temperature\n{text}"),
                Truth::of(scene).numbered(),
            )
        },
    );
}
